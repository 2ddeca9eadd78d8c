"""Several rotors in one free wake marched step by step: each with its own collective and speed.

    march = rj.march(rj.solve(rj.several_wakes(...)))           # compiles, once
    state = march.step(march.start, replace(march.inputs, omega=[1.02, 0.98, 1.02, 0.98]))
    print(state.y.thrust)

The rotors see each other's blades where they stand, also on one shaft, whose periodic wake is solved in mean flows. A
step is that of `simulation/march.py`.
"""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from rotorjax.checks import check_whole
from rotorjax.errors import InputError
from rotorjax.ode import exponential
from rotorjax.simulation.case import Precision
from rotorjax.simulation.march import March, MarchState, all_finite, cast, compiled, on_device, precision_of, unknown
from rotorjax.simulation.step import steps_of_ages, twelfths
from rotorjax.wake.performance import Coefficients
from rotorjax.wake.several import SeveralWakes
from rotorjax.wake.several_dynamics import SeveralInputs, SeveralState, at_one_instant, nominal, rhs
from rotorjax.wake.several_solution import SeveralSolution

Marched = MarchState[SeveralState, Coefficients]


def several_march(
    solution: SeveralSolution, steps_per_turn: int | None = None, *, precision: Precision = "single"
) -> March[SeveralState, Coefficients, SeveralInputs]:
    """March several rotors from their periodic wake, one step at a time (the module tells how).

    steps_per_turn: of a revolution at the nominal speed, None for what the wake needs, at least 24. Inputs are
    `theta_0` (N,), rad, and `omega` (N,), over the nominal speed; outputs y are C_T, C_P and mean inflow of each rotor
    in units of the nominal speed.

    Raises InputError where the solution is not converged, rotors have one blade, or the steps are too few for the wake,
    with the number that is enough.
    """
    if not solution.converged:
        raise InputError(f"Argument `solution` must be converged to be marched from, but: {solution.why}")
    several = marching(solution.model)
    needed = steps_of_ages(several.wakes.settings)
    steps = steps_of(several, steps_per_turn)
    angle = 2 * np.pi / steps
    with precision_of(precision):
        start, inputs, p = on_device(
            cast((at_one_instant(several, solution.state), nominal(several), several), precision)
        )
        y = unknown(lambda: rhs(0.0, start, inputs, p)[1])
        first = MarchState(start, y, jnp.zeros((), jnp.int32), jnp.ones((), bool))
        dt = jnp.asarray(angle)

        def one(state: Marched, inputs: SeveralInputs, p: SeveralWakes) -> Marched:
            return advanced(state, dt, inputs, p)

        program = compiled(one, first, inputs, bound=(p,))
    seconds = angle / float(np.ravel(several.wakes.operating.omega)[0])
    return March(first, inputs, steps, seconds, precision, steps / needed, program)


def advanced(state: Marched, dt: Array, inputs: SeveralInputs, several: SeveralWakes) -> Marched:
    """One step of dt (rad at the nominal speed) with inputs held over it."""
    x, y = stepped(state.x, dt, inputs, several)
    x = replace(x, azimuth=jnp.mod(x.azimuth, 2 * np.pi))
    return MarchState(x, y, state.steps + 1, all_finite(x))


def stepped(
    x: SeveralState, dt: Array, inputs: SeveralInputs, several: SeveralWakes
) -> tuple[SeveralState, Coefficients]:
    """The state a step later, azimuths counted on, and the outputs at its start."""
    still = jax.tree.map(lambda _: 0.0, x)
    lag = several.wakes.settings.circulation_lag
    decay = replace(still, wakes=replace(still.wakes, gamma_bound=1 / jnp.ravel(lag)[0]))
    return exponential.told_step(rhs, jnp.zeros_like(dt), x, dt, decay, inputs, several)


def marching(several: SeveralWakes) -> SeveralWakes:
    """The rotors on the solutions of their lifting lines, their pairs summed by matrix products."""
    wakes = [several.one(i) for i in range(len(several))]
    each = [replace(one.settings, bound_filter="solution", pair_sums="products") for one in wakes]
    settings = jax.tree.map(lambda *a: jnp.stack(a), *each)
    return replace(several, wakes=replace(several.wakes, settings=settings))


def steps_of(several: SeveralWakes, wanted: int | None = None) -> int:
    """Steps of a revolution, what the wakes need where none are wanted. Raises InputError where they are too few."""
    least = twelfths(steps_of_ages(several.wakes.settings))
    if wanted is None:
        return max(24, least)
    if check_whole("steps_per_turn", wanted, 1, 100_000) < least:
        raise InputError(f"Argument `steps_per_turn` must be at least {least} for this wake, but is {wanted}")
    return wanted
