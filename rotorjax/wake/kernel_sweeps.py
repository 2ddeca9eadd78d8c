"""The Biot–Savart sum over all pairs: velocity, its tangent and its cotangent, a few segments at a time.

Each step of a scan takes a block of U segments against all N points, with points along the vector lanes: the scalars
of the pairs come out as (U, N) arrays that stay in cache, then the U rows are added up. Memory is O(N U + S).
Written so that XLA's CPU back end makes each of these one vectorised, two-core loop; benchmarks/README.md tells how.
"""

from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from rotorjax.device import on_cpu
from rotorjax.wake.kernel_pairs import Vector, add, between, cross, dot, influence, loose_pairs, pairs, slopes, subtract

PRODUCT_PAIRS, PRODUCT_BLOCK = 170_000, 64
"""Pairs a step where the sum is a matrix product, as many as the caches of two cores hold, and the segments that it has
at least: few large steps leave few hand-overs between threads.
"""

AT_ONCE = 4096
"""Segments a step on an accelerator: with 20 000 points their pairs take .7 GB in double precision."""


class KernelSegments(NamedTuple):
    """S segments: ends (3, S), circulation over 4π (S,) and softening e = |l|² r_c² (S,)."""

    start: Array
    end: Array
    strength: Array
    soft: Array


class KernelSettings(NamedTuple):
    """exponent: Vatistas n. chained: each segment starts where the last one ended. block: segments a step. products:
    sum the velocity by matrix products (`_by_products`). at_once: sum it in one step instead (`_at_once`).
    """

    exponent: float
    chained: bool
    block: int
    products: bool = False
    at_once: bool = False


class Block(NamedTuple):
    """One step's U segments: nodes (3, U + 1) of a chain or (3, 2U); strength times edge (3, U); the rest (U,).

    The first U nodes are the starts, the last U the ends.
    """

    nodes: Array
    whirl: Array
    strength: Array
    soft: Array


@partial(jax.jit, static_argnums=0)
def velocity(settings: KernelSettings, points: Array, segments: KernelSegments) -> Array:
    """Velocity (3, N) at points (3, N)."""
    if settings.at_once:
        return _at_once(settings, points, segments)
    if settings.products:
        return _by_products(settings, points, segments)
    x = tuple(points)

    def step(total: Vector, block: Block):
        k = influence(pairs(x, block.nodes, block.soft, slice_r=True), settings.exponent)
        for u in range(k.shape[0]):
            c = cross(block.whirl[:, u], subtract(x, block.nodes[:, u]))
            total = add(total, _times(k[u], c))
        return total, None

    return jnp.stack(jax.lax.scan(step, _zeros(points), _blocks(segments, settings))[0])


def _by_products(settings: KernelSettings, points: Array, segments: KernelSegments) -> Array:
    """The same sum as Σ k (w × x − w × s), w = Γ l/4π and s its start: a product of (6, U) with k (U, N) a step.

    It takes half the time of rows added one by one, and steps of many segments leave few hand-overs between threads.
    Written so, w × (x − s) is a difference of nearly equal numbers next to a segment: its relative error there is
    ε |x|/|x − s|, which a core of .01 keeps below 1e-13 of the largest velocity in double and 1e-4 in single precision.
    """
    x, width = tuple(points), _even(segments, max(PRODUCT_BLOCK, PRODUCT_PAIRS // points.shape[1]))
    # an accelerator would round single precision to ten bits; asked to do so too, XLA's CPU back end takes four times
    # as long
    precision = None if on_cpu() else "highest"

    def step(total: Array, block: Block):
        start, end = tuple(block.nodes[:, :width]), tuple(block.nodes[:, -width:])
        k = influence(loose_pairs(x, start, end, block.soft), settings.exponent)
        whirl = tuple(block.whirl)
        return total + jnp.dot(jnp.stack([*whirl, *cross(whirl, start)]), k, precision=precision), None

    start = jnp.zeros((6, points.shape[1]), points.dtype)
    total = jax.lax.scan(step, start, _blocks(segments, settings._replace(block=width)))[0]
    return jnp.stack(cross(tuple(total[:3]), x)) - total[3:]


def _at_once(settings: KernelSettings, points: Array, segments: KernelSegments) -> Array:
    """The same sum for an accelerator, in as few steps as memory allows: a scan is a row of small programs there.

    Segments go along the lanes, so that neighbours in memory are added up, and one reduction adds all three components.
    """
    x = tuple(row[:, None] for row in points)
    width = _even(segments, AT_ONCE)

    def step(total: Vector, block: Block):
        start, end = block.nodes[:, None, :width], block.nodes[:, None, -width:]
        r1, edge = subtract(x, start), tuple(end - start)
        k = influence(between(r1, subtract(x, end), edge, block.soft), settings.exponent)
        each = _times(k, cross(tuple(block.whirl[:, None]), r1))
        return add(total, jax.lax.reduce(each, (jnp.zeros((), points.dtype),) * 3, add, (1,))), None

    return jnp.stack(jax.lax.scan(step, _zeros(points), _blocks(segments, settings._replace(block=width)))[0])


@partial(jax.jit, static_argnums=0)
def velocity_and_tangent(
    settings: KernelSettings, points: Array, segments: KernelSegments, points_t: Array, segments_t: KernelSegments
) -> tuple[Array, Array]:
    """Velocity and its directional derivative in one sweep (…_t: tangents), (3, N) each."""
    x, x_t = tuple(points), tuple(points_t)

    def step(totals: tuple[Vector, Vector], blocks: tuple[Block, Block]):
        (total, total_t), (block, block_t) = totals, blocks
        pair = pairs(x, block.nodes, block.soft)
        f = slopes(pair, settings.exponent)
        pair_t = pairs(x_t, block_t.nodes, block_t.soft)
        inner = (
            f.rho * dot(pair.edge, pair_t.edge)
            + f.kappa1 * dot(pair.r1, pair_t.r1)
            - f.kappa2 * dot(pair.r2, pair_t.r2)
        )
        k, k_t = f.k, (inner - f.k_e * pair_t.soft) / f.spread
        for u in range(k.shape[0]):
            r, r_t = subtract(x, block.nodes[:, u]), subtract(x_t, block_t.nodes[:, u])
            c = cross(block.whirl[:, u], r)
            c_t = add(cross(block_t.whirl[:, u], r), cross(block.whirl[:, u], r_t))
            total = add(total, _times(k[u], c))
            total_t = add(total_t, add(_times(k_t[u], c), _times(k[u], c_t)))
        return (total, total_t), None

    both = jax.jvp(lambda s: _blocks(s, settings), (segments,), (segments_t,))
    total, total_t = jax.lax.scan(step, (_zeros(points), _zeros(points)), both)[0]
    return jnp.stack(total), jnp.stack(total_t)


@partial(jax.jit, static_argnums=0)
def cotangents(
    settings: KernelSettings, points: Array, segments: KernelSegments, weight: Array
) -> tuple[Array, KernelSegments]:
    """Derivatives of sum(weight * velocity) with respect to points and segments, in one sweep.

    With a = W w·c for the weight w, a pair of unit strength gives its start −ρa l − κ₁a r₁ − k r₂ × w, its end
    ρa l + κ₂a r₂ + k r₁ × w, and its point minus the sum of both. The sums over points are products with [x, 1]
    and [w, x × w], with x measured from the points' mean to keep digits.
    """
    p, w = tuple(points), tuple(weight)
    centre = points.mean(axis=1, keepdims=True)
    x = tuple(points - centre)
    one = jnp.ones_like(x[0])
    moments, swirls = jnp.stack([*x, one], axis=1), jnp.stack([*w, *cross(x, w)], axis=1)

    def step(totals: tuple[Vector, Vector], block: Block):
        turn, pull = totals
        pair = pairs(p, block.nodes, block.soft)
        f = slopes(pair, settings.exponent)
        a = dot(w, cross(pair.edge, pair.r1)) / f.spread
        kappa1, kappa2 = a * f.kappa1, a * f.kappa2
        count = f.k.shape[0]
        for u in range(count):
            g, r1, r2 = block.strength[u], subtract(p, block.nodes[:, u]), subtract(p, block.nodes[:, u - count])
            turn = add(turn, _times(f.k[u], tuple(block.whirl[:, u])))
            pull = add(pull, subtract(_times(kappa1[u], _times(g, r1)), _times(kappa2[u], _times(g, r2))))
        sums = kappa1 @ moments, kappa2 @ moments, f.k @ swirls, (a * f.rho) @ one, (a * f.k_e) @ one
        return (turn, pull), sums

    blocks = _blocks(segments, settings)
    (turn, pull), sums = jax.lax.scan(step, (_zeros(points), _zeros(points)), blocks)
    sums = [s.reshape(-1, *s.shape[2:])[: segments.strength.shape[0]].T for s in sums]
    return jnp.stack(add(pull, cross(w, turn))), _gather(segments, centre, *sums)


def _gather(segments: KernelSegments, centre: Array, first: Array, second: Array, swirl: Array, rho: Array, k_e: Array):
    """Cotangents of the segments from their sums over the points."""
    start, end, g = tuple(segments.start - centre), tuple(segments.end - centre), segments.strength
    edge = subtract(end, start)
    r1_w, r2_w = (subtract(tuple(swirl[3:]), cross(r, tuple(swirl[:3]))) for r in (start, end))
    at_start = [-g * (rho * edge[i] + first[i] - start[i] * first[3] + r2_w[i]) for i in range(3)]
    at_end = [g * (rho * edge[i] + second[i] - end[i] * second[3] + r1_w[i]) for i in range(3)]
    return KernelSegments(jnp.stack(at_start), jnp.stack(at_end), dot(edge, r1_w), -g * k_e)


def _even(segments: KernelSegments, most: int) -> int:
    """Segments a step where steps, none of more than `most`, are as equal as can be: what fills the last one up costs
    as much as segments do.
    """
    count = segments.strength.shape[0]
    return -(-count // -(-count // most))


def _blocks(segments: KernelSegments, settings: KernelSettings) -> Block:
    """Cut S segments into steps of U, (steps, …, U); the last step is filled up with segments of no length or strength.

    They stand where the last segment ends, which keeps a chain a chain.
    """
    width = settings.block
    steps = -(-segments.strength.shape[0] // width)
    missing = steps * width - segments.strength.shape[0]

    def cut(row: Array, filler: Array) -> Array:
        filling = jnp.broadcast_to(filler, (*row.shape[:-1], missing))
        full = jnp.concatenate([row, filling], axis=-1)
        return jnp.moveaxis(full.reshape(*row.shape[:-1], steps, width), -2, 0)

    last = segments.end[:, -1:]
    start, end = cut(segments.start, last), cut(segments.end, last)
    strength, soft = cut(segments.strength, 0 * segments.strength[-1:]), cut(segments.soft, segments.soft[-1:])
    nodes = jnp.concatenate([start, end[..., -1:] if settings.chained else end], axis=-1)
    return Block(nodes, strength[:, None] * (end - start), strength, soft)


def _times(scale: Array, vector: Vector) -> Vector:
    return scale * vector[0], scale * vector[1], scale * vector[2]


def _zeros(points: Array) -> Vector:
    return (jnp.zeros_like(points[0]),) * 3
