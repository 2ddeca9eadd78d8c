"""Guesses of the wake: a prescribed one (after Landgrebe 1972), and a solved one moved to another ground."""

import jax.numpy as jnp
import numpy as np

from rotorjax.frames import rotate_about_shaft
from rotorjax.ground import Plane
from rotorjax.wake.equilibrium import Unknowns
from rotorjax.wake.model import FreeWake


def prescribed(model: FreeWake, inflow: float = 0.055) -> Unknowns:
    """Axisymmetric wake (K = 1) that goes down at `inflow` (over ΩR) and contracts to 0.78 R.

    Over ground it slows towards the plane and spreads so that the flow through it is conserved.
    """
    settings = model.settings
    step = settings.age_step
    edges, stations = np.asarray(model.edges), np.asarray(model.stations)
    near_age = step * np.arange(1, settings.near_ages + 1)
    narrowing = 0.8 + 0.2 * np.exp(-0.3 * near_age)
    near = np.stack(
        [
            np.outer(edges, narrowing * np.cos(near_age)),
            -np.outer(edges, narrowing * np.sin(near_age)),
            np.tile(-0.5 * inflow * near_age, (len(edges), 1)),
        ],
        axis=-1,
    )
    age = settings.filament_ages[1:]
    passage = 2 * np.pi / model.rotor.blades
    depth = inflow * np.where(age < passage, 0.4 * age, 0.4 * passage + (age - passage))
    radius = 0.78 + 0.22 * np.exp(-0.3 * age)
    if model.ground is not None:
        height = float(model.ground.height)
        radius = radius * np.exp(0.5 * np.clip(inflow / height * age - 1, 0, None))
        depth = height * (1 - np.exp(-inflow / height * age))
    spans = [1.0, *(min(r, 0.85) for r in settings.inboard)]
    far = np.stack([np.stack([s * radius * np.cos(age), -s * radius * np.sin(age), -depth], axis=-1) for s in spans])
    gamma = 0.36 * model.chords * np.sqrt(np.clip(1 - ((stations - 0.65) / 0.37) ** 2, 0, 1))
    return Unknowns(*(jnp.asarray(a, float)[None] for a in (near, far, gamma)))


def with_the_ground(x: Unknowns, before: Plane | None, after: Plane | None) -> Unknowns:
    """Move a wake's nodes along as the ground rises and tilts: wholly at the ground, not at all at the rotor.

    The guess that continuation needs: the wake of the old ground may lie under the new one.
    """
    if before is None or after is None:
        return x
    at = 2 * jnp.pi / x.near.shape[0] * jnp.arange(x.near.shape[0])[:, None, None]
    tilt = after.slope - before.slope
    down = jnp.array([0.0, 0.0, 1.0])

    def move(nodes):
        hub = rotate_about_shaft(nodes, at)
        depth = 1 - before.distance(hub) / (before.height * jnp.cos(before.slope))
        share = jnp.clip(depth, 0, 1)[..., None] ** 2
        arm = hub + before.height * down
        # the mountain side, x > 0, goes up
        turned = jnp.stack(
            [
                jnp.cos(tilt) * arm[..., 0] - jnp.sin(tilt) * arm[..., 2],
                arm[..., 1],
                jnp.sin(tilt) * arm[..., 0] + jnp.cos(tilt) * arm[..., 2],
            ],
            axis=-1,
        )
        moved = hub + share * (turned - arm + (before.height - after.height) * down)
        return rotate_about_shaft(moved, -at)

    return x._replace(near=move(x.near), far=move(x.far))


def laid_level(x: Unknowns, ground: Plane) -> Unknowns:
    """Axisymmetric wake (K = 1) like that of a slope: its nodes sheared down or up to level ground, then averaged.

    All above the ground, and more so than by with_the_ground: a mean of nodes under it would be no wake.
    """
    at = 2 * jnp.pi / x.near.shape[0] * jnp.arange(x.near.shape[0])[:, None, None]

    def move(nodes):
        hub = rotate_about_shaft(nodes, at)
        above = jnp.clip(ground.distance(hub) / (ground.height * jnp.cos(ground.slope)), 0, 1)
        lowered = hub[..., 2] - (1 - above**2) * hub[..., 0] * jnp.tan(ground.slope)
        return jnp.mean(rotate_about_shaft(hub.at[..., 2].set(lowered), -at), axis=0, keepdims=True)

    return Unknowns(move(x.near), move(x.far), jnp.mean(x.gamma_bound, axis=0, keepdims=True))
