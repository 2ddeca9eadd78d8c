"""Velocities that the wake induces: at its own nodes, on the blades, anywhere."""

from dataclasses import replace
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from rotorjax.frames import rotate_about_shaft
from rotorjax.ground import Plane
from rotorjax.panels.surface import leak, watched
from rotorjax.wake.above import above_ground, senses
from rotorjax.wake.biot_savart import segment_velocity, sharpened_velocity
from rotorjax.wake.far_wake import faded
from rotorjax.wake.model import FreeWake, WakeState, azimuths, slices
from rotorjax.wake.segments import (
    Part,
    Segments,
    bound_vortex,
    far_filaments,
    join,
    lattice_segments,
    near_lattice,
    points_between,
    releases,
)


class Velocities(NamedTuple):
    """Air velocity over ΩR in the blades' frames: control (K, R, 3), near (K, R+1, A_N, 3), far (K, F, A_F, 3)."""

    control: Float[Array, "K R 3"]
    near: Float[Array, "K R1 AN 3"]
    far: Float[Array, "K F AF 3"]


def wake_segments(
    model: FreeWake, state: WakeState, psi: float | Float[Array, ""] = 0.0, part: Part = "all"
) -> Segments:
    """All segments of every slice, or those without ("free") or of the closure alone ("old"), each in its blade's
    frame: fields (K, S, …).
    """

    def one(slice_, angle, k):
        own = model.of_slice(k)
        far = far_filaments(own, slice_, releases(own, slice_), angle, part)
        if part == "old":
            return far
        near = near_lattice(own, slice_, model.settings.near_core)
        return join(near, far, bound_vortex(own, slice_.gamma_bound))

    return jax.vmap(one)(above_ground(model, state, psi), azimuths(state, psi), jnp.arange(slices(state)))


def node_velocities(
    model: FreeWake,
    state: WakeState,
    psi: float | Float[Array, ""] = 0.0,
    old: Float[Array, "K N 3"] | None = None,
) -> Velocities:
    """Velocities at the blades' control points and at all wake nodes; slice 0 stands at azimuth psi.

    old: what closure and ground add to them (`old_velocities`), None to sum it up here.
    """
    angles = azimuths(state, psi)
    numbers = jnp.arange(slices(state))
    control = jax.vmap(lambda k: model.of_slice(k).control)(numbers)
    targets = targets_of(model, state)
    segments = wake_segments(model, state, psi, "all" if old is None else "free")
    if old is None:
        v = _at_targets(model, segments, targets, angles)
    else:
        v = old + _at_targets(alone(model), segments, targets, angles)
    v = v + jax.vmap(lambda points, angle: undisturbed(model, points, angle))(targets, angles)
    ends = np.cumsum([control.shape[1], state.near.shape[1] * state.near.shape[2]])
    at_control, *rest = jnp.split(v, ends, axis=1)
    near, far = (part.reshape(a.shape) for part, a in zip(rest, (state.near, state.far), strict=True))
    sharpened = jax.vmap(lambda *both: _sharpened(model, *both))(control, segments)
    bent = jax.vmap(lambda k, *at: self_induction(model.of_slice(k), *at))(numbers, state, angles)
    return Velocities(at_control + sharpened, near, far + bent)


def old_velocities(model: FreeWake, state: WakeState, psi: float | Float[Array, ""] = 0.0) -> Float[Array, "K N 3"]:
    """What the closure and all images in the ground induce at control points, near and far nodes, in the blades'
    frames over ΩR.

    Over ground four fifths of all pairs; seen from the blades it changes slowly: a march may take it once a step
    (`node_velocities`).
    """
    targets, angles = targets_of(model, state), azimuths(state, psi)
    found = _at_targets(model, wake_segments(model, state, psi, "old"), targets, angles)
    if model.ground is None and model.surfaces is None:
        return found
    free = wake_segments(model, state, psi, "free")
    return found + _at_targets(_in_calm(model), free, targets, angles, answer=True)


def targets_of(model: FreeWake, state: WakeState) -> Float[Array, "K N 3"]:
    """Control points, near and far nodes of each slice."""
    control = jax.vmap(lambda k: model.of_slice(k).control)(jnp.arange(slices(state)))
    return jnp.concatenate([a.reshape(len(a), -1, 3) for a in (control, state.near, state.far)], axis=1)


def _at_targets(
    model: FreeWake,
    segments: Segments,
    targets: Float[Array, "K N 3"],
    angles: Float[Array, " K"],
    *,
    answer: bool = False,
) -> Float[Array, "K N 3"]:
    """Velocity at points of the slices' frames, all blades' at one instant in one sum; answer: of ground and surfaces
    alone.
    """
    places = to_hub(targets, angles, model.rotor.blades)
    return from_hub(at_instants(model, segments, places, angles, answer=answer), angles, len(targets))


def velocity(state: WakeState, points: Float[Array, "N 3"], model: FreeWake) -> Float[Array, "K N 3"]:
    """Induced velocity over ΩR at hub-frame points over R, at each of the state's azimuths; climb not included."""
    instants = -(-slices(state) // model.rotor.blades)
    places = jnp.broadcast_to(points, (instants, *points.shape))
    found = at_instants(model, wake_segments(model, state), places, azimuths(state))
    return jnp.tile(found, (slices(state) // instants, 1, 1))


def velocity_now(
    state: WakeState, psi: Float[Array, ""], points: Float[Array, "N 3"], model: FreeWake
) -> Float[Array, "N 3"]:
    """Induced velocity over ΩR at hub-frame points over R, at the one instant at which slice 0 stands at psi."""
    segments, angles = wake_segments(model, state, psi), azimuths(state, psi)
    if slices(state) == 1:
        turned = rotate_about_shaft(points, -angles)
        return rotate_about_shaft(at_instants(model, segments, turned[None], angles)[0], angles)
    places = jnp.broadcast_to(points, (slices(state) // model.rotor.blades, *points.shape))
    return at_instants(model, segments, places, angles)[0]


def at_instants(
    model: FreeWake,
    segments: Segments,
    places: Float[Array, "I N 3"],
    angles: Float[Array, " K"],
    *,
    answer: bool = False,
) -> Float[Array, "I N 3"]:
    """Velocity at points of the hub frame, N for each instant, from all blades' wakes, their images in the ground and
    the surfaces that they and the wind blow on; answer: of images and surfaces alone.

    Ground and surfaces are fixed in that frame. Slices i, i + I, i + 2I … are the blades' wakes at instant i. K = 1:
    every blade's wake is the same, and points are seen from the slice's own blade, as level ground looks from all of
    them.
    """
    turned = segments._replace(start=_turned(segments.start, angles), end=_turned(segments.end, angles))
    blades = model.rotor.blades if len(angles) == 1 else 1
    of_instants = jax.tree.map(lambda a: _together(a, model.rotor.blades), turned)

    def one(operand: tuple[Array, Segments]) -> Array:
        return _flow(model, *operand, blades, answer)

    if len(places) == 1:
        return one(jax.tree.map(lambda a: a[0], (places, of_instants)))[None]
    return jax.lax.map(one, (places, of_instants))


def _flow(
    model: FreeWake, points: Float[Array, "N 3"], sources: Segments, blades: int, answer: bool
) -> Float[Array, "N 3"]:
    """Velocity at points at one instant; answer: of the images and surfaces alone."""

    def induced(points: Array, plane: Plane | None) -> Array:
        products = model.settings.pair_sums == "products"
        return segment_velocity(points, *sources, plane=plane, blades=blades, products=products)

    ground = model.ground
    if not answer:
        found = induced(points, ground)
    elif ground is None:
        found = jnp.zeros_like(points)
    else:
        found = ground.reflect_vectors(induced(ground.reflect_points(points), None))
    if model.surfaces is None:
        return found
    panels = model.surfaces.panels
    through = jnp.sum((induced(panels.middles, ground) + _past(model)) * panels.normals, axis=1)
    return found + model.surfaces.answer(points, through, ground)


def leaked(model: FreeWake, state: WakeState) -> Float[Array, ""]:
    """Share of what wake and wind blow on the surfaces that goes through between their panels' middles."""
    assert model.surfaces is not None
    panels, angles = model.surfaces.panels, azimuths(state)
    points = watched(panels)
    places = jnp.broadcast_to(points.reshape(-1, 3), (slices(state) // model.rotor.blades, points.size // 3, 3))
    flow = at_instants(replace(model, surfaces=None), wake_segments(model, state), places, angles) + _past(model)
    blown = jnp.sum(flow.reshape(-1, *points.shape) * panels.normals[:, None], axis=-1)
    return leak(model.surfaces, model.ground, blown)


def _past(model: FreeWake) -> Float[Array, "3"]:
    """The air that blows past the surfaces where no vortex moves it, in the hub frame."""
    assert model.surfaces is not None
    return carried(model, jnp.zeros(())) if model.surfaces.wind is None else model.surfaces.wind


def _in_calm(model: FreeWake) -> FreeWake:
    """The model with surfaces that answer vortices alone: their answer to the wind is summed with other segments."""
    if model.surfaces is None:
        return model
    return replace(model, surfaces=replace(model.surfaces, wind=jnp.zeros(3)))


def alone(model: FreeWake) -> FreeWake:
    """The model without ground and surfaces."""
    return replace(model, ground=None, surfaces=None)


def to_hub(points: Float[Array, "K n 3"], angles: Float[Array, " K"], blades: int) -> Float[Array, "I m 3"]:
    """Points of the slices' frames in the hub's, by instants: all blades' at one instant in a row."""
    return _together(_turned(points, angles), blades)


def from_hub(vectors: Float[Array, "I m 3"], angles: Float[Array, " K"], count: int) -> Float[Array, "K n 3"]:
    """Vectors at the points of `to_hub` back in the frames of `count` slices."""
    return _turned(_apart(vectors, count), -angles)


def _turned(vectors: Float[Array, "K n 3"], angles: Float[Array, " K"]) -> Float[Array, "K n 3"]:
    """Vectors of each slice turned by its angle; the frame of a lone slice (K = 1) is as good as the hub's."""
    return vectors if len(angles) == 1 else rotate_about_shaft(vectors, angles[:, None])


def _together(a: Float[Array, "K n *rest"], blades: int) -> Float[Array, "I m *rest"]:
    """What K slices hold, by instants: all blades' at one instant in a row; one slice stands for itself."""
    count = len(a)
    if count == 1:
        return a
    by_blade = a.reshape(blades, count // blades, *a.shape[1:])
    return jnp.swapaxes(by_blade, 0, 1).reshape(count // blades, -1, *a.shape[2:])


def _apart(a: Float[Array, "I m 3"], count: int) -> Float[Array, "K n 3"]:
    """The way back from `_together` to `count` slices."""
    if count == 1:
        return a
    instants = len(a)
    by_instant = a.reshape(instants, count // instants, -1, 3)
    return jnp.swapaxes(by_instant, 0, 1).reshape(count, -1, 3)


def carried(model: FreeWake, angle: Float[Array, ""]) -> Float[Array, "3"]:
    """What the wake is carried by besides itself, in the frame at `angle`: climb, wind, the solver's auxiliary flow."""
    axial = -(model.climb + model.washout) * np.array([0.0, 0.0, 1.0])
    return axial if model.flight is None else axial + rotate_about_shaft(model.flight.wind, -angle)


def undisturbed(model: FreeWake, points: Float[Array, "N 3"], angle: Float[Array, ""]) -> Float[Array, "#N 3"]:
    """Velocity of the air that no vortex moves, seen at points of the frame at `angle`: on a hub that turns, of each
    point its own.
    """
    flight, air = model.flight, carried(model, angle)[None]
    if flight is None:
        return air
    if flight.turn is not None:
        air = air - jnp.cross(rotate_about_shaft(flight.turn, -angle), points)
    if flight.gust is not None:
        up = jnp.sin(jnp.pi * rotate_about_shaft(points, angle)[:, :2]) @ flight.gust
        air = air + up[:, None] * np.array([0.0, 0.0, 1.0])
    return air


def _sharpened(model: FreeWake, control: Float[Array, "R 3"], segments: Segments) -> Float[Array, "R 3"]:
    """What the blade's own near wake adds at its control points when its core is small there.

    The core that keeps the lattice smooth at its own nodes would smear the tip loss, where panels are narrower than
    it, and the circulation would end at the tip with a finite value.
    """
    lattice = jax.tree.map(lambda a: a[: lattice_segments(model)], segments)
    return sharpened_velocity(control, *lattice, fine=model.settings.control_core)


def self_induction(model: FreeWake, slice_: WakeState, angle: float | Float[Array, ""] = 0.0) -> Float[Array, "F AF 3"]:
    """Velocity of the tip vortex's nodes from its own curvature, which straight segments lose; the slice is at `angle`.

    The two segments that meet in a node induce nothing there. Cutting ±Δs out of a ring of radius ρ leaves
    Γ/4πρ · ln(4ρ/Δs); the whole ring with a Lamb–Oseen core r_c has Γ/4πρ · (ln(8ρ/r_c) − 0.444) (Saffman 1992,
    §10.3, with r_c the radius of greatest swirl), so the local part is Γκ/4π · (ln(2Δs/r_c) − 0.444) along the
    binormal. The inboard filaments stand for a sheet and have none.
    """
    released = releases(model, slice_).points[:1]
    ends = points_between(model, jnp.concatenate([released, slice_.far[0]])[None])[0]
    tip = jnp.concatenate([ends, 2 * ends[-1:] - ends[-2:-1]])
    own = model.settings.far_segments.own[1:]
    tangent = 0.5 * (tip[own + 1] - tip[own - 1])
    bend = tip[own + 1] - 2 * tip[own] + tip[own - 1]
    step = jnp.sqrt(jnp.sum(tangent**2, axis=-1, keepdims=True))
    binormal = jnp.cross(tangent, bend) / step**3
    log = jnp.log(2 * step / model.settings.self_induction_core) - 0.444
    strength = faded(model, slice_.gamma_far, model.settings.filament_ages[1:])[0]
    strength = strength * senses(model, slice_.far[0], angle)
    found = strength[:, None] / (4 * jnp.pi) * log * binormal
    return jnp.pad(found[None], [(0, len(slice_.far) - 1), (0, 0), (0, 0)])
