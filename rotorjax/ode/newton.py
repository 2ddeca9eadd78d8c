"""Newton's method on host with a line search, over dense (full, chord, Broyden) or Krylov linear solves."""

from collections.abc import Callable
from typing import Any, Protocol

import jax.numpy as jnp
import numpy as np
from jaxtyping import PyTree

from rotorjax.ode.linear import Dense
from rotorjax.ode.outcome import Log, Measure, Outcome, advice, attainable, flatten, relative_rms, traceable


class LinearSolve(Protocol):
    """Where Newton gets its direction from; `memory` is whatever the method reuses from step to step."""

    def at(self, f: Callable, unravel: Callable, x: Any, args: PyTree) -> tuple[Any, Any]:
        """Return f's flat value at flat x, and all that `direction` needs of that place."""
        ...

    def direction(self, place: Any, value: np.ndarray, memory: Any) -> tuple[np.ndarray, Any]:
        """Return (direction, memory) with J direction ≈ −value."""
        ...

    def gauge(self, place: Any) -> Measure | None:
        """Return the size of the residual that a step from that place has to lower, None for Newton's own measure."""
        ...

    def learn(self, memory: Any, step: np.ndarray, change: np.ndarray, ratio: float) -> Any:
        """Return memory after a step that changed the residual by `change` and its size by `ratio`; None forgets."""
        ...

    def retry(self, memory: Any, fresh: bool) -> tuple[bool, Any]:
        """Return whether another direction is worth a try where the last one led nowhere or not far, and its memory.

        fresh: the last direction was made without memory.
        """
        ...


SMALLEST_STEP = 2.0**-10


def newton(
    residual: Callable[..., PyTree],
    x0: PyTree,
    *args: Any,
    linear: LinearSolve | None = None,
    tol: float = 1e-10,
    max_iterations: int = 30,
    measure: Measure = relative_rms,
    memory: Any = None,
    smallest_step: float = SMALLEST_STEP,
    progress: bool = False,
) -> Outcome:
    """Find residual(x, *args) = 0 from x0 by Newton's method with backtracking on the residual's size.

    x0: pytree of floating-point arrays; `residual` returns the same structure. linear: `Dense(...)` (default) or
    `Krylov(...)`. measure(f, x): size of the residual, relative rms by default; `tol` is compared with it. memory: that
    of an earlier Outcome, so that a continuation can go on with a factorised Jacobian. smallest_step: share of a step
    below which it leads nowhere; a continuation that can take less of its own way need not try hard.

    In single precision `tol` is at least 1e-5.

    A step is halved until the residual falls (Armijo, 1e-4), in the size that `linear` gauges it by; where a reused
    Jacobian finds no descent it is made anew before giving up. Numbers in `args` may change without compiling again, as
    long as `residual` is the same function. A run that diverges, stalls or is interrupted returns the best iterate with
    `converged` False and says why.

    Raises InputError where x0 is not made of finite floating-point arrays or `residual` returns another structure.
    """
    linear = Dense() if linear is None else linear
    flat, unravel = flatten(x0)
    args = traceable(args)

    def evaluate(x: np.ndarray) -> tuple[np.ndarray, Any]:
        value, place = linear.at(residual, unravel, jnp.asarray(x, flat.dtype), args)
        return np.asarray(value), place

    with Log("newton", attainable(tol, flat.dtype), max_iterations, progress) as log:
        log.memory = memory
        _iterate(log, evaluate, measure, linear, np.asarray(flat), smallest_step)
    return log.outcome(unravel)


def _iterate(
    log: Log,
    evaluate: Callable[[np.ndarray], tuple],
    measure: Measure,
    linear: LinearSolve,
    x: np.ndarray,
    smallest: float,
) -> None:
    """Note iterates from x on until one is good enough or none can be, and what the linear solver can reuse."""
    f, place = evaluate(x)
    size = measure(f, x)
    done = log.note(x, size)
    if not np.isfinite(size):
        log.why = "the residual is not finite at the start"
    while not done and np.isfinite(size) and len(log.residuals) <= log.limit:
        fresh = log.memory is None
        direction, log.memory = linear.direction(place, f, log.memory)
        gauge = linear.gauge(place)
        gauged = size if gauge is None else gauge(f, x)
        share, new, (new_f, new_place), new_size = _backtrack(
            evaluate, gauge or measure, x, direction, gauged, smallest
        )
        if new_size >= gauged:
            again, log.memory = linear.retry(log.memory, fresh)
            if not again:
                log.why = (
                    f"stalled at residual {size:.2e}: no step along Newton's direction, down to {share:.0e} of it, "
                    f"lowers the residual (a fold, a kink or the limit of precision{advice(x.dtype)})"
                )
                return
            continue
        new_size = new_size if gauge is None else measure(new_f, new)
        done = log.note(new, new_size)
        if share == 1:
            log.memory = linear.learn(log.memory, new - x, new_f - f, new_size / size)
        else:
            _, log.memory = linear.retry(log.memory, fresh)
        x, f, place, size = new, new_f, new_place, new_size


def _backtrack(
    evaluate: Callable[[np.ndarray], tuple],
    gauge: Measure,
    x: np.ndarray,
    direction: np.ndarray,
    size: float,
    smallest: float,
) -> tuple[float, np.ndarray, tuple[np.ndarray, Any], float]:
    """Halve the step until the residual's gauge falls below `size`; returns share, iterate, what `evaluate` finds and
    the gauge there, of the last one tried.
    """
    share = 1.0
    while True:
        new = x + share * direction
        found = evaluate(new)
        new_size = gauge(found[0], new)
        if new_size <= (1 - 1e-4 * share) * size or share <= smallest:
            return share, new, found, new_size
        share /= 2
