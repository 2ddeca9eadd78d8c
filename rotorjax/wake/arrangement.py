"""Where the rotors of several stand, how they turn and lean, and that their disks keep apart."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from rotorjax.checks import refuse, shown

NEAREST = 0.02
"""Least distance of two disks on one shaft, over R."""

STEEPEST = 60.0
"""Most that a shaft leans, degrees: beyond it a wake of hover runs along the ground that a rotor stands over."""


def places_of(places: Sequence[Sequence[float]]) -> Float[np.ndarray, "N 3"]:
    """Hubs over R. Raises InputError where they are not (N, 3) finite numbers."""
    place = np.array(places, float)
    if place.ndim != 2 or place.shape[1] != 3 or len(place) < 1 or not np.all(np.isfinite(place)):
        raise refuse("places", "be finite and of shape (N, 3)", f"of shape {place.shape}")
    return place


def senses_of(senses: Sequence[int] | None, count: int) -> Float[np.ndarray, " N"]:
    """1 for each rotor that turns counter-clockwise, −1 for one that does not; in turns where nothing is said.

    Raises InputError for other numbers or another count.
    """
    sense = np.array([1 - 2 * (i % 2) for i in range(count)] if senses is None else senses, float)
    if sense.shape != (count,) or not np.all(np.abs(sense) == 1):
        raise refuse("senses", f"hold {count} numbers, 1 (counter-clockwise) or -1", shown(senses))
    return sense


def tilts_of(tilts_deg: Sequence[Sequence[float]] | None, count: int) -> Float[np.ndarray, "N 2"]:
    """Lean of each shaft forward and to starboard, rad; upright where nothing is said.

    Raises InputError where they are not (N, 2) numbers within STEEPEST.
    """
    tilts = np.zeros((count, 2)) if tilts_deg is None else np.array(tilts_deg, float)
    if tilts.shape != (count, 2) or not np.all(np.abs(tilts) <= STEEPEST):
        rule = f"be of shape ({count}, 2), degrees forward and to starboard, within ±{STEEPEST:g}"
        raise refuse("tilts_deg", rule, shown(tilts_deg))
    return np.deg2rad(tilts)


def axes_of(tilts: Float[np.ndarray, "N 2"], senses: Float[np.ndarray, " N"]) -> Float[np.ndarray, "N 3 3"]:
    """Each rotor's own axes as columns: to starboard about x first, then forward about y; y mirrored for sense −1.

    >>> axes_of(np.deg2rad([[90.0, 0.0], [0.0, 90.0]]), np.ones(2))[..., 2].round(12).tolist()  # the shafts
    [[-1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]
    """
    (c, s), (d, t) = ((np.cos(a), np.sin(a)) for a in tilts.T)
    o = np.zeros_like(c)
    forward = np.stack([c, o, -s, o, o + 1, o, s, o, c], axis=-1).reshape(-1, 3, 3)
    starboard = np.stack([o + 1, o, o, o, d, t, o, -t, d], axis=-1).reshape(-1, 3, 3)
    return forward @ starboard * np.stack([o + 1, senses, o + 1], axis=-1)[:, None]


def check_apart(places: Float[np.ndarray, "N 3"], shafts: Float[np.ndarray, "N 3"]) -> None:
    """Refuse disks that have a point in common, and disks of one shaft nearer than NEAREST."""
    for i in range(len(places)):
        for j in range(i):
            if _meet(places[i] - places[j], shafts[i], shafts[j]):
                raise refuse(
                    "places",
                    "keep the disks apart",
                    f"such that rotors {j} and {i} at {places[j].tolist()} and {places[i].tolist()} overlap: move one "
                    f"by 2 R, or by {NEAREST:g} R along its shaft",
                )


def _meet(apart: np.ndarray, shaft: np.ndarray, other: np.ndarray) -> bool:
    """Whether two disks `apart` from each other meet: along the line in which their planes cut each other, each covers
    the chord about the point nearest to its hub.
    """
    line = np.cross(shaft, other)
    if np.linalg.norm(line) < 1e-9:
        along = apart @ shaft
        return bool(np.linalg.norm(apart - along * shaft) < 2 and abs(along) < NEAREST)
    line /= np.linalg.norm(line)
    # the one hub is the origin, the other at −apart: a point that lies in both planes
    point = np.linalg.solve(np.stack([shaft, other, line]), np.array([0.0, -apart @ other, 0.0]))
    here, there = -point, -apart - point
    chords = [1 - hub @ hub + (hub @ line) ** 2 for hub in (here, there)]
    if min(chords) < 0:
        return False
    return bool(abs(here @ line - there @ line) < np.sum(np.sqrt(chords)))
