"""Momentum theory's flow through the disk, and the ground under it: what uniform inflow and Pitt-Peters share.

Carpenter & Fridovich (NACA TN 3044, 1953) give the uniform inflow the mass of a disk that is accelerated in still air:
8/(3π) λ̇ + 2 V_T λ = C_T, V_T = √(μ² + (λ + λ_c)²). Steady, it is Glauert's momentum theory.

Ground: the images' upflow at the hub takes away the share (1/16h²)/(1 + (μ/λ)²) of the induced velocity (Cheeseman &
Bennett, ARC R&M 3021, 1955), over level ground and for h above about half a radius.
"""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from rotorjax.inflow.interface import DiskLoads, InflowModel
from rotorjax.rotor.hub import RotorInputs

APPARENT_MASS = 8 / (3 * np.pi)


def edgewise(inputs: RotorInputs) -> Float[Array, "2"]:
    """Air's velocity along the disk, aft and to starboard, over Ω_ref R."""
    return -inputs.velocity[:2]


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
    """Share of the induced velocity that is left over ground (Cheeseman & Bennett)."""
    if inputs.height is None:
        return jnp.ones_like(mean)
    wind, through = edgewise(inputs), mean + inputs.climb
    square = wind @ wind + through**2
    rest = square == 0
    axial = jnp.where(rest, 1.0, through**2) / jnp.where(rest, 1.0, square)
    return 1 - axial / (16 * inputs.height**2)


def hover_inflow(thrust: Float[Array, ""], inputs: RotorInputs) -> Float[Array, ""]:
    """Momentum theory's induced inflow λ_i of a thrust: C_T = 2λ_i√(μ² + (λ_i + λ_c)²), by twelve Newton steps."""
    wind = edgewise(inputs)
    mean = jnp.sqrt(jnp.abs(thrust) / 2) + 1e-9
    for _ in range(12):
        speed = jnp.sqrt(wind @ wind + (mean + inputs.climb) ** 2)
        slope = 2 * speed + 2 * mean * (mean + inputs.climb) / speed
        mean = jnp.abs(mean - (2 * mean * speed - thrust) / slope)
    return mean


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
