"""The inverse Jacobian of the axisymmetric wake, as a preconditioner for the wake over a slope.

Over level ground the Jacobian of the residual (equilibrium.py) is block-circulant in the slices: a discrete Fourier
transform over the azimuth takes it to one matrix J_p for each harmonic, which is inverted outright. Over a slope it is
still close.
"""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.flatten_util import ravel_pytree
from jaxtyping import Array, Complex

from rotorjax.ode.fourier import half_coefficients, half_values
from rotorjax.wake.dynamics import inputs_of
from rotorjax.wake.equilibrium import Evaluation, Unknowns, evaluated, full_state, transported
from rotorjax.wake.field import Velocities
from rotorjax.wake.influence import velocity_response
from rotorjax.wake.loads import blade_loads
from rotorjax.wake.model import FreeWake
from rotorjax.wake.segments import releases


class HarmonicInverse(eqx.Module):
    """Inverse of J_p for p = 0 … K/2, [K/2 + 1, n, n], over the n unknowns of a slice."""

    inverse: Complex[Array, "P n n"]

    def __call__(self, v: Unknowns, x: Unknowns, model: FreeWake) -> Unknowns:
        """Return J⁻¹ v for unknowns of K slices; x and model are not looked at."""
        slices = v.near.shape[0]
        solved = jnp.einsum("pij,pj->pi", self.inverse, half_coefficients(_rows(v)))
        back = ravel_pytree(_first(v))[1]
        return jax.vmap(back)(half_values(solved, slices))


def harmonic_inverse(model: FreeWake, x: Unknowns, slices: int, found: Evaluation | None = None) -> HarmonicInverse:
    """Make the preconditioner for K slices from an axisymmetric wake (K = 1) over level ground or none.

    found: the wake's evaluation, where it is at hand.
    """
    blades = model.rotor.blades
    found = evaluated(model, x) if found is None else found
    # the derivative is real, so that of −q is the conjugate of that of q
    waves = [p % blades for p in range(slices // 2 + 1)]
    half = {
        q: velocity_response(model, found.state, jnp.asarray(2 * np.pi * q / blades))
        for q in sorted({min(p, blades - p) for p in waves})
    }
    return _inverse(model, x, found, [half[min(p, blades - p)] for p in waves], [p in half for p in waves], slices)


@eqx.filter_jit
def _inverse(
    model: FreeWake, x: Unknowns, found: Evaluation, responses: list[Array], direct: list[bool], slices: int
) -> HarmonicInverse:
    """Invert J_p for harmonics that answer with `responses`, or with their conjugates where not `direct`.

    One after the other: a batch is shared out to the threads that run the programs, and where each of them waits for
    its share to be done by another all wait for ever (jaxlib 0.10; two wakes at a time on two cores).
    """
    whole = jnp.stack([r if d else jnp.conj(r) for r, d in zip(responses, direct, strict=True)])
    return HarmonicInverse(jax.lax.map(jnp.linalg.inv, _jacobian(model, x, found, whole, slices)))


def _jacobian(model: FreeWake, x: Unknowns, found: Evaluation, responses: Complex[Array, "P N 3 m"], slices: int):
    """J_p [P, n, n]: a unit disturbance of each unknown of slice 0, followed through one pass."""
    one, unravel = ravel_pytree(_first(x))
    state, state_of = ravel_pytree(_first(found.state))
    here = jax.tree.map(lambda a: jnp.repeat(a, slices, axis=0), (x, found))
    of_nodes = np.cumsum([len(model.stations), x.near[0].size // 3])

    def to_state(column):
        """Disturbance [K, m] of the states."""
        pushed = jax.tree.map(lambda d, a: jnp.zeros_like(a).at[0].set(d), unravel(column), here[0])
        return _rows(jax.jvp(lambda y: full_state(model, y)[0], (here[0],), (pushed,))[1])

    def to_unknowns(moved, v):
        """Disturbance [K, n] of the wake that is produced, from those of states [K, m] and velocities [K, N, 3]."""
        parts = jnp.split(v, of_nodes, axis=1)
        change = jax.vmap(state_of)(moved)
        velocities = Velocities(*(p.reshape(a.shape) for p, a in zip(parts, here[1].velocities, strict=True)))
        loads = jax.jvp(
            lambda control, gamma: blade_loads(model, control, gamma, inputs_of(model)),
            (here[1].velocities.control, here[1].state.gamma_bound),
            (velocities.control, change.gamma_bound),
        )[1]
        start = jax.vmap(lambda t: jax.jvp(lambda s: releases(model, state_of(s)), (state,), (t,))[1])(moved)
        change = Evaluation(change, velocities, loads, start)
        return _rows(jax.jvp(lambda e: transported(model, e), (here[1],), (change,))[1])

    states = jax.vmap(to_state)(jnp.eye(one.size))
    response = jnp.einsum("pnim,cpm->cpni", responses, half_coefficients(states, axis=1))
    columns = jax.vmap(to_unknowns)(states, half_values(response, slices, axis=1))
    return jnp.einsum("cpn->pnc", half_coefficients(columns, axis=1)) - jnp.eye(one.size)


def _first(tree):
    """The first slice."""
    return jax.tree.map(lambda a: a[0], tree)


def _rows(tree) -> Array:
    """Slices as rows, K of them."""
    return jax.vmap(lambda one: ravel_pytree(one)[0])(tree)
