"""The ground as a plane, shared by both models. No ground is `None`, never h = inf (its gradients would be NaN).

A hub that turns sees the plane turned: `TurnedPlane`, or by pitch alone `pitched`.
"""

import math

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float

from rotorjax.checks import Range, array, known, number_of, refuse, shown


def component(vectors: Float[Array, "*n 3"], unit: Float[Array, "3"]) -> Float[Array, "*n"]:
    """Component of vectors along a unit vector; as a sum of products it is part of the loop that reads it."""
    return jnp.sum(vectors * unit, axis=-1)


class Plane(eqx.Module):
    """A plane under the hub, z = −h + x tan δ in the hub frame (Eq. 9): the mountain side is aft, ψ = 0.

    height: distance of the hub above the plane along the shaft, over R. slope: δ in rad.
    """

    height: Float[Array, ""]
    slope: Float[Array, ""]

    @property
    def normal(self) -> Float[Array, "3"]:
        """Unit normal, pointing up out of the ground."""
        return jnp.stack([-jnp.sin(self.slope), jnp.zeros_like(self.slope), jnp.cos(self.slope)])

    @property
    def clearance(self) -> Float[Array, ""]:
        """Least distance of the disk's rim from the plane, over R; negative where the disk cuts it."""
        return self.height * jnp.cos(self.slope) - jnp.hypot(self.normal[0], self.normal[1])

    def distance(self, points: Float[Array, "*n 3"]) -> Float[Array, "*n"]:
        """Height of points above the plane along its normal, over R."""
        return component(points, self.normal) + self.height * jnp.cos(self.slope)

    def reflect_points(self, points: Float[Array, "*n 3"]) -> Float[Array, "*n 3"]:
        """Mirror images of points."""
        return points - 2 * self.distance(points)[..., None] * self.normal

    def reflect_vectors(self, vectors: Float[Array, "*n 3"]) -> Float[Array, "*n 3"]:
        """Mirror images of vectors: the component along the normal changes sign."""
        return vectors - 2 * component(vectors, self.normal)[..., None] * self.normal


class TurnedPlane(Plane):
    """A plane seen from a hub that has turned. height, slope: of the plane in level axes, under the hub. turn (3, 3):
    takes level axes into the hub frame (`rotor.hub.RotorInputs.turn`).
    """

    turn: Float[Array, "3 3"]

    @property
    def normal(self) -> Float[Array, "3"]:
        """Unit normal in the hub frame, pointing up out of the ground."""
        return self.turn @ super().normal


def pitched(ground: Plane, pitch: Float[Array, ""]) -> Plane:
    """The plane seen from a hub whose nose has come up by `pitch` (rad), height along its shaft again."""
    slope = ground.slope + pitch
    return Plane(ground.height * jnp.cos(ground.slope) / jnp.cos(slope), slope)


def plane(height: ArrayLike, slope_deg: ArrayLike = 0.0) -> Plane:
    """Make a ground plane from its height (over R) and slope (degrees); either may be traced by jax.

    >>> import jax
    >>> float(jax.grad(lambda h: plane(h).distance(jnp.zeros(3)))(1.0))
    1.0

    Raises InputError where the height is not positive, the slope is not in [0°, 60°), or the disk would cut the plane.
    """
    if known(height) and number_of(height) not in Range(0.0, above=True):
        found = f"{height}" if isinstance(height, int | float) else shown(height)
        raise refuse("height", "be positive and finite (hub above ground, over R)", found)
    if known(slope_deg) and not 0 <= number_of(slope_deg) < 60:
        found = f"{slope_deg}" if isinstance(slope_deg, int | float) else shown(slope_deg)
        raise refuse("slope_deg", "lie in [0, 60) degrees", found)
    if known(height, slope_deg) and number_of(height) <= (least := math.tan(math.radians(number_of(slope_deg)))):
        raise refuse(
            "height", f"exceed tan({slope_deg} deg) = {least:.3f}, where the disk cuts the ground", f"{height}"
        )
    slope = math.radians(slope_deg) if known(slope_deg) else jnp.deg2rad(slope_deg)  # type: ignore[arg-type]
    return Plane(array(height), array(slope))
