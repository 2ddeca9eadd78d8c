"""From a case to linear models: solve, linearise, find the spectrum, reduce, and march the same steps."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from rotorjax.errors import InputError
from rotorjax.linearisation import figures
from rotorjax.linearisation.assembly import assemble
from rotorjax.linearisation.drive import check_double
from rotorjax.linearisation.marching import STEPS, Response, nonlinear_step, stable_steps
from rotorjax.linearisation.reduce import Pair, reduce
from rotorjax.linearisation.stages import Stages
from rotorjax.linearisation.system import NODES, check_names, linear_wake, order_of, residual_of
from rotorjax.linearisation.waves import Spectrum, spectrum
from rotorjax.ode.harmonic import harmonic_model
from rotorjax.ode.models import LinearModel, PeriodicModel
from rotorjax.wake import solution
from rotorjax.wake.clock import Clock
from rotorjax.wake.model import FreeWake
from rotorjax.wake.search import Progress
from rotorjax.wake.solution import Solution

TOL = 1e-9


@dataclass(frozen=True)
class Linearised:
    """Everything found about one case.

    at_rest: relative rms of `dynamics.rhs` at the solution. periodic, full, small: the models, `full` being the
    time-invariant one of the `harmonics` of a blade's passage. spectrum: None over a slope. marched: nonlinear
    responses by input. march_error (q, m): largest difference between linear and nonlinear step over a revolution, over
    the largest response. seconds: wall time by stage.
    """

    solution: Solution
    at_rest: float
    periodic: PeriodicModel
    harmonics: tuple[int, ...]
    full: LinearModel
    small: Pair
    spectrum: Spectrum | None
    marched: dict[str, Response]
    march_error: Float[np.ndarray, "q m"]
    seconds: dict[str, float]
    compile_time_s: float


def check(model: FreeWake, inputs: tuple[str, ...], outputs: tuple[str, ...], order: int, harmonics: int = 0) -> None:
    """Raise InputError for unknown names, an order that the model does not have, or harmonics of what does not change,
    before anything is solved.
    """
    check_double("model", model.operating.omega.dtype)
    check_names(model, inputs, outputs)
    tilted = model.ground is not None and float(model.ground.slope) != 0
    if harmonics < 0 or (harmonics > 0 and not tilted):
        raise InputError(
            f"Argument `harmonics` must be 0 where the wake does not change with azimuth (level ground or none) and at "
            f"least 0 over a slope, but is {harmonics}"
        )
    most = order_of(model) * (1 + 2 * harmonics)
    if not 1 <= order <= most:
        raise InputError(f"Argument `order` must lie in [1, {most}], the states of a blade, but is {order}")


def linearise_case(
    model: FreeWake,
    inputs: tuple[str, ...],
    outputs: tuple[str, ...],
    order: int,
    progress: Progress | None = None,
    *,
    harmonics: int = 0,
    solver: Callable[..., Solution] | None = None,
) -> Linearised | Solution:
    """Solve and linearise a case; a solution that did not converge is returned as it is.

    harmonics: of a blade's passage over a slope that the time-invariant model holds, 0 for averaging. progress(stage,
    residual) is called as things go on. Raises InputError as `check` does.
    """
    check(model, inputs, outputs, order, harmonics)
    clock, stages = Clock(), Stages(progress)
    found = (solver or solution.solve)(model, None, progress, TOL)
    stages.done("orbit")
    if not found.converged:
        return found
    parts = assemble(found) if found.psi.size == 1 else None
    at_rest = residual_of(found, parts)
    periodic = linear_wake(found, inputs, outputs, parts=parts, nodes=max(NODES, 4 * harmonics + 1))
    stages.done("linearisation")
    kept = tuple(range(harmonics + 1))
    full = harmonic_model(periodic, kept)
    waves = None if parts is None else spectrum(found, parts=parts)
    stages.done("spectrum")
    small = reduce(full, order)
    stages.done("reduction")
    steps = stable_steps(full)
    marched = {name: nonlinear_step(found, name, steps=steps) for name in full.inputs}
    error = march_error(full, marched)
    stages.done("marches")
    seconds = stages.seconds
    return Linearised(found, at_rest, periodic, kept, full, small, waves, marched, error, seconds, clock.read()[1])


def march_error(full: LinearModel, marched: dict[str, Response]) -> Float[np.ndarray, "q m"]:
    """Largest difference between linear and marched steps (STEPS), over the largest marched response."""
    error = np.empty((len(full.outputs), len(full.inputs)))
    step = full.step(marched[full.inputs[0]].psi)
    for m, name in enumerate(full.inputs):
        truth = figures.values_of(marched[name], full.outputs)
        ours = STEPS[name] * step[:, :, m]
        error[:, m] = np.abs(ours - truth).max(axis=0) / np.abs(truth).max(axis=0)
    return error
