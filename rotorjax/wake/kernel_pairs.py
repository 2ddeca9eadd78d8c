"""One segment and one point: the scalars of the Biot–Savart law and of its derivatives.

With r₁, r₂ from the segment's ends to the point, l its edge, d = |r|, c = l × r₁ and h = |c|² (|l|² times the squared
distance from the axis), a segment of circulation Γ and softening e = |l|² r_c² induces

    v = (Γ/4π) k c,    k = M W,    M = l·(r̂₁ − r̂₂),    W = (hⁿ + eⁿ)^(−1/n)         (Vatistas 1991; n = 1 is Scully)

and with q = r₁·r₂, μ = l·r the tangent of k is

    k' = W [ρ l·l' + κ₁ r₁·r₁' − κ₂ r₂·r₂' − k_e e'],    ρ = 1/d₁ + 1/d₂ − 2 k_h q,
    κ₁ = 1/d₁ − 1/d₂ − μ₁/d₁³ + 2 k_h μ₂,    κ₂ = 1/d₁ − 1/d₂ − μ₂/d₂³ + 2 k_h μ₁,
    k_h = M hⁿ⁻¹/(hⁿ + eⁿ),    k_e = M eⁿ⁻¹/(hⁿ + eⁿ)          (all three equal k for Scully).

Vectors are tuples of x, y, z arrays: XLA fuses component arrays into one vectorised loop, and (…, 3) arrays not.
"""

from typing import NamedTuple

import jax.numpy as jnp
from jax import Array

Vector = tuple[Array, ...] | Array


class Pairs(NamedTuple):
    """Geometry of U segments (rows) against N points (columns), (U, N) each; edge and soft are (U, 1).

    i1 and i2 are 1/d₁ and 1/d₂, but 0 on the node, where r̂ := 0 is the mean over directions.
    """

    r1: Vector
    r2: Vector
    d1: Array
    d2: Array
    i1: Array
    i2: Array
    edge: Vector
    soft: Array


class Slopes(NamedTuple):
    """What k' needs, (U, N) each: see the module's formulas."""

    k: Array
    k_e: Array
    spread: Array  # 1/W, to divide by
    rho: Array
    kappa1: Array
    kappa2: Array


def dot(a: Vector, b: Vector) -> Array:
    """Inner product of two vectors."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Vector, b: Vector) -> Vector:
    """Vector product."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def subtract(a: Vector, b: Vector) -> Vector:
    """Difference of two vectors."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def add(a: Vector, b: Vector) -> Vector:
    """Sum of two vectors."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


def columns(a: Vector) -> Vector:
    """Vectors of U segments as (U, 1), to stand against N points."""
    return a[0][:, None], a[1][:, None], a[2][:, None]


def pairs(points: Vector, nodes: Array, soft: Array, *, slice_r: bool = False) -> Pairs:
    """Geometry of all pairs of N points and U segments, whose starts are the first and ends the last U of the nodes.

    A chain has U + 1 nodes, so that a distance serves the segments on both sides of its node; loose segments have 2U.
    slice_r: cut r₁ and r₂ out of all nodes' r instead of subtracting again. The numbers are the same, but XLA fuses the
    plain sum three times better with it and the derivatives twice better without.
    """
    count = soft.shape[0]
    start, end = nodes[:, :count], nodes[:, -count:]
    r = subtract(points, columns(nodes))
    d, i = _distance(r)
    if slice_r:
        r1, r2 = tuple(x[:count] for x in r), tuple(x[-count:] for x in r)
    else:
        r1, r2 = subtract(points, columns(start)), subtract(points, columns(end))
    edge = columns(subtract(end, start))
    return Pairs(r1, r2, d[:count], d[-count:], i[:count], i[-count:], edge, soft[:, None])


def loose_pairs(points: Vector, start: Vector, end: Vector, soft: Array) -> Pairs:
    """Geometry of all pairs of N points and U segments that share no nodes."""
    r1, r2 = subtract(points, columns(start)), subtract(points, columns(end))
    return between(r1, r2, columns(subtract(end, start)), soft[:, None])


def between(r1: Vector, r2: Vector, edge: Vector, soft: Array) -> Pairs:
    """Geometry of pairs whose r₁, r₂, edge and softening are known, whichever way segments and points run."""
    (d1, i1), (d2, i2) = _distance(r1), _distance(r2)
    return Pairs(r1, r2, d1, d2, i1, i2, edge, soft)


def _distance(r: Vector) -> tuple[Array, Array]:
    """|r| and 1/|r| (0 where r is 0)."""
    square = dot(r, r)
    d = jnp.sqrt(square)
    return d, d / nonzero(square)


def influence(pair: Pairs, exponent: float) -> Array:
    """k of every pair, with one division for Scully's core.

    M = (d₁ + d₂)(1 − cos) cancels where the segment is seen under a small angle, so ahead of and behind it
    1 − cos = h/(d₁d₂(d₁d₂ + q)) is used. On a node c = 0, so any finite k will do.
    """
    c = cross(pair.edge, pair.r1)
    h, q, p = dot(c, c), dot(pair.r1, pair.r2), pair.d1 * pair.d2
    outside = q > 0
    top = (pair.d1 + pair.d2) * jnp.where(outside, h, p - q)
    bottom = p * jnp.where(outside, p + q, 1)
    if exponent == 1:
        return top / nonzero(bottom * (h + pair.soft))
    return top / nonzero(bottom) * _core(h, pair.soft, exponent)[0]


def slopes(pair: Pairs, exponent: float) -> Slopes:
    """The factors of k'. Divisions come last: XLA computes a quotient once and keeps it for all its readers."""
    r1, r2, edge, i1, i2 = pair.r1, pair.r2, pair.edge, pair.i1, pair.i2
    c = cross(edge, r1)
    h, q = dot(c, c), dot(r1, r2)
    cos = q * (i1 * i2)
    outside = cos > 0
    top = (pair.d1 + pair.d2) * jnp.where(outside, h * (i1 * i2) ** 2, 1 - cos)
    bottom = jnp.where(outside, 1 + cos, 1)
    if exponent == 1:
        k = k_h = k_e = top / nonzero(bottom * (h + pair.soft))
        spread = nonzero(h + pair.soft)
    else:
        w, slope_h, slope_e = _core(h, pair.soft, exponent)
        m = top / bottom
        k, k_h, k_e = m * w, m * slope_h, m * slope_e
        spread = 1 / w
    mu1, mu2 = dot(edge, r1), dot(edge, r2)
    difference = i1 - i2
    kappa1 = difference - i1 * i1 * i1 * mu1 + 2 * k_h * mu2
    kappa2 = difference - i2 * i2 * i2 * mu2 + 2 * k_h * mu1
    return Slopes(k, k_e, spread, i1 + i2 - 2 * k_h * q, kappa1, kappa2)


def _core(h: Array, e: Array, n: float) -> tuple[Array, Array, Array]:
    """W, hⁿ⁻¹/(hⁿ + eⁿ) and eⁿ⁻¹/(hⁿ + eⁿ), scaled by the larger of h and e so that no power overflows."""
    scale = 1 / nonzero(jnp.maximum(h, e))
    h, e = h * scale, e * scale
    total = h**n + e**n
    total = jnp.where(total > 0, total, 1)
    return scale * total ** (-1 / n), scale * h ** (n - 1) / total, scale * e ** (n - 1) / total


def nonzero(x: Array) -> Array:
    """1 in place of 0: the numerator (or what multiplies the quotient) vanishes there too."""
    return jnp.where(x > 0, x, 1)
