"""Solid surfaces beside the finite-state flow: panels of sources answer it as the ground's sources do.

Unit rotor states, with the answer of the ground's own sources, blow through the panels' middles; the densities that
keep this out (`rotorjax.panels.surface`), one column a state, are further rows of G in c = G a. With a level ground
each panel has its image, so that it blows nothing through the plane that the ground's sources close.

The wake's column of air ends on the first surface under the disk; what is below lies in its shadow (`shadow`). There
only the flow towards the disk is left, so that a roof's lower side, the ground under a deck, or what a box encloses
see no jet. The shadow falls straight down and its rim is a step of finite width, smooth in the place of the surface.
"""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from rotorjax.ground import Plane
from rotorjax.panels.kernel import panel_velocity, solid_angles
from rotorjax.panels.surface import ON_GROUND, Panels, Solid
from rotorjax.region import smooth_step

RIM = 0.1
"""Half-width over R of the step at a shadow's rim: finer than panels, so that middles are on one side of it."""

IN_SHADOW = (6, 5)
"""Harmonics and terms of the ground's sources beside surfaces: what the rim of a shadow on the ground needs."""

LEVEL = np.array([[-0.5, -0.5, 0], [0.5, -0.5, 0], [0.5, 0.5, 0], [-0.5, 0.5, 0]])


@jax.jit
def shadow(panels: Panels, points: Float[Array, "*N 3"]) -> Float[Array, "*N"]:
    """Return 1 at points with a surface straight between them and the disk, 0 at others, and a smooth step between.

    The solid angle that faces turned upward, laid flat, are seen under from RIM above is half of the sky's under the
    rim of a large one, and the same for panels as for the surface that they make up.
    """
    middles, normals = panels.middles, panels.normals
    upward = normals[:, 2] > ON_GROUND
    flat = panels.corners.at[..., 2].set(0.0)
    flat = jnp.where(upward[:, None, None], flat, jnp.asarray(LEVEL, flat.dtype))
    fall = jnp.where(upward[:, None], normals[:, :2], 0.0) / jnp.where(upward, normals[:, 2], 1.0)[:, None]
    seat = points.reshape(-1, 3)
    away = seat[:, None, :2] - middles[:, :2]
    top = middles[:, 2] - jnp.maximum(jnp.sum(away * fall, axis=-1), 0.0)  # no higher than its middle: ridges
    over = upward & (middles[:, 2] < 0) & (top > seat[:, 2:] + ON_GROUND)
    seen = solid_angles(seat.at[:, 2].set(RIM), flat)
    share = jnp.sum(jnp.where(over, seen, 0.0), axis=1) / (2 * jnp.pi)
    return smooth_step(share - 0.5, jnp.asarray(0.25)).reshape(points.shape[:-1])


def answers(surfaces: Solid, into: Float[Array, "M P"], ground: Plane | None) -> Float[Array, "P M"]:
    """Return the densities that keep out M flows, given by their velocities along the panels' normals."""
    return jax.vmap(lambda one: surfaces.densities(one, ground), out_axes=1)(into)


def flow(
    surfaces: Solid, densities: Float[Array, "P M"], points: Float[Array, "*N 3"], ground: Plane | None
) -> Float[Array, "3 M ..."]:
    """Return the velocity (hub frame) of M sets of densities at points, images included."""
    corners, flat = surfaces.panels.corners, points.reshape(-1, 3)
    found = jax.vmap(lambda one: panel_velocity(flat, corners, one, ground), in_axes=1)(densities)
    return surfaces.share * jnp.moveaxis(found, -1, 0).reshape(3, densities.shape[1], *points.shape[:-1])
