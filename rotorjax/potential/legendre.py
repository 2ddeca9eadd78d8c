"""Normalised associated Legendre functions P̄_n^m(ν) and Q̄_n^m(iη) of Appendix B for a whole list of (m, n) at once.

P̄ comes as (1−ν²)^{m/2} times a polynomial, which is returned without that factor: with r^m cos mψ beside it the
product stays smooth on the axis.

Q̄ decays with n where P̄(iη) grows, so the upward recursion drowns in rounding (4e-2 at η = 5, n = 7), and the
series in 1/(1+η²) does not converge near the disk. Three steps avoid both; each adds positive numbers only (but for
signs inside one short series), so that no digit is lost, and there is no branch in η
(tests/potential/test_legendre.py):
1. the two highest degrees at m = 0 and 1, by Whipple's transformation (DLMF 14.9.16, 15.8.1):
   Q_n^m(iη) ∝ e^{n+1}(1+e²)^{−1/2} ₂F₁(½+m, ½−m; n+3/2; u),  e = √(1+η²) − η,  u = e²/(1+e²) ≤ ½ for every η ≥ 0;
2. downward in n:  Q̄_{n−1}^m = Q̄_{n+1}^m + (2n+1) K_n^m η Q̄_n^m;
3. upward in m:    Q̄_n^{m+1} = Q̄_n^{m−1} + 2m K_n^m η/√(1+η²) Q̄_n^m.
The factor e^{n+1} is put in last: it would underflow in float32.
"""

from functools import cache, partial
from itertools import zip_longest
from math import factorial, pi, prod, sqrt

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

Pairs = tuple[tuple[int, int], ...]
_LOWEST_START = 8  # a start at a higher degree needs fewer terms of the series


def double_factorial(n: int) -> int:
    """Return n!!, with 0!! = (−1)!! = 1."""
    return prod(range(n, 0, -2))


def h_constant(m: int, n: int) -> float:
    """Return H_n^m = (n+m−1)!!(n−m−1)!!/[(n+m)!!(n−m)!!] (He 1989)."""
    f = double_factorial
    return f(n + m - 1) * f(n - m - 1) / (f(n + m) * f(n - m))


def k_constant(m: int, n: int) -> float:
    """Return K_n^m, minus the reciprocal of dQ̄_n^m/dη on the disk: (2/π)H for n + m odd, (π/2)H for n + m even."""
    return (2 / pi if (n + m) % 2 else pi / 2) * h_constant(m, n)


def _first_polynomial(m: int) -> float:
    """P̄_m^m without (1−ν²)^{m/2} (Eqs. 22a, 23a)."""
    return sqrt((2 * m + 1) * double_factorial(2 * m - 1) / double_factorial(2 * m))


def _upward_steps(orders: list[int], steps: int) -> tuple[np.ndarray, np.ndarray]:
    """Coefficients a, b (steps, orders) of P̄_{n+1} = a ν P̄_n − b P̄_{n−1} from n = m up, one column for each order m."""
    m, n = np.array(orders)[None, :], np.array(orders)[None, :] + np.arange(steps)[:, None]
    new = (n + 1) ** 2 - m**2
    b = (2 * n + 3) * (n**2 - m**2) / (np.maximum(2 * n - 1, 1) * new)  # 2n − 1 < 0 only at n = m = 0, where b = 0
    return np.sqrt((2 * n + 3) * (2 * n + 1) / new), np.sqrt(b)


@partial(jax.jit, static_argnums=0)
def reduced_legendre_p(pairs: Pairs, nu_squared: Float[Array, "*N"]) -> Float[Array, "L ..."]:
    """Return P̄_n^m/(1−ν²)^{m/2} for n−m even and P̄_n^m/[ν(1−ν²)^{m/2}] for n−m odd: polynomials in ν².

    pairs: L tuples (m, n), static. On the disk ν² = 1−r̄², so there is no root at the edge.
    """
    orders, steps = sorted({m for m, _ in pairs}), max(n - m for m, n in pairs)
    shape = (len(orders),) + (1,) * jnp.ndim(nu_squared)
    first = jnp.asarray([_first_polynomial(m) for m in orders], jnp.result_type(nu_squared)).reshape(shape)
    first = first * jnp.ones_like(nu_squared)
    a, b = (jnp.asarray(c, first.dtype).reshape(steps, *shape) for c in _upward_steps(orders, steps))
    to_odd = np.arange(steps) % 2 == 0

    def step(carry: tuple[Array, Array], row: tuple[Array, Array, Array]) -> tuple[tuple[Array, Array], Array]:
        (previous, current), (a, b, to_odd) = carry, row
        new = a * jnp.where(to_odd, 1.0, nu_squared) * current - b * previous
        return (current, new), new

    rows = jax.lax.scan(step, (jnp.zeros_like(first), first), (a, b, to_odd))[1]  # (steps, orders, *N)
    rows = jnp.concatenate([first[None], rows])
    return rows[np.array([n - m for m, n in pairs]), np.array([orders.index(m) for m, _ in pairs])]


@partial(jax.jit, static_argnums=0)
def legendre_p(pairs: Pairs, nu: Float[Array, "*N"]) -> Float[Array, "L ..."]:
    """Return P̄_n^m(ν)/(1−ν²)^{m/2} for L pairs (m, n): polynomials in ν (Eqs. 22a, 23a)."""
    odd = np.array([(n - m) % 2 == 1 for m, n in pairs]).reshape((-1,) + (1,) * jnp.ndim(nu))
    return reduced_legendre_p(pairs, nu * nu) * jnp.where(odd, nu, jnp.ones_like(nu))


@cache
def _series(m: int, n: int) -> tuple[float, ...]:
    """Coefficients of ₂F₁(½+m, ½−m; n+3/2; u)/₂F₁(…; ½) up to the last that matters at u = ½."""
    coefficients, total, k = [1.0], 1.0, 0
    while abs(coefficients[-1]) * 0.5**k > 1e-18 * abs(total):
        coefficients.append(coefficients[-1] * (0.5 + m + k) * (0.5 - m + k) / ((n + 1.5 + k) * (k + 1)))
        k += 1
        total += coefficients[-1] * 0.5**k
    return tuple(c / total for c in coefficients)


def _start(top: int, e: Float[Array, "*N"]) -> Float[Array, "2 2 *N"]:
    """Q̄_n^m/e^{n+1} for n = top, top + 1 (first axis) and m = 0, 1, by Horner's rule."""
    rows = list(zip_longest(*(_series(m, n) for n in (top, top + 1) for m in (0, 1)), fillvalue=0.0))
    coefficients = jnp.asarray(rows, e.dtype).reshape(len(rows), 2, 2, *(1,) * e.ndim)
    u = e * e / (1 + e * e)
    total = coefficients[-1]
    for c in coefficients[-2::-1]:
        total = total * u + c
    return total * jnp.sqrt(2 / (1 + e * e))


def _downward(top: int, lowest: int, eta: Float[Array, "*N"], e: Float[Array, "*N"]) -> Float[Array, "D 2 *N"]:
    """Q̄_n^m/e^{n+1} for n = lowest … top and m = 0, 1 (step 2 of the module's head)."""
    degrees = np.arange(top, lowest, -1)
    slopes = np.array([[(2 * n + 1) * k_constant(m, n) for m in (0, 1)] for n in degrees.tolist()])
    slopes = jnp.asarray(slopes, e.dtype).reshape(len(degrees), 2, *(1,) * e.ndim)
    at_top, above = _start(top, e)
    e2, eta_e = e * e, eta * e

    def step(carry: tuple[Array, Array], slope: Array) -> tuple[tuple[Array, Array], Array]:
        above, current = carry
        return (current, e2 * above + slope * eta_e * current), e2 * above + slope * eta_e * current

    rows = jax.lax.scan(step, (above, at_top), slopes)[1]
    return jnp.concatenate([at_top[None], rows])[::-1]


def _by_order(orders: int, degrees: np.ndarray, rows: Float[Array, "D 2 *N"], s: Float[Array, "*N"]) -> Array:
    """Add the orders m = 2 … orders (step 3): (orders + 1, D, *N). Entries with m > n mean nothing."""
    slopes = [[2 * m * k_constant(m, n) if n > m else 0.0 for n in degrees.tolist()] for m in range(1, orders)]
    slopes = jnp.asarray(slopes, s.dtype).reshape(orders - 1, len(degrees), *(1,) * s.ndim)

    def step(carry: tuple[Array, Array], slope: Array) -> tuple[tuple[Array, Array], Array]:
        below, current = carry
        return (current, below + slope * s * current), below + slope * s * current

    first = jnp.moveaxis(rows, 1, 0)
    return jnp.concatenate([first, jax.lax.scan(step, (first[0], first[1]), slopes)[1]])


@partial(jax.custom_jvp, nondiff_argnums=(0,))
@partial(jax.jit, static_argnums=0)
def legendre_q(pairs: Pairs, eta: Float[Array, "*N"]) -> Float[Array, "L ..."]:
    """Return Q̄_n^m(iη) for L static pairs (m, n), m ≤ n, at η ≥ 0; one at η = 0 (Eqs. 22b, 23b)."""
    eta = jnp.asarray(eta)
    root = jnp.sqrt(1 + eta * eta)
    e = 1 / (eta + root)  # √(1+η²) − η without cancellation
    lowest, top = min(n for _, n in pairs), max(_LOWEST_START, max(n for _, n in pairs))
    degrees = np.arange(lowest, top + 1)
    rows = _downward(top, lowest, eta, e)
    orders = max(m for m, _ in pairs)
    rows = jnp.moveaxis(rows, 1, 0) if orders < 2 else _by_order(orders, degrees, rows, eta / root)
    m, n = np.array(pairs).T
    return rows[m, n - lowest] * jnp.stack([e ** int(k + 1) for k in n])


@legendre_q.defjvp
def _legendre_q_jvp(pairs: Pairs, primals: tuple[Array], tangents: tuple[Array]) -> tuple[Array, Array]:
    """(1+η²) dQ̄_n^m/dη = −(n+1) η Q̄_n^m − Q̄_{n+1}^m/K_n^m: again of one sign, and the rule serves every order."""
    (eta,), (tangent,) = primals, tangents
    both = legendre_q(pairs + tuple((m, n + 1) for m, n in pairs), eta)
    value, above = both[: len(pairs)], both[len(pairs) :]
    shape = (-1,) + (1,) * jnp.ndim(eta)
    degree = jnp.asarray([n + 1.0 for _, n in pairs], value.dtype).reshape(shape)
    inverse_k = jnp.asarray([1 / k_constant(m, n) for m, n in pairs], value.dtype).reshape(shape)
    return value, -(degree * eta * value + inverse_k * above) / (1 + eta * eta) * tangent


def rho(m: int, n: int) -> float:
    """Return ρ_n^m, the norm of P_n^m on [0, 1] (Eq. 23a)."""
    return sqrt(factorial(n + m) / factorial(n - m) / (2 * n + 1))
