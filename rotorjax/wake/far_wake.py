"""The far filaments beyond their free part: closure, fading and cores."""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from rotorjax.frames import rotate_about_shaft
from rotorjax.ground import Plane
from rotorjax.wake.model import FreeWake
from rotorjax.wake.vortex_core import core_radius

STILL = 0.01
"""Wind over ΩR below which the closure over ground is that of hover."""


def closure(model: FreeWake, nodes: Float[Array, "F A 3"], psi: Float[Array, ""]) -> Float[Array, "F C 3"]:
    """Nodes of the turns that follow the free ones: the last free turn, repeated under the flow in which it ends.

    Out of ground effect the turn moves on by its own pitch, and with the wind; over ground it follows a stagnation
    flow, whose distance from the plane falls by the ratio of the last two turns while its radius grows by the inverse
    square root. As h → ∞ the second becomes the first. A wake cut off without closure expands and bunches at its end
    and pulls the inflow at the disk with it.
    """
    turn = model.settings.steps_per_turn
    last, before = nodes[:, -turn:], nodes[:, -2 * turn : -turn]
    repeats = range(1, model.settings.closure_turns + 1)
    drift = along = jnp.zeros(3, nodes.dtype)
    if model.flight is not None:
        along = model.flight.wind.at[2].set(0.0)
        drift = 2 * jnp.pi * rotate_about_shaft(along, -psi)
    if model.ground is None:
        pitch = jnp.mean(last[..., 2] - before[..., 2], axis=1)
        down = jnp.stack([jnp.zeros_like(pitch), jnp.zeros_like(pitch), pitch], axis=-1)[:, None] + drift
        return jnp.concatenate([last + k * down for k in repeats], axis=1)
    plane = model.ground
    # heights do not depend on the frame, so only the foot and the normal have to be turned into the blade's
    normal = rotate_about_shaft(plane.normal, -psi)
    # where the shaft meets the plane, which a hub that has turned sees elsewhere than under its height
    zero = jnp.zeros_like(plane.height)
    foot = jnp.stack([zero, zero, -plane.height * jnp.cos(plane.slope) / normal[2]])
    height = last @ normal + plane.height * jnp.cos(plane.slope)
    mean, mean_before = jnp.mean(height, axis=1), jnp.mean(_heights(before, normal, plane), axis=1)
    ratio = (mean / mean_before)[:, None, None]
    flat = last - height[..., None] * normal - foot
    if model.flight is not None:
        # in a wind the stagnation point goes with the turn; in none it stays on the shaft, as in hover
        drift = drift - (drift @ normal) * normal
        share = (along @ along) / (along @ along + STILL**2)
        foot = foot + share * jnp.mean(flat, axis=1, keepdims=True)
        flat = last - height[..., None] * normal - foot
    return jnp.concatenate(
        [foot + k * drift + flat * ratio ** (-0.5 * k) + height[..., None] * ratio**k * normal for k in repeats],
        axis=1,
    )


def _heights(nodes: Float[Array, "*n 3"], normal: Float[Array, "3"], plane: Plane) -> Float[Array, "*n"]:
    return nodes @ normal + plane.height * jnp.cos(plane.slope)


def segment_ages(model: FreeWake) -> Float[np.ndarray, " S"]:
    """Age (rad) at the middle of each far segment, closure included, counted from the blade."""
    settings = model.settings
    count = settings.far_ages + settings.closure_turns * settings.steps_per_turn
    return settings.age_step * (settings.near_ages + np.arange(count) + 0.5)


def fading(model: FreeWake) -> Float[Array, "F S"]:
    """Factors on the segments' strengths: both kinds fade at the end, the inboard filaments also with age."""
    settings = model.settings
    ages = jnp.asarray(segment_ages(model))
    left = (ages[-1] - ages + 0.5 * settings.age_step) / (2 * jnp.pi * settings.taper_turns)
    u = jnp.clip(left, 0, 1)
    end = u * u * (3 - 2 * u)
    decay = jnp.exp(-settings.inboard_decay * (ages - settings.age_step * settings.near_ages) / (2 * jnp.pi))
    return jnp.stack([end] + [end * decay] * (settings.filaments - 1))


def cores(model: FreeWake, tip_strength: Float[Array, ""]) -> Float[Array, "F S"]:
    """Core radii of the far segments over R (Eq. 16), growing from r₀ at the blade with the tip vortex's strength."""
    settings = model.settings
    tip = core_radius(
        jnp.asarray(segment_ages(model)), settings.tip_core, tip_strength, model.viscosity, settings.turbulence
    )
    # a smooth maximum: the inboard line stands for a sheet and is never thinner than that
    inner = jnp.sqrt(tip**2 + settings.inboard_core**2)
    return jnp.stack([tip] + [inner] * (settings.filaments - 1))
