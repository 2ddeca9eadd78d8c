"""Loads of the blades in the air's velocity at their lifting lines."""

from dataclasses import replace
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from rotorjax.rotor.blade_element import SectionLoads, section_loads, span_averages
from rotorjax.wake.lifting_surface import chord_downwash
from rotorjax.wake.model import FreeWake

REVERSAL = 0.02
"""Speed over ΩR within which the flow over a blade turns round; far below that of any station of a hovering rotor."""


SLOW = 0.04
"""Speed over ΩR below which a section carries no lift in flight: a polar is of steady flow, and a blade turns by a
radian while so slow a flow passes it (reduced frequency cΩ/2u near 1). There its angle turns round within 0.01 ΩR."""


class WakeInputs(NamedTuple):
    """What drives the wake. collective: θ₀ (rad). climb: velocity over ΩR, positive up. height: over R, None for none.

    A rotor that moves over fixed ground has dheight/dψ = climb; the velocity of ground that moves itself is left out.
    """

    collective: Float[Array, ""]
    climb: Float[Array, ""]
    height: Float[Array, ""] | None


def blade_loads(
    model: FreeWake, control: Float[Array, "K R 3"], gamma_bound: Float[Array, "K R"], inputs: WakeInputs
) -> SectionLoads:
    """Section loads (K, R) from the air's velocity at the lifting line, in the blades' frames, and its circulation."""
    pitch = inputs.collective
    if model.flight is not None:
        pitch = pitch + model.flight.cyclic[:, None]
    tangential, perpendicular = across_blades(model, control)
    downwash = gamma_bound @ own_downwash(model).T * follows(model, tangential)
    found = section_loads(
        model.rotor,
        model.operating,
        model.stations,
        tangential,
        perpendicular,
        collective=pitch,
        chord_downwash=downwash,
        span_mean=span_averages(model.stations, model.widths, model.settings.stall_chords * model.chords),
    )
    return found if model.flight is None else _without_slow_lift(found, tangential**2 + perpendicular**2)


def _without_slow_lift(loads: SectionLoads, square: Float[Array, "K R"]) -> SectionLoads:
    """Loads whose lift fades where the square of the speed over ΩR is below SLOW²; at 2.5 SLOW all of it is there."""
    left = -jnp.expm1(-((square / SLOW**2) ** 2))
    return replace(loads, cl=left * loads.cl, circulation=left * loads.circulation, dlift=left * loads.dlift)


def own_downwash(model: FreeWake) -> Float[Array, "R R"]:
    """Downwash at the control points by the bound circulation, beyond the lattice's (lifting_surface.py)."""
    behind = model.settings.control_chords * model.chords
    return chord_downwash(model.stations, model.edges, behind)


def follows(model: FreeWake, tangential: Float[Array, "K R"]) -> float | Float[Array, "K R"]:
    """Sign of `own_downwash`: where the flow over the blade is reversed the wake lies ahead of it, and the sign turns
    with it; in hover only a wake far from the solution could do so, and then the way to it is lost.
    """
    return 1.0 if model.flight is None else jax.scipy.special.erf(tangential / REVERSAL)


def across_blades(model: FreeWake, control: Float[Array, "K R 3"]) -> tuple[Float[Array, "K R"], Float[Array, "K R"]]:
    """Velocities u_T and u_P (blade_element.py) of the air over the blades."""
    flight = model.flight
    if flight is None:
        return model.stations - control[..., 1], -control[..., 2]
    outboard, ahead, up = (v[:, None] for v in flight.axes)
    arm = (model.stations - flight.hinge)[:, None]
    place = arm * outboard + flight.hinge * jnp.array([1.0, 0.0, 0.0])
    carried = model.speed * jnp.stack([-place[..., 1], place[..., 0], jnp.zeros_like(place[..., 0])], axis=-1)
    through = carried - control
    tangential, perpendicular = jnp.sum(through * ahead, axis=-1), jnp.sum(through * up, axis=-1)
    if flight.lag_rate is not None:
        tangential = tangential - arm[:, 0] * (jnp.cos(flight.flap) * flight.lag_rate)[:, None]
    return tangential, perpendicular + arm[:, 0] * flight.flap_rate[:, None]
