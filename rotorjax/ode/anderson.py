"""Anderson acceleration of a fixed point (Walker & Ni 2011, doi:10.1137/10078356X), safeguarded."""

from collections.abc import Callable
from typing import Any

import jax.numpy as jnp
import numpy as np
from jaxtyping import PyTree

from rotorjax.errors import InputError
from rotorjax.ode.newton import LinearSolve
from rotorjax.ode.outcome import Log, Measure, Outcome, attainable, flat_residual, flatten, relative_rms, traceable
from rotorjax.ode.threads import one_thread

ALIKE = 1e-3
"""Singular value, over the largest one of unit differences, below which a combination of them is dropped: old ones grow
parallel to each other, and what is left between them is curvature, which leads astray.
"""


class _Window:
    """The last differences of iterates and residuals, a row each, and the products of the latter with each other."""

    def __init__(self, size: int, length: int) -> None:
        self.dx, self.df = np.empty((2, size, length))
        self.products = np.empty((size, size))
        self.clear()

    def clear(self) -> None:
        self.pushed = 0

    @one_thread
    def push(self, dx: np.ndarray, df: np.ndarray) -> None:
        row = self.pushed % len(self.df)
        self.dx[row], self.df[row] = dx, df
        self.pushed += 1
        kept = self.kept
        self.products[row, :kept] = self.products[:kept, row] = self.df[:kept] @ df

    @property
    def kept(self) -> int:
        return min(self.pushed, len(self.df))

    @one_thread
    def advance(self, x: np.ndarray, f: np.ndarray, mixing: float) -> np.ndarray:
        """Next iterate: the combination of past residuals that is least, plus `mixing` of what is left of it.

        From the normal equations, of which a pass adds one row: with what is ALIKE dropped they lose six digits of
        sixteen, and take a tenth of the time of the singular values of all differences.
        """
        kept = self.kept
        dx, df, products = self.dx[:kept], self.df[:kept], self.products[:kept, :kept]
        sizes = np.sqrt(np.diag(products))
        sizes[sizes == 0] = 1.0
        squares, ways = np.linalg.eigh(products / np.outer(sizes, sizes))
        unlike = squares > ALIKE**2 * squares.max(initial=0.0)
        ways, squares = ways[:, unlike], squares[unlike]
        weights = ways @ (ways.T @ ((df @ f) / sizes) / squares) / sizes
        return x + mixing * f - weights @ dx - mixing * (weights @ df)


def anderson(
    g: Callable[..., PyTree],
    x0: PyTree,
    *args: Any,
    window: int = 8,
    mixing: float = 0.1,
    tol: float = 1e-10,
    max_iterations: int = 200,
    safeguard: float = 10.0,
    measure: Measure = relative_rms,
    linear: LinearSolve | None = None,
    progress: bool = False,
) -> Outcome:
    """Find x = g(x, *args) from x0 by Anderson acceleration.

    x0: pytree of floating-point arrays. window: how many past differences are combined. mixing: share β of the
    remaining residual that is added, in (0, 1]. measure(f, x): size of the residual f = g(x) − x, relative rms by
    default; `tol` is compared with it. linear: g is a residual f for Newton's method with this linear solver, which
    evaluates it: one program serves both. safeguard: a residual that grows to this many times the best one (or is not
    finite) goes back to the best iterate, forgets the window and halves the mixing until there is a new best.

    In single precision `tol` is at least 1e-5. Numbers in `args` may change from call to call without compiling again,
    as long as `g` is the same function. A run that diverges or is interrupted returns the best iterate with `converged`
    False and says why.

    Raises InputError where a setting is out of range, x0 is not made of finite floating-point arrays, or `g` returns
    another structure.
    """
    if window < 1 or not 0 < mixing <= 1 or safeguard <= 1:
        raise InputError(
            f"Arguments must satisfy window ≥ 1, 0 < mixing ≤ 1, safeguard > 1, but are {window}, {mixing}, {safeguard}"
        )
    flat, unravel = flatten(x0)
    args = traceable(args)
    # compiled ahead, for jax traces a program that holds a primitive of hijax anew in every call
    passed = None if linear is not None else flat_residual.lower(g, unravel, flat, args).compile()

    def residual(x: np.ndarray) -> np.ndarray:
        point = jnp.asarray(x, flat.dtype)
        if linear is not None:
            return np.asarray(linear.at(g, unravel, point, args)[0])
        assert passed is not None
        return np.asarray(passed(g, unravel, point, args)) - x

    with Log("anderson", attainable(tol, flat.dtype), max_iterations, progress) as log:
        _iterate(log, residual, measure, np.asarray(flat), _Window(window, flat.size), mixing, safeguard)
    return log.outcome(unravel)


def _iterate(
    log: Log,
    residual: Callable[[np.ndarray], np.ndarray],
    measure: Measure,
    x: np.ndarray,
    past: _Window,
    mixing: float,
    safeguard: float,
) -> None:
    """Note iterates from x on until one is good enough, or none can be."""
    f = best_f = residual(x)
    share, done = mixing, log.note(x, measure(f, x))
    while not done and len(log.residuals) <= log.limit:
        new = past.advance(x, f, share)
        new_f = residual(new)
        size, best = measure(new_f, new), log.best
        done = log.note(new, size)
        if not size <= safeguard * best:
            past.clear()
            share = share / 2
            x, f = log.best_x, best_f
            if share < mixing / 2**10 or not np.isfinite(best):
                log.why = f"diverged: from the best residual {log.best:.2e} even a mixing of {2 * share:.1e} goes up"
                return
            continue
        if size < best:
            share, best_f = mixing, new_f
        past.push(new - x, new_f - f)
        x, f = new, new_f
