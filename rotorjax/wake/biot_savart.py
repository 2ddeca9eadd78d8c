"""Velocity of straight vortex segments: the Biot–Savart sum, blocked so that no N × S array is ever stored.

The formulas know no units: any consistent ones will do (the wake uses lengths over R and circulation over ΩR²).
With r₁ and r₂ from a segment's ends to the point, û along it and h the distance from its axis,

    v = (Γ/4π) û·(r̂₁ − r̂₂) (û × r₁) / (h²ⁿ + r_c²ⁿ)^(1/n)          (Vatistas et al. 1991; n = 1 is Scully's core)

It is differentiable in forward and in reverse mode with respect to points, nodes, strengths and cores. On a segment's
axis and its extension the velocity is zero; on a node, where one segment alone has no derivative, its mean over
directions is taken, which is right for a filament that runs straight on. A segment without a core is singular on its
axis: the velocity there is zero by convention and has no meaningful derivative.
"""

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer
from jaxtyping import Array, Float

from rotorjax.device import on_cpu
from rotorjax.errors import InputError
from rotorjax.frames import rotate_about_shaft
from rotorjax.ground import Plane
from rotorjax.wake.kernel_pairs import between, cross, dot, influence, nonzero, subtract
from rotorjax.wake.kernel_rule import BiotSavart
from rotorjax.wake.kernel_sweeps import KernelSegments, KernelSettings


def segment_velocity(
    points: Float[Array, "N 3"],
    start: Float[Array, "S 3"],
    end: Float[Array, "S 3"],
    strength: Float[Array, " S"],
    core: Float[Array, " S"],
    *,
    exponent: float = 1,
    plane: Plane | None = None,
    blades: int = 1,
    block: int | None = None,
    products: bool = False,
) -> Float[Array, "N 3"]:
    """Velocity at points from straight segments with a strength (positive from start to end) and a core radius each.

    exponent: Vatistas n ≥ 1 (1 Scully, 2 Bagai–Leishman). plane: add the mirror image in this plane. blades: the
    segments belong to one blade and repeat by rotation about the shaft. block: segments per step of the sum; an
    accelerator makes it in one unless told. products: on a CPU sum by matrix products, twice as fast and less exact
    next to thin cores (`kernel_sweeps._by_products`); derivatives are the same.

    Raises InputError where shapes do not match, a core is negative or the exponent is below 1.
    """
    for name, ends in (("start", start), ("end", end)):
        if ends.ndim != 2 or ends.shape[1] != 3:
            raise InputError(f"Argument `{name}` must have shape (S, 3), but is {ends.shape}")
    if start.shape != end.shape:
        raise InputError(f"Argument `end` must have the shape of start, {start.shape}, but is {end.shape}")
    _check_segments(points, strength, core, start.shape[:1])
    settings = _settings(exponent, blades, block, chained=False)._replace(products=products)
    return _velocity(settings, points, start, end, strength, core, plane, blades)


def filament_velocity(
    points: Float[Array, "N 3"],
    nodes: Float[Array, "F A 3"],
    strength: Float[Array, "F A-1"],
    core: Float[Array, "F A-1"],
    *,
    exponent: float = 1,
    plane: Plane | None = None,
    blades: int = 1,
    block: int | None = None,
) -> Float[Array, "N 3"]:
    """Velocity at points from filaments of straight segments between consecutive nodes; options as segment_velocity.

    All filaments are strung on one chain, with links of no strength between them, so that the distance of a node
    serves the segments on both its sides.

    Raises InputError where a filament has fewer than two nodes, shapes do not match, a core is negative or the
    exponent is below 1.
    """
    if nodes.ndim != 3 or nodes.shape[1] < 2 or nodes.shape[2] != 3:
        raise InputError(f"Argument `nodes` must have shape (F, A, 3) with A >= 2, but is {nodes.shape}")
    _check_segments(points, strength, core, (nodes.shape[0], nodes.shape[1] - 1))
    settings = _settings(exponent, blades, block, chained=True)
    chain = nodes.reshape(-1, 3)
    strength, core = (jnp.pad(x, ((0, 0), (0, 1))).reshape(-1)[:-1] for x in (strength, core))
    return _velocity(settings, points, chain[:-1], chain[1:], strength, core, plane, blades)


def lattice_velocity(
    points: Float[Array, "N 3"],
    nodes: Float[Array, "R A 3"],
    rings: Float[Array, "R-1 A-1"],
    core_along: Float[Array, "R A-1"],
    core_across: Float[Array, "R-1 A"],
    **options,
) -> Float[Array, "N 3"]:
    """Velocity at points from a lattice of vortex rings; options as segment_velocity.

    A positive ring runs nodes (r, a) → (r, a+1) → (r+1, a+1) → (r+1, a). Shared edges are summed once: along A row r
    carries Γ[r] − Γ[r−1], across it column a carries Γ[a−1] − Γ[a].

    Raises InputError as filament_velocity, and where rings do not fit the nodes.
    """
    if nodes.ndim != 3 or min(nodes.shape[:2]) < 2 or nodes.shape[2] != 3:
        raise InputError(f"Argument `nodes` must have shape (R, A, 3) with R, A >= 2, but is {nodes.shape}")
    if rings.shape != (nodes.shape[0] - 1, nodes.shape[1] - 1):
        raise InputError(f"Argument `rings` must have shape (R-1, A-1) for nodes {nodes.shape}, but is {rings.shape}")
    along = jnp.diff(rings, axis=0, prepend=0, append=0)
    across = -jnp.diff(rings, axis=1, prepend=0, append=0)
    swapped = jnp.swapaxes(nodes, 0, 1)
    return filament_velocity(points, nodes, along, core_along, **options) + filament_velocity(
        points, swapped, across.T, core_across.T, **options
    )


@partial(jax.jit, static_argnames=("settings", "blades"))
def _velocity(settings, points, start, end, strength, core, plane: Plane | None, blades: int):
    """Sum over the segments, the other blades and the mirror image: one program, also where nothing else is compiled.

    A copy's velocity is the segments' own at the point turned (or reflected) back, turned (or reflected) with the copy.
    """
    if not points.shape[0] or not strength.shape[0]:
        return jnp.zeros_like(points)
    soft = jnp.sum((end - start) ** 2, axis=1) * core**2
    segments = KernelSegments(start.T, end.T, strength / (4 * jnp.pi), soft)
    angles = jnp.asarray(2 * np.pi / blades * np.arange(blades)[:, None], points.dtype)
    sides = points[None] if plane is None else jnp.stack([points, plane.reflect_points(points)])
    # one sum for all copies, (sides, blades, N, 3)
    copies = jnp.broadcast_to(sides[:, None], (len(sides), blades, *points.shape))
    places = rotate_about_shaft(copies, -angles)
    everywhere = places.reshape(-1, 3).T
    found = BiotSavart(settings, everywhere, segments)(everywhere, segments).T.reshape(places.shape)
    turned = jnp.sum(rotate_about_shaft(found, angles), axis=1)
    return turned[0] if plane is None else turned[0] + plane.reflect_vectors(turned[1])


def sharpened_velocity(
    points: Float[Array, "N 3"],
    start: Float[Array, "S 3"],
    end: Float[Array, "S 3"],
    strength: Float[Array, " S"],
    core: Float[Array, " S"],
    *,
    fine: Float[Array, ""],
) -> Float[Array, "N 3"]:
    """What the velocity of `segment_velocity` (Scully's core) changes by as all cores shrink to `fine`.

    For few points, none of them on a segment's end: all N × S pairs are stored. Both cores share their pairs, and the
    difference of two nearly equal numbers is not taken: 1/(h + e₁) − 1/(h + e₂) = (e₂ − e₁)/((h + e₁)(h + e₂)).
    """
    length = jnp.sum((end - start) ** 2, axis=1)
    thin, pair = length * fine**2, _stored(points, start, end, length * core**2)
    c = cross(pair.edge, pair.r1)
    sharper = influence(pair, 1) * (pair.soft - thin) / nonzero(dot(c, c) + thin)
    weight = strength / (4 * jnp.pi) * sharper
    return jnp.stack([jnp.sum(weight * component, axis=1) for component in c], axis=1)


def unit_velocities(
    points: Float[Array, "N 3"], start: Float[Array, "S 3"], end: Float[Array, "S 3"], core: Float[Array, ""]
) -> Float[Array, "N S 3"]:
    """Velocity at each point from each segment of unit strength (Scully's core), all pairs stored: for few of them."""
    pair = _stored(points, start, end, jnp.sum((end - start) ** 2, axis=1) * core**2)
    found = jnp.stack(cross(pair.edge, pair.r1)) * influence(pair, 1) / (4 * jnp.pi)
    return jnp.moveaxis(found, 0, -1)


def _stored(
    points: Float[Array, "N 3"], start: Float[Array, "S 3"], end: Float[Array, "S 3"], soft: Float[Array, " S"]
):
    """All N × S pairs, segments along the vector lanes: a blade has more of them than control points."""
    r1, r2 = (subtract(tuple(points.T[:, :, None]), tuple(ends.T)) for ends in (start, end))
    return between(r1, r2, tuple((end - start).T), soft)


def _settings(exponent: float, blades: int, block: int | None, chained: bool) -> KernelSettings:
    if not exponent >= 1:
        raise InputError(f"Argument `exponent` must be at least 1, but is {exponent}")
    if blades < 1:
        raise InputError(f"Argument `blades` must be at least 1, but is {blades}")
    if block is not None and block < 1:
        raise InputError(f"Argument `block` must be at least 1, but is {block}")
    # on a CPU eight rows of pairs stay in cache; an accelerator wants all at once, or fewer and larger steps
    return KernelSettings(exponent, chained, block or (8 if on_cpu() else 64), at_once=not (block or on_cpu()))


def _check_segments(points, strength, core, shape: tuple[int, ...]) -> None:
    if points.ndim != 2 or points.shape[1] != 3:
        raise InputError(f"Argument `points` must have shape (N, 3), but is {points.shape}")
    for name, value in (("strength", strength), ("core", core)):
        if value.shape != shape:
            raise InputError(f"Argument `{name}` must have one value a segment, {shape}, but is {value.shape}")
    if not isinstance(core, Tracer) and np.any(np.asarray(core) < 0):
        raise InputError(f"Argument `core` {core.shape} must not be negative, but its least value is {np.min(core)}")
