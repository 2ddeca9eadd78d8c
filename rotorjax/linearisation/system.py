"""The free wake as a system with named inputs and outputs, linearised about its periodic state.

Over level ground or none the state is constant in the blades' frames. Collective, climb and height move all blades
alike and thrust, torque and mean inflow are means over the blades, so they meet axisymmetric disturbances only: one
slice (K = 1) is the whole of that model, not an approximation.

Over a slope the state changes with the azimuth and repeats from blade to blade, after 2π/B. Disturbances that are the
same on all blades (`blades="alike"`) still make a model of one slice, the mean of the blades' rates; it leaves out that
a slope turns them into disturbances that differ from blade to blade and back, which is of second order in the slope.
Within a passage the mean hardly changes: at 10° and h = 1 the first harmonic of A(ψ) is 0.13 % of its mean, and leaving
it out changes the response to a step of collective by less than 1e-6, so that averaging is the default.
`blades="all"` keeps every blade's own states.
"""

from typing import Literal, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from rotorjax.errors import InputError
from rotorjax.linearisation.assembly import Assembly, assemble
from rotorjax.linearisation.outputs import WakeOutputs, outputs
from rotorjax.ode.fourier import half_coefficients
from rotorjax.ode.labels import labels, select
from rotorjax.ode.linearise import linearise
from rotorjax.ode.models import PeriodicModel
from rotorjax.ode.orbit import Orbit, make_orbit
from rotorjax.ode.outcome import Outcome, relative_rms
from rotorjax.wake.dynamics import inputs_of, rhs
from rotorjax.wake.loads import WakeInputs
from rotorjax.wake.model import FreeWake, WakeState, azimuths, slices
from rotorjax.wake.solution import Solution

Blades = Literal["alike", "all"]
UNITS = {
    "near": "R",
    "far": "R",
    "gamma_near": "ΩR²",
    "gamma_far": "ΩR²",
    "gamma_bound": "ΩR²",
    "collective": "rad",
    "climb": "ΩR",
    "height": "R",
    "lambda0": "ΩR",
    "inflow": "ΩR",
}
NODES = 4
"""Azimuths within a blade's passage at which the wake over a slope is linearised."""


class WakeBase(NamedTuple):
    """Periodic wake (slices over one revolution) and its model."""

    wake: WakeState
    model: FreeWake

    def at(self, psi: Float[Array, ""]) -> WakeState:
        """Wakes of the B blades when blade 0 stands at psi, by trigonometric interpolation of the slices."""
        blades, count = self.model.rotor.blades, slices(self.wake)
        angle = psi + 2 * jnp.pi / blades * jnp.arange(blades)
        # the highest harmonic of an even count is a cosine: its sine is zero at every slice
        number = jnp.arange(count // 2 + 1)
        weight = jnp.where((number == 0) | (2 * number == count), 1.0, 2.0) / count
        wave = weight * jnp.exp(1j * number * angle[:, None])

        def leaf(a: Array) -> Array:
            return jnp.real(jnp.tensordot(wave, half_coefficients(a), axes=1))

        return jax.tree.map(leaf, self.wake)


def _moved(t: Array, x: WakeState, base: WakeBase) -> tuple[WakeState, WakeState]:
    """State of all blades with the disturbance x (one slice for all, or B), and the base's own rate."""
    state, rate = jax.jvp(base.at, (t,), (jnp.ones_like(t),))
    return jax.tree.map(lambda a, d: a + d, state, x), rate


def disturbed_rhs(t: Array, x: WakeState, u: WakeInputs, base: WakeBase) -> WakeState:
    """Rate of a disturbance of the wake over a slope: one slice for all blades alike, or B."""
    state, own = _moved(t, x, base)
    change = jax.tree.map(jnp.subtract, rhs(t, state, u, base.model), own)
    return change if slices(x) > 1 else jax.tree.map(lambda a: jnp.mean(a, axis=0, keepdims=True), change)


_compiled = eqx.filter_jit(disturbed_rhs)


def disturbed_outputs(t: Array, x: WakeState, u: WakeInputs, base: WakeBase) -> WakeOutputs:
    """Outputs of the wake with a disturbance, shaped as for `disturbed_rhs`."""
    return outputs(t, _moved(t, x, base)[0], u, base.model)


def residual_of(solution: Solution, parts: Assembly | None = None) -> float:
    """Relative rms of `dynamics.rhs` at an axisymmetric solution: how far it is from rest. On a slope, of the mean
    over the blades and the azimuths solved for. parts: `assemble(solution)` where it is at hand.
    """
    model, state = solution.model, solution.state
    if slices(state) == 1:
        parts = assemble(solution) if parts is None else parts
        return relative_rms(parts.value[: parts.order], _flat(state))
    base, zero = WakeBase(state, model), jax.tree.map(lambda a: jnp.zeros((1, *a.shape[1:])), state)
    times = np.asarray(azimuths(state))[: slices(state) // model.rotor.blades]
    rates = [_flat(_compiled(jnp.asarray(t), zero, inputs_of(model), base)) for t in times]
    return relative_rms(np.concatenate(rates), _flat(state))


def orbit_of(solution: Solution, blades: Blades = "alike", nodes: int = NODES) -> Orbit:
    """The periodic wake as the orbit that is linearised about.

    Axisymmetric: the constant state. Over a slope: disturbances from the solution, which are zero, at `nodes` azimuths.
    """
    model, state = solution.model, solution.state
    found = Outcome(
        None,
        solution.residual,
        tuple(solution.residuals) or (solution.residual,),
        solution.iterations,
        solution.converged,
        solution.why,
        solution.wall_time_s,
    )
    if slices(state) == 1 and blades == "alike":
        return make_orbit(0.0, jax.tree.map(lambda a: jnp.asarray(a)[None], state), 2 * np.pi, found)
    count = 1 if blades == "alike" else model.rotor.blades
    nodes = 1 if slices(state) == 1 else nodes
    zero = jax.tree.map(lambda a: jnp.zeros((nodes, count, *a.shape[1:])), state)
    return make_orbit(0.0, zero, 2 * np.pi / model.rotor.blades, found)


def linear_wake(
    solution: Solution,
    inputs: tuple[str, ...] | None = None,
    outputs_: tuple[str, ...] | None = None,
    *,
    blades: Blades = "alike",
    nodes: int = NODES,
    chunk: int = 64,
    progress: bool = False,
    parts: Assembly | None = None,
) -> PeriodicModel:
    """Linear model of a periodic wake, by `ode.linearise`: time is azimuth (rad), frequencies are per revolution.

    inputs: of `WakeInputs` (collective, climb, height over ground); outputs_: of `WakeOutputs`. None takes all. One
    time where the wake is axisymmetric, put together from `parts` (`assemble(solution)`, made here by default); over a
    slope `nodes` times in a passage 2π/B, by forward mode.

    Raises InputError where the solution has not converged or a name is unknown.
    """
    orbit, u = orbit_of(solution, blades, nodes), inputs_of(solution.model)
    chosen = {"inputs": inputs, "outputs": outputs_, "units": UNITS, "chunk": chunk, "progress": progress}
    if slices(solution.state) == 1 and blades == "alike":
        if orbit.converged and parts is None:
            parts = assemble(solution)

        def derivative(t: Array, x: WakeState) -> tuple[np.ndarray, np.ndarray]:
            assert parts is not None
            return parts.value, np.concatenate([parts.jacobian(), parts.by_input], axis=1)

        return linearise(rhs, outputs, orbit, u, solution.model, **chosen, derivative=derivative)
    return linearise(disturbed_rhs, disturbed_outputs, orbit, u, WakeBase(solution.state, solution.model), **chosen)


def order_of(model: FreeWake) -> int:
    """Number of states of one slice: the order of the linear model with all blades alike."""
    settings, stations = model.settings, len(model.stations)
    near, far = settings.near_ages, settings.filaments * settings.far_ages
    return 3 * (stations + 1) * near + 3 * far + stations * near + far + stations


def check_names(model: FreeWake, inputs: tuple[str, ...], outputs_: tuple[str, ...]) -> None:
    """Raise InputError for an input or output that the model does not have, before anything is solved."""
    inflow = jnp.zeros(len(model.stations))
    for what, wanted, tree in (
        ("inputs", inputs, inputs_of(model)),
        ("outputs", outputs_, WakeOutputs(jnp.zeros(()), jnp.zeros(()), jnp.zeros(()), inflow)),
    ):
        if not wanted:
            raise InputError(f"Argument `{what}` must name at least one, but is empty")
        select(labels(tree, what), wanted, what)


def _flat(state: WakeState) -> np.ndarray:
    return np.concatenate([np.asarray(leaf).ravel() for leaf in jax.tree.leaves(state)])
