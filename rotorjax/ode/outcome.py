"""What an iterative solver hands back, how a residual is measured, and how progress is shown."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from types import TracebackType
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.flatten_util import ravel_pytree
from jaxtyping import Array, Float, PyTree
from tqdm import tqdm

from rotorjax.errors import InputError
from rotorjax.ode.structure import require_like

Measure = Callable[[np.ndarray, np.ndarray], float]


@dataclass(frozen=True)
class Outcome:
    """End of an iteration, converged or not.

    x: best iterate found. residual: its measure. residuals: measure of every iterate, the start included. iterations:
    how many were made. converged: whether residual ≤ tol. why: one sentence. wall_time: seconds, compilation included.
    memory: what a following solve can reuse (a factorised Jacobian), or None. interrupted: whether the user ended it.
    """

    x: PyTree
    residual: float
    residuals: tuple[float, ...]
    iterations: int
    converged: bool
    why: str
    wall_time: float
    memory: Any = None
    interrupted: bool = False


def relative_rms(f: np.ndarray, x: np.ndarray) -> float:
    """Root mean square of f over that of x (over 1 where x is zero); infinite where f is not finite."""
    if not np.all(np.isfinite(f)):
        return float("inf")
    scale = float(np.sqrt(np.mean(np.square(x))))
    return float(np.sqrt(np.mean(np.square(f)))) / (scale if scale > 0 else 1.0)


SINGLE = 1e-5  # residual that single precision reaches in these models: its rounding of 6e-8, grown by their sums


def attainable(tol: float, dtype: Any) -> float:
    """A tolerance, or what single precision can meet of it."""
    return tol if jnp.finfo(dtype).bits == 64 else max(tol, SINGLE)


def advice(dtype: Any) -> str:
    """What to do about a residual that stays too large, where single precision may be to blame."""
    single = jnp.finfo(dtype).bits < 64
    return ' in single precision; jax.config.update("jax_enable_x64", True) lifts it' if single else ""


def flatten(x: PyTree, name: str = "x0") -> tuple[Float[Array, " n"], Callable[[Array], PyTree]]:
    """Flat vector of a state and the way back, after checking that it is made of finite floating-point numbers.

    On the host, where nothing needs compiling; there the way back is `unravelled`. Raises InputError where a leaf is
    not.
    """
    leaves, _ = jax.tree_util.tree_flatten_with_path(x)
    for path, leaf in leaves:
        if not jnp.issubdtype(jnp.result_type(leaf), jnp.floating):
            raise InputError(
                f"Argument `{name}` must hold floating-point arrays only, but {jax.tree_util.keystr(path) or 'it'} "
                f"is {jnp.result_type(leaf)}: cast it or pass it elsewhere"
            )
    flat, unravel = ravelled(x)
    if not np.all(np.isfinite(flat)):
        raise InputError(f"Argument `{name}` must be finite, but holds NaN or infinity")
    return flat, unravel


def ravelled(x: PyTree) -> tuple[Float[Array, " n"], Callable[[Array], PyTree]]:
    """`jax.flatten_util.ravel_pytree` of numbers, on the host."""
    flat = np.concatenate([np.zeros(0), *(np.ravel(leaf) for leaf in jax.tree.leaves(x))])
    ways = []
    jax.eval_shape(lambda x: ways.append(ravel_pytree(x)[1]), x)  # hashable, and equal for all x of one structure
    return jnp.asarray(flat, jnp.result_type(float, *jax.tree.leaves(x))), ways[0]


def unravelled(unravel: Callable[[Array], PyTree], flat: Float[np.ndarray, " n"]) -> PyTree:
    """unravel(flat), on the host."""
    leaves, structure = jax.tree.flatten(jax.eval_shape(unravel, flat))
    parts = np.split(flat, np.cumsum([leaf.size for leaf in leaves])[:-1])
    made = [jnp.asarray(p.reshape(leaf.shape), leaf.dtype) for p, leaf in zip(parts, leaves, strict=True)]
    return jax.tree.unflatten(structure, made)


def traceable(args: PyTree) -> PyTree:
    """Make Python and numpy numbers into arrays, so that jitted kernels take new values without compiling again."""
    number = (float, complex, np.ndarray, np.floating)
    return jax.tree.map(lambda v: jnp.asarray(v) if isinstance(v, number) else v, args)


@eqx.filter_jit
def flat_residual(f: Callable, unravel: Callable, x: Float[Array, " n"], args: PyTree) -> Float[Array, " n"]:
    """f(x, *args) between flat vectors, refused where it is not shaped like x: checked while tracing, so once."""
    value = f(unravel(x), *args)
    require_like(value, unravel(x), "residual(x, ...)")
    return ravel_pytree(value)[0]


class Log:
    """Residual history, best iterate, clock and progress bar of one iteration, kept whatever ends it."""

    def __init__(self, title: str, tol: float, max_iterations: int, progress: bool) -> None:
        """Start the clock; `progress` shows a bar."""
        self.tol, self.limit = tol, max_iterations
        self.residuals: list[float] = []
        self.best, self.why, self.interrupted = float("inf"), "", False
        self.best_x: Any = None
        self.memory: Any = None
        self._bar = tqdm(total=max_iterations, desc=title, disable=not progress)
        self._start = time.perf_counter()

    def note(self, x: Any, residual: float) -> bool:
        """Record an iterate; True where it is good enough."""
        self._bar.update(1 if self.residuals else 0)
        self._bar.set_postfix_str(f"residual {residual:.2e}")
        self.residuals.append(residual)
        if self.best_x is None or residual < self.best:
            self.best, self.best_x = residual, x
        if residual <= self.tol:
            self.why = f"residual {residual:.2e} is within {self.tol:.1e}"
        return residual <= self.tol

    def __enter__(self) -> "Log":
        """Use as `with Log(...) as log`: an interrupt ends the iteration and keeps what it had."""
        return self

    def __exit__(self, kind: type | None, error: BaseException | None, trace: TracebackType | None) -> bool:
        """Close the bar; swallow a keyboard interrupt once there is something to keep."""
        self._bar.close()
        if kind is KeyboardInterrupt and self.residuals:
            self.interrupted = True
            self.why = f"interrupted at residual {self.best:.2e}"
            return True
        return False

    def outcome(self, unravel: Callable) -> Outcome:
        """Pack up the best iterate."""
        made = len(self.residuals) - 1
        converged = self.best <= self.tol
        why = self.why or f"residual {self.best:.2e} is above {self.tol:.1e} after {made} of {self.limit} iterations"
        spent = time.perf_counter() - self._start
        x = unravelled(unravel, np.asarray(self.best_x))
        return Outcome(x, self.best, tuple(self.residuals), made, converged, why, spent, self.memory, self.interrupted)
