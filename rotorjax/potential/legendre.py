"""Normalised associated Legendre functions P̄_n^m(ν) and Q̄_n^m(iη) of Appendix B for a whole list of (m, n) at once.

P̄ comes as (1−ν²)^{m/2} times a polynomial, which is returned without that factor: with r^m cos mψ beside it the
product stays smooth on the axis. It is one matrix product for all modes, too.

Q̄ decays with n where P̄(iη) grows, so the upward recursion drowns in rounding (4e-2 at η = 5, n = 7), and the
series in 1/(1+η²) does not converge near the disk. Three steps avoid both; each adds positive numbers only (but for
signs inside one short series), so that no digit is lost, and there is no branch in η
(tests/potential/test_legendre.py):
1. the two highest degrees at m = 0 and 1, by Whipple's transformation (DLMF 14.9.16, 15.8.1):
   Q_n^m(iη) ∝ e^{n+1}(1+e²)^{−1/2} ₂F₁(½+m, ½−m; n+3/2; u),  e = √(1+η²) − η,  u = e²/(1+e²) ≤ ½ for every η ≥ 0;
2. downward in n:  Q̄_{n−1}^m = Q̄_{n+1}^m + (2n+1) K_n^m η Q̄_n^m;
3. upward in m:    Q̄_n^{m+1} = Q̄_n^{m−1} + 2m K_n^m η/√(1+η²) Q̄_n^m.
The steps run once, in numpy, at Chebyshev nodes in u; what is left, Q̄_n^m e^{−n−1} as a function of u, is smooth
on [0, ½] and comes from a product of its coefficients with powers of 4u − 1: one matrix product for all modes,
compiled in an instant. The factor e^{n+1} outside it keeps the far field's relative accuracy, in float32 too.
"""

from fractions import Fraction
from functools import cache, partial
from math import comb, factorial, perm, pi, prod, sqrt

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

Pairs = tuple[tuple[int, int], ...]
_LOWEST_START = 8  # a start at a higher degree needs fewer terms of the series
_TERMS = 25


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


@cache
def _bernstein_table(pairs: Pairs) -> np.ndarray:
    """Coefficients of tⁱ(1−t)^{D−i} in the polynomials of `reduced_legendre_p`, (L, D + 1), by way of exact fractions.

    In these terms a polynomial keeps its own size at either end, where one of them is left: no digit is lost.
    """
    degree = max((n - m) // 2 for m, n in pairs)
    rows = []
    for m, n in pairs:
        count = (n - m) // 2
        power = [(-1) ** k * comb(n, k) * comb(2 * n - 2 * k, n) * perm(n - 2 * k, m) for k in range(count + 1)][::-1]
        raised = [
            sum(Fraction(comb(i, j), comb(degree, j)) * c for j, c in enumerate(power)) for i in range(degree + 1)
        ]
        rows.append([float(c * comb(degree, i) / 2**n) / rho(m, n) for i, c in enumerate(raised)])
    return np.array(rows)


@partial(jax.jit, static_argnums=0)
def reduced_legendre_p(pairs: Pairs, nu_squared: Float[Array, "*N"]) -> Float[Array, "L ..."]:
    """Return P̄_n^m/(1−ν²)^{m/2} for n−m even and P̄_n^m/[ν(1−ν²)^{m/2}] for n−m odd: polynomials in ν².

    pairs: L tuples (m, n), static. On the disk ν² = 1−r̄², so there is no root at the edge.
    """
    table, t = _bernstein_table(pairs), jnp.asarray(nu_squared)
    rising = list(range(table.shape[1]))
    return combined(table, powers(t, rising) * powers(1 - t, rising[::-1]))


def _column(values: np.ndarray, like: Float[Array, "*N"]) -> np.ndarray:
    """One number for each pair, against an array for each."""
    return values.reshape(-1, *(1,) * like.ndim)


@partial(jax.custom_jvp, nondiff_argnums=(0,))
@partial(jax.jit, static_argnums=0)
def legendre_p(pairs: Pairs, nu: Float[Array, "*N"]) -> Float[Array, "L ..."]:
    """Return P̄_n^m(ν)/(1−ν²)^{m/2} for L pairs (m, n): polynomials in ν (Eqs. 22a, 23a)."""
    nu = jnp.asarray(nu)
    odd = np.array([(n - m) % 2 == 1 for m, n in pairs])
    return reduced_legendre_p(pairs, nu * nu) * jnp.where(_column(odd, nu), nu, 1.0)


@legendre_p.defjvp
def _legendre_p_jvp(pairs: Pairs, primals: tuple[Array], tangents: tuple[Array]) -> tuple[Array, Array]:
    """A derivative of P_n of order m has one of order m + 1 as its derivative; that of order n is level."""
    nu = jnp.asarray(primals[0])
    factor = np.array([sqrt((n + m + 1) * (n - m)) for m, n in pairs])
    both = legendre_p(pairs + tuple((min(m + 1, n), n) for m, n in pairs), nu)
    return both[: len(pairs)], _column(factor.astype(nu.dtype), nu) * both[len(pairs) :] * tangents[0]


def _series(m: int, n: int, u: np.ndarray) -> np.ndarray:
    """₂F₁(½+m, ½−m; n+3/2; u)/₂F₁(…; ½) for m = 0 or 1 and 0 ≤ u ≤ ½."""
    coefficients, k = [1.0], 0
    while abs(coefficients[-1]) * 0.5**k > 1e-18:
        coefficients.append(coefficients[-1] * (0.5 + m + k) * (0.5 - m + k) / ((n + 1.5 + k) * (k + 1)))
        k += 1
    return np.polynomial.polynomial.polyval(u, coefficients) / np.polynomial.polynomial.polyval(0.5, coefficients)


@cache
def _scaled_q(highest: int, u: tuple[float, ...]) -> dict[tuple[int, int], np.ndarray]:
    """Q̄_n^m e^{−n−1} √((1+e²)/2) at points u for 0 ≤ m ≤ n ≤ highest, by the three steps of the module's head."""
    x = np.array(u)
    e2, eta_e, s = x / (1 - x), (1 - 2 * x) / (1 - x) / 2, 1 - 2 * x
    top = max(_LOWEST_START, highest)
    rows = {(m, n): _series(m, n, x) for m in (0, 1) for n in (top, top + 1)}
    for m in (0, 1):
        for n in range(top, m, -1):
            rows[m, n - 1] = e2 * rows[m, n + 1] + (2 * n + 1) * k_constant(m, n) * eta_e * rows[m, n]
    for n in range(2, highest + 1):
        for m in range(1, n):
            rows[m + 1, n] = rows[m - 1, n] + 2 * m * k_constant(m, n) * s * rows[m, n]
    return rows


def _flattening(m: int, n: int) -> int:
    """The power of 1 − u that a row behaves like: divided out, the row is level and its fit keeps relative accuracy."""
    return max(0, round((m * m - 0.25) / (n + 1.5)))


@cache
def _power_table(pairs: Pairs) -> np.ndarray:
    """Coefficients of the powers of 4u − 1 in each flattened row, (L, 25), by way of Chebyshev's.

    Those end at 5.8^{−24}, since a row is analytic up to u = 1; a power's share in T_k grows as 2.4^k alone.
    """
    node = np.polynomial.chebyshev.chebpts1(_TERMS)
    u = (node + 1) / 4
    rows = _scaled_q(max(n for _, n in pairs), tuple(u))
    values = np.stack([rows[m, n] / (1 - u) ** _flattening(m, n) for m, n in pairs])
    basis = np.polynomial.chebyshev.chebvander(node, _TERMS - 1)  # orthogonal on its nodes
    series = values @ basis * np.where(np.arange(_TERMS) == 0, 1, 2) / _TERMS
    return np.stack([np.polynomial.chebyshev.cheb2poly(row) for row in series])


def combined(table: np.ndarray, basis: Float[Array, "T ..."]) -> Float[Array, "L ..."]:
    """Return the matrix product of numbers (L, T) and functions.

    XLA fuses nothing past it: else each use of a value would go through all of its steps again.
    """
    return jnp.tensordot(jnp.asarray(table, basis.dtype), basis, 1, precision=jax.lax.Precision.HIGHEST)


def powers(x: Float[Array, "*N"], exponents: list[int]) -> Float[Array, "L ..."]:
    """Return x to each exponent, by its binary digits (no 0/0 in any derivative at x = 0)."""
    left = np.array(exponents).reshape(-1, *(1,) * jnp.ndim(x))
    product = jnp.ones(left.shape, jnp.result_type(x))
    while left.any():
        product, x, left = product * jnp.where(left % 2 == 1, x, 1.0), x * x, left // 2
    return product * jnp.ones_like(x)


@partial(jax.custom_jvp, nondiff_argnums=(0,))
@partial(jax.jit, static_argnums=0)
def legendre_q(pairs: Pairs, eta: Float[Array, "*N"]) -> Float[Array, "L ..."]:
    """Return Q̄_n^m(iη) for L static pairs (m, n), m ≤ n, at η ≥ 0; one at η = 0 (Eqs. 22b, 23b)."""
    eta = jnp.asarray(eta)
    e = 1 / (eta + jnp.sqrt(1 + eta * eta))  # √(1+η²) − η without cancellation
    u = e * e / (1 + e * e)
    rows = combined(_power_table(pairs), powers(4 * u - 1, list(range(_TERMS))))
    rows = rows * jnp.sqrt(2 * (1 - u)) * powers(e, [n + 1 for _, n in pairs])
    flattening = [_flattening(m, n) for m, n in pairs]
    return rows * powers(1 - u, flattening) if any(flattening) else rows


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
