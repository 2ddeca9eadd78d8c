"""Velocity of straight vortex segments: the Biot–Savart sum, blocked so that no N × S array is ever stored.

The formulas know no units: any consistent ones will do (the wake uses lengths over R and circulation over ΩR²).
With r₁ and r₂ from a segment's ends to the point, û along it and h the distance from its axis,

    v = (Γ/4π) · W · E · (û × r),    E = û·(r̂₁ − r̂₂),    W = (h²ⁿ + r_c²ⁿ)^(−1/n)      (Vatistas 1991; n = 1 is Scully)
"""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from rotorjax.errors import InputError
from rotorjax.frames import rotate_about_shaft
from rotorjax.ground import Plane


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
) -> Float[Array, "N 3"]:
    """Velocity at points from straight segments with a strength (positive from start to end) and a core radius each.

    exponent: Vatistas n ≥ 1 (1 Scully, 2 Bagai–Leishman). plane: add the mirror image in this plane. blades: the
    segments belong to one blade and repeat by rotation about the shaft. block: points per block.

    Raises InputError where shapes do not match, a core is negative or the exponent is below 1.
    """
    _check(points, strength, core, exponent, blades, {"start": (start, strength.shape), "end": (end, strength.shape)})
    block = block or 32

    def direct(points):
        def one(point):
            return _sum(point, start, end, strength, core, exponent)

        return jax.lax.map(jax.checkpoint(one), points, batch_size=min(block, max(points.shape[0], 1)))

    return _with_copies(direct, points, plane, blades)


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

    Raises InputError where a filament has fewer than two nodes, shapes do not match, or a core is negative.
    """
    if nodes.ndim != 3 or nodes.shape[1] < 2 or nodes.shape[2] != 3:
        raise InputError(f"Argument `nodes` must have shape (F, A, 3) with A >= 2, but is {nodes.shape}")
    _check(points, strength, core, exponent, blades, {"nodes": (nodes[:, 1:], strength.shape)})
    return segment_velocity(
        points,
        nodes[:, :-1].reshape(-1, 3),
        nodes[:, 1:].reshape(-1, 3),
        strength.reshape(-1),
        core.reshape(-1),
        exponent=exponent,
        plane=plane,
        blades=blades,
        block=block,
    )


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


def _sum(point, start, end, strength, core, exponent):
    """Velocity at one point (3,) from all segments."""
    r1 = point - start
    r2 = point - end
    edge = end - start
    s1, s2, l2 = (jnp.sum(a * a, -1) for a in (r1, r2, edge))
    # 1/|r| := 0 on the node itself: the mean over directions, hence what a filament passing straight through has
    i1, i2, il = (jnp.where(s > 0, 1 / jnp.sqrt(jnp.where(s > 0, s, 1)), 0) for s in (s1, s2, l2))
    unit = edge * il[:, None]
    c = jnp.cross(unit, jnp.where((s1 < s2)[:, None], r1, r2))
    h2 = jnp.sum(c * c, -1)
    cos = jnp.sum(r1 * r2, -1) * i1 * i2
    # (1 − cos)/l cancels where the segment is seen under a small angle
    ahead = cos > 0
    versine = jnp.where(ahead, h2 * (i1 * i2) ** 2 * l2 * il / jnp.where(ahead, 1 + cos, 1), (1 - cos) * il)
    e = (s1 * i1 + s2 * i2) * versine
    return (strength / (4 * jnp.pi) * e * _vatistas(h2, core * core, exponent)) @ c


def _vatistas(h2, core2, exponent):
    if exponent == 1:
        d = h2 + core2
        return 1 / jnp.where(d > 0, d, 1)
    top = jnp.maximum(h2, core2)
    top = jnp.where(top > 0, top, 1)
    return (1 / top) * ((h2 / top) ** exponent + (core2 / top) ** exponent) ** (-1 / exponent)


def _with_copies(direct, points, plane, blades):
    """Add the other blades and the mirror image: the field at the turned or reflected point, turned or reflected back."""
    turned = [points]
    angles = [2 * jnp.pi * b / blades for b in range(blades)]
    if plane is not None:
        turned.append(plane.reflect_points(points))
    everywhere = jnp.stack([rotate_about_shaft(p, -a) for p in turned for a in angles])
    v = direct(everywhere.reshape(-1, 3)).reshape(len(turned), blades, -1, 3)
    total = sum(rotate_about_shaft(v[:, b], a) for b, a in enumerate(angles))
    return total[0] if plane is None else total[0] + plane.reflect_vectors(total[1])


def _check(points, strength, core, exponent, blades, ends):
    if points.ndim != 2 or points.shape[1] != 3:
        raise InputError(f"Argument `points` must have shape (N, 3), but is {points.shape}")
    for name, (value, shape) in ends.items():
        if value.shape != (*shape, 3):
            raise InputError(
                f"Argument `strength` needs one value a segment, but is {shape} for `{name}` {value.shape}"
            )
    if core.shape != strength.shape:
        raise InputError(f"Argument `core` must have the shape of strength, {strength.shape}, but is {core.shape}")
    if not isinstance(core, jax.core.Tracer) and bool((core < 0).any()):
        raise InputError(f"Argument `core` {core.shape} must not be negative, but its least value is {core.min()}")
    if not exponent >= 1:
        raise InputError(f"Argument `exponent` must be at least 1, but is {exponent}")
    if blades < 1:
        raise InputError(f"Argument `blades` must be at least 1, but is {blades}")
