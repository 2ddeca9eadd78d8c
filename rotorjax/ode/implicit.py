"""Derivatives of a converged solution by the implicit function theorem: one linear solve, nothing unrolled."""

from collections.abc import Callable
from typing import Any, Literal, NamedTuple

import equinox as eqx
import jax
import jax.core
import jax.numpy as jnp
from jax.flatten_util import ravel_pytree
from jaxtyping import Array, Float, PyTree

from rotorjax.errors import InputError
from rotorjax.ode.jacobian import CHUNK
from rotorjax.ode.outcome import Outcome, traceable

Method = Literal["dense", "gmres"]


class _Way(NamedTuple):
    """How the linear equation is solved; see `attach`."""

    method: Method
    chunk: int
    restart: int
    refinements: int = 1


def _materialise(product: Callable, example: Float[Array, " n"], chunk: int) -> Float[Array, "n n"]:
    """Matrix of a linear map, `chunk` columns at a time."""

    def column(i: Array) -> Array:
        return product((jnp.arange(example.size) == i).astype(example.dtype))

    return jax.lax.map(column, jnp.arange(example.size), batch_size=min(chunk, example.size)).T


def _solve(product: Callable, b: Float[Array, " n"], way: _Way, inverse: Array | None) -> Float[Array, " n"]:
    """Solve product(v) = b so that jax can differentiate and transpose it."""
    if inverse is not None:

        def refined(matrix: Callable, v: Array, inverse: Array) -> Array:
            found = inverse @ v
            for _ in range(way.refinements):
                found = found + inverse @ (v - matrix(found))
            return found

        return jax.lax.custom_linear_solve(
            product,
            b,
            solve=lambda matrix, v: refined(matrix, v, inverse),
            transpose_solve=lambda matrix, v: refined(matrix, v, inverse.T),
        )
    if way.method == "gmres":
        # Wrapped once more: jax's gmres alone starts from zeros_like(b), which transposition takes for an unknown.
        def solve(matrix: Callable, v: Array) -> Array:
            gmres = jax.scipy.sparse.linalg.gmres
            found = gmres(matrix, v, tol=1e-11, restart=min(way.restart, b.size), maxiter=20, solve_method="batched")[0]
            reached = jnp.linalg.norm(matrix(found) - v) <= 1e-7 * jnp.linalg.norm(v)
            return jnp.where(reached, found, jnp.nan)

        return jax.lax.custom_linear_solve(product, b, solve=solve, transpose_solve=solve)
    factors = jax.scipy.linalg.lu_factor(_materialise(product, b, way.chunk))
    return jax.lax.custom_linear_solve(
        product,
        b,
        solve=lambda _, v: jax.scipy.linalg.lu_solve(factors, v),
        transpose_solve=lambda _, v: jax.scipy.linalg.lu_solve(factors, v, trans=1),
    )


@eqx.filter_jit
def _tangent(
    residual: Callable,
    solution: PyTree,
    args: tuple,
    args_dot: tuple,
    way: _Way,
    inverse: Array | None = None,
    left: Callable | None = None,
) -> PyTree:
    """Solve F_x dx = −F_p dp at the solution; both sides first go through left(v, solution, *args), if there is one."""
    flat, unravel = ravel_pytree(solution)
    here = jax.lax.stop_gradient((solution, *args))

    def value(x: PyTree, args: tuple) -> Array:
        found = residual(x, *args)
        return ravel_pytree(found if left is None else left(found, *here))[0]

    def of_state(v: Array) -> Array:
        return value(unravel(v), args)

    def of_args(args: tuple) -> Array:
        return value(solution, args)

    _, push = eqx.filter_jvp(of_args, (args,), (args_dot,))
    _, product = jax.linearize(of_state, flat)
    return unravel(_solve(product, -push, way, inverse))


def attach(
    residual: Callable[..., PyTree],
    solution: PyTree,
    *args: Any,
    method: Method = "dense",
    chunk: int = CHUNK,
    restart: int = 60,
    inverse: Float[Array, "n n"] | Callable[..., Array] | None = None,
    refinements: int = 1,
    precondition: Callable[..., Callable] | None = None,
) -> PyTree:
    """Give a converged solution of residual(x, *args) = 0 its derivative with respect to args.

    The value is `solution` unchanged; dx = −(∂F/∂x)⁻¹ (∂F/∂p) dp in forward and reverse mode, to any order, under jit
    and vmap. The solution must have converged at these args: what it misses is missing in the derivative too.

    method: "dense" makes and factorises the Jacobian once (`chunk` columns at a time) for all directions; "gmres"
    needs no matrix, at most 20 cycles of `restart` products, and gives NaN rather than a derivative that it could not
    solve for. inverse: that of ∂F/∂x over the raveled solution where the caller has it, instead of either. Each of the
    `refinements` takes one product with ∂F/∂x and makes good what the inverse misses; an exact one needs none, and the
    program is then half as long. precondition: what "gmres" is helped by, a function of (x, *args) that makes the map
    (v, x, *args) → v, near the inverse. `inverse` too may be a function of (x, *args); either is called where a
    derivative is wanted and nowhere else. Derivatives flow through `args` only, not through arrays that `residual`
    closes over.

    Raises InputError where `method` is unknown.
    """
    _check(method)
    way = _Way(method, chunk, restart, refinements)

    @eqx.filter_custom_jvp
    def value(solution: PyTree, args: tuple) -> PyTree:
        return solution

    @value.def_jvp
    def rule(primals: tuple, tangents: tuple) -> tuple:
        # The value again, and not `solution`: second derivatives must see how it moves.
        x = value(*primals)
        here = jax.lax.stop_gradient((x, *primals[1]))
        exact = inverse(*here) if callable(inverse) else inverse
        left = None if precondition is None else precondition(*here)
        return x, _tangent(residual, x, primals[1], tangents[1], way, exact, left)

    return value(jax.lax.stop_gradient(solution), traceable(args))


def implicit_orbit(
    residual: Callable[..., PyTree],
    solver: Callable[..., Outcome],
    *,
    method: Method = "dense",
    chunk: int = CHUNK,
    restart: int = 60,
) -> Callable[..., PyTree]:
    """Make x(*args), the solution of residual(x, *args) = 0 that solver(*args) finds, differentiable both ways.

    solver(*args) runs on host and returns an Outcome; the derivative costs one linear solve (see `attach`), whatever
    the solver did. The function returned works under grad, jacfwd, jacrev, jvp and vjp but not under jit, where no
    number is known: there, solve beforehand and `attach`.

    Raises InputError where it is called under jit or vmap, or where the solver does not converge.
    """
    _check(method)

    @eqx.filter_custom_jvp
    def orbit(args: tuple) -> PyTree:
        if any(isinstance(leaf, jax.core.Tracer) for leaf in jax.tree.leaves(args)):
            raise InputError(
                "Arguments of an implicit orbit must be concrete, but jit or vmap traces them: solve first and `attach`"
            )
        found = solver(*args)
        if not found.converged:
            raise InputError(f"Argument `solver` must converge at the arguments asked for, but: {found.why}")
        return found.x

    @orbit.def_jvp
    def rule(primals: tuple, tangents: tuple) -> tuple:
        x = orbit(*primals)
        return x, _tangent(residual, x, primals[0], tangents[0], _Way(method, chunk, restart))

    return lambda *args: orbit(traceable(args))


def _check(method: str) -> None:
    if method not in ("dense", "gmres"):
        raise InputError(f"Argument `method` must be 'dense' or 'gmres', but is {method!r}")
