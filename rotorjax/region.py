"""Where there is ground: a part of the plane with a smooth edge (half-plane, rectangle, disk, or any mask).

A mask is 1 on the ground and 0 off it. Its edge is a quintic step over 2 `width`, exactly 1 and 0 beyond and twice
differentiable, so that the solution is smooth in the edge's place and both limits are exact. Places are those of the
plane's points along the shaft: hub frame x aft, y to starboard, over R.
"""

from abc import abstractmethod
from collections.abc import Callable

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from rotorjax.errors import InputError
from rotorjax.ground import Plane

WIDTH = 0.3  # over R: half of the step, as fine as a few harmonics resolve to some per cent


def smooth_step(s: Float[Array, "*N"], width: Float[Array, ""]) -> Float[Array, "*N"]:
    """Return 0 below −width, 1 above width and a quintic between."""
    t = jnp.clip(s / width, -1.0, 1.0)
    return 0.5 + t * (15 - t * t * (10 - 3 * t * t)) / 16


class Region(eqx.Module):
    """A part of the plane."""

    @abstractmethod
    def mask(self, x: Float[Array, "*N"], y: Float[Array, "*N"]) -> Float[Array, "*N"]:
        """Return 1 where there is ground, 0 where there is none."""


class HalfPlane(Region):
    """Ground on one side of a straight edge: x cos α + y sin α < edge.

    edge (): over R. azimuth (): α (rad), the direction off the ground. width (): half-width of the step, over R.
    """

    edge: Float[Array, ""]
    azimuth: Float[Array, ""]
    width: Float[Array, ""]

    def mask(self, x: Float[Array, "*N"], y: Float[Array, "*N"]) -> Float[Array, "*N"]:
        """Return 1 where there is ground, 0 where there is none."""
        return smooth_step(self.edge - x * jnp.cos(self.azimuth) - y * jnp.sin(self.azimuth), self.width)


class Rectangle(Region):
    """A rectangular deck. x, y (2,): its lower and upper bounds, over R. width (): half-width of the step, over R."""

    x: Float[Array, "2"]
    y: Float[Array, "2"]
    width: Float[Array, ""]

    def mask(self, x: Float[Array, "*N"], y: Float[Array, "*N"]) -> Float[Array, "*N"]:
        """Return 1 where there is ground, 0 where there is none."""
        along = smooth_step(x - self.x[0], self.width) * smooth_step(self.x[1] - x, self.width)
        return along * smooth_step(y - self.y[0], self.width) * smooth_step(self.y[1] - y, self.width)


class Disk(Region):
    """A round pad. centre (2,), radius (): over R. width (): half-width of the step, over R."""

    centre: Float[Array, "2"]
    radius: Float[Array, ""]
    width: Float[Array, ""]

    def mask(self, x: Float[Array, "*N"], y: Float[Array, "*N"]) -> Float[Array, "*N"]:
        """Return 1 where there is ground, 0 where there is none."""
        apart = (x - self.centre[0]) ** 2 + (y - self.centre[1]) ** 2
        # (r² − d²)/2r is r − d at the edge and smooth at the centre, where d has no derivative
        return smooth_step((self.radius**2 - apart) / (2 * self.radius), self.width)


class Mask(Region):
    """Any smooth function (x, y) ↦ mask in [0, 1], static."""

    function: Callable[[Array, Array], Array] = eqx.field(static=True)

    def mask(self, x: Float[Array, "*N"], y: Float[Array, "*N"]) -> Float[Array, "*N"]:
        """Return 1 where there is ground, 0 where there is none."""
        return self.function(x, y)


def _number(name: str, value: float, positive: bool = False) -> Array:
    if not np.isfinite(value) or (positive and value <= 0):
        rule = "be positive and finite" if positive else "be finite"
        raise InputError(f"Argument `{name}` must {rule} (over R or deg), but is {value}")
    return jnp.asarray(value, float)


def half_plane(edge: float, azimuth_deg: float = 0.0, width: float = WIDTH) -> HalfPlane:
    """Make the ground before a straight edge. Raises InputError where a number is not finite or width not positive."""
    return HalfPlane(
        _number("edge", edge), jnp.deg2rad(_number("azimuth_deg", azimuth_deg)), _number("width", width, True)
    )


def rectangle(
    corner: tuple[float, float, float],
    opposite: tuple[float, float, float],
    ground: Plane,
    width: float = WIDTH,
) -> Rectangle:
    """Make a deck between two opposite corners (hub frame, over R) of the plane.

    Raises InputError where a corner is off the plane by more than 1e-6, or the deck has no extent.
    """
    corners = np.array([corner, opposite], float)
    on_plane(corners, ground)
    low, high = corners.min(axis=0), corners.max(axis=0)
    if not np.all(high[:2] - low[:2] > 2 * width):
        raise InputError(
            f"Arguments `corner`, `opposite` must lie more than 2 width = {2 * width:g} apart in x and y, "
            f"but do by {tuple((high - low)[:2].tolist())}"
        )
    return Rectangle(
        jnp.asarray([low[0], high[0]]), jnp.asarray([low[1], high[1]]), _number("width", width, positive=True)
    )


def disk(centre: tuple[float, float, float], radius: float, ground: Plane, width: float = WIDTH) -> Disk:
    """Make a round pad. Raises InputError where its centre is off the plane, or radius or width are not positive."""
    on_plane(np.array([centre], float), ground)
    return Disk(
        jnp.asarray(centre[:2], float), _number("radius", radius, positive=True), _number("width", width, positive=True)
    )


def on_plane(points: np.ndarray, ground: Plane, tolerance: float = 1e-6) -> None:
    """Raise InputError where a point (N, 3) is off the plane."""
    if not np.all(np.isfinite(points)):
        raise InputError(f"Argument `points` must be finite, but is {points.tolist()}")
    away = np.abs(np.asarray(ground.distance(jnp.asarray(points))))
    if away.max() > tolerance:
        worst = points[away.argmax()]
        below = float(-ground.height + worst[0] * jnp.tan(ground.slope))
        raise InputError(
            f"The region's points must lie on the plane, but {tuple(worst.tolist())} is {away.max():.3g} R off it: "
            f"z must be {below:.6g} there"
        )
