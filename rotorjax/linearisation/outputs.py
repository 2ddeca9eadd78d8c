"""What is read off a wake at one instant: thrust, torque and inflow, with names."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from rotorjax.wake.dynamics import driven
from rotorjax.wake.equilibrium import Evaluation
from rotorjax.wake.field import Velocities, node_velocities
from rotorjax.wake.loads import WakeInputs, blade_loads
from rotorjax.wake.model import FreeWake, WakeState
from rotorjax.wake.performance import performance
from rotorjax.wake.segments import releases


class WakeOutputs(NamedTuple):
    """What is read off a wake, mean over the blades at one instant.

    CT: T/(ρA(ΩR)²). CQ: Q/(ρA(ΩR)²R), equal to C_P. lambda0: area-mean inflow over ΩR, positive down, climb included.
    inflow (R,): the same at each station.
    """

    CT: Float[Array, ""]
    CQ: Float[Array, ""]
    lambda0: Float[Array, ""]
    inflow: Float[Array, " R"]


def read(state: WakeState, velocities: Velocities, inputs: WakeInputs, model: FreeWake) -> WakeOutputs:
    """Outputs of a state in given velocities."""
    start = jax.vmap(lambda s: releases(model, s))(state)
    loads = blade_loads(model, velocities.control, state.gamma_bound, inputs)
    found = performance(model, Evaluation(state, velocities, loads, start))
    return WakeOutputs(found.thrust, found.power, found.mean_inflow, -jnp.mean(velocities.control[..., 2], axis=0))


def outputs(psi: float | Float[Array, ""], state: WakeState, inputs: WakeInputs, model: FreeWake) -> WakeOutputs:
    """Outputs of a state (K = 1 or B slices, as for `dynamics.rhs`), slice 0 at azimuth psi."""
    model = driven(model, inputs)
    return read(state, node_velocities(model, state, psi), inputs, model)
