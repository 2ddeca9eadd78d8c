"""Pitt and Peters' three-state inflow λ = λ_0 + λ_1c r cos ψ + λ_1s r sin ψ, positive down.

    M λ̇ + V L⁻¹ λ = (C_T, C_c, C_s),   V = diag(V_T, V̄, V̄)

C_c = ∫ dC_T r cos ψ and C_s = ∫ dC_T r sin ψ are the moments of the thrust about the disk's axes; in Pitt and Peters'
order they are (−C_M, −C_L). Written with the skew tan(χ/2) as a vector X that points where the wake goes, the static
gain has no wind axes to turn into, nor an angle that does not exist in hover:

    L = | 1/2            −(15π/64) Xᵀ           |
        | (15π/64) X      2(1 + X²) I − 4 X Xᵀ  |      M = diag(8/3π, 16/45π, 16/45π)

Pitt & Peters, Vertica 5 (1981) 21-34; mass flow of Peters & HaQuang, J. AHS 33(4), 1988. The first mass is that of an
impermeable disk, 8/3π, as in Carpenter & Fridovich; Pitt and Peters' own choice for lift that vanishes at the root is
128/75π. The gain from moments to gradients is (1 ∓ X²): 4 sin α/(1 + sin α) and 4/(1 + sin α) in their angle.
"""

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from rotorjax.inflow.interface import DiskLoads, InflowModel
from rotorjax.inflow.momentum import APPARENT_MASS, downward, flow_through, ground_share, hover_inflow
from rotorjax.rotor.hub import RotorInputs

GRADIENT_MASS = 16 / (45 * np.pi)
COUPLING = 15 * np.pi / 64


class PittPeters(InflowModel):
    """The three-state model. State (3,): λ_0, λ_1c, λ_1s out of ground. mass (3,): diagonal of M."""

    mass: Float[Array, "3"]

    def start(self, thrust: Float[Array, ""], inputs: RotorInputs) -> Float[Array, "3"]:
        """Steady inflow of a thrust without moments."""
        return _without_moments(thrust, inputs)

    def velocity(
        self, state: Float[Array, "3"], points: Float[Array, "*n 3"], inputs: RotorInputs
    ) -> Float[Array, "*n 3"]:
        """Straight down, linear over the disk."""
        inflow = state[0] + points[..., :2] @ state[1:]
        return downward(ground_share(state[0], inputs) * inflow)

    def rate(self, state: Float[Array, "3"], loads: DiskLoads, inputs: RotorInputs) -> Float[Array, "3"]:
        """Rate of the three inflow components."""
        total, varying, skew = flow_through(state[0], inputs)
        carried = jnp.linalg.solve(static_gain(skew), state)
        flow = jnp.stack([total, varying, varying])
        return (disk_moments(loads) - flow * carried) / self.mass


@partial(jax.jit, inline=True)
def _without_moments(thrust: Float[Array, ""], inputs: RotorInputs) -> Float[Array, "3"]:
    mean = hover_inflow(thrust, inputs)
    total, _, skew = flow_through(mean, inputs)
    # in air at rest the skew is zero, and so is the wind that it would need
    return jnp.concatenate([mean[None], COUPLING * thrust / jnp.where(total == 0, 1.0, total) * skew])


def pitt_peters(first_mass: float = APPARENT_MASS) -> PittPeters:
    """Make the model; first_mass: of λ_0, 8/3π or 128/75π."""
    return PittPeters(jnp.array([first_mass, GRADIENT_MASS, GRADIENT_MASS]))


def static_gain(skew: Float[Array, "2"]) -> Float[Array, "3 3"]:
    """L without its 1/V: inflow from (C_T, C_c, C_s). skew: tan(χ/2) towards where the wake goes (aft, starboard)."""
    gradient = 2 * (1 + skew @ skew) * jnp.eye(2) - 4 * jnp.outer(skew, skew)
    first = jnp.concatenate([jnp.array([0.5]), -COUPLING * skew])
    return jnp.concatenate([first[None], jnp.concatenate([COUPLING * skew[:, None], gradient], axis=1)])


def disk_moments(loads: DiskLoads) -> Float[Array, "3"]:
    """(C_T, C_c, C_s) of the blades at one instant, over ρA(ΩR)² and ρA(ΩR)²R."""
    arms = jnp.concatenate([jnp.ones_like(loads.points[..., :1]), loads.points[..., :2]], axis=-1)
    return jnp.einsum("br,r,brc->c", loads.lift, loads.widths, arms) / jnp.pi
