"""Flow of flat panels of constant source density (Hess & Smith 1967, doi:10.1016/0376-0421(67)90003-6), softened.

With 1/r³ softened to (r² + SOFT²)^(−3/2) the integral over a panel keeps its closed form: in the panel's own axes, at
the height z over its plane and with ζ² = z² + SOFT²,

    v = (σ/4π) [ Σ u_e ln((r₁ + r₂ + d)/(r₁ + r₂ − d)) + n (z/ζ) Ω(ζ) ],

the sum over edges of length d with outward normal u_e in the plane, r₁ and r₂ the distances of a point at height ζ from
an edge's ends, and Ω the solid angle that it sees the panel under. ζ is never 0, so that Ω is smooth, an edge is not
singular, and the velocity has every derivative everywhere: in the plane of the panel the jump of ±σ/2 n is spread over
SOFT, and halfway it is 0. Far beyond SOFT nothing differs from a panel without.

Cost and memory: a step of a scan takes a few panels against all points; derivatives, forward and reverse, make a step's
pairs again instead of keeping them.
"""

from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float

from rotorjax.ground import Plane

SOFT = 1e-3
"""Length over R over which the jump across a panel is spread: a hundredth of the smallest panels that make sense."""

BLOCK = 16
"""Panels a step: (16, 2000) numbers stay in a core's cache."""


class Frames(NamedTuple):
    """Panels in their own axes. origin (P, 3): middle. axes (P, 3, 3): rows along the panel, along it, normal.
    x, y (P, 4): corners, counter-clockwise about the normal; a triangle has its last one twice.
    """

    origin: Float[Array, "P 3"]
    axes: Float[Array, "P 3 3"]
    x: Float[Array, "P 4"]
    y: Float[Array, "P 4"]


@jax.jit
def frames(corners: Float[Array, "P 4 3"]) -> Frames:
    """Axes and corners of panels."""
    origin = jnp.mean(corners, axis=1)
    across = jnp.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
    normal, first = _unit(across), _unit(corners[:, 1] - corners[:, 0])
    axes = jnp.stack([first, jnp.cross(normal, first), normal], axis=1)
    x, y, _ = jnp.moveaxis(jnp.einsum("pij,pcj->pci", axes, corners - origin[:, None]), -1, 0)
    return Frames(origin, axes, x, y)


def _unit(v: Float[Array, "P 3"]) -> Float[Array, "P 3"]:
    return v / jnp.linalg.norm(v, axis=-1, keepdims=True)


def panel_velocity(
    points: Float[Array, "N 3"],
    corners: Float[Array, "P 4 3"],
    density: Float[Array, " P"],
    plane: Plane | None = None,
) -> Float[Array, "N 3"]:
    """Velocity at points from panels of source density σ (positive: air comes out), and their images in a plane.

    >>> square = jnp.array([[[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]])
    >>> far = panel_velocity(jnp.array([[0.0, 0, 50]]), square, jnp.ones(1))
    >>> bool(abs(far[0, 2] * 4 * jnp.pi * 50**2 / 4 - 1) < 1e-3)  # a point source of its area
    True
    """
    if plane is None:
        return _velocity(points, corners, density)
    both = _velocity(jnp.concatenate([points, plane.reflect_points(points)]), corners, density)
    return both[: len(points)] + plane.reflect_vectors(both[len(points) :])


@jax.jit
def _velocity(points: Array, corners: Array, density: Array) -> Array:
    """The sum over all panels, BLOCK of them a step."""
    missing = -len(density) % BLOCK
    filled = (jnp.concatenate([a, jnp.repeat(a[-1:], missing, axis=0)]) for a in frames(corners))
    strength = jnp.pad(density, (0, missing)) / (4 * np.pi)
    blocks = jax.tree.map(lambda a: a.reshape(-1, BLOCK, *a.shape[1:]), (Frames(*filled), strength))

    @partial(jax.checkpoint, prevent_cse=False)
    def step(total: Array, block: tuple[Frames, Array]):
        panels, strength = block
        found = jnp.stack(_of_unit_density(points.T, panels))
        return total + jnp.einsum("p,pij,ipn->jn", strength, panels.axes, found), None

    return jax.lax.scan(step, jnp.zeros_like(points.T), blocks)[0].T


def normal_velocities(
    points: Float[Array, "N 3"], normals: Float[Array, "N 3"], corners: Float[Array, "P 4 3"]
) -> Float[Array, "N P"]:
    """Component along a normal at each point of each panel's velocity at density 1, all pairs kept."""
    panels = frames(corners)

    def at(point: Array, normal: Array) -> Array:
        found = jnp.stack(_of_unit_density(point[:, None], panels))[:, :, 0]
        return jnp.einsum("pij,ip,j->p", panels.axes, found, normal) / (4 * np.pi)

    return jax.lax.map(lambda one: at(*one), (points, normals), batch_size=64)


def solid_angles(points: Float[Array, "N 3"], corners: Float[Array, "P 4 3"]) -> Float[Array, "N P"]:
    """Solid angle that each point sees each panel under, negative from behind."""
    panels = frames(corners)
    return jax.lax.map(lambda point: _of_unit_density(point[:, None], panels)[2][:, 0], points, batch_size=64)


@jax.jit
def seen(point: Float[Array, "3"], corners: Float[Array, "P 4 3"]) -> Float[Array, ""]:
    """Solid angle that a point sees a surface under: −4π inside a closed one, 0 outside it."""
    return jnp.sum(solid_angles(point[None], corners))


def _of_unit_density(points: Float[Array, "3 N"], panels: Frames) -> tuple[Array, Array, Array]:
    """4π times the velocity of each panel at each point, components (P, N) in the panel's axes."""
    x, y, z = jnp.moveaxis(panels.axes @ points - (panels.axes @ panels.origin[..., None]), 1, 0)
    square = z**2 + SOFT**2
    height = jnp.sqrt(square)
    dx, dy = ([c[:, i, None] - v for i in range(4)] for c, v in ((panels.x, x), (panels.y, y)))
    r = [jnp.sqrt(a * a + b * b + square) for a, b in zip(dx, dy, strict=True)]
    along, across = jnp.zeros_like(x), jnp.zeros_like(x)
    for i, j in ((0, 1), (1, 2), (2, 3), (3, 0)):
        edge_x, edge_y = ((c[:, j] - c[:, i])[:, None] for c in (panels.x, panels.y))
        length = _length(edge_x, edge_y)
        both = r[i] + r[j]
        log = jnp.log((both + length) / jnp.maximum(both - length, jnp.finfo(x.dtype).eps * both))
        along, across = along + edge_y / length * log, across - edge_x / length * log
    return along, across, z / height * _solid_angle(panels, height, square, dx, dy, r)


def _length(x: Array, y: Array) -> Array:
    """Length of an edge; of one without, 1, which stands below a log of 1."""
    square = x * x + y * y
    nothing = square == 0
    return jnp.where(nothing, 0.0, 1.0) * jnp.sqrt(jnp.where(nothing, 1.0, square)) + jnp.where(nothing, 1e-30, 0.0)


def _solid_angle(panels: Frames, height: Array, square: Array, dx: list, dy: list, r: list) -> Array:
    """Solid angle from above, in (0, 2π), of two triangles: tan(Ω/2) of each (van Oosterom & Strackee 1983,
    doi:10.1109/TBME.1983.325207); half angles add as complex numbers multiply.
    """

    def triangle(i: int, j: int, k: int) -> tuple[Array, Array]:
        def dot(a: int, b: int) -> Array:
            return dx[a] * dx[b] + dy[a] * dy[b] + square

        ax, ay, bx, by = (c[:, m] - c[:, i] for m in (j, k) for c in (panels.x, panels.y))
        beside = r[i] * r[j] * r[k] + dot(i, j) * r[k] + dot(j, k) * r[i] + dot(k, i) * r[j]
        return (ax * by - bx * ay)[:, None] * height, beside

    (up1, on1), (up2, on2) = triangle(0, 1, 2), triangle(0, 2, 3)
    return 2 * jnp.arctan2(up1 * on2 + up2 * on1, on1 * on2 - up1 * up2)
