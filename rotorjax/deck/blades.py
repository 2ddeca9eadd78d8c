"""Blade loads of an inflow, as pressure coefficients: linear aerodynamics, or the sections of a real rotor.

Loads are taken at K azimuths and R radii of the disk and averaged over the blades' passage (Eq. 17). A blade at ψ moves
through the wind with u_T = r + μ sin ψ; the inflow through the disk, climb and flapping included, is u_P.
"""

from abc import abstractmethod

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from rotorjax.errors import InputError
from rotorjax.inflow.balance import Stations
from rotorjax.operating import OperatingPoint
from rotorjax.potential.loading import from_distribution
from rotorjax.potential.modes import ModeTable
from rotorjax.rotor.blade_element import disk_loading, lifting_share, section_loads
from rotorjax.rotor.geometry import Rotor


def stations(root: float, radii: int = 12, azimuths: int = 8) -> Stations:
    """Make stations at Gauss nodes between root (over R) and tip.

    Raises InputError where root is not in [0, 1) or a count below 1.
    """
    if not 0 <= root < 1:
        raise InputError(f"Argument `root` must lie in [0, 1) (over R), but is {root}")
    if radii < 1 or azimuths < 1:
        raise InputError(f"Arguments `radii`, `azimuths` must be at least 1, but are {radii}, {azimuths}")
    node, weight = np.polynomial.legendre.leggauss(radii)
    r = root + (1 - root) * (node + 1) / 2
    return Stations(
        jnp.asarray(r), jnp.asarray(weight * (1 - root) / 2), 2 * jnp.pi / azimuths * jnp.arange(azimuths, dtype=float)
    )


def pressure_matrix(at: Stations, modes: ModeTable) -> Float[Array, "M KR"]:
    """Return the matrix from dC_T/dr̄ at the stations to τ (Eq. 2)."""
    unit = jnp.eye(at.psi.size * at.r.size).reshape(-1, at.psi.size, at.r.size)
    return eqx.filter_vmap(lambda load: from_distribution(load, at.r, at.widths, at.psi, modes))(unit).T


class Blades(eqx.Module):
    """Loads of an inflow."""

    @abstractmethod
    def loading(
        self, down: Float[Array, "K R"], pitch: Float[Array, "*#K"], mu: Float[Array, ""], at: Stations
    ) -> Float[Array, "K R"]:
        """Return dC_T/dr̄ at stations where u_P is `down` over ΩR; pitch (rad): without twist, () or (K, 1)."""


class LinearBlades(Blades):
    """dC_T/dr̄ = ½ σ a u_T (θ u_T − u_P), θ = pitch + twist · r.

    solidity (): σ. lift_slope (): a (per rad). twist (): rad from hub to tip.
    """

    solidity: Float[Array, ""]
    lift_slope: Float[Array, ""]
    twist: Float[Array, ""]

    def loading(
        self, down: Float[Array, "K R"], pitch: Float[Array, "*#K"], mu: Float[Array, ""], at: Stations
    ) -> Float[Array, "K R"]:
        """Return dC_T/dr̄ at stations where u_P is `down` over ΩR; pitch (rad): without twist, () or (K, 1)."""
        u = at.r + mu * jnp.sin(at.psi)[:, None]
        return self.solidity * self.lift_slope / 2 * u * ((pitch + self.twist * at.r) * u - down)


def linear_blades(solidity: float, lift_slope: float = 5.73, twist: float = 0.0) -> LinearBlades:
    """Make linear blades. Raises InputError where solidity or lift slope is not positive."""
    for name, value in {"solidity": solidity, "lift_slope": lift_slope}.items():
        if not (np.isfinite(value) and value > 0):
            raise InputError(f"Argument `{name}` must be positive and finite, but is {value}")
    return LinearBlades(*(jnp.asarray(v, float) for v in (solidity, lift_slope, twist)))


class SectionBlades(Blades):
    """The blade element of a rotor with its airfoil tables. rotor, operating: SI, as elsewhere in the package."""

    rotor: Rotor
    operating: OperatingPoint

    def loading(
        self, down: Float[Array, "K R"], pitch: Float[Array, "*#K"], mu: Float[Array, ""], at: Stations
    ) -> Float[Array, "K R"]:
        """Return dC_T/dr̄ at stations where u_P is `down` over ΩR; pitch (rad): without twist, () or (K, 1)."""
        u = at.r + mu * jnp.sin(at.psi)[:, None]
        loads = section_loads(self.rotor, self.operating, at.r, jnp.broadcast_to(u, down.shape), down, pitch)
        return disk_loading(self.rotor, loads) * lifting_share(self.rotor, at.widths)
