"""Ellipsoidal coordinates (ν, η, ψ) of Appendix A: ν = 0 outside the disk in its plane, η = 0 on the disk.

The square roots of Eq. 20 lose half of their digits where their arguments cancel, and their derivatives are 0/0 on the
disk and in its plane. Here the larger of |ν| and η comes from its root and the other one from νη = −z̄ (Eq. 18c), so
values and derivatives are right everywhere but at the disk edge itself, where the coordinates have no derivative: there
the values are exact and the derivatives finite. A point with z̄ = 0 on the disk belongs to the upper face (ν > 0).
"""

from typing import NamedTuple

import jax.numpy as jnp
from jaxtyping import Array, Float

from rotorjax.frames import to_ellipsoidal


class Ellipsoidal(NamedTuple):
    """Coordinates of points without the azimuth's singularity on the axis.

    nu (*N,): ν; eta (*N,): η; cosine, sine (*N,): √(1−ν²) cos ψ and √(1−ν²) sin ψ, smooth on the axis.
    """

    nu: Float[Array, "*N"]
    eta: Float[Array, "*N"]
    cosine: Float[Array, "*N"]
    sine: Float[Array, "*N"]


def nu_eta(radius_squared: Float[Array, "*N"], z: Float[Array, "*N"]) -> tuple[Float[Array, "*N"], Float[Array, "*N"]]:
    """Return (ν, η) from r̄² = x̄² + ȳ² and z̄ (positive down), over R (Eqs. 20a, 20b)."""
    d = 1 - radius_squared - z * z
    edge = d * d + 4 * z * z == 0  # also where z is so small that its square is zero
    d, z_safe = jnp.where(edge, 1.0, d), jnp.where(edge, 0.0, z)
    root = jnp.sqrt(d * d + 4 * z_safe * z_safe)
    inner = d >= 0  # |ν| ≥ η
    larger = jnp.sqrt(jnp.where(inner, d + root, root - d) / 2)
    larger = jnp.where(inner & (z_safe > 0), -larger, larger)
    smaller = -z_safe / larger
    nu, eta = jnp.where(inner, larger, smaller), jnp.where(inner, smaller, larger)
    return jnp.where(edge, 0.0, nu), jnp.where(edge, 0.0, eta)


def ellipsoidal(points: Float[Array, "*N 3"]) -> Ellipsoidal:
    """Return the ellipsoidal coordinates of hub-frame points (over R)."""
    x, y, z = jnp.moveaxis(to_ellipsoidal(points), -1, 0)
    nu, eta = nu_eta(x * x + y * y, z)
    scale = 1 / jnp.sqrt(1 + eta * eta)
    return Ellipsoidal(nu, eta, -x * scale, y * scale)  # Eqs. 18a, 18b


def azimuth(x: Float[Array, "*N"], y: Float[Array, "*N"]) -> Float[Array, "*N"]:
    """Return ψ = atan2(ȳ, −x̄) in rad (Eq. 20c, paper's frame); zero, with zero derivative, on the axis."""
    axis = (x == 0) & (y == 0)
    return jnp.where(axis, 0.0, jnp.arctan2(jnp.where(axis, 0.0, y), jnp.where(axis, 1.0, -x)))


def from_ellipsoidal(
    nu: Float[Array, "*N"], eta: Float[Array, "*N"], psi: Float[Array, "*N"]
) -> tuple[Float[Array, "*N"], Float[Array, "*N"], Float[Array, "*N"]]:
    """Return (x̄, ȳ, z̄) in the paper's frame, over R (Eq. 18)."""
    radius = jnp.sqrt(1 - nu * nu) * jnp.sqrt(1 + eta * eta)
    return -radius * jnp.cos(psi), radius * jnp.sin(psi), -nu * eta
