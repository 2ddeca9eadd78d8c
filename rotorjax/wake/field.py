"""Velocities that the wake induces: at its own nodes, on the blades, anywhere."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from rotorjax.frames import rotate_about_shaft
from rotorjax.wake.biot_savart import segment_velocity
from rotorjax.wake.far_wake import faded
from rotorjax.wake.model import FreeWake, WakeState, azimuths, slices
from rotorjax.wake.roll_up import Release
from rotorjax.wake.segments import Segments, bound_vortex, far_filaments, join, near_lattice, releases


class Velocities(NamedTuple):
    """Air velocity over ΩR in the blades' frames: control (K, R, 3), near (K, R+1, A_N, 3), far (K, F, A_F, 3)."""

    control: Float[Array, "K R 3"]
    near: Float[Array, "K R1 AN 3"]
    far: Float[Array, "K F AF 3"]


def wake_segments(model: FreeWake, state: WakeState, psi: float | Float[Array, ""] = 0.0) -> Segments:
    """All segments of every slice, each in its blade's frame: fields (K, S, …)."""

    def one(slice_, angle, k):
        own = model.of_slice(k)
        near = near_lattice(own, slice_, model.settings.near_core)
        far = far_filaments(own, slice_, releases(own, slice_), angle)
        return join(near, far, bound_vortex(own, slice_.gamma_bound))

    return jax.vmap(one)(state, azimuths(state, psi), jnp.arange(slices(state)))


def node_velocities(model: FreeWake, state: WakeState, psi: float | Float[Array, ""] = 0.0) -> Velocities:
    """Velocities at the blades' control points and at all wake nodes; slice 0 stands at azimuth psi."""
    segments = wake_segments(model, state, psi)

    def one(operand):
        k, angle, slice_ = operand
        own = model.of_slice(k)
        points = own.control
        targets = jnp.concatenate([points, slice_.near.reshape(-1, 3), slice_.far.reshape(-1, 3)])
        v = _at_slice(model, segments, targets, k, angle)
        split = len(points), len(points) + slice_.near.size // 3
        control, near, far = jnp.split(v, split)
        control = control + _sharpened(own, slice_, points)
        far = far.reshape(slice_.far.shape) + self_induction(own, slice_)
        return control, near.reshape(slice_.near.shape), far

    operands = (jnp.arange(slices(state)), azimuths(state, psi), state)
    if slices(state) == 1:
        return Velocities(*(v[None] for v in one(jax.tree.map(lambda a: a[0], operands))))
    return Velocities(*jax.lax.map(one, operands))


def velocity(state: WakeState, points: Float[Array, "N 3"], model: FreeWake) -> Float[Array, "K N 3"]:
    """Induced velocity over ΩR at hub-frame points over R, at each of the state's azimuths; climb not included."""
    segments = wake_segments(model, state)

    def one(operand):
        k, angle = operand
        return rotate_about_shaft(_induced(model, segments, rotate_about_shaft(points, -angle), k, angle), angle)

    return jax.lax.map(one, (jnp.arange(slices(state)), azimuths(state)))


def velocity_now(
    state: WakeState, psi: Float[Array, ""], points: Float[Array, "N 3"], model: FreeWake
) -> Float[Array, "N 3"]:
    """Induced velocity over ΩR at hub-frame points over R, at the one instant at which slice 0 stands at psi."""
    turned = rotate_about_shaft(points, -psi)
    return rotate_about_shaft(_induced(model, wake_segments(model, state, psi), turned, 0, psi), psi)


def _at_slice(model, segments, targets, k, angle):
    """Induced velocity, climb, wind and the auxiliary washout at points in the frame of slice k."""
    return _induced(model, segments, targets, k, angle) + undisturbed(model, targets, angle)


def _induced(model: FreeWake, segments: Segments, targets: Float[Array, "N 3"], k, angle) -> Float[Array, "N 3"]:
    """Velocity from all blades' wakes, and from their images in the ground, in the frame of slice k.

    The image needs no states: its velocity is the reflected velocity of the real wake at the reflected point.
    """
    blades = model.rotor.blades
    count = segments.strength.shape[0]
    # the plane is fixed in the hub frame, so the sum is made there
    targets = rotate_about_shaft(targets, angle)
    if count == 1:
        own = jax.tree.map(lambda a: a[0], segments)
        turned = own._replace(start=rotate_about_shaft(own.start, angle), end=rotate_about_shaft(own.end, angle))
        v = segment_velocity(targets, *turned, plane=model.ground, blades=blades)
    else:
        others = (k + count // blades * jnp.arange(blades)) % count
        at = (angle + 2 * jnp.pi / blades * jnp.arange(blades))[:, None]
        start, end, strength, core = (a[others] for a in segments)
        start, end = rotate_about_shaft(start, at), rotate_about_shaft(end, at)
        v = segment_velocity(
            targets, start.reshape(-1, 3), end.reshape(-1, 3), strength.ravel(), core.ravel(), plane=model.ground
        )
    return rotate_about_shaft(v, -angle)


def carried(model: FreeWake, angle: Float[Array, ""]) -> Float[Array, "3"]:
    """What the wake is carried by besides itself, in the frame at `angle`: climb, wind, the solver's auxiliary flow."""
    axial = jnp.zeros(3, model.climb.dtype).at[2].set(-model.climb - model.washout)
    return axial if model.flight is None else axial + rotate_about_shaft(model.flight.wind, -angle)


def undisturbed(model: FreeWake, points: Float[Array, "N 3"], angle: Float[Array, ""]) -> Float[Array, "#N 3"]:
    """Velocity of the air that no vortex moves, seen at points of the frame at `angle`: on a hub that turns, of each
    point its own.
    """
    if model.flight is None or model.flight.turn is None:
        return carried(model, angle)[None]
    return carried(model, angle) - jnp.cross(rotate_about_shaft(model.flight.turn, -angle), points)


def _sharpened(model: FreeWake, slice_: WakeState, points: Float[Array, "R 3"]) -> Float[Array, "R 3"]:
    """What the blade's own near wake adds at its control points when its core is small there.

    The core that keeps the lattice smooth at its own nodes would smear the tip loss, where panels are narrower than
    it, and the circulation would end at the tip with a finite value.
    """
    fine = near_lattice(model, slice_, model.settings.control_core)
    smooth = near_lattice(model, slice_, model.settings.near_core)
    both = join(fine, smooth._replace(strength=-smooth.strength))
    return segment_velocity(points, *both)


def self_induction(model: FreeWake, slice_: WakeState) -> Float[Array, "F AF 3"]:
    """Velocity of the tip vortex's nodes from its own curvature, which straight segments lose.

    The two segments that meet in a node induce nothing there. Cutting ±Δs out of a ring of radius ρ leaves
    Γ/4πρ · ln(4ρ/Δs); the whole ring with a Lamb–Oseen core r_c has Γ/4πρ · (ln(8ρ/r_c) − 0.444) (Saffman 1992,
    §10.3, with r_c the radius of greatest swirl), so the local part is Γκ/4π · (ln(2Δs/r_c) − 0.444) along the
    binormal. The inboard filaments stand for a sheet and have none.
    """
    start: Release = releases(model, slice_)
    tip = jnp.concatenate([start.points[:1], slice_.far[0], 2 * slice_.far[0, -1:] - slice_.far[0, -2:-1]])
    tangent = 0.5 * (tip[2:] - tip[:-2])
    bend = tip[2:] - 2 * tip[1:-1] + tip[:-2]
    step = jnp.sqrt(jnp.sum(tangent**2, axis=-1, keepdims=True))
    binormal = jnp.cross(tangent, bend) / step**3
    log = jnp.log(2 * step / model.settings.self_induction_core) - 0.444
    strength = faded(model, slice_.gamma_far, model.settings.filament_ages[1:])[0]
    own = strength[:, None] / (4 * jnp.pi) * log * binormal
    return jnp.zeros_like(slice_.far).at[0].set(own)
