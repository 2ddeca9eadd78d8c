"""The ground in motion: height, slope and their rates as inputs, no penetration at every step on the moving plane.

The plane's own velocity along its normal is −ḣ cos δ + x δ̇/cos δ in the hub frame, that of the free stream
−μ sin δ − V_c cos δ (μ blows aft, the climb V_c down), and the sources make up the difference to the rotor's flow into
the plane:

    c S = (rotor's flow) + w,   w = (V_c − ḣ) cos δ + μ sin δ + x δ̇/cos δ.

A rotor that climbs from ground at rest (ḣ = V_c) has w = 0, a deck that heaves under a hovering one has not. Sources
fill the ground disk only, so a heaving plane is a piston of that size; an infinite one would move all the air.

Three ways to see the rotor's flow at the plane:
"static"  the steady model at this instant: present loads, w = 0;
"quasi-steady"  present loads, and w;
"dynamic"  loads as they were when the air passed the disk (`rotorjax.potential.wake_transport`), and w.
"""

from typing import Literal, get_args

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer
from jaxtyping import Array, Float

from rotorjax.errors import InputError
from rotorjax.ground import Plane
from rotorjax.potential.dynamics import InflowInputs
from rotorjax.potential.model import (
    FiniteStateModel,
    closing,
    footprint,
    relative_residual,
    rotor_into_ground,
    strength_factors,
)
from rotorjax.potential.wake_transport import WakeTransport, transported_flow

Variant = Literal["static", "quasi-steady", "dynamic"]


class GroundMotion(eqx.Module):
    """The plane at one instant, or at T instants with a leading axis on every field.

    height (): under the hub along the shaft, over R. slope (): rad, rising aft. height_rate, slope_rate (): by azimuth,
    per rad.
    """

    height: Float[Array, "*T"]
    slope: Float[Array, "*T"]
    height_rate: Float[Array, "*T"]
    slope_rate: Float[Array, "*T"]

    @property
    def plane(self) -> Plane:
        """The plane where it is."""
        return Plane(self.height, self.slope)


def still(ground: Plane) -> GroundMotion:
    """Return the motion of a plane at rest under the hub."""
    return GroundMotion(ground.height, ground.slope, jnp.zeros_like(ground.height), jnp.zeros_like(ground.slope))


def prescribed(psi: Float[Array, " T"], height: Float[Array, " T"], slope: Float[Array, " T"]) -> GroundMotion:
    """Return the motion through given heights (over R) and slopes (rad), rates by second-order differences.

    Raises InputError where the instants do not increase, the shapes differ, or the plane cuts the disk.
    """
    if psi.ndim != 1 or psi.size < 3 or height.shape != psi.shape or slope.shape != psi.shape:
        raise InputError(
            "Arguments `psi`, `height`, `slope` must be of one length of at least 3, but have shapes "
            f"{psi.shape}, {height.shape}, {slope.shape}"
        )
    require_increasing("psi", psi)
    require_clear(height, slope)
    rates = [jnp.asarray(jnp.gradient(v, psi)) for v in (height, slope)]
    return GroundMotion(height, slope, rates[0], rates[1])


def require_increasing(name: str, times: Float[Array, " T"]) -> None:
    """Raise InputError where concrete times do not increase."""
    if isinstance(times, Tracer):
        return
    steps = np.diff(np.asarray(times))
    if not np.all(steps > 0):
        i = int(np.flatnonzero(~(steps > 0))[0])
        raise InputError(f"Argument `{name}` must increase, but has {times[i]:g} followed by {times[i + 1]:g}")


def require_clear(height: Float[Array, " T"], slope: Float[Array, " T"]) -> None:
    """Raise InputError where a concrete plane cuts the disk or is steeper than 60 degrees."""
    if isinstance(height, Tracer) or isinstance(slope, Tracer):
        return
    high, steep = np.atleast_1d(np.asarray(height)), np.atleast_1d(np.asarray(slope))
    if not np.all(np.abs(steep) < np.pi / 3):
        raise InputError(f"Argument `slope` must stay within 60 deg, but reaches {np.rad2deg(np.abs(steep).max()):.3g}")
    clear = high - np.abs(np.tan(steep))
    if not np.all(clear > 0):
        i = int(np.flatnonzero(~(clear > 0))[0])
        raise InputError(
            f"Argument `height` must exceed |tan slope|, where the disk cuts the ground: it is {high[i]:.3g} "
            f"at a slope of {np.rad2deg(steep[i]):.3g} deg (entry {i})"
        )


def plane_velocity(
    motion: GroundMotion, mu: Float[Array, ""], climb: Float[Array, ""], x: Float[Array, "*N"]
) -> Float[Array, "*N"]:
    """Return w, the plane's velocity along its normal relative to the free stream at stations x, over ΩR."""
    cosine = jnp.cos(motion.slope)
    uniform = (climb - motion.height_rate) * cosine + mu * jnp.sin(motion.slope)
    return uniform + x * motion.slope_rate / cosine


def require_variant(variant: str, transport: WakeTransport | None) -> None:
    """Raise InputError where the variant is unknown, or "dynamic" comes without a wake transport."""
    if variant not in get_args(Variant):
        raise InputError(f"Argument `variant` must be one of {get_args(Variant)}, but is {variant!r}")
    if variant == "dynamic" and transport is None:
        raise InputError("Argument `transport` must be given with variant 'dynamic', but is None")


def flow_into_plane(
    a: Float[Array, " M"],
    motion: GroundMotion,
    inputs: InflowInputs,
    model: FiniteStateModel,
    variant: Variant = "quasi-steady",
    transport: WakeTransport | None = None,
    wake: Float[Array, "K M"] | None = None,
) -> Float[Array, " N"]:
    """Return what the sources must make up for at the ground disk's quadrature points: the rotor's flow and w.

    wake: states that the wake carries ("dynamic" only), by default those of a rotor that has long been at a.
    Raises InputError where the variant is unknown or lacks its transport.
    """
    require_variant(variant, transport)
    flow = _rotor_flow(a, motion, model, variant, transport, wake)
    return flow + _plane_flow(motion, inputs, model, variant)


def _rotor_flow(a, motion, model, variant, transport, wake) -> Float[Array, " N"]:
    if variant != "dynamic" or transport is None:
        return a @ rotor_into_ground(model, motion.plane)
    b = transport.whole(a, transport.settled(a) if wake is None else wake)
    x, y = footprint(model, motion.plane)
    return jnp.einsum("nmk,km->n", transported_flow(model, transport, motion.plane, x, y), b)


def _plane_flow(motion, inputs, model, variant) -> Float[Array, " N"]:
    x, _ = footprint(model, motion.plane)
    return jnp.zeros_like(x) if variant == "static" else plane_velocity(motion, inputs.mu, inputs.climb, x)


@eqx.filter_jit
def ground_states(
    a: Float[Array, " M"],
    motion: GroundMotion,
    inputs: InflowInputs,
    model: FiniteStateModel,
    variant: Variant = "quasi-steady",
    transport: WakeTransport | None = None,
    wake: Float[Array, "K M"] | None = None,
) -> Float[Array, " G"]:
    """Return the source states c that close the moving plane, as `flow_into_plane` sees it.

    "printed" strengths answer the rotor's flow as printed, the plane's own motion in full.
    """
    require_variant(variant, transport)
    if model.surfaces is not None:
        raise InputError(
            "Argument `model` must have no surfaces beside ground that moves, but has some: leave them out"
        )
    row, column = strength_factors(model)
    carried = None if wake is None else wake * column
    flow = _rotor_flow(a * column, motion, model, variant, transport, carried)
    solver = closing(model, motion.plane)
    return row * (solver @ flow) + solver @ _plane_flow(motion, inputs, model, variant)


@eqx.filter_jit
def residual(
    c: Float[Array, " G"],
    a: Float[Array, " M"],
    motion: GroundMotion,
    inputs: InflowInputs,
    model: FiniteStateModel,
    variant: Variant = "quasi-steady",
    transport: WakeTransport | None = None,
    wake: Float[Array, "K M"] | None = None,
) -> Float[Array, ""]:
    """Return the rms of the normal velocity that c leaves on the moving plane over that of the flow into it."""
    into = flow_into_plane(a, motion, inputs, model, variant, transport, wake)
    return relative_residual(c, into, model, motion.plane)
