"""From a periodic model of thousands of states to one of a hundred, the blades' states kept as they are.

What pulses of the inputs leave behind and what the outputs look back at, over a few revolutions and from every azimuth
of a passage, are roots of the two Gramians; their product's leading directions balance them (Rowley 2005,
doi:10.1142/S0218127405012429), found from random mixtures of its columns (Halko et al. 2011, doi:10.1137/090771806).
Differential states are balanced by themselves, so that the model still repeats after a passage but for their sign.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from rotorjax.linearisation.rotor import signs, unfolded
from rotorjax.ode.labels import NO_UNIT
from rotorjax.ode.models import PeriodicModel
from rotorjax.ode.reduction import even
from rotorjax.ode.repeated import Repeated

STATES = 100
"""Of the wake, at most."""
TURNS = 2.25
"""Revolutions that pulses are followed: as long as a wake takes to leave."""
MIXTURES = 9
"""Of the outputs, looked at from each azimuth."""
EVERY = 2
"""Steps of the march from one look to the next."""
SPARE, POWERS = 40, 2
"""More random vectors than states, and how often they are sharpened."""
WAKE = "wake"


def repeated(part: PeriodicModel) -> Repeated:
    """A rotor's model over a passage as one of the whole revolution."""
    return Repeated(part, signs(part.states), signs(part.outputs))


class Condensed(NamedTuple):
    """model: over a revolution, the blades' states first. basis (n, r): what its states are of all states' motion."""

    model: PeriodicModel
    basis: Float[np.ndarray, "n r"]


def condensed(
    model: Repeated,
    blades: int,
    gains: Float[np.ndarray, "q m"],
    states: int = STATES,
    shares: tuple[int, int] | None = None,
) -> Condensed:
    """The model with `states` of the wake.

    gains: largest values of the outputs' steps, by which both are evened. shares: of the wake's states those that are
    not differential and those that are, found by their weight by default. What grows from passage to passage weighs as
    much as it has grown: the model is for TURNS revolutions then.
    """
    kept = np.array([k for k, name in enumerate(model.part.states) if name.startswith(("beta_", "lag_"))])
    rest = np.setdiff1d(np.arange(model.part.order), kept)
    reach, see = _snapshots(model, max(1, round(TURNS * blades)), gains)
    bases = [_balanced(reach, see, rest[model.signs[rest] == sign], states) for sign in (1.0, -1.0)]
    least = np.sort(np.concatenate([size for *_, size in bases]))[::-1][:states][-1]
    counts = [int(np.sum(size >= least)) for *_, size in bases] if shares is None else shares
    right, left, names = [np.eye(model.part.order)[:, kept]], [np.eye(model.part.order)[:, kept]], []
    for (v, w, _), count, mark in zip(bases, counts, ("", "_D"), strict=True):
        right, left = [*right, v[:, :count]], [*left, w[:, :count]]
        names += [f"{WAKE}{mark}[{i}]" for i in range(count)]
    named = tuple(model.part.states[k] for k in kept) + tuple(names)
    units = tuple(model.part.state_units[k] for k in kept) + (NO_UNIT,) * len(names)
    v, w = np.concatenate(right, axis=1), np.concatenate(left, axis=1).T
    small = {"a": w @ model.part.a @ v, "b": w @ model.part.b, "c": model.part.c @ v, "x": model.part.x @ w.T}
    return Condensed(unfolded(replace(model.part, **small, states=named, state_units=units), blades), v)


def shares_of(states: tuple[str, ...]) -> tuple[int, int]:
    """How many of a condensed model's states are the wake's, and how many of it differential."""
    return sum(s.startswith(f"{WAKE}[") for s in states), sum(s.startswith(f"{WAKE}_D[") for s in states)


def aligned(found: Sequence[Condensed]) -> list[PeriodicModel]:
    """Models of several flights with states that mean the same in all of them.

    Coordinates in the directions that all their bases have most in common (Panzer et al. 2010,
    doi:10.1524/auto.2010.0844), the wake's and the differential ones each among themselves. Bases of one
    shape. Between flights far apart the matrices are not to be interpolated all the same.
    """
    states = found[0].model.states
    turns = [np.eye(len(states)) for _ in found]
    for mark in (f"{WAKE}[", f"{WAKE}_D["):
        members = np.array([k for k, name in enumerate(states) if name.startswith(mark)], int)
        own = [np.linalg.qr(one.basis[:, members])[0] for one in found]
        common = np.linalg.svd(np.concatenate(own, axis=1), full_matrices=False)[0][:, : members.size]
        for turn, one in zip(turns, found, strict=True):
            turn[np.ix_(members, members)] = common.T @ one.basis[:, members]
    return [_turned(one.model, turn) for one, turn in zip(found, turns, strict=True)]


def _turned(model: PeriodicModel, t: Float[np.ndarray, "r r"]) -> PeriodicModel:
    """The model of the states T x."""
    back = np.linalg.inv(t)
    return replace(model, a=t @ model.a @ back, b=t @ model.b, c=model.c @ back, x=model.x @ t.T)


def _snapshots(model: Repeated, parts: int, gains: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """What pulses leave behind (n, S) and what mixtures of the outputs see (n, T)."""
    rows, columns = even(gains)
    rng = np.random.default_rng(0)
    mix = rng.normal(size=(model.steps // EVERY, rows.size, min(MIXTURES, rows.size))) / rows[:, None]
    reach = np.concatenate(list(model.pulses(parts, 1 / columns, EVERY)), axis=1)
    return reach, np.concatenate(list(model.readings_back(parts, mix, EVERY)), axis=1)


def _balanced(
    reach: np.ndarray, see: np.ndarray, members: Int[np.ndarray, " N"], most: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Directions V and W (n, r) within some states, WᵀV = 1, and their singular values (r,), the largest first."""
    x, y = reach[members], see[members]
    if not members.size:
        return np.zeros((len(reach), 0)), np.zeros((len(reach), 0)), np.zeros(0)
    probe = np.random.default_rng(0).normal(size=(x.shape[1], min(most + SPARE, members.size)))
    found = np.linalg.qr(y.T @ (x @ probe))[0]
    for _ in range(POWERS):
        found = np.linalg.qr(y.T @ (x @ np.linalg.qr(x.T @ (y @ found))[0]))[0]
    u, size, vt = np.linalg.svd((x.T @ (y @ found)).T, full_matrices=False)
    kept = np.flatnonzero(size > 1e-12 * size[0])[:most]
    right, left = np.zeros((len(reach), kept.size)), np.zeros((len(reach), kept.size))
    root = np.sqrt(size[kept])
    right[members], left[members] = x @ vt[kept].T / root, y @ (found @ u[:, kept]) / root
    return right, left, size[kept]
