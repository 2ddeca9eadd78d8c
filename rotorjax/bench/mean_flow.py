"""The mean flow of a periodic free wake: velocities at points, and lines along it."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from rotorjax.frames import rotate_about_shaft
from rotorjax.wake import field
from rotorjax.wake.solution import Solution

RADII, ABOVE = (0.3, 0.5, 0.7, 0.9, 1.15), 0.6  # where streamlines begin, over R
STEPS, LENGTH, AROUND = 90, 0.04, 8  # of a streamline; its length in all over R is STEPS LENGTH


@eqx.filter_jit
def mean_velocity(found: Solution, points: Float[Array, "N 3"], instants: int = 12) -> Float[Array, "N 3"]:
    """Induced velocity over ΩR at hub-frame points over R, mean over time.

    instants: of a blade's passage, over which an axisymmetric wake is averaged; one over a slope has its own.
    """
    if found.state.near.shape[0] > 1:
        return jnp.mean(field.velocity(found.state, points, found.model), axis=0)
    turns = 2 * jnp.pi / (found.model.rotor.blades * instants) * jnp.arange(instants)
    seen = jax.vmap(lambda angle: rotate_about_shaft(points, -angle))(turns)
    flow = field.velocity(found.state, seen.reshape(-1, 3), found.model)[0].reshape(seen.shape)
    return jnp.mean(jax.vmap(rotate_about_shaft)(flow, turns), axis=0)


def streamlines(found: Solution) -> Float[np.ndarray, "L N 3"]:
    """Lines along the mean flow from a ring of points above the disk down, in equal steps (midpoint rule).

    Those of an axisymmetric wake are one azimuth's, turned.
    """
    psi = 2 * np.pi / AROUND * np.arange(AROUND)
    alike = found.state.near.shape[0] == 1
    start = jnp.array([[r, 0.0, ABOVE] for r in RADII])
    begun = start if alike else jnp.concatenate([rotate_about_shaft(start, angle) for angle in psi])
    lines = _along(found, begun).swapaxes(0, 1)
    return np.asarray(jnp.concatenate([rotate_about_shaft(lines, angle) for angle in psi]) if alike else lines)


@eqx.filter_jit
def _along(found: Solution, start: Float[Array, "L 3"]) -> Float[Array, "N L 3"]:
    climb = jnp.array([0.0, 0.0, 1.0]) * found.model.operating.climb_ratio(found.model.rotor.radius)

    def step(points: Float[Array, "L 3"]) -> Float[Array, "L 3"]:
        flow = mean_velocity(found, points) - climb
        return LENGTH * flow / (jnp.linalg.norm(flow, axis=-1, keepdims=True) + 1e-9)

    def midpoint(points, _):
        return points + step(points + 0.5 * step(points)), points

    return jax.lax.scan(midpoint, start, None, STEPS)[1]
