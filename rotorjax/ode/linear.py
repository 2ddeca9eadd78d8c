"""Newton directions: from a dense factorised Jacobian, kept or corrected between steps, or from GMRES."""

import warnings
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, Literal, cast

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import scipy.linalg
from jax.flatten_util import ravel_pytree
from jaxtyping import Array, Float, PyTree
from scipy.sparse.linalg import LinearOperator, gmres

from rotorjax.errors import InputError
from rotorjax.ode.jacobian import CHUNK, dense_jacobian

# Beyond this many corrections Broyden's inverse costs more to apply than it saves, and is stale.
MOST_CORRECTIONS = 30
TIGHTEST = 1e-8


@dataclass(frozen=True)
class Factor:
    """LU factors of a Jacobian (n, n) and Broyden's rank-one corrections (a, s) of its inverse, H ← (I + a sᵀ) H."""

    lu: tuple[np.ndarray, np.ndarray]
    corrections: tuple[tuple[np.ndarray, np.ndarray], ...] = ()

    def solve(self, b: Float[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
        """H b, with H ≈ J⁻¹."""
        v = scipy.linalg.lu_solve(self.lu, b, check_finite=False)
        for a, s in self.corrections:
            v = v + a * (s @ v)
        return v


@dataclass(frozen=True)
class Dense:
    """Direction from the dense Jacobian.

    chunk: columns per forward-mode pass. reuse: "none" makes the Jacobian anew in every step, "chord" keeps it,
    "broyden" keeps and corrects it; both make it anew once a step shrinks the residual by less than `slow`.
    """

    reuse: Literal["none", "chord", "broyden"] = "none"
    chunk: int = CHUNK
    slow: float = 0.3
    progress: bool = False

    def __post_init__(self) -> None:
        """Refuse an unknown way of reuse."""
        if self.reuse not in ("none", "chord", "broyden"):
            raise InputError(f"Argument `reuse` must be 'none', 'chord' or 'broyden', but is {self.reuse!r}")

    def direction(
        self, f: Callable, unravel: Callable, x: Array, args: PyTree, value: Array, memory: Factor | None
    ) -> tuple[np.ndarray, Factor]:
        """Solve J d = −value with a Jacobian from memory or made here."""
        if memory is None:
            jacobian = dense_jacobian(_Flat(f, unravel), x, *args, chunk=self.chunk, progress=self.progress)
            with warnings.catch_warnings():
                # An exactly singular Jacobian gives a direction of infinities, which the line search turns down.
                warnings.simplefilter("ignore", scipy.linalg.LinAlgWarning)
                memory = Factor(scipy.linalg.lu_factor(jacobian, overwrite_a=True, check_finite=False))
        return memory.solve(-np.asarray(value)), memory

    def retry(self, memory: Factor, fresh: bool) -> tuple[bool, None]:
        """A reused Jacobian is made anew; a new one is as good as it gets."""
        return not fresh, None

    def learn(self, memory: Factor, step: np.ndarray, change: np.ndarray, ratio: float) -> Factor | None:
        """Keep, correct or forget the factors."""
        if self.reuse == "none" or ratio > self.slow or len(memory.corrections) >= MOST_CORRECTIONS:
            return None
        if self.reuse == "chord":
            return memory
        shift = memory.solve(change)
        bottom = step @ shift
        # Broyden's good update divides by sᵀH y; where that nearly vanishes the correction is worth nothing.
        if abs(bottom) < 1e-8 * (step @ step):
            return memory
        return replace(memory, corrections=(*memory.corrections, ((step - shift) / bottom, step)))


@dataclass(frozen=True)
class Forcing:
    """Norm of the last residual and relative tolerance of the last linear solve; fixed: the next one is to be this."""

    size: float
    rtol: float
    fixed: bool = False

    def next(self, size: float, largest: float) -> float:
        """Tolerance for a residual of norm `size`: choice 2 of Eisenstat & Walker with their safeguard."""
        if self.fixed:
            return self.rtol
        rtol = 0.9 * (size / self.size) ** 2
        if 0.9 * self.rtol**2 > 0.1:
            rtol = max(rtol, 0.9 * self.rtol**2)
        return min(largest, max(rtol, TIGHTEST))


@dataclass(frozen=True)
class Krylov:
    """Direction from GMRES on Jacobian-vector products, no matrix.

    restart: Krylov vectors before a restart; a short one stagnates on wake-like spectra, so it is long. restarts: how
    often. precondition(v, x, *args): pytree map close to J⁻¹ v, or None. forcing: largest relative tolerance of the
    linear solve, tightened as Newton converges (Eisenstat & Walker 1996, doi:10.1137/0917003, choice 2).
    """

    restart: int = 400
    restarts: int = 3
    precondition: Callable[..., PyTree] | None = None
    forcing: float = 0.1

    def direction(
        self, f: Callable, unravel: Callable, x: Array, args: PyTree, value: Array, memory: Forcing | None
    ) -> tuple[np.ndarray, Forcing]:
        """Solve J d = −value to the forcing tolerance."""
        size = float(jnp.linalg.norm(value))
        rtol = self.forcing if memory is None else memory.next(size, self.forcing)
        matrix = _operator(lambda v: _product(f, unravel, x, args, v), x)
        inverse = None
        if self.precondition is not None:
            precondition = self.precondition
            inverse = _operator(lambda v: _preconditioned(precondition, unravel, x, args, v), x)
        # scipy's, on host: it leaves as soon as rtol is met. jax 0.10.1's "incremental" method adds a wrong last term
        # when it does so, and its "batched" one and lineax's finish every cycle of `restart` products.
        d, _ = gmres(
            matrix, -np.asarray(value), rtol=rtol, restart=min(self.restart, x.size), maxiter=self.restarts, M=inverse
        )
        return d, Forcing(size, rtol)

    def learn(self, memory: Forcing, step: np.ndarray, change: np.ndarray, ratio: float) -> Forcing:
        """Keep what the next forcing tolerance needs."""
        return memory

    def retry(self, memory: Forcing, fresh: bool) -> tuple[bool, Forcing]:
        """Solve a hundred times tighter, as long as that is still tighter."""
        return memory.rtol > TIGHTEST, replace(memory, rtol=max(memory.rtol / 100, TIGHTEST), fixed=True)


class _Flat(eqx.Module):
    """A pytree function between flat vectors; hashable, so that jitted kernels recognise it."""

    f: Callable
    unravel: Callable = eqx.field(static=True)

    def __call__(self, x: Array, *args: Any) -> Array:
        return ravel_pytree(self.f(self.unravel(x), *args))[0]


@eqx.filter_jit
def _product(f: Callable, unravel: Callable, x: Array, args: PyTree, v: Array) -> Array:
    """Jacobian at x times v."""
    return jax.jvp(lambda y: ravel_pytree(f(unravel(y), *args))[0], (x,), (v,))[1]


@eqx.filter_jit
def _preconditioned(f: Callable, unravel: Callable, x: Array, args: PyTree, v: Array) -> Array:
    return ravel_pytree(f(unravel(v), unravel(x), *args))[0]


def _operator(apply: Callable[[Array], Array], like: Array) -> LinearOperator:
    def matvec(v: np.ndarray) -> np.ndarray:
        # A copy: GMRES writes into what it gets, and jax's arrays are read-only.
        return np.array(apply(jnp.asarray(v, like.dtype).ravel()))

    # cast: the checker takes the class, whose __new__ builds a subclass, for the subclass.
    return cast(Any, LinearOperator)((like.size, like.size), matvec=matvec, dtype=like.dtype)
