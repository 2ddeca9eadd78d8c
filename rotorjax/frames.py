"""Frames and signs: the only place where they are defined.

Hub frame: x aft, y to starboard, z up, origin at the hub. Lengths over R and velocities over ΩR inside both models (the
paper's own units); SI at the rotor, the operating point and every file.

Azimuth: ψ = 0 aft, counter-clockwise seen from above, so the blade at ψ lies along (cos ψ, sin ψ, 0).

Ellipsoidal frame (Appendix A): x forward, y to starboard, z down. `to_ellipsoidal` is the only bridge.

Inflow is positive down through the disk: λ = −v_z/ΩR.
"""

from functools import partial

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float


def to_ellipsoidal(xyz: Float[Array, "*n 3"]) -> Float[Array, "*n 3"]:
    """Turn hub-frame vectors (x aft, z up) into the paper's frame (x forward, z down); its own inverse."""
    return xyz * jnp.array([-1.0, 1.0, -1.0], xyz.dtype)


@partial(jax.jit, inline=True)
def rotate_about_shaft(xyz: Float[Array, "*n 3"], angle: Float[Array, "*#n"]) -> Float[Array, "*n 3"]:
    """Turn vectors by `angle` (rad) about the shaft, counter-clockwise seen from above."""
    c, s = jnp.cos(angle), jnp.sin(angle)
    x, y, z = xyz[..., 0], xyz[..., 1], xyz[..., 2]
    return jnp.stack([c * x - s * y, s * x + c * y, z], axis=-1)


@partial(jax.jit, inline=True)
def disk_points(r: Float[Array, "*n"], psi: Float[Array, "*n"]) -> Float[Array, "*n 3"]:
    """Points of the disk at radius r (over R) and azimuth psi (rad), in the hub frame."""
    return jnp.stack([r * jnp.cos(psi), r * jnp.sin(psi), jnp.zeros_like(r * psi)], axis=-1)
