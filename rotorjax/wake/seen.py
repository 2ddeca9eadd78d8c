"""A wake as it is seen: blades, near wake and filaments as points, of one slice or of all blades at an instant."""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from rotorjax.frames import rotate_about_shaft
from rotorjax.rotor import geometry
from rotorjax.wake.above import above_ground
from rotorjax.wake.far_wake import cores
from rotorjax.wake.model import FreeWake, WakeState, azimuths
from rotorjax.wake.segments import lattice_nodes, releases


class Seen(NamedTuple):
    """A wake seen from the hub: x aft, y to starboard, z up, lengths over R, strengths over ΩR².

    filaments (F, A, 3): nodes from the release on, tip vortex first. circulation (F, A): at them. core (F, A − 1): of
    the segments between. lattice (R + 1, A_N + 1, 3): near wake, lifting line first. leading, trailing (R + 1, 3):
    edges of the blade. bound (R,): circulation. Of several blades: with an axis B before these.
    """

    filaments: Float[Array, "*B F A 3"]
    circulation: Float[Array, "*B F A"]
    core: Float[Array, "*B F A1"]
    lattice: Float[Array, "*B R1 AN1 3"]
    leading: Float[Array, "*B R1 3"]
    trailing: Float[Array, "*B R1 3"]
    bound: Float[Array, "*B R"]


def seen_slice(model: FreeWake, state: WakeState, psi: Float[Array, ""], pitch: Float[Array, ""]) -> Seen:
    """Look at the wake of one blade. model, state: of its slice; pitch (rad): at the root, before the twist."""
    start = releases(model, state)
    filaments = jnp.concatenate([start.points[:, None], state.far], axis=1)
    circulation = jnp.concatenate([start.strength[:, None], state.gamma_far], axis=1)
    ages = model.settings.filament_ages
    core = cores(model, start.strength[0], 0.5 * (ages[1:] + ages[:-1]))
    _, forward, up = np.eye(3) if model.flight is None else model.flight.axes
    chord = geometry.chord(model.rotor, model.edges)[:, None]
    turned = (pitch + geometry.twist(model.rotor, model.edges))[:, None]
    ahead = jnp.cos(turned) * forward + jnp.sin(turned) * up
    leading, trailing = model.leading + 0.25 * chord * ahead, model.leading - 0.75 * chord * ahead
    points = (filaments, lattice_nodes(model, state.near), leading, trailing)
    filaments, lattice, leading, trailing = (rotate_about_shaft(v, psi) for v in points)
    return Seen(filaments, circulation, core, lattice, leading, trailing, state.gamma_bound)


@eqx.filter_jit
def seen_around(model: FreeWake, state: WakeState) -> Seen:
    """Look at a periodic wake of K slices at the K instants at which blade 0 stands where a slice does; (K, B, …)."""
    psi, state = azimuths(state), above_ground(model, state)
    pitch = jnp.broadcast_to(model.operating.collective, psi.shape)
    if model.flight is not None:
        pitch = pitch + model.flight.cyclic
    blades, count = model.rotor.blades, psi.size

    def one(k, turn):
        own = jax.tree.map(lambda v: v[k], state)
        return seen_slice(model.of_slice(k), own, psi[k] + turn, pitch[k])

    if count == 1:
        return jax.vmap(jax.vmap(one, (None, 0)), (0, None))(jnp.arange(1), 2 * jnp.pi / blades * jnp.arange(blades))
    of = (jnp.arange(count)[:, None] + jnp.arange(blades) * count // blades) % count
    return jax.vmap(jax.vmap(lambda k: one(k, 0.0)))(of)
