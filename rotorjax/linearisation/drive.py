"""What drives a linear rotor, by name: Eq. 11's inputs, the ground, and gusts.

A uniform gust moves the air as the hub's own velocity would move it the other way; with a hub that does not turn that
is exact to first order, inertia included. A sinusoidal one belongs to the inflow at the blades (`Gusty`), and in a free
wake to its nodes too (`wake.model.Flight`); it stands still while the blades pass, so that with it not even a hover is
time-invariant.
"""

from collections.abc import Sequence
from dataclasses import fields, replace
from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, PyTree

from rotorjax.checks import refuse
from rotorjax.coupled import Coupled, CoupledRotor
from rotorjax.errors import InputError
from rotorjax.inflow.finite_state import FiniteStateInflow
from rotorjax.inflow.interface import DiskLoads, InflowModel
from rotorjax.inflow.momentum import downward
from rotorjax.rotor.hub import RotorInputs

Drive = dict[str, Array]
UNITS = {
    **dict.fromkeys(("theta_0", "theta_1c", "theta_1s", "roll", "pitch", "heading", "slope"), "rad"),
    **dict.fromkeys(("u", "v", "w", "gust_u", "gust_v", "gust_w", "gust_aft", "gust_starboard"), "ΩR"),
    **dict.fromkeys(("u_rate", "v_rate", "w_rate"), "Ω²R"),
    **dict.fromkeys(("p", "q", "r", "omega"), "Ω"),
    **dict.fromkeys(("p_rate", "q_rate", "r_rate", "omega_rate"), "Ω²"),
    "height": "R",
}
"""Unit of every input that some model has."""
WAVES = ("gust_aft", "gust_starboard")
"""Those that change with the azimuth seen from any blade."""


class Gusty(InflowModel):
    """Any inflow model in a gust that goes up by aft · sin πx + starboard · sin πy, one wave across the disk."""

    inflow: InflowModel
    aft: Float[Array, ""]
    starboard: Float[Array, ""]

    def start(self, thrust: Float[Array, ""], inputs: RotorInputs) -> PyTree:
        """The model's own."""
        return self.inflow.start(thrust, inputs)

    def velocity(self, state: PyTree, points: Float[Array, "*n 3"], inputs: RotorInputs) -> Float[Array, "*n 3"]:
        """The model's own, and the gust."""
        up = self.aft * jnp.sin(jnp.pi * points[..., 0]) + self.starboard * jnp.sin(jnp.pi * points[..., 1])
        return self.inflow.velocity(state, points, inputs) - downward(up)

    def rate(self, state: PyTree, loads: DiskLoads, inputs: RotorInputs) -> PyTree:
        """The model's own."""
        return self.inflow.rate(state, loads, inputs)


def drive_of(hub: RotorInputs, p: Coupled) -> Drive:
    """Every input that a rotor has, with its value: `RotorInputs`' own names, then

    gust_u, gust_v, gust_w: velocity of the air over ΩR, forward, to starboard, down. gust_aft, gust_starboard: of
    `Gusty`, or a free wake's. slope: of the ground (rad). Height and slope are there where the model has them.
    """
    zero = jnp.zeros_like(hub.u)
    found = {field.name: getattr(hub, field.name) for field in fields(hub)}
    found = {name: value for name, value in found.items() if value is not None}
    found |= dict.fromkeys(("gust_u", "gust_v", "gust_w", *WAVES), zero)
    where = _slope(p)
    return found if where is None else found | {"slope": where(p)}


def lasting(u: Drive) -> Drive:
    """Inputs that leave a hover time-invariant: all but WAVES."""
    return {name: value for name, value in u.items() if name not in WAVES}


def driven(u: Drive, p: Coupled) -> tuple[RotorInputs, Coupled]:
    """Hub motion and rotor under some inputs."""
    own = {name: u.get(name) for name in (field.name for field in fields(RotorInputs))}
    moved = {name: u[name] - u[f"gust_{name}"] for name in ("u", "v", "w")}
    where = _slope(p)
    if where is not None:
        p = eqx.tree_at(where, p, u["slope"])
    if isinstance(p, CoupledRotor):
        p = eqx.tree_at(lambda q: q.inflow, p, Gusty(p.inflow, u["gust_aft"], u["gust_starboard"]))
    elif "gust_aft" in u:
        p = replace(p, gust=jnp.stack([u["gust_aft"], u["gust_starboard"]]))
    return RotorInputs(**own | moved), p  # type: ignore[arg-type]


def _slope(p: Coupled):
    """Where a rotor's ground has its slope; None for ground that is level by construction, or none."""
    if not isinstance(p, CoupledRotor):
        return None if p.ground is None else lambda q: q.ground.slope
    finite = isinstance(p.inflow, FiniteStateInflow) and p.inflow.model.ground is not None
    return (lambda q: q.inflow.model.ground.slope) if finite else None


def check_double(name: str, dtype: Any) -> None:
    """Raise InputError in single precision, whose rounding would be most of a linearisation's differences."""
    if dtype != np.float64:
        raise refuse(
            name,
            "be in double precision, whose rounding a linearisation's differences need",
            f'{dtype}: jax.config.update("jax_enable_x64", True) first',
        )


def check_names(what: str, wanted: Sequence[str] | None, allowed: Sequence[str], model: str) -> None:
    """Raise InputError for an empty choice, or a name that the model does not have, with all that it has."""
    if wanted is not None and not wanted:
        raise InputError(f"Argument `{what}` must name at least one, but is empty")
    for name in wanted or ():
        if name not in allowed:
            raise InputError(
                f"Argument `{what}` must name what a rotor with {model} has, but has '{name}': allowed are "
                f"{', '.join(allowed)}"
            )
