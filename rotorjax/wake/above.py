"""Wake nodes that a coarse wake takes through the ground stand for their mirror images above it.

No flow crosses the plane, and no node of a fine wake does. Differences over the long steps of old age may carry one
past it all the same, most easily where the flow turns up a slope. Under the plane the flow of wake and images is the
mirror image of the flow above, so such a node still moves as its image should; but its vortex would turn the wrong way,
and the wake would not be one. So vortices lie where the images are, while the node itself goes on through zero, smooth
in age. Near wakes, a quarter of a turn old, are left where they are.
"""

from dataclasses import replace
from typing import NamedTuple

import jax.numpy as jnp
from jaxtyping import Array, Float

from rotorjax.ground import Plane
from rotorjax.wake.model import FreeWake, WakeState, azimuths

FILM = 0.02
"""Distance over R from the plane, less than a vortex's core, below which the two sides pass smoothly into each other;
farther above a node lies where it is."""


class Height(NamedTuple):
    """Height over R at which a node's vortex lies, and its derivative by the node's own: 1 above the ground, −1 under
    it.
    """

    value: Float[Array, "*n"]
    sense: Float[Array, "*n"]


def height(distance: Float[Array, "*n"]) -> Height:
    """|distance|, with two continuous derivatives."""
    s = jnp.clip(distance / FILM, -1.0, 1.0)
    return Height(jnp.abs(distance) + FILM * (3 - 8 * jnp.abs(s) + 6 * s**2 - s**4) / 8, (3 * s - s**3) / 2)


def above_ground(model: FreeWake, state: WakeState, psi: float | Float[Array, ""] = 0.0) -> WakeState:
    """The wake as its far vortices lie, all above the ground; slice 0 at azimuth psi."""
    if model.ground is None:
        return state
    distance, normals = _from_ground(model.ground, state.far, azimuths(state, psi)[:, None, None])
    lift = height(distance).value - distance
    return replace(state, far=jnp.stack([state.far[..., i] + lift * normals[i] for i in range(3)], axis=-1))


def senses(model: FreeWake, nodes: Float[Array, "A 3"], angle: float | Float[Array, ""]) -> Float[Array, " A"] | float:
    """Sense in which a vortex at the nodes of the slice at `angle` turns, seen from the nodes: −1 under the ground."""
    return 1.0 if model.ground is None else height(_from_ground(model.ground, nodes, angle)[0]).sense


def _from_ground(
    plane: Plane, nodes: Float[Array, "*n 3"], angles: float | Float[Array, "*#n"]
) -> tuple[Float[Array, "*n"], tuple[Array, Array, Array]]:
    """Distance of nodes in frames at `angles` from the plane, and its normal's components there."""
    x, y, z = plane.normal
    c, s = jnp.cos(angles), jnp.sin(angles)
    normal = c * x + s * y, c * y - s * x, z
    x, y, z = (nodes[..., i] * normal[i] for i in range(3))
    return x + y + z + plane.height * jnp.cos(plane.slope), normal
