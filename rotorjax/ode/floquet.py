"""Stability of periodic orbits: monodromy matrix and Floquet multipliers, dense or matrix-free."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, cast

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.flatten_util import ravel_pytree
from jax.typing import ArrayLike
from jaxtyping import Array, Complex, Float, PyTree
from scipy.sparse.linalg import ArpackNoConvergence, LinearOperator, eigs

from rotorjax.errors import InputError
from rotorjax.ode.collocation import Symmetry
from rotorjax.ode.jacobian import CHUNK, dense_jacobian
from rotorjax.ode.orbit import Orbit, require_converged
from rotorjax.ode.outcome import traceable
from rotorjax.ode.runge_kutta import Rhs
from rotorjax.ode.trajectory import integrate


@dataclass(frozen=True)
class Floquet:
    """Floquet multipliers, the largest first.

    multipliers: (k,) complex, growth of each mode over `period`. modes: (n, k) complex, states at t0 in the order of
    `jax.flatten_util.ravel_pytree`, unit columns. residuals: (k,) |M v − μ v|, how far each pair is from being one.
    period: time over which the growth was taken.
    """

    multipliers: Complex[np.ndarray, " k"]
    modes: Complex[np.ndarray, "n k"]
    residuals: Float[np.ndarray, " k"]
    period: float

    @property
    def exponents(self) -> Complex[np.ndarray, " k"]:
        """Exponents log(μ)/period: growth and frequency in 1/time, the frequency up to multiples of 2π/period."""
        with np.errstate(divide="ignore"):
            return np.log(self.multipliers) / self.period


class Flow(eqx.Module):
    """State one period (or one symmetric part of it, brought back by the inverse of the symmetry) after x at t0.

    rhs: right-hand side. steps: Runge-Kutta steps over the part. undo: inverse symmetry, or None. copies: parts of a
    period; the multipliers of the whole period are those of the part to the power of `copies`.
    """

    rhs: Rhs
    steps: int = eqx.field(static=True)
    undo: Symmetry | None = None
    copies: int = eqx.field(static=True, default=1)

    def __call__(self, x: PyTree, t0: Array, period: Array, *args: Any) -> PyTree:
        """State at the end, shaped like x."""
        dt = period / (self.copies * self.steps)
        after = integrate(self.rhs, x, t0, dt, self.steps, *args, save_every=self.steps).last
        return after if self.undo is None else self.undo(after)


def monodromy(
    rhs: Rhs,
    orbit: Orbit,
    steps: int,
    *args: Any,
    undo: Symmetry | None = None,
    copies: int = 1,
    chunk: int = CHUNK,
    progress: bool = False,
) -> Float[np.ndarray, "n n"]:
    """Derivative of the state one period later with respect to that at orbit.t[0], by forward mode through the march.

    steps: Runge-Kutta steps over period/copies; undo: inverse of the orbit's symmetry where copies > 1, and then the
    matrix is that of one part. `chunk` columns at a time. Error O(dt⁵).

    Raises InputError where the orbit has not converged.
    """
    require_converged(orbit)
    flow = Flow(rhs, steps, undo, copies)
    return dense_jacobian(flow, orbit.start, orbit.t[0], orbit.period, *args, chunk=chunk, progress=progress)


def multipliers_of(matrix: Float[np.ndarray, "n n"], period: ArrayLike) -> Floquet:
    """All multipliers and modes of a monodromy matrix over `period`.

    Dense eigenvalues of a strongly non-normal matrix (a long wake) are right to about cond(V)·eps only: `residuals`
    does not show that, so compare a few with `floquet`.
    """
    values, vectors = np.linalg.eig(matrix)
    order = np.argsort(-np.abs(values))
    return _pack(values[order], vectors[:, order], lambda v: matrix @ v, float(jnp.asarray(period)))


def _pack(values: np.ndarray, vectors: np.ndarray, product: Callable, period: float) -> Floquet:
    """Multipliers with the residuals that they really have."""
    images = np.stack([product(v.real) + 1j * product(v.imag) for v in vectors.T], axis=1)
    residuals = np.linalg.norm(images - vectors * values, axis=0)
    return Floquet(values.astype(complex), vectors.astype(complex), residuals, period)


@eqx.filter_jit
def _push(flow: Flow, unravel: Callable, x: Array, args: tuple, v: Array) -> Array:
    """Monodromy matrix times v: the variational equation marched with the orbit."""
    return jax.jvp(lambda y: ravel_pytree(flow(unravel(y), *args))[0], (x,), (v,))[1]


def floquet(
    rhs: Rhs,
    orbit: Orbit,
    steps: int,
    *args: Any,
    count: int = 6,
    undo: Symmetry | None = None,
    copies: int = 1,
    tol: float = 1e-10,
    subspace: int | None = None,
) -> Floquet:
    """The `count` largest Floquet multipliers and modes without a matrix: Arnoldi (ARPACK) over one period (or part).

    Arguments as in `monodromy`. tol: relative accuracy of the multipliers. subspace: Arnoldi vectors kept between
    restarts, more where multipliers cluster. One product costs one march of the variational equation.

    Raises InputError where the orbit has not converged, `count` is not between 1 and n − 2, or Arnoldi does not
    converge.
    """
    require_converged(orbit)
    x, unravel = ravel_pytree(orbit.start)
    if not 1 <= count <= x.size - 2:
        raise InputError(
            f"Argument `count` must lie in [1, {x.size - 2}] for {x.size} states, but is {count}: "
            "use `monodromy` and `multipliers_of` for all of them"
        )
    flow, settings = Flow(rhs, steps, undo, copies), traceable((orbit.t[0], orbit.period, *args))

    def product(v: np.ndarray) -> np.ndarray:
        return np.array(_push(flow, unravel, x, settings, jnp.asarray(v.ravel(), x.dtype)))

    matrix = cast(Any, LinearOperator)((x.size, x.size), matvec=product, dtype=x.dtype)
    start = np.random.default_rng(0).normal(size=x.size)
    try:
        values, vectors = cast(Any, eigs)(matrix, k=count, v0=start, tol=tol, ncv=subspace)
    except ArpackNoConvergence as error:
        raise InputError(
            f"Argument `count` must be one that Arnoldi reaches, but {len(error.eigenvalues)} of {count} multipliers "
            "converged: ask for fewer or give a larger `subspace`"
        ) from error
    order = np.argsort(-np.abs(values))
    return _pack(values[order], vectors[:, order], product, float(orbit.period) / copies)
