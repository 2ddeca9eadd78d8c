"""The march of a rotor over ground (`over_ground.py`) along given inputs, from a trimmed state or any other.

The rule is explicit, and flapping bounds its step: the tip-path plane's fast tilt turns at about two per rev, damped by
γ/16. With 16 steps a turn it stays bounded down to a Lock number γ of 2, with 12 down to 4.
"""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from rotorjax.deck.over_ground import DeckControls, DiskState, Output, OverGround, output, rhs
from rotorjax.errors import InputError
from rotorjax.potential.moving_ground import require_increasing


class History(NamedTuple):
    """States and outputs at the instants psi (T,)."""

    psi: Float[Array, " T"]
    states: DiskState
    outputs: Output


@eqx.filter_jit
def simulate(
    model: OverGround, start: DiskState, psi: Float[Array, " T"], inputs: DeckControls, save_every: int = 1
) -> History:
    """March from psi[0] with inputs linear between the instants, one midpoint step (second order) an interval.

    start: state at psi[0]. inputs: leading axis T. save_every: keep every that many instants. Raises InputError where
    the instants do not increase, the shapes differ, or save_every does not divide T − 1.
    """
    if inputs.climb.shape != psi.shape or psi.ndim != 1 or psi.size < 2:
        raise InputError(
            f"Arguments `psi` and `inputs` must share their instants, at least 2, but have shapes {psi.shape} and "
            f"{inputs.climb.shape}"
        )
    if save_every < 1 or (psi.size - 1) % save_every:
        raise InputError(f"Argument `save_every` must divide the {psi.size - 1} intervals, but is {save_every}")
    require_increasing("psi", psi)

    def step(state: DiskState, row: tuple[Array, DeckControls, DeckControls]) -> tuple[DiskState, None]:
        h, first, last = row
        middle = jax.tree.map(lambda p, q: (p + q) / 2, first, last)
        half = _moved(state, rhs(h, state, first, model), h / 2)
        return _moved(state, rhs(h, half, middle, model), h), None

    def stretch(state: DiskState, rows: tuple) -> tuple[DiskState, DiskState]:
        state = jax.lax.scan(step, state, rows)[0]
        return state, state

    first, last = (jax.tree.map(lambda v, s=s: v[s], inputs) for s in (slice(None, -1), slice(1, None)))
    rows = jax.tree.map(lambda v: v.reshape(-1, save_every, *v.shape[1:]), (jnp.diff(psi), first, last))
    states = jax.lax.scan(stretch, start, rows)[1]
    states = jax.tree.map(lambda one, rest: jnp.concatenate([one[None], rest]), start, states)
    kept, instants = jax.tree.map(lambda v: v[::save_every], (inputs, psi))
    outputs = jax.lax.map(lambda pair: output(psi[0], pair[0], pair[1], model), (states, kept))
    return History(instants, states, outputs)


def _moved(state: DiskState, rate: DiskState, h: Array) -> DiskState:
    return jax.tree.map(lambda x, x_dot: x + h * x_dot, state, rate)
