"""Matrices of the finite-state equation M å + D V L⁻¹ M a = D τ (Eq. 1): closed forms for any skew angle.

Rows (r, j), columns (m, n), blocks by the parities of the two mode tables; "odd" is an odd index sum (pressure), "even"
an even one (mass source). X = tan(χ/2) with χ the wake skew, l = min(r, m), s = √((2n+1)(2j+1)) and
q = √(H_n^m H_j^r)(n+j)(n+j+2)[(n−j)²−1]. They are Galerkin integrals over the plane of the disk with the test functions
∂Φ_j^r/∂z (tests/potential/test_matrices.py integrates them); cosine and sine modes do not couple.
"""

from functools import cache
from math import pi, sqrt

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from rotorjax.potential.legendre import h_constant, k_constant, powers
from rotorjax.potential.modes import Mode, ModeTable


def _sign(exponent: int) -> int:
    return -1 if exponent % 2 else 1


def gamma(r: int, j: int, m: int, n: int) -> float:
    """Return Γ_jn^rm, the part of L that does not depend on the skew (Peters and He 1995; Morillo and Peters 2002)."""
    odd_row, odd_column = (r + j) % 2 == 1, (m + n) % 2 == 1
    s, h = sqrt((2 * n + 1) * (2 * j + 1)), sqrt(h_constant(m, n) * h_constant(r, j))
    if (r + m) % 2 == 0 and odd_row != odd_column:
        return 1 / (h * s) if abs(j - n) == 1 else 0.0
    if (r + m) % 2 == 1 and odd_row == odd_column:
        k = sqrt(k_constant(m, n) * k_constant(r, j))
        return np.sign(r - m) / (k * s) if abs(j - n) == 1 else 0.0
    if n + j == 0:
        raise ValueError("Γ of (0, 0) with itself depends on the outer radius and has no closed form")
    q = h * (n + j) * (n + j + 2) * ((n - j) ** 2 - 1)
    if odd_row != odd_column:
        return np.sign(r - m) * 4 * _sign((3 * n + j + 2 * m - 2 * r) // 2) * s / (pi * q)
    if odd_row:
        return 2 * _sign((n + j - 2 * r) // 2) * s / q
    return 8 * _sign((n + j - 2 * r + 2) // 2) * s / (pi**2 * q)


def _damping_entry(row: Mode, column: Mode) -> float:
    (r, j, kind), (m, n, other) = row, column
    if r != m or kind != other:
        return 0.0
    if (j - n) % 2 == 0:
        return 1 / k_constant(m, n) if j == n else 0.0
    root = sqrt((2 * n + 1) * (2 * j + 1)) / sqrt(h_constant(m, n) * h_constant(m, j))
    return 2 / pi * root * _sign((j + 3 * n - 1) // 2) / ((j + n + 1) * (j - n))


@cache
def damping(rows: ModeTable, columns: ModeTable) -> np.ndarray:
    """Return the block of D, (rows, columns)."""
    return np.array([[_damping_entry(a, b) for b in columns.modes] for a in rows.modes])


@cache
def apparent_mass(rows: ModeTable, columns: ModeTable) -> np.ndarray:
    """Return the block of M = L(X = 0), (rows, columns)."""
    entries = [
        [gamma(a.m, a.n, b.m, b.n) if (a.m, a.kind) == (b.m, b.kind) else 0.0 for b in columns.modes]
        for a in rows.modes
    ]
    return np.array(entries)


@cache
def _influence_tables(rows: ModeTable, columns: ModeTable) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Γ, the factor of X^{m+r}, and the two exponents |m−r| and m+r, each (rows, columns)."""
    kinds = np.array([[a.kind == b.kind for b in columns.modes] for a in rows.modes])
    table = np.array([[gamma(a.m, a.n, b.m, b.n) for b in columns.modes] for a in rows.modes]) * kinds
    r, m = rows.m[:, None], columns.m[None, :]
    sine = np.array([a.kind == "sin" for a in rows.modes])[:, None]
    second = np.where(np.minimum(r, m) % 2 == 0, 1.0, -1.0) * np.where(sine, -1.0, 1.0)
    return table, np.where(r == 0, 0.0, second), np.abs(m - r), m + r


@jax.jit
def influence(rows: ModeTable, columns: ModeTable, x: Float[Array, ""]) -> Float[Array, "J N"]:
    """Return the block of L at X = tan(χ/2), (rows, columns).

    It is X^m Γ for r = 0 and [X^{|m−r|} ± (−1)^l X^{m+r}] Γ otherwise; the upper sign is for cosine modes, the
    lower for sine modes.
    """
    table, second, low, high = _influence_tables(rows, columns)
    x = jnp.asarray(x)
    power = powers(x, list(range(int(high.max()) + 1)))
    return (power[low] + jnp.asarray(second, x.dtype) * power[high]) * jnp.asarray(table, x.dtype)
