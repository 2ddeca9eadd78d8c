"""A rotor, and the two models of the inflow that it makes."""

from pathlib import Path
from typing import Any

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float

from rotorjax.checks import array
from rotorjax.ground import Plane
from rotorjax.inflow.balance import Stations, stations_of
from rotorjax.operating import OperatingPoint, check_still
from rotorjax.panels.surface import Panels, Solid
from rotorjax.potential.model import FiniteStateModel, finite_state_model
from rotorjax.potential.surfaces import IN_SHADOW
from rotorjax.rotor import catalogue
from rotorjax.rotor.geometry import Rotor

SIZES = ("ground_harmonics", "ground_radial_terms")


class FiniteStateRotor(eqx.Module):
    """A rotor whose blades see the finite-state inflow of their own loads. flow: the model, over ground or none."""

    rotor: Rotor
    operating: OperatingPoint
    flow: FiniteStateModel

    @property
    def ground(self) -> Plane | None:
        """The ground under it."""
        return self.flow.ground

    @property
    def surfaces(self) -> Solid | None:
        """The surfaces beside and under it."""
        return self.flow.surfaces

    @property
    def stations(self) -> Stations:
        """Where its blades carry load."""
        return stations_of(self.rotor)

    @property
    def climb(self) -> Float[Array, ""]:
        """Climb velocity over ΩR."""
        return self.operating.climb_ratio(self.rotor.radius)


def rotor(
    name_or_file: str | Path, collective_deg: ArrayLike | None = None, climb: ArrayLike | None = None
) -> tuple[Rotor, OperatingPoint]:
    """Load a rotor of the catalogue or of a TOML file, and its operating point.

    collective_deg: pitch in degrees where the twist table is zero; climb: in m/s; None takes the file's. Both may be
    traced by jax. Raises InputError for an unknown name or a file that is not right.

    >>> import rotorjax as rj
    >>> uh60, hover = rj.rotor("uh60", collective_deg=18.0)
    >>> uh60.blades
    4
    """
    body, operating = catalogue.load(name_or_file)
    if collective_deg is not None:
        operating = eqx.tree_at(lambda o: o.collective, operating, array(collective_deg) * (jnp.pi / 180))
    if climb is not None:
        operating = eqx.tree_at(lambda o: o.climb, operating, array(climb))
    return body, operating


def finite_state(
    rotor: Rotor,
    operating: OperatingPoint,
    ground: Plane | None = None,
    harmonics: int = 1,
    surfaces: Panels | None = None,
    **settings,
) -> FiniteStateRotor:
    """Make the finite-state model (VPBFSM) of a rotor, in or out of ground effect, beside and above solid surfaces.

    harmonics: highest harmonic of loading and ground sources, which a slope needs. surfaces: as in `free_wake`; ground
    beside them must be level, and its sources are as many as `IN_SHADOW` says. settings: of
    `potential.model.finite_state_model`. Raises InputError as that does and where the rotor climbs past surfaces.

    >>> import rotorjax as rj
    >>> roof = rj.slab((-3.0, -2.0), (3.0, 2.0), top=-0.7, panel=0.6)
    >>> over, free = (rj.solve(rj.finite_state(*rj.rotor("uh60", 18.0), surfaces=s)) for s in (roof, None))
    >>> bool(over.CT > free.CT)
    True
    """
    if surfaces is not None:
        check_still(operating)
    sizes: dict[str, Any] = dict(zip(SIZES, (harmonics, 7) if surfaces is None else IN_SHADOW, strict=True))
    return FiniteStateRotor(
        rotor, operating, finite_state_model(ground, harmonics, surfaces=surfaces, **sizes | settings)
    )
