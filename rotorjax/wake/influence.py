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

from rotorjax.frames import rotate_about_shaft
from rotorjax.wake import kernel_sweeps
from rotorjax.wake.field import self_induction
from rotorjax.wake.kernel_pairs import cross, pairs, slopes
from rotorjax.wake.model import FreeWake, WakeState, along_blade
from rotorjax.wake.segments import Segments, bound_vortex, far_filaments, join, lattice_segments, near_lattice, releases


class PairDerivatives(NamedTuple):
    """Velocity (N, S, 3) of each pair by the segment's end points (N, S, 3, 3), strength and softening (N, S, 3)."""

    start: Float[Array, "N S 3 3"]
    end: Float[Array, "N S 3 3"]
    strength: Float[Array, "N S 3"]
    soft: Float[Array, "N S 3"]


def pair_derivatives(points: Float[Array, "N 3"], segments: kernel_sweeps.Segments) -> PairDerivatives:
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
    own = jax.tree.map(lambda a: a[0], state)
    flat, unravel = ravel_pytree(own)
    places = along_blade(model.stations)

    def nodes(s: WakeState):
        return jnp.concatenate([places, s.near.reshape(-1, 3), s.far.reshape(-1, 3)])

    def everything(v):
        s = unravel(v)
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
    whole = _chain(by_segments, everything, flat) + jnp.einsum("nij,njm->nim", at_targets, moved)
    bend = jax.jacfwd(lambda v: self_induction(model, unravel(v)))(flat).reshape(-1, 3, flat.size)
    return whole.at[len(targets) - len(bend) :].add(bend)


def _sharpened(points: Float[Array, "N 3"], lattice: kernel_sweeps.Segments, fine: Float[Array, ""]) -> PairDerivatives:
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


def _kernel_form(segments: Segments) -> kernel_sweeps.Segments:
    soft = jnp.sum((segments.end - segments.start) ** 2, axis=1) * segments.core**2
    return kernel_sweeps.Segments(segments.start.T, segments.end.T, segments.strength / (4 * jnp.pi), soft)


def _chain(by_segments: PairDerivatives, of_state: Callable, flat: Float[Array, " m"]):
    """Derivative by the segments times the segments' by the state: rows go back to the few nodes they depend on."""
    back = jax.vjp(of_state, flat)[1]

    def row(start, end, strength, soft):
        return back(kernel_sweeps.Segments(start.T, end.T, strength, soft))[0]

    # one row for each point and component: segments stand last but one, or last
    rows = [jnp.swapaxes(d, 1, 2) for d in by_segments]
    rows = [d.reshape(-1, *d.shape[2:]) for d in rows]
    parts = [jnp.concatenate([jnp.real(d), jnp.imag(d)]) for d in rows]
    real, imaginary = jax.vmap(row)(*parts).reshape(2, -1, 3, flat.size)
    return real + 1j * imaginary
