"""A wake slice as straight vortex segments: near-wake lattice, far filaments, bound vortex."""

from typing import Literal, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from rotorjax.wake.far_wake import closure, cores, faded, segment_ages, turns_each
from rotorjax.wake.model import FreeWake, WakeState
from rotorjax.wake.roll_up import Release, release, rolled_up, tip_point, trailers

Part = Literal["all", "free", "old"]


class Segments(NamedTuple):
    """Straight segments: start, end (S, 3) over R, strength (S,) over ΩR² from start to end, core (S,) over R."""

    start: Float[Array, "S 3"]
    end: Float[Array, "S 3"]
    strength: Float[Array, " S"]
    core: Float[Array, " S"]


def join(*parts: Segments) -> Segments:
    """Put segments one behind the other."""
    return Segments(*(jnp.concatenate(field) for field in zip(*parts, strict=True)))


def near_lattice(model: FreeWake, state: WakeState, core: Float[Array, ""]) -> Segments:
    """Near wake of one slice (fields without their K axis): trailed and shed vorticity, every edge once.

    Ring strengths live at nodes; the ring between two ages carries their mean, less what the far filaments have taken
    over (`roll_up.rolled_up`). The spanwise edge at the blade belongs to the bound vortex; at that of the last row the
    far filaments carry all.
    """
    nodes = lattice_nodes(model, state.near)
    gamma = jnp.concatenate([state.gamma_bound[:, None], state.gamma_near], axis=1)
    rings = 0.5 * (gamma[:, 1:] + gamma[:, :-1])
    settings, ages = model.settings, model.settings.lattice_ages
    left = [1 - rolled_up(settings, at) for at in (0.5 * (ages[1:] + ages[:-1]), ages[1:-1])]
    trailed = _segments(nodes[:, :-1], nodes[:, 1:], trailers(rings) * left[0], core)
    shed = _segments(nodes[:-1, 1:-1], nodes[1:, 1:-1], jnp.diff(rings, axis=1) * left[1], core)
    return join(trailed, shed)


def lattice_segments(model: FreeWake) -> int:
    """How many segments a near lattice has, the first of a slice's."""
    panels, ages = model.settings.panels, model.settings.near_ages
    return (panels + 1) * ages + panels * (ages - 1)


def lattice_nodes(model: FreeWake, near: Float[Array, "R+1 AN 3"]) -> Float[Array, "R+1 A 3"]:
    """All nodes of a slice's lattice, the lifting line first."""
    return jnp.concatenate([model.leading[:, None], near], axis=1)


def releases(model: FreeWake, state: WakeState) -> Release:
    """Start of the far filaments of one slice."""
    row = model.settings.release_ages - 1
    return release(model, state.near[:, row], state.gamma_near[:, row])


def tip_vortex(model: FreeWake, near: Float[Array, "R+1 AN 3"], far: Float[Array, "F AF 3"]) -> Float[Array, "A 3"]:
    """Tip vortex of one slice at `settings.tip_ages`; where it is not released yet, the place in the lattice where it
    will be.
    """
    rows = lattice_nodes(model, near)[:, : model.settings.release_ages + 1]
    return jnp.concatenate([jax.vmap(lambda row: tip_point(model, row), in_axes=1)(rows), far[0]])


def far_filaments(
    model: FreeWake, state: WakeState, start: Release, psi: Float[Array, ""], part: Part = "all"
) -> Segments:
    """Far filaments of one slice at azimuth psi, with their fading and cores; part: "free" turns, "old" (the closure
    that follows them) or "all".
    """
    nodes = jnp.concatenate([start.points[:, None], state.far], axis=1)
    gamma = ends_between(model, jnp.concatenate([start.strength[:, None], state.gamma_far], axis=1))
    strength = 0.5 * (gamma[:, 1:] + gamma[:, :-1])
    free = strength.shape[1]
    nodes = points_between(model, nodes)
    more = closure(model, nodes, psi) if model.settings.closure_turns and part != "free" else nodes[:, :0]
    nodes = jnp.concatenate([nodes, more], axis=1)
    if more.shape[1]:
        strength = jnp.concatenate([strength, jnp.repeat(strength[:, -1:], more.shape[1], axis=1)], axis=1)
    chosen = slice(free if part == "old" else 0, strength.shape[1])
    ages, turns = segment_ages(model)[: chosen.stop], turns_each(model)[: chosen.stop]
    weights = faded(model, strength, ages) * turns
    core = cores(model, start.strength[0], ages)
    return Segments(
        nodes[:, :-1][:, chosen].reshape(-1, 3),
        nodes[:, 1:][:, chosen].reshape(-1, 3),
        weights[:, chosen].ravel(),
        core[:, chosen].ravel(),
    )


def ends_between(model: FreeWake, values: Float[Array, "F A+1"]) -> Float[Array, "F P+1"]:
    """Values at the ends of the far filaments' segments from those at their nodes."""
    return values if model.settings.stretch == 1 else values @ model.settings.far_segments.table.T


def points_between(model: FreeWake, nodes: Float[Array, "F A+1 3"]) -> Float[Array, "F P+1 3"]:
    """Places of the ends of the far filaments' segments; what does not go round with the blade is smooth in age."""
    settings = model.settings
    if settings.stretch == 1:
        return nodes
    round_, back = (np.exp(1j * f * v) for f, v in ((1, settings.filament_ages), (-1, settings.segment_ages)))
    table = settings.far_segments.table
    turned = back[:, None] * table * round_
    x, y = nodes[..., 0], nodes[..., 1]
    turn = np.real(turned), np.imag(turned)
    (xc, xs), (yc, ys) = ([v @ t.T for t in turn] for v in (x, y))
    return jnp.stack([xc - ys, xs + yc, nodes[..., 2] @ table.T], axis=-1)


def bound_vortex(model: FreeWake, gamma: Float[Array, " R"]) -> Segments:
    """Lifting line of one slice, with a core of about half a chord (it stands for a blade, not for a line)."""
    core = model.settings.bound_core_chords * model.chords
    return Segments(model.leading[:-1], model.leading[1:], gamma, core)


def _segments(start, end, strength, core) -> Segments:
    strength = strength.ravel()
    return Segments(start.reshape(-1, 3), end.reshape(-1, 3), strength, jnp.broadcast_to(core, strength.shape))
