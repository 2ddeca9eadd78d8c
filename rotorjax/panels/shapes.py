"""Surfaces from a few numbers, in the hub frame (x aft, y to starboard, z up), lengths over R."""

from collections.abc import Sequence
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import ArrayLike, Float

from rotorjax.checks import Range, array, check_range, known, refuse, shown
from rotorjax.errors import InputError
from rotorjax.frames import rotate_about_shaft
from rotorjax.panels.surface import Panels

Point = ArrayLike | Sequence[ArrayLike]

PANEL = 0.25
"""Size over R of a panel near the shaft."""

STRETCH = 2.0
"""Distance over R from the shaft up to which panels keep their size; beyond they grow with it."""

_turned = jax.jit(rotate_about_shaft)


def box(low: Point, high: Point, panel: float = PANEL) -> Panels:
    """Make a box between two corners: a hangar, a superstructure, a building with its roof.

    low, high (3,): over R, either may be traced. panel: size near the shaft. A face that rests on the ground is left
    out where the box is put into a flow. Raises InputError where high is not above low, or panels are too many.

    >>> hangar = box((2, -1, -1), (4, 1, 0.5), panel=0.5)
    >>> len(hangar), round(float(hangar.areas.sum()), 3)
    (52, 20.0)
    """
    low, high = _corner("low", low), _corner("high", high)
    xp: Any = jnp
    if known(low, high):  # by numpy: no programs to compile
        xp, low, high = np, np.asarray(low), np.asarray(high)
        if not np.all(high - low > 0):
            raise refuse("high", f"lie beyond low = {low.tolist()} on all axes", shown(high.tolist()))
    lines = [_divided(low[i], high[i], panel, even=i == 2) for i in range(3)]
    faces = [_face(lines, axis, upper, xp) for axis in range(3) for upper in (False, True)]
    return Panels(array(xp.concatenate(faces)))


def slab(low: Point, high: Point, top: ArrayLike, thickness: ArrayLike = 0.5, panel: float = PANEL) -> Panels:
    """Make a deck or a roof, a flat box: low, high (2,) in x and y, top (z, negative under the hub) and thickness.

    It has a thickness because sources stop air on one side only: behind a sheet it would come out again.
    """
    (x0, y0), (x1, y1), z = _corner("low", low, 2), _corner("high", high, 2), array(top)
    return box(jnp.stack([x0, y0, z - jnp.asarray(thickness)]), jnp.stack([x1, y1, z]), panel)


def wall(
    distance: ArrayLike,
    bottom: ArrayLike,
    top: ArrayLike,
    length: float = 6.0,
    azimuth_deg: ArrayLike = 0.0,
    thickness: float = 0.5,
    panel: float = PANEL,
) -> Panels:
    """Make a wall that stands at a distance from the shaft in the direction of an azimuth (0 aft, 90 to starboard).

    distance: of its near face. bottom, top: z, so negative under the hub. length: along it, half to each side.
    """
    near = array(distance)
    ends = jnp.asarray(length) / 2
    low = jnp.stack([near, -ends, jnp.asarray(bottom, float)])
    high = jnp.stack([near + thickness, ends, jnp.asarray(top, float)])
    return Panels(_turned(box(low, high, panel).corners, jnp.deg2rad(jnp.asarray(azimuth_deg, float))))


def terrain(x: Sequence[float], y: Sequence[float], heights: ArrayLike | Sequence[Sequence[float]]) -> Panels:
    """Make a patch of terrain: z of the surface (negative under the hub) at the nodes of a grid x, y.

    Each cell is two triangles. The patch is open: air comes out behind it and passes its rim. Lay the rim on the ground
    plane, if there is one.
    Raises InputError where shapes differ or x, y do not rise.

    >>> hill = terrain([-1, 0, 1], [-1, 0, 1], [[-1, -1, -1], [-1, -0.8, -1], [-1, -1, -1]])
    >>> len(hill), bool(jnp.all(hill.normals[:, 2] > 0))
    (8, True)
    """
    lines = [np.asarray(v, float) for v in (x, y)]
    z = array(heights)  # type: ignore[arg-type]
    for name, line in zip("xy", lines, strict=True):
        if line.ndim != 1 or len(line) < 2 or not np.all(np.diff(line) > 0):
            raise refuse(name, "be two or more rising numbers", shown(line.tolist()))
    if z.shape != (len(lines[0]), len(lines[1])):
        raise refuse("heights", f"have shape {(len(lines[0]), len(lines[1]))}, that of the grid", f"of shape {z.shape}")
    nodes = jnp.stack([*(jnp.asarray(v) for v in np.meshgrid(*lines, indexing="ij")), z], axis=-1)
    a, b, c, d = (v.reshape(-1, 3) for v in _cells(nodes))
    return Panels(jnp.concatenate([jnp.stack([a, b, c, c], axis=1), jnp.stack([a, c, d, d], axis=1)]))


def _corner(name: str, value: Point, count: int = 3) -> Array:
    found = array(value)  # type: ignore[arg-type]
    if found.shape != (count,) or (known(found) and not np.all(np.isfinite(np.asarray(found)))):
        raise refuse(name, f"be {count} finite numbers over R", shown(value))
    return found


def _divided(low: Any, high: Any, panel: float, *, even: bool) -> Float[Array, " N"]:
    """Places from low to high a panel's size apart, wider far from the shaft unless `even`; their share of the way is
    fixed by numbers, so that they move with low and high.
    """
    check_range("panel", panel, Range(0.01, 10.0, hint="size over R of a panel near the shaft"))
    numbers = jax.lax.stop_gradient((low, high))
    if not known(numbers):
        raise InputError("Argument `panel` cannot be met where corners are traced under jit: make the surface outside")
    ends = np.array([float(v) for v in numbers])
    even_in = ends if even else np.arcsinh(ends / STRETCH)
    count = max(1, round(float(np.ptp(even_in)) * (1.0 if even else STRETCH) / panel))
    places = np.linspace(even_in[0], even_in[1], count + 1)
    places = places if even else STRETCH * np.sinh(places)
    share = (places - ends[0]) / np.ptp(ends)
    return low + share * (high - low)


def _face(lines: list[Any], axis: int, upper: bool, xp: Any) -> Float[Array, "P 4 3"]:
    """Panels of the lower or upper face of a box along an axis, counter-clockwise from outside; xp: numpy or jax's."""
    first, second = (axis + 1) % 3, (axis + 2) % 3
    one, other = xp.meshgrid(lines[first], lines[second], indexing="ij")
    parts: dict[int, Array] = {
        first: one,
        second: other,
        axis: xp.full_like(one, 1.0) * lines[axis][-1 if upper else 0],
    }
    a, b, c, d = (v.reshape(-1, 3) for v in _cells(xp.stack([parts[i] for i in range(3)], axis=-1)))
    return xp.stack([a, b, c, d] if upper else [a, d, c, b], axis=1)


def _cells(nodes: Float[Array, "X Y 3"]) -> tuple[Array, Array, Array, Array]:
    """Corners of the cells of a grid, counter-clockwise from above."""
    return nodes[:-1, :-1], nodes[1:, :-1], nodes[1:, 1:], nodes[:-1, 1:]
