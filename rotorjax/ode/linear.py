"""Newton directions: from a dense factorised Jacobian, kept or corrected between steps, or from GMRES."""

import warnings
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, Literal, NamedTuple, cast

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
from rotorjax.ode.outcome import Measure, flat_residual, relative_rms
from rotorjax.ode.structure import require_like

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

    def at(self, f: Callable, unravel: Callable, x: Array, args: PyTree) -> tuple[Array, tuple]:
        """Value, and what the Jacobian is made from if it comes to that."""
        return flat_residual(f, unravel, x, args), (f, unravel, x, args)

    def direction(self, place: tuple, value: np.ndarray, memory: Factor | None) -> tuple[np.ndarray, Factor]:
        """Solve J d = −value with a Jacobian from memory or made here."""
        if memory is None:
            f, unravel, x, args = place
            jacobian = dense_jacobian(_Flat(f, unravel), x, *args, chunk=self.chunk, progress=self.progress)
            with warnings.catch_warnings():
                # An exactly singular Jacobian gives a direction of infinities, which the line search turns down.
                warnings.simplefilter("ignore", scipy.linalg.LinAlgWarning)
                memory = Factor(scipy.linalg.lu_factor(jacobian, overwrite_a=True, check_finite=False))
        return memory.solve(-value), memory

    def gauge(self, place: tuple) -> None:
        """Newton's own measure."""

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


class Place(NamedTuple):
    """A point of a residual: x, the Jacobian's product there, the preconditioner, and what else the residual told."""

    x: Array
    product: Callable[[Array], Array]
    inverse: Callable[[Array], Array] | None
    told: PyTree


@dataclass(frozen=True)
class Krylov:
    """Direction from GMRES on Jacobian-vector products, no matrix.

    Value and linear map come from one program (`jax.linearize`), which is run wherever the residual is evaluated.
    restart: Krylov vectors before a restart; a short one stagnates on wake-like spectra, so it is long. restarts: how
    often. precondition(v, x, *args): pytree map close to J⁻¹ v, or None. forcing: largest relative tolerance of the
    linear solve, tightened as Newton converges (Eisenstat & Walker 1996, doi:10.1137/0917003, choice 2). tightest: the
    least that is tried where a direction leads nowhere. natural: whether a step has to lower the preconditioned
    residual, about the distance to the solution, in place of the residual, which a good step may raise manyfold where
    the Jacobian is badly conditioned (Deuflhard 2011, doi:10.1007/978-3-642-23899-4). tells: the residual returns a
    pair, itself and something else that it knows, which is kept in the `Place`.
    """

    restart: int = 400
    restarts: int = 3
    precondition: Callable[..., PyTree] | None = None
    forcing: float = 0.1
    tells: bool = False
    tightest: float = TIGHTEST
    natural: bool = False

    def at(self, f: Callable, unravel: Callable, x: Array, args: PyTree) -> tuple[Array, Place]:
        """Value, and the linear map there."""
        value, product, told = _linearised(f, unravel, x, args, self.tells)
        inverse = None
        if self.precondition is not None:
            inverse = partial(_preconditioned, self.precondition, unravel, x, args)
        return value, Place(x, partial(_product, product), inverse, told)

    def direction(self, place: Place, value: np.ndarray, memory: Forcing | None) -> tuple[np.ndarray, Forcing]:
        """Solve J d = −value to the forcing tolerance."""
        size, x = float(np.linalg.norm(value)), place.x
        rtol = self.forcing if memory is None else memory.next(size, self.forcing)
        matrix = _operator(place.product, x)
        inverse = None if place.inverse is None else _operator(place.inverse, x)
        # scipy's, on host: it leaves as soon as rtol is met. jax 0.10.1's "incremental" method adds a wrong last term
        # when it does so, and its "batched" one and lineax's finish every cycle of `restart` products.
        d, _ = gmres(matrix, -value, rtol=rtol, restart=min(self.restart, x.size), maxiter=self.restarts, M=inverse)
        return d, Forcing(size, rtol)

    def gauge(self, place: Place) -> Measure | None:
        """Size of the preconditioned residual over that of x where that is asked for and there is a preconditioner."""
        inverse = place.inverse if self.natural else None
        if inverse is None:
            return None
        return lambda f, x: relative_rms(np.asarray(inverse(jnp.asarray(f, place.x.dtype))), x)

    def learn(self, memory: Forcing, step: np.ndarray, change: np.ndarray, ratio: float) -> Forcing:
        """Keep what the next forcing tolerance needs."""
        return memory

    def retry(self, memory: Forcing, fresh: bool) -> tuple[bool, Forcing]:
        """Solve a hundred times tighter, as long as that is still tighter."""
        return memory.rtol > self.tightest, replace(memory, rtol=max(memory.rtol / 100, self.tightest), fixed=True)


class _Flat(eqx.Module):
    """A pytree function between flat vectors; hashable, so that jitted kernels recognise it."""

    f: Callable
    unravel: Callable = eqx.field(static=True)

    def __call__(self, x: Array, *args: Any) -> Array:
        return ravel_pytree(self.f(self.unravel(x), *args))[0]


@eqx.filter_jit
def _linearised(f: Callable, unravel: Callable, x: Array, args: PyTree, tells: bool) -> tuple:
    """f(x, *args) between flat vectors, checked as in `flat_residual`, its linear map at x, and what else f tells."""

    def flat(y: Array) -> tuple[Array, PyTree]:
        value, told = f(unravel(y), *args) if tells else (f(unravel(y), *args), None)
        require_like(value, unravel(y), "residual(x, ...)")
        return ravel_pytree(value)[0], told

    return jax.linearize(flat, x, has_aux=True)


@jax.jit
def _product(linear_map: Callable[[Array], Array], v: Array) -> Array:
    """The linear map applied: it holds its numbers as arrays, so that one program serves all places."""
    return linear_map(v)


@eqx.filter_jit
def _preconditioned(f: Callable, unravel: Callable, x: Array, args: PyTree, v: Array) -> Array:
    return ravel_pytree(f(unravel(v), unravel(x), *args))[0]


def _operator(apply: Callable[[Array], Array], like: Array) -> LinearOperator:
    def matvec(v: np.ndarray) -> np.ndarray:
        # A copy: GMRES writes into what it gets, and jax's arrays are read-only.
        return np.array(apply(jnp.asarray(np.ravel(v), like.dtype)))

    # cast: the checker takes the class, whose __new__ builds a subclass, for the subclass.
    return cast(Any, LinearOperator)((like.size, like.size), matvec=matvec, dtype=like.dtype)
