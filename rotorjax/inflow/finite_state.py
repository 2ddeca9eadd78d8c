"""The finite-state potential flow (VPBFSM) as an inflow model: pressure coefficients of the blades' loads drive it.

The wind is taken along the disk's x axis: its sideways part turns the frame that the states are written in, out of
ground effect; over a slope the ground fixes the frame and a side wind is refused by whoever sets it.
"""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from rotorjax.ground import Plane
from rotorjax.inflow.interface import DiskLoads, InflowModel
from rotorjax.inflow.momentum import downward, hover_inflow
from rotorjax.potential import dynamics, loading
from rotorjax.potential.model import FiniteState, FiniteStateModel, disk_inflow, finite_state_model
from rotorjax.rotor.hub import RotorInputs


class FiniteStateInflow(InflowModel):
    """The VPBFSM. State (M,): velocity states a; the ground's follow at once, c = G a. model: modes and ground."""

    model: FiniteStateModel

    def start(self, thrust: Float[Array, ""], inputs: RotorInputs) -> Float[Array, " M"]:
        """One pressure mode that carries the thrust, with momentum theory's mean inflow."""
        first = self.model.modes.index(0, 1)
        return jnp.zeros(len(self.model.modes)).at[first].set(jnp.sqrt(3.0) / 2 * hover_inflow(thrust, inputs))

    def velocity(
        self, state: Float[Array, " M"], points: Float[Array, "*n 3"], inputs: RotorInputs
    ) -> Float[Array, "*n 3"]:
        """Axial velocity of the disk, the ground's effect included."""
        over = self._over(inputs)
        return downward(disk_inflow(dynamics.with_ground(state, over), points[..., 0], points[..., 1], over))

    def rate(self, state: Float[Array, " M"], loads: DiskLoads, inputs: RotorInputs) -> Float[Array, " M"]:
        """Eq. 1 under the blades' pressure coefficients (Eq. 2)."""
        tau = loading.from_blades(loads.lift, loads.r, loads.widths, loads.psi, self.model.modes)
        alone = eqx.tree_at(lambda m: m.ground, self.model, None, is_leaf=lambda g: isinstance(g, Plane) or g is None)
        driven = dynamics.RotorInputs(tau, inputs.u, inputs.climb)
        rest = FiniteState(state, jnp.zeros(len(self.model.sources), state.dtype))
        return dynamics.rhs(jnp.zeros(()), rest, driven, alone).a

    def _over(self, inputs: RotorInputs) -> FiniteStateModel:
        """The model over ground at the inputs' height."""
        if self.model.ground is None or inputs.height is None:
            return self.model
        return eqx.tree_at(lambda m: m.ground.height, self.model, inputs.height)


def finite_state(ground: Plane | None = None, harmonics: int = 2, radial_terms: int = 3) -> FiniteStateInflow:
    """Make the model. harmonics, radial_terms: of the inflow; over ground the sources have the same harmonics.

    Raises InputError where a count is not allowed.
    """
    return FiniteStateInflow(
        finite_state_model(ground, harmonics, radial_terms, ground_harmonics=harmonics if ground is not None else 0)
    )
