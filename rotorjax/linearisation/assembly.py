"""Derivatives of the axisymmetric wake put together from its parts, instead of one column at a time.

Rates and outputs depend on states and inputs at given velocities, which costs little to differentiate, and on the
velocities at the blades and nodes, whose derivative by the states comes from the pairs themselves (wake/influence.py).
The chain rule joins the two. It is exact, and cheaper than forward mode through the Biot–Savart sum for every state.
"""

from dataclasses import dataclass

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.flatten_util import ravel_pytree
from jaxtyping import Array, Complex, Float

from rotorjax.errors import InputError
from rotorjax.linearisation.outputs import WakeOutputs, read
from rotorjax.wake.dynamics import driven, inputs_of, rates
from rotorjax.wake.field import Velocities, node_velocities
from rotorjax.wake.influence import velocity_response
from rotorjax.wake.loads import WakeInputs
from rotorjax.wake.model import FreeWake, WakeState, slices
from rotorjax.wake.solution import Solution

CHUNK = 64


@eqx.filter_jit
def velocities_along(
    psi: float | Float[Array, ""], state: WakeState, inputs: WakeInputs, along: WakeInputs, model: FreeWake
) -> tuple[Velocities, Velocities]:
    """Velocities of a wake under some inputs, and their derivative along a change of the inputs."""
    return jax.jvp(lambda u: node_velocities(driven(model, u), state, psi), (inputs,), (along,))


@jax.jit
def _flat(tree) -> Array:
    return ravel_pytree(tree)[0]


@eqx.filter_jit
def _explicit(
    model: FreeWake, state: WakeState, inputs: WakeInputs, velocities: Velocities
) -> tuple[Float[Array, " n+q"], Float[Array, "n+q V+n+m"]]:
    """Rates and outputs, and their derivatives by velocities (V of them), states and inputs, each at fixed others."""
    z, parts = ravel_pytree((velocities, state, inputs))

    def joint(z: Array) -> Array:
        v, x, u = parts(z)
        there = driven(model, u)
        return ravel_pytree((rates(x, v, u, there), read(x, v, u, there)))[0]

    columns = jax.lax.map(lambda e: jax.jvp(joint, (z,), (e,))[1], jnp.eye(z.size), batch_size=CHUNK)
    return joint(z), columns.T


@dataclass(frozen=True)
class Assembly:
    """Rates and outputs of an axisymmetric wake, and their derivatives.

    value (n + q,): rates, then outputs. by_velocity (n + q, V), by_state (n + q, n): at fixed others. by_input
    (n + q, m): in all, through the velocities too. Order as `ravel_pytree` lays WakeState, WakeOutputs, Velocities and
    WakeInputs out.
    """

    solution: Solution
    value: Float[np.ndarray, " n+q"]
    by_velocity: Float[np.ndarray, "n+q V"]
    by_state: Float[np.ndarray, "n+q n"]
    by_input: Float[np.ndarray, "n+q m"]

    @property
    def order(self) -> int:
        """Number of states n."""
        return self.by_state.shape[1]

    def jacobian(self, wave: int = 0) -> Complex[np.ndarray, "n+q n"]:
        """Derivative by the states for disturbances of wave number p: the same on all blades but for e^{2πip/B}.

        The rows of the outputs, which are means over the blades, are meant for wave number 0, where all is real.
        """
        model, state = self.solution.model, jax.tree.map(jnp.asarray, self.solution.state)
        phase = jnp.asarray(2 * np.pi * wave / model.rotor.blades)
        response = np.asarray(velocity_response(model, state, phase)).reshape(-1, self.order)
        whole = self.by_velocity @ (response if wave else np.real(response))
        return whole + self.by_state


def assemble(solution: Solution) -> Assembly:
    """Differentiate the rates (`dynamics.rhs`) and the outputs at an axisymmetric wake.

    Raises InputError where the solution has not converged or is not axisymmetric.
    """
    if not solution.converged:
        raise InputError(f"Argument `solution` must be converged to be linearised, but: {solution.why}")
    if slices(solution.state) != 1:
        raise InputError(
            f"Argument `solution` must be axisymmetric (level ground or none), but has {slices(solution.state)} "
            "azimuths: wave numbers mix over a slope"
        )
    model, state = solution.model, jax.tree.map(jnp.asarray, solution.state)
    inputs = inputs_of(model)
    flat, unravel = ravel_pytree(inputs)
    pushes = [velocities_along(jnp.zeros(()), state, inputs, unravel(e), model) for e in jnp.eye(flat.size)]
    value, columns = _explicit(model, state, inputs, pushes[0][0])
    columns, through = np.asarray(columns), np.stack([np.asarray(_flat(push[1])) for push in pushes], axis=1)
    v, n = through.shape[0], value.size - _outputs_size(model)
    by_velocity, by_state, by_input = np.split(columns, [v, v + n], axis=1)
    return Assembly(solution, np.asarray(value), by_velocity, by_state, by_input + by_velocity @ through)


def _outputs_size(model: FreeWake) -> int:
    return len(WakeOutputs._fields) - 1 + len(model.stations)
