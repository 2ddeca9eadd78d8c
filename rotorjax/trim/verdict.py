"""What a trim is worth, in one word and in units that a user understands."""

from dataclasses import dataclass, replace
from typing import Literal

import jax
import jax.numpy as jnp
import numpy as np

from rotorjax.ode.linear import Krylov
from rotorjax.ode.outcome import flat_residual, ravelled, traceable, unravelled
from rotorjax.trim.free_wake import InWake, WakeTrim, passed, residual
from rotorjax.trim.in_wake import TrimmedInWake
from rotorjax.trim.means import means
from rotorjax.trim.solve import Trimmed
from rotorjax.wake.equilibrium import displacement

Word = Literal["converged", "stalled", "no solution"]

PASSES = 2
"""Of the wake through its own velocities, over which loads are watched; each is several revolutions of transport."""

USEFUL = 0.01
"""Relative change of C_T or C_P in these passes above which a stalled trim is none."""


@dataclass(frozen=True)
class Verdict:
    """word: "converged"; "stalled" where the loads hold within USEFUL all the same; "no solution". why: one sentence.

    load_change: largest relative change of C_T and C_P in PASSES passes of the wake through its own velocities; with an
    inflow model what is left of the equations (angles in rad, thrust over the wanted one). node_movement: rms way over
    R that the wake's nodes go in the first pass; None without a wake. damping: of the wake's highest harmonics over the
    azimuth, which slow flight may need (docs/free_wake.md).
    """

    word: Word
    why: str
    load_change: float
    node_movement: float | None
    damping: float = 0.0

    def __str__(self) -> str:
        """One sentence."""
        if self.node_movement is None:
            return f"{self.word if self.word == 'converged' else 'NO SOLUTION'}: {self.why}"
        moving = (
            f"loads change by {100 * self.load_change:.1g} % and nodes move by {self.node_movement:.1g} R as the wake "
            "goes on"
        )
        if self.word == "converged":
            how = f" with its highest harmonics damped (azimuth_damping = {self.damping:g})" if self.damping else ""
            return f"converged{how}: {moving}"
        if self.word == "stalled":
            return f"STALLED, but with loads good to about {100 * self.load_change:.1g} %: {moving}; {self.why}"
        return f"NO SOLUTION found: {self.why}; there {moving}"


def verdict(found: Trimmed | TrimmedInWake) -> Verdict:
    """Judge a trim."""
    outcome = found.outcome
    if isinstance(found, Trimmed):
        return Verdict("converged" if outcome.converged else "no solution", outcome.why, outcome.residual, None)
    change, moved = _watched(found)
    word: Word = "stalled" if change <= USEFUL else "no solution"
    damping = found.p.model.settings.azimuth_damping
    return Verdict("converged" if outcome.converged else word, outcome.why, change, moved, damping)


def _watched(found: TrimmedInWake) -> tuple[float, float]:
    """Change of loads and movement of nodes as the wake goes on."""
    first, z, change, moved = means(found), found.z, 0.0, 0.0
    for number in range(PASSES):
        step = _step(z, found.p)
        moved = moved if number else displacement(step.wake)
        z = jax.tree.map(jnp.add, z, step)
        then = means(replace(found, z=z))
        change = max(change, abs(then.CT / first.CT - 1), abs(then.CQ / first.CQ - 1))
    return change, moved


def _step(z: InWake, p: WakeTrim) -> InWake:
    """The residual, by the program that the search has compiled anyway: Newton's in hover, that of passes in a wind."""
    flat, unravel = ravelled(z)
    if z.flap.shape[0] == 1:
        value = Krylov().at(residual, unravel, flat, traceable((p,)))[0]
    else:
        value = flat_residual(passed, unravel, flat, traceable((p,))) - flat
    return unravelled(unravel, np.asarray(value))
