"""Dense derivatives of the velocities in an axisymmetric wake, one azimuthal harmonic of its disturbance at a time.

A disturbance û e^{ipψ} of an axisymmetric wake stands at the blades with the phases e^{2πi pj/B}, j = 0 … B−1, so the
velocities answer with a matrix that depends on p mod B only: B matrices hold the whole derivative, whatever the
number of slices. They are assembled from the pairs themselves (kernel_pairs.py), each pair once for all its eleven
derivatives, which takes about as long as a few products with the Jacobian.
"""

from collections.abc import Callable
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.flatten_util import ravel_pytree
from jaxtyping import Array, Complex, Float

from rotorjax.errors import InputError
from rotorjax.frames import rotate_about_shaft
from rotorjax.wake.above import above_ground
from rotorjax.wake.field import self_induction
from rotorjax.wake.kernel_pairs import cross, pairs, slopes
from rotorjax.wake.kernel_sweeps import KernelSegments
from rotorjax.wake.model import FreeWake, WakeState, along_blade, azimuths, slices
from rotorjax.wake.segments import Segments, bound_vortex, far_filaments, join, lattice_segments, near_lattice, releases


class PairDerivatives(NamedTuple):
    """Velocity (N, S, 3) of each pair by the segment's end points (N, S, 3, 3), strength and softening (N, S, 3)."""

    start: Float[Array, "N S 3 3"]
    end: Float[Array, "N S 3 3"]
    strength: Float[Array, "N S 3"]
    soft: Float[Array, "N S 3"]


def pair_derivatives(points: Float[Array, "N 3"], segments: KernelSegments) -> PairDerivatives:
    """Derivatives of every segment's velocity at every point (Scully's core); by the point it is −(start + end).

    With v = g k c and c = l × r₁ = l × r₂ (formulas of kernel_pairs.py): c' = e' × r₁ − s' × r₂ for moved ends s, e.
    """
    nodes = jnp.concatenate([segments.start, segments.end], axis=1)
    pair = pairs(tuple(points.T), nodes, segments.soft)
    f = slopes(pair, 1)
    g = segments.strength[:, None]
    r1, r2, edge = (jnp.stack(jnp.broadcast_arrays(*v), -1) for v in (pair.r1, pair.r2, pair.edge))
    c = jnp.stack(cross(pair.edge, pair.r1), -1)
    rho, kappa1, kappa2 = ((x / f.spread)[..., None] for x in (f.rho, f.kappa1, f.kappa2))
    by_start, by_end = -rho * edge - kappa1 * r1, rho * edge + kappa2 * r2
    gk, gc = (g * f.k)[..., None, None], (g[..., None] * c)[..., :, None]
    found = PairDerivatives(
        start=gc * by_start[..., None, :] + gk * _cross_matrix(r2),
        end=gc * by_end[..., None, :] - gk * _cross_matrix(r1),
        strength=f.k[..., None] * c,
        soft=-(f.k_e / f.spread)[..., None] * gc[..., 0],
    )
    return PairDerivatives(*(jnp.swapaxes(x, 0, 1) for x in found))


def _cross_matrix(a: Float[Array, "*n 3"]) -> Float[Array, "*n 3 3"]:
    """[a]× with [a]× b = a × b."""
    x, y, z = a[..., 0], a[..., 1], a[..., 2]
    zero = jnp.zeros_like(x)
    rows = [[zero, -z, y], [z, zero, -x], [-y, x, zero]]
    return jnp.stack([jnp.stack(row, -1) for row in rows], -2)


@eqx.filter_jit
def velocity_response(model: FreeWake, state: WakeState, phase: Float[Array, ""]) -> Complex[Array, "N 3 n"]:
    """Derivative of a slice's velocities at its control points and nodes by the states of all slices.

    state: axisymmetric (K = 1), over level ground or none. phase: 2πp/B, by which the disturbance e^{ipψ} of one blade
    leads that of the one before. n runs over the slice's state as `ravel_pytree` lays it out, N over control points,
    near and far nodes.
    """
    _require_open_air(model)
    own = jax.tree.map(lambda a: a[0], state)
    flat, unravel = ravel_pytree(own)
    places = along_blade(model.stations)

    def nodes(s: WakeState):
        return jnp.concatenate([places, s.near.reshape(-1, 3), s.far.reshape(-1, 3)])

    def everything(v):
        s = _above(model, unravel(v), 0.0)
        near = near_lattice(model, s, model.settings.near_core)
        far = far_filaments(model, s, releases(model, s), jnp.zeros(()))
        return _kernel_form(join(near, far, bound_vortex(model, s.gamma_bound)))

    targets, segments = nodes(own), everything(flat)
    moved = jax.jacfwd(lambda v: nodes(unravel(v)))(flat)
    at_targets, by_segments = _blade_sum(model, targets, segments, phase)
    near = slice(len(places)), slice(lattice_segments(model))
    lattice = jax.tree.map(lambda a: a[..., near[1]], segments)
    sharper = _sharpened(places, lattice, model.settings.control_core)
    by_segments = jax.tree.map(lambda whole, own: whole.at[near].add(own), by_segments, sharper)
    parts = jax.tree.map(lambda d: jnp.concatenate([jnp.real(d), jnp.imag(d)]), by_segments)
    real, imaginary = jnp.split(_chain(parts, everything, flat), 2)
    whole = real + 1j * imaginary + jnp.einsum("nij,njm->nim", at_targets, moved)
    bend = jax.jacfwd(lambda v: self_induction(model, unravel(v)))(flat).reshape(-1, 3, flat.size)
    return whole.at[len(targets) - len(bend) :].add(bend)


@eqx.filter_jit
def instant_response(model: FreeWake, state: WakeState, psi: Float[Array, ""]) -> Float[Array, "B N 3 B n"]:
    """Derivative of each blade's velocities, in its frame, by the wake states of all blades at one instant.

    state: K = B slices, blade 0 at psi. n runs over a slice's state as `ravel_pytree` lays it out, N over control
    points, near and far nodes; hub and blades stand still.
    """
    _require_open_air(model)
    angles, numbers = azimuths(state, psi), jnp.arange(slices(state))
    unravel = ravel_pytree(jax.tree.map(lambda a: a[0], state))[1]
    flat = jax.vmap(lambda s: ravel_pytree(s)[0])(state)

    def nodes(v, k, angle):
        s = unravel(v)
        own = jnp.concatenate([model.of_slice(k).control, s.near.reshape(-1, 3), s.far.reshape(-1, 3)])
        return rotate_about_shaft(own, angle)

    def everything(v, k, angle):
        own, s = model.of_slice(k), _above(model, unravel(v), angle)
        far = far_filaments(own, s, releases(own, s), angle)
        whole = join(near_lattice(own, s, model.settings.near_core), far, bound_vortex(own, s.gamma_bound))
        start, end = (rotate_about_shaft(ends, angle) for ends in (whole.start, whole.end))
        return _kernel_form(whole._replace(start=start, end=end))

    targets, segments = jax.vmap(nodes)(flat, numbers, angles), jax.vmap(everything)(flat, numbers, angles)
    moved = jax.vmap(jax.jacfwd(nodes))(flat, numbers, angles)

    def at_blade(one):
        k, angle = one
        own = _of_all(model, targets[k], flat, everything, k, angles)
        own = own.at[:, :, k].add(jnp.einsum("nij,njm->nim", _by_place(model, targets[k], segments), moved[k]))
        own = jnp.einsum("ij,njbm->nibm", rotate_about_shaft(jnp.eye(3), angle), own)  # back into the blade's frame
        bend = jax.jacfwd(lambda v: self_induction(model.of_slice(k), unravel(v), angle))(flat[k])
        bend = bend.reshape(-1, 3, flat.shape[1])
        return own.at[len(own) - len(bend) :, :, k].add(bend)

    return jax.lax.map(at_blade, (numbers, angles))


def _above(model: FreeWake, slice_: WakeState, angle: float | Float[Array, ""]) -> WakeState:
    """One slice as its vortices lie."""
    return jax.tree.map(lambda a: a[0], above_ground(model, jax.tree.map(lambda a: a[None], slice_), angle))


def _require_open_air(model: FreeWake) -> None:
    if model.surfaces is not None:
        raise InputError(
            "Argument `model` must have no surfaces to have dense derivatives, which know planes only, but has some: "
            "linearise over the ground alone, or take products with `ode.linear`"
        )


def _seen(model: FreeWake, points: Float[Array, "N 3"]) -> list[tuple[Array, Array]]:
    """Points and, over ground, their mirror points; with the matrix that brings a velocity there back."""
    if model.ground is None:
        return [(points, jnp.eye(3))]
    mirror = model.ground.reflect_vectors(jnp.eye(3)).T
    return [(points, jnp.eye(3)), (model.ground.reflect_points(points), mirror)]


def _by_place(model: FreeWake, points: Float[Array, "N 3"], segments: KernelSegments) -> Float[Array, "N 3 3"]:
    """Derivative of the velocity at points by their own places, of all blades' segments."""

    def add(total, of_blade):
        for place, back in _seen(model, points):
            found = pair_derivatives(place, of_blade)
            total = total - jnp.einsum("ij,njk,kl->nil", back, jnp.sum(found.start + found.end, axis=1), back)
        return total, None

    return jax.lax.scan(add, jnp.zeros((len(points), 3, 3)), segments)[0]


def _of_all(
    model: FreeWake, points: Float[Array, "N 3"], flat: Float[Array, "B n"], everything: Callable, k, angles
) -> Float[Array, "N 3 B n"]:
    """Derivative of the velocity at blade k's points by every blade's state, through its segments."""
    near, control = lattice_segments(model), len(model.stations)

    def of_blade(one):
        number, own, angle = one
        sources = everything(own, number, angle)
        found = [
            jax.tree.map(
                lambda d, back=back: jnp.einsum("ij,nsj...->nsi...", back, d), pair_derivatives(place, sources)
            )
            for place, back in _seen(model, points)
        ]
        whole = jax.tree.map(lambda *parts: sum(parts), *found)
        lattice = jax.tree.map(lambda a: a[..., :near], sources)
        sharper = _sharpened(points[:control], lattice, model.settings.control_core)
        whole = jax.tree.map(
            lambda all_, own: all_.at[:control, :near].add(jnp.where(number == k, own, 0.0)), whole, sharper
        )
        return _chain(whole, lambda v: everything(v, number, angle), own)

    found = jax.lax.map(of_blade, (jnp.arange(len(flat)), flat, angles))
    return jnp.moveaxis(found, 0, 2)


def _sharpened(points: Float[Array, "N 3"], lattice: KernelSegments, fine: Float[Array, ""]) -> PairDerivatives:
    """Derivatives of `biot_savart.sharpened_velocity`, the fine core's softening |l|² fine² moving with the ends."""
    edge = (lattice.end - lattice.start).T
    softs = jnp.stack([jnp.sum(edge**2, axis=-1) * fine**2, lattice.soft])
    both = jax.vmap(lambda soft: pair_derivatives(points, lattice._replace(soft=soft)))(softs)
    thin, thick = PairDerivatives(*(d[0] for d in both)), PairDerivatives(*(d[1] for d in both))
    stretched = 2 * fine**2 * thin.soft[..., None] * edge[:, None]
    return PairDerivatives(
        thin.start - thick.start - stretched,
        thin.end - thick.end + stretched,
        thin.strength - thick.strength,
        -thick.soft,
    )


def _blade_sum(model: FreeWake, targets, segments, phase):
    """Derivatives by the targets (N, 3, 3) and, with each blade's phase, by the segments, image included."""
    blades, plane = model.rotor.blades, model.ground
    turns = jnp.stack([rotate_about_shaft(jnp.eye(3), jnp.asarray(2 * np.pi * j / blades)).T for j in range(blades)])
    places, to, back = targets @ turns, turns, jnp.swapaxes(turns, 1, 2)
    phases = jnp.exp(1j * phase * jnp.arange(blades))
    if plane is not None:
        mirror = plane.reflect_vectors(jnp.eye(3)).T
        places = jnp.concatenate([places, plane.reflect_points(targets) @ turns])
        to, back = jnp.concatenate([to, mirror @ to]), jnp.concatenate([back, back @ mirror])
        phases = jnp.concatenate([phases, phases])

    def add(totals, copy):
        """One blade, or the image of one: `to` takes a velocity out of its frame, `back` a disturbance into it."""
        at_targets, by_segments = totals
        place, to, back, phase = copy
        found = pair_derivatives(place, segments)
        at_targets = at_targets - jnp.einsum("ij,njk,kl->nil", to, jnp.sum(found.start + found.end, axis=1), back)
        turned = [jnp.einsum("ij,nsj...->nsi...", phase * to, d) for d in found]
        return (at_targets, PairDerivatives(*map(jnp.add, by_segments, turned))), None

    shapes = jax.eval_shape(pair_derivatives, targets, segments)
    nothing = jax.tree.map(lambda a: jnp.zeros(a.shape, phases.dtype), shapes)
    start = jnp.zeros((len(targets), 3, 3), targets.dtype), nothing
    return jax.lax.scan(add, start, (places, to, back, phases))[0]


def _kernel_form(segments: Segments) -> KernelSegments:
    soft = jnp.sum((segments.end - segments.start) ** 2, axis=1) * segments.core**2
    return KernelSegments(segments.start.T, segments.end.T, segments.strength / (4 * jnp.pi), soft)


def _chain(by_segments: PairDerivatives, of_state: Callable, flat: Float[Array, " m"]):
    """Derivative by the segments times the segments' by the state: rows go back to the few nodes they depend on."""
    back = jax.vjp(of_state, flat)[1]

    def row(start, end, strength, soft):
        return back(KernelSegments(start.T, end.T, strength, soft))[0]

    # one row for each point and component: segments stand last but one, or last
    rows = [jnp.swapaxes(d, 1, 2) for d in by_segments]
    found = jax.vmap(row)(*(d.reshape(-1, *d.shape[2:]) for d in rows))
    return found.reshape(-1, 3, flat.size)
