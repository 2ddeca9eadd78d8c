"""Where the far filaments have their nodes in wake age: short steps while the wake is young, then longer ones.

Steps of one length from the release on, then a smooth growth over half a turn's number of steps, then `stretch` times
that length up to the end, two turns or more of it. Age is a smooth function ζ(s) of a node's number, so differences in
s, of equal spacing, keep their order: ∂/∂ζ = (dζ/ds)⁻¹ ∂/∂s.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

LAST = 2
"""Whole turns of steps of one length at the end: the closure repeats the last one by what it differs from the other."""


class AgeGrid(NamedTuple):
    """Ages of nodes 0 … A over the young step, from 0 on, and dζ/ds at them, over the young step."""

    nodes: Float[np.ndarray, " A+1"]
    spacing: Float[np.ndarray, " A+1"]


def growth(turn: int) -> int:
    """How many steps the growth takes: about half of those of a turn, and an even number."""
    return 2 * round(turn / 4)


def least(turn: int, stretch: int) -> int:
    """Least length, in young steps, that has room for the growth and two turns of long steps."""
    return growth(turn) * (1 + stretch) // 2 + LAST * turn


def age_grid(length: int, turn: int, stretch: int) -> AgeGrid:
    """Grid over `length` young steps, `turn` of them in a turn, the last `stretch` times as long.

    >>> age_grid(90, 24, 2).nodes[-2:]
    array([88., 90.])
    """
    if stretch == 1:
        return AgeGrid(np.arange(length + 1.0), np.ones(length + 1))
    grown = growth(turn)
    spare = length - grown * (1 + stretch) // 2 - LAST * turn
    young = min(spare, turn)
    young += (spare - young) % stretch
    t = np.arange(grown + 1) / grown
    # from 1 to `stretch` as a quintic with two derivatives of 0 at both ends
    rate = 1 + (stretch - 1) * t**3 * (10 - 15 * t + 6 * t**2)
    way = young + grown * (t + (stretch - 1) * t**4 * (2.5 - 3 * t + t**2))
    old = (length - round(way[-1])) // stretch
    nodes = [np.arange(young), way, round(way[-1]) + stretch * np.arange(1, old + 1)]
    return AgeGrid(np.concatenate(nodes), np.concatenate([np.ones(young), rate, np.full(old, float(stretch))]))


class Halved(NamedTuple):
    """Ages of the ends of segments no longer than about a young step, and the table [P+1, A+1] that reads values there
    off those at the nodes, by cubics in s; it has a row for each node too, the numbers of which are `own`.
    """

    nodes: Float[np.ndarray, " P+1"]
    table: Float[np.ndarray, "P+1 A+1"]
    own: Int[np.ndarray, " A+1"]


def halved(grid: AgeGrid) -> Halved:
    """Segments of a grid, those much longer than a young step in two halves."""
    count, long = len(grid.nodes), np.flatnonzero(np.diff(grid.nodes) > LONG)
    middles = np.zeros((len(long), count))
    for row, left in zip(middles, long, strict=True):
        first = int(np.clip(left - 1, 0, count - 4))
        row[first : first + 4] = CUBIC[left - first]
    order = np.argsort(np.concatenate([np.arange(count), long + 0.5]), kind="stable")
    table = np.concatenate([np.eye(count), middles])[order]
    return Halved(table @ grid.nodes, table, np.argsort(order)[:count])


LONG = 1.5
"""Young steps above which a segment is halved."""

CUBIC = np.array([[5, 15, -5, 1], [-1, 9, 9, -1], [1, -5, 15, 5]]) / 16
"""Weights of four equidistant values at the middle of their first, second and third interval."""
