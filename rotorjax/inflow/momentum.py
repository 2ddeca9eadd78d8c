"""Momentum theory's flow through the disk, and the ground under it: what uniform inflow and Pitt-Peters share.

Momentum theory has a slipstream through the disk in climb, hover and slow descent, where the air goes down, and in the
windmill brake state, a descent faster than 2 v_h with v_h = √(C_T/2), where it goes up. Between them, in the vortex
ring state, there is none: `flight_state` names where a rotor is, and is the one place that knows.

Carpenter & Fridovich (NACA TN 3044, 1953) give the uniform inflow the mass of a disk that is accelerated in still air:
8/(3π) λ̇ + 2 V_T λ = C_T, V_T = √(μ² + (λ + λ_c)²). Steady, it is Glauert's momentum theory.

Ground: Cheeseman and Bennett's T/T∞ = 1/(1 − (1/16h²)/(1 + (μ/λ)²)) at the same induced power (ARC R&M 3021, 1955),
over level ground and for h above about half a radius. Here the thrust is given, and its inflow sought: `ground_share`.
"""

from functools import partial
from typing import Any, Literal

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from rotorjax.inflow.interface import DiskLoads, InflowModel
from rotorjax.rotor.hub import RotorInputs

APPARENT_MASS = 8 / (3 * np.pi)
FlightState = Literal["climb", "hover", "slow descent", "vortex ring", "windmill brake"]
VORTEX_RING = (-2.0, -0.45)
"""Climb over v_h between which no momentum theory holds. Its own limit is −2; the upper one is where measured inflow
leaves it (Johnson, Model for Vortex Ring State Influence on Rotorcraft Flight Dynamics, NASA/TP-2005-213477)."""
BLOWN_FREE = 1.0  # speed along the disk, over v_h, that carries the ring away (the same source: 0.95)
_HALVINGS = 60


def edgewise(inputs: RotorInputs) -> Float[Array, "2"]:
    """Air's velocity along the disk, aft and to starboard, over Ω_ref R."""
    return -inputs.velocity[:2]


@partial(jax.jit, inline=True)
def flow_through(
    mean: Float[Array, ""], inputs: RotorInputs
) -> tuple[Float[Array, ""], Float[Array, ""], Float[Array, "2"]]:
    """V_T, V̄ = (μ² + λ(λ + λ_i))/V_T and the skew tan(χ/2) as a vector, of a mean inflow λ_i; λ = λ_i + λ_c.

    V_T is the mass flow that carries the mean, V̄ the one that carries what varies over the disk (Peters & HaQuang,
    J. AHS 33(4), 1988). The skew points where the wake goes. In air at rest all are finite, with finite derivatives.
    """
    wind, through = edgewise(inputs), mean + inputs.climb
    square = wind @ wind + through**2
    rest = square == 0
    total = jnp.where(rest, 0.0, jnp.sqrt(jnp.where(rest, 1.0, square)))
    safe = jnp.where(rest, 1.0, total)
    varying = (wind @ wind + through * (through + mean)) / safe
    return total, varying, wind / (safe + jnp.abs(through))


def ground_share(mean: Float[Array, ""], inputs: RotorInputs) -> Float[Array, ""]:
    """Share of the induced velocity that is left over ground at the same thrust.

    Cheeseman and Bennett's s = T∞/T holds at the same power. Momentum theory's power goes as T^{1+n}, n = dln λ/dln T =
    1/(1 + λ²/V_T²), so that at the same thrust it is s^{1+n} of that in free air: s^{3/2} in hover, s² in fast flight.
    """
    if inputs.height is None:
        return jnp.ones_like(mean)
    wind, through = edgewise(inputs), mean + inputs.climb
    square = wind @ wind + through**2
    rest = square == 0
    axial = jnp.where(rest, 1.0, through**2) / jnp.where(rest, 1.0, square)
    same_power = jnp.maximum(1 - axial / (16 * inputs.height**2), 0.0)  # zero where the source leaves no flow
    return same_power ** (1 + 1 / (1 + axial))


def in_vortex_ring(thrust: Float[np.ndarray, "*n"], climb: Float[np.ndarray, "*n"], advance: Any) -> Any:
    """Where C_T and speeds over ΩR lie in the vortex ring state, elementwise."""
    hover, along = np.sqrt(np.abs(thrust) / 2), np.where(np.asarray(thrust) < 0, -1.0, 1.0) * climb
    return (along > VORTEX_RING[0] * hover) & (along < VORTEX_RING[1] * hover) & (advance < BLOWN_FREE * hover)


def flight_state(thrust: float, climb: float, advance: float = 0.0) -> FlightState:
    """Name what a rotor does, by C_T and speeds over ΩR; a negative thrust is the same upside down.

    Ranges of climb over v_h: VORTEX_RING. Speed along the disk above v_h leaves no vortex ring.
    """
    if in_vortex_ring(np.asarray(thrust), np.asarray(climb), advance):
        return "vortex ring"
    climb = climb if thrust >= 0 else -climb
    if climb >= 0:
        return "climb" if climb else "hover"
    return "windmill brake" if climb <= VORTEX_RING[0] * np.sqrt(abs(thrust) / 2) else "slow descent"


@partial(jax.jit, inline=True)
def hover_inflow(thrust: Float[Array, ""], inputs: RotorInputs) -> Float[Array, ""]:
    """Momentum theory's induced inflow λ_i of a thrust: C_T = 2λ_i√(μ² + (λ_i + λ_c)²), down for a thrust up."""
    wind = edgewise(inputs)
    return induced_inflow(thrust, inputs.climb, wind @ wind)


@jax.jit
def induced_inflow(
    thrust: Float[Array, ""], climb: Float[Array, ""] | float, square: Float[Array, ""] | float = 0.0
) -> Float[Array, ""]:
    """λ_i of C_T = 2λ_i√(μ² + (λ_i + λ_c)²), of the sign of the thrust; square: μ², all over ΩR.

    Where the equation has three roots, in fast descent, the least is meant: the windmill brake state, joined to the
    others at the end of the vortex ring (−2 v_h along the axis). It is bracketed between the extrema of the cubic
    2w² + 3λ_c w + λ_c² + μ² = 0, halved, and finished by two Newton steps, through which derivatives are exact. Without
    thrust or flow, where the derivative is infinite, and at the end of the windmill brake state it is that of the
    last step.
    """
    thrust, climb, square = jnp.broadcast_arrays(*(jnp.asarray(v, float) for v in (thrust, climb, square)))
    sign = jnp.where(thrust < 0, -1.0, 1.0)
    size, along = jnp.abs(thrust), sign * climb
    root = _bracketed(*jax.lax.stop_gradient((size, along, square)))
    for _ in range(2):
        excess, slope = _excess(root, size, along, square)
        root = root - excess / jnp.where(slope == 0, 1.0, slope) * (slope != 0)
    return sign * jnp.maximum(root, 0.0)


def _excess(
    w: Float[Array, ""], size: Float[Array, ""], along: Float[Array, ""], square: Float[Array, ""]
) -> tuple[Float[Array, ""], Float[Array, ""]]:
    """2w√(μ² + (w + λ_c)²) − C_T and its derivative by w."""
    through = w + along
    speed_squared = square + through**2
    rest = speed_squared == 0
    speed = jnp.where(rest, 0.0, jnp.sqrt(jnp.where(rest, 1.0, speed_squared)))
    return 2 * w * speed - size, 2 * speed + 2 * w * through / jnp.where(rest, 1.0, speed)


def _bracketed(size: Float[Array, ""], along: Float[Array, ""], square: Float[Array, ""]) -> Float[Array, ""]:
    """The least positive root, by halving between bounds that hold it alone."""
    inner = along**2 - 8 * square
    peak = jnp.where((along < 0) & (inner > 0), (-3 * along - jnp.sqrt(jnp.maximum(inner, 0.0))) / 4, 0.0)
    rounding = 16 * jnp.finfo(size.dtype).eps * size  # the end of the windmill brake state belongs to it
    before = (peak > 0) & (_excess(peak, size, along, square)[0] >= -rounding)
    low, high = jnp.where(before, 0.0, peak), jnp.where(before, peak, jnp.sqrt(size / 2) + jnp.maximum(-along, 0.0))

    def halve(_: int, ends: tuple[Array, Array]) -> tuple[Array, Array]:
        middle = 0.5 * (ends[0] + ends[1])
        below = _excess(middle, size, along, square)[0] < 0
        return jnp.where(below, middle, ends[0]), jnp.where(below, ends[1], middle)

    low, high = jax.lax.fori_loop(0, _HALVINGS, halve, (low, high))
    return 0.5 * (low + high)


def downward(inflow: Float[Array, "*n"]) -> Float[Array, "*n 3"]:
    """Velocity of an inflow λ, positive down, in the hub frame."""
    still = jnp.zeros_like(inflow)
    return jnp.stack([still, still, -inflow], axis=-1)


class Uniform(InflowModel):
    """One inflow for the whole disk. State (): λ_i out of ground. mass (): of the air that has to be accelerated."""

    mass: Float[Array, ""]

    def start(self, thrust: Float[Array, ""], inputs: RotorInputs) -> Float[Array, ""]:
        """Momentum theory's inflow."""
        return hover_inflow(thrust, inputs)

    def velocity(
        self, state: Float[Array, ""], points: Float[Array, "*n 3"], inputs: RotorInputs
    ) -> Float[Array, "*n 3"]:
        """The same velocity everywhere, straight down."""
        inflow = ground_share(state, inputs) * state
        return downward(jnp.broadcast_to(inflow, points.shape[:-1]))

    def rate(self, state: Float[Array, ""], loads: DiskLoads, inputs: RotorInputs) -> Float[Array, ""]:
        """Carpenter and Fridovich's balance."""
        total, _, _ = flow_through(state, inputs)
        return (loads.thrust - 2 * total * state) / self.mass


def uniform(mass: float = APPARENT_MASS) -> Uniform:
    """Make the model of uniform inflow; mass: 8/3π, of an impermeable disk."""
    return Uniform(jnp.asarray(mass, float))
