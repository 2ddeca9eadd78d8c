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
The steps run once, in numpy, at Chebyshev nodes in u; what is left, Q̄_n^m e^{−n−1} as a function of u, is smooth
on [0, ½] and comes from a product of its Chebyshev coefficients with T_k(4u − 1): one matrix product for all modes,
compiled in an instant. The factor e^{n+1} outside it keeps the far field's relative accuracy, in float32 too.
"""

from functools import cache, partial
from math import factorial, pi, prod, sqrt

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
def _chebyshev_table(pairs: Pairs) -> np.ndarray:
    """Chebyshev coefficients in 4u − 1 of each flattened row, (L, 25): analytic up to u = 1, they end at 5.8^{−24}."""
    node = np.polynomial.chebyshev.chebpts1(_TERMS)
    u = (node + 1) / 4
    rows = _scaled_q(max(n for _, n in pairs), tuple(u))
    values = np.stack([rows[m, n] / (1 - u) ** _flattening(m, n) for m, n in pairs])
    basis = np.polynomial.chebyshev.chebvander(node, _TERMS - 1)  # orthogonal on its nodes
    return values @ basis * np.where(np.arange(_TERMS) == 0, 1, 2) / _TERMS


def _chebyshev_basis(x: Float[Array, "*N"]) -> Float[Array, "T ..."]:
    """T_0 … T_24 at x, by doubling (T_{k+j} = 2 T_k T_j − T_{k−j}): few operations, so that they compile fast."""
    rows = jnp.stack([jnp.ones_like(x), x])
    while (k := len(rows) - 1) < _TERMS - 1:
        j = min(k, _TERMS - 1 - k)
        rows = jnp.concatenate([rows, 2 * rows[k] * rows[1 : j + 1] - rows[k - j : k][::-1]])
    return rows


def powers(x: Float[Array, "*N"], exponents: list[int]) -> Float[Array, "L ..."]:
    """Return x to each exponent, by doubling (no 0/0 in any derivative at x = 0)."""
    rows = jnp.stack([jnp.ones_like(x), x])
    while len(rows) <= max(exponents):
        rows = jnp.concatenate([rows, rows[1:] * rows[-1]])
    return rows[np.array(exponents)]


@partial(jax.custom_jvp, nondiff_argnums=(0,))
@partial(jax.jit, static_argnums=0)
def legendre_q(pairs: Pairs, eta: Float[Array, "*N"]) -> Float[Array, "L ..."]:
    """Return Q̄_n^m(iη) for L static pairs (m, n), m ≤ n, at η ≥ 0; one at η = 0 (Eqs. 22b, 23b)."""
    eta = jnp.asarray(eta)
    e = 1 / (eta + jnp.sqrt(1 + eta * eta))  # √(1+η²) − η without cancellation
    u = e * e / (1 + e * e)
    table = jnp.asarray(_chebyshev_table(pairs), eta.dtype)
    rows = jnp.tensordot(table, _chebyshev_basis(4 * u - 1), 1, precision=jax.lax.Precision.HIGHEST)
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
