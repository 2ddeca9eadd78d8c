"""The rotor in its free wake at one azimuth as a linear system, put together from its parts.

A wake of three thousand states has as many columns, and a product with its Jacobian takes a Biot–Savart sum each. The
velocities' derivative comes from the pairs themselves instead (wake/influence.py), and what is left of the equations
in given velocities tells no blade's wake from another's but through them: all blades are moved at once, a column for a
state of one blade. Only the few columns of flap, lag and inputs, and the rows of the outputs, are products of all.
"""

from collections.abc import Sequence
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.flatten_util import ravel_pytree
from jaxtyping import Array, Float

from rotorjax.coupled import blades_at, rate_in
from rotorjax.coupled_wake import CoupledWake, model_of
from rotorjax.linearisation.drive import Drive, driven
from rotorjax.linearisation.hover import Flat, members_of, products, pulled
from rotorjax.linearisation.rotor import SteadyState, coupled_state
from rotorjax.rotor import multiblade
from rotorjax.wake.field import node_velocities
from rotorjax.wake.influence import instant_response

BATCH = 64
"""Columns of a pass without pairs."""
MOTIONS = 4
"""Flap, lag and their rates of a blade."""


class Instant(NamedTuple):
    """a (n, n), b (n, m), c (q, n), d (q, m) and the outputs y (q,) at one azimuth."""

    a: Float[np.ndarray, "n n"]
    b: Float[np.ndarray, "n m"]
    c: Float[np.ndarray, "q n"]
    d: Float[np.ndarray, "q m"]
    y: Float[np.ndarray, " q"]


def instant(
    psi: Array, x: SteadyState, u: Drive, p: CoupledWake, inputs: Sequence[str], outputs: Sequence[str]
) -> Instant:
    """The matrices of state, inputs and outputs with blade 0 at psi, in multi-blade coordinates."""
    flat, blades = ravel_pytree(x)[0], p.rotor.blades
    z, n = jnp.concatenate([flat, jnp.stack([u[name] for name in inputs])]), flat.size
    members = members_of(x, blades)
    moved = np.concatenate([members[:, :MOTIONS].ravel(), np.arange(n, z.size)])
    function = Flat(x, tuple(inputs), tuple(outputs))
    along = np.zeros((moved.size, z.size))
    along[np.arange(moved.size), moved] = 1.0
    y, rows = (np.asarray(part) for part in pulled(function, z, psi, u, p))
    wakes = np.asarray(by_wake(psi, x, u, p))  # first, for it takes the room of several of the whole
    whole = np.zeros((n, z.size))
    whole[:, moved] = products(function, z, psi, u, p, along)[:, :n].T
    wake, rates = members[:, MOTIONS:], members[:, [1, 3]]  # a blade's flap, its rate, lag and its rate come first
    into = np.concatenate([rates, wake], axis=1).ravel()
    whole[np.ix_(into, wake.ravel())] = wakes.reshape(into.size, wake.size)
    return Instant(whole[:, :n], whole[:, n:].copy(), rows[:, :n], rows[:, n:], y)  # a view would keep all of it


@eqx.filter_jit
def by_wake(psi: Array, x: SteadyState, u: Drive, p: CoupledWake) -> Float[Array, "B 2+n B n"]:
    """Derivative of each coordinate's flap and lag accelerations and wake rates by the wakes of all coordinates."""
    hub, moved = driven(u, p)
    assert isinstance(moved, CoupledWake)
    p = moved
    state, blades = coupled_state(psi, x, p), p.rotor.blades
    to, back = multiblade.transform(psi, blades), multiblade.inverse(psi, blades)
    model = model_of(hub, blades_at(state, hub, p), p)
    velocities = node_velocities(model, state.inflow, psi)
    unravel = ravel_pytree(jax.tree.map(lambda leaf: leaf[0], state.inflow))[1]
    count = ravel_pytree(state.inflow)[0].size // blades

    def alike(z: Array) -> Float[Array, "B 2+n"]:
        """Rates in given velocities, all wakes moved alike, and all velocities at the blades."""
        wake = jax.tree.map(lambda v, change: v + change, state.inflow, unravel(z[:count]))
        at_blades = velocities.control + z[count:].reshape(-1, 3)
        rate = rate_in(eqx.tree_at(lambda s: s.inflow, state, wake), hub, p, velocities._replace(control=at_blades))
        turning = to @ jnp.stack([rate.rotor.flap_rate, rate.rotor.lag_rate], axis=1)
        return jnp.concatenate([turning, jax.vmap(lambda s: ravel_pytree(s)[0])(rate.inflow)], axis=1)

    start = jnp.zeros(count + 3 * velocities.control.shape[1])
    columns = jax.lax.map(jax.linearize(alike, start)[1], jnp.eye(start.size), batch_size=BATCH)
    own, by_control = jnp.split(jnp.moveaxis(columns, 0, -1), [count], axis=-1)
    response = instant_response(model, state.inflow, psi)
    at_control, at_nodes = jnp.split(response.reshape(blades, -1, blades, count), [start.size - count], axis=1)
    whole = jnp.einsum("irc,icln->irln", by_control, at_control)
    # nodes go with the velocity at them, and they are the first of a wake's states
    whole = whole.at[:, 2 : 2 + at_nodes.shape[1]].add(at_nodes)
    whole = whole.at[jnp.arange(blades), :, jnp.arange(blades)].add(own)
    whole = jnp.einsum("ci,irln,ld->crdn", back, whole, to) / hub.omega
    turning = jnp.asarray(multiblade.generator(blades))
    return whole.at[:, 2 + jnp.arange(count), :, jnp.arange(count)].add(-turning)
