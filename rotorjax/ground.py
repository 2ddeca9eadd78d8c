"""The ground as a plane, shared by both models. No ground is `None`, never h = inf (its gradients would be NaN)."""

import math

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from rotorjax.errors import InputError


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

    def distance(self, points: Float[Array, "*n 3"]) -> Float[Array, "*n"]:
        """Height of points above the plane along its normal, over R."""
        return points @ self.normal + self.height * jnp.cos(self.slope)

    def reflect_points(self, points: Float[Array, "*n 3"]) -> Float[Array, "*n 3"]:
        """Mirror images of points."""
        return points - 2 * self.distance(points)[..., None] * self.normal

    def reflect_vectors(self, vectors: Float[Array, "*n 3"]) -> Float[Array, "*n 3"]:
        """Mirror images of vectors: the component along the normal changes sign."""
        return vectors - 2 * (vectors @ self.normal)[..., None] * self.normal


def plane(height: float, slope_deg: float = 0.0) -> Plane:
    """Make a ground plane from its height (over R) and slope (degrees).

    Raises InputError where the height is not positive, the slope is not in [0°, 60°), or the disk would cut the plane.
    """
    if not (math.isfinite(height) and height > 0):
        raise InputError(f"Argument `height` must be positive and finite (hub above ground, over R), but is {height}")
    if not 0 <= slope_deg < 60:
        raise InputError(f"Argument `slope_deg` must lie in [0, 60) degrees, but is {slope_deg}")
    clearance = math.tan(math.radians(slope_deg))
    if height <= clearance:
        raise InputError(
            f"Argument `height` must exceed tan({slope_deg} deg) = {clearance:.3f}, where the disk cuts the ground, "
            f"but is {height}"
        )
    return Plane(jnp.asarray(height, float), jnp.deg2rad(jnp.asarray(slope_deg, float)))
