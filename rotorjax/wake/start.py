"""Guesses of the wake: a prescribed one (after Landgrebe 1972), a solved one with more turns or another ground."""

from dataclasses import replace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from rotorjax.frames import rotate_about_shaft
from rotorjax.ground import Plane
from rotorjax.wake.equilibrium import Unknowns, full_state
from rotorjax.wake.far_wake import closure
from rotorjax.wake.model import FreeWake, azimuths
from rotorjax.wake.segments import points_between
from rotorjax.wake.settings import WakeSettings


def prescribed(model: FreeWake, inflow: float = 0.055) -> Unknowns:
    """Axisymmetric wake (K = 1) that goes down at `inflow` (over ΩR) and contracts to 0.78 R.

    Over ground it slows towards the plane and spreads so that the flow through it is conserved.
    """
    return _prescribed(model, jnp.asarray(inflow, float))


@eqx.filter_jit
def _prescribed(model: FreeWake, inflow: Float[Array, ""]) -> Unknowns:
    settings = model.settings
    step = settings.age_step
    near_age = step * np.arange(1, settings.near_ages + 1)
    narrowing = 0.8 + 0.2 * np.exp(-0.3 * near_age)
    x, y = (model.edges[:, None] * (narrowing * part) for part in (np.cos(near_age), -np.sin(near_age)))
    near = jnp.stack([x, y, jnp.broadcast_to(-0.5 * inflow * near_age, x.shape)], axis=-1)
    age = settings.filament_ages[1:]
    passage = 2 * np.pi / model.rotor.blades
    depth = inflow * np.where(age < passage, 0.4 * age, 0.4 * passage + (age - passage))
    radius = 0.78 + 0.22 * np.exp(-0.3 * age)
    if model.ground is not None:
        height = model.ground.height
        radius = radius * jnp.exp(0.5 * jnp.clip(inflow / height * age - 1, 0, None))
        depth = height * (1 - jnp.exp(-inflow / height * age))
    spans = np.minimum([1.0, *settings.inboard], [1.0, *(0.85 for _ in settings.inboard)])
    x, y = (spans[:, None] * (radius * part) for part in (np.cos(age), -np.sin(age)))
    far = jnp.stack([x, y, jnp.broadcast_to(-depth, x.shape)], axis=-1)
    gamma = 0.36 * model.chords * jnp.sqrt(jnp.clip(1 - ((model.stations - 0.65) / 0.37) ** 2, 0, 1))
    return Unknowns(near[None], far[None], gamma[None])


def lengthens(short: WakeSettings, long: WakeSettings) -> bool:
    """Whether a longer wake's free nodes begin with a shorter one's, which has the turns that its closure goes by."""
    return short.free_turns >= short.least_turns and np.array_equal(
        short.far_grid.nodes, long.far_grid.nodes[: short.far_ages + 1]
    )


def shorter(model: FreeWake) -> FreeWake | None:
    """The model with half of its free turns or little more; None where no shorter wake can be lengthened to it."""
    settings = model.settings
    half = int(np.ceil(max(settings.free_turns / 2, settings.least_turns)))
    for turns in range(half, int(np.ceil(settings.free_turns))):
        short = replace(settings, free_turns=float(turns))
        if lengthens(short, settings):
            return eqx.tree_at(lambda m: m.settings, model, short)
    return None


def with_turns(x: Unknowns, model: FreeWake, far_ages: int) -> Unknowns:
    """The model's wake with `far_ages` free nodes a filament: cut off there, or lengthened by turns of its closure.

    The guess that a longer wake needs: one over ground is hardly found from a prescribed wake.
    """
    more = far_ages - model.settings.far_ages
    return x._replace(far=x.far[:, :, :far_ages]) if more <= 0 else _lengthened(model, x, more)


@eqx.filter_jit
def _lengthened(model: FreeWake, x: Unknowns, more: int) -> Unknowns:
    settings = model.settings
    each = settings.old_segments_per_turn // settings.bundle_skip
    turns = replace(settings, closure_turns=-(-more // each), closure_bundles=0)
    one_by_one = eqx.tree_at(lambda m: m.settings, model, turns)
    state, start = full_state(model, x)

    def after(points, far, psi):
        nodes = points_between(model, jnp.concatenate([points[:, None], far], axis=1))
        return closure(one_by_one, nodes, psi)[:, settings.bundle_skip - 1 :: settings.bundle_skip][:, :more]

    return x._replace(far=jnp.concatenate([x.far, jax.vmap(after)(start.points, x.far, azimuths(state))], axis=2))


def with_the_ground(x: Unknowns, before: Plane | None, after: Plane | None) -> Unknowns:
    """Move a wake's nodes along as the ground rises and tilts: wholly at the ground, not at all at the rotor.

    The guess that continuation needs: the wake of the old ground may lie under the new one.
    """
    if before is None or after is None:
        return x
    return _with_the_ground(x, before, after)


@eqx.filter_jit
def _with_the_ground(x: Unknowns, before: Plane, after: Plane) -> Unknowns:
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


@eqx.filter_jit
def laid_level(x: Unknowns, ground: Plane | None) -> Unknowns:
    """Axisymmetric wake (K = 1) like that of a slope: its nodes sheared down or up to level ground, then averaged.

    All above the ground, and more so than by with_the_ground: a mean of nodes under it would be no wake.
    """
    if ground is None:
        return jax.tree.map(lambda a: jnp.mean(a, axis=0, keepdims=True), x)
    at = 2 * jnp.pi / x.near.shape[0] * jnp.arange(x.near.shape[0])[:, None, None]

    def move(nodes):
        hub = rotate_about_shaft(nodes, at)
        above = jnp.clip(ground.distance(hub) / (ground.height * jnp.cos(ground.slope)), 0, 1)
        lowered = hub[..., 2] - (1 - above**2) * hub[..., 0] * jnp.tan(ground.slope)
        return jnp.mean(rotate_about_shaft(hub.at[..., 2].set(lowered), -at), axis=0, keepdims=True)

    return Unknowns(move(x.near), move(x.far), jnp.mean(x.gamma_bound, axis=0, keepdims=True))
