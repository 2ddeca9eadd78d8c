"""Modes of a linear rotor by name: coning, regressing and progressing flap and lag, inflow; who takes part in each."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from rotorjax.ode.hill import Exponents, exponents
from rotorjax.ode.models import PeriodicModel

FAMILIES = {"beta": "flap", "lag": "lag"}
"""By the first part of a state's name; all others are the inflow's."""
TELLING = 0.02
"""Participation from which on a state is told."""
LEAST = 0.1
"""Of the part that a coordinate takes in its leading mode: with less a mode is none of its own."""


@dataclass(frozen=True)
class RotorMode:
    """A mode, or a complex pair of them by the one of positive frequency. name: unique in its model. exponent: growth +
    i frequency per unit of time, as seen from the hub. shares: participation of the families. states: those of the
    leading ones.
    """

    name: str
    exponent: complex
    shares: dict[str, float]
    states: dict[str, float]

    @property
    def damping(self) -> float:
        """Damping ratio."""
        return -self.exponent.real / abs(self.exponent) if self.exponent else 0.0


def modes(model: PeriodicModel) -> tuple[RotorMode, ...]:
    """All modes of a rotor's model, the least damped first."""
    return named(exponents(model), model.states)


def named(
    found: Exponents, states: tuple[str, ...], known: Mapping[int, tuple[str, str]] | None = None
) -> tuple[RotorMode, ...]:
    """Name exponents by what takes part in them: a complex pair is one mode. known: what `called` says, by number of
    exponent, where the largest share is not to decide.
    """
    shown = [k for k, value in enumerate(found.values) if is_upper(value)]
    families = np.array([family_of(state) for state in states])
    chosen = []
    for k in shown:
        part = found.participation[:, k]
        shares = {family: float(part[families == family].sum()) for family in dict.fromkeys(families.tolist())}
        family, coordinate = (known or {}).get(k) or called(states, part, max(shares, key=lambda name: shares[name]))
        value = complex(found.values[k]) if _turns(found.values[k]) else complex(found.values[k].real)
        chosen.append((family, coordinate, value, shares, part))
    names = _names([(family, coordinate, value) for family, coordinate, value, _, _ in chosen])
    return tuple(
        RotorMode(name, value, shares, {states[i]: float(part[i]) for i in np.argsort(-part) if part[i] > TELLING})
        for name, (_, _, value, shares, part) in zip(names, chosen, strict=True)
    )


def called(states: tuple[str, ...], part: Float[np.ndarray, " n"], family: str) -> tuple[str, str]:
    """A family, and its multi-blade coordinate, or state of the inflow, that takes part most."""
    own = np.where([family_of(state) == family for state in states], part, 0.0)
    return family, states[int(np.argmax(own))] if family == "inflow" else _coordinate(states, own)


def numbered(found: Sequence[RotorMode]) -> list[RotorMode]:
    """Modes with names that occur once each."""
    counts: dict[str, int] = {}
    told = []
    for mode in found:
        counts[mode.name] = counts.get(mode.name, 0) + 1
        told.append(mode if counts[mode.name] == 1 else replace(mode, name=f"{mode.name} ({counts[mode.name]})"))
    return told


def blade_modes(found: Exponents, states: tuple[str, ...]) -> dict[int, tuple[str, str]]:
    """Which exponents are the blades', by family and multi-blade coordinate: as many as that has states at most, those
    in which it takes part most, by no less than `LEAST` of its largest part and at one of its own frequencies.

    A wake of a thousand states, far from normal, takes some part in everything, and more than all blades together: one
    of its modes may be shared by a coordinate as much as another coordinate's own.
    """
    groups: dict[tuple[str, str], list[int]] = {}
    for row, state in enumerate(states):
        if family_of(state) != "inflow":
            groups.setdefault((family_of(state), _coordinate_of(state)), []).append(row)
    upper = np.array([k for k, value in enumerate(found.values) if is_upper(value)])
    shares = {group: found.participation[rows][:, upper].sum(axis=0) for group, rows in groups.items()}
    frequencies, values = np.imag(found.values[upper]), found.values
    fits = {group: _fits(group, shares, frequencies) for group in groups}
    left = {group: len(rows) for group, rows in groups.items()}
    known: dict[int, tuple[str, str]] = {}
    pairs = [(group, at) for group in groups for at in np.flatnonzero(fits[group])]
    for group, at in sorted(pairs, key=lambda one: -shares[one[0]][one[1]]):
        k = int(upper[at])
        cost = 2 if _turns(values[k]) and np.isclose(values, values[k].conj(), rtol=1e-9).any() else 1
        if left[group] >= cost and k not in known:
            known[k] = group
            left[group] -= cost
    return known


def _fits(group: tuple[str, str], shares: Mapping[tuple[str, str], np.ndarray], frequencies: np.ndarray) -> np.ndarray:
    """Which modes may be a coordinate's: enough of it takes part, and a cyclic one turns as fast as a blade moves, more
    or less its order, as far as the differential or collective motion tells a blade's frequency.
    """
    family, coordinate = group
    enough = shares[group] >= LEAST * shares[group].max()
    alone = [shares[family, name] for name in ("D", "0") if (family, name) in shares]
    if coordinate in ("0", "D") or not alone:
        return enough
    blade, order = frequencies[np.argmax(alone[0])], int(coordinate)
    gaps = [np.abs(frequencies - abs(blade + turn)) for turn in (-order, order)]
    return enough & (np.minimum(*gaps) < 0.5)


def _turns(value: complex) -> bool:
    """Whether an exponent has a frequency, and not only what rounding leaves of none."""
    return abs(value.imag) > 1e-9 * (1 + abs(value))


def is_upper(value: complex) -> bool:
    """Whether it is the one of its pair that is told, or real; rounding gives that either sign."""
    return value.imag > 0 or not _turns(value)


def family_of(state: str) -> str:
    """Family of a state by its name."""
    return FAMILIES.get(state.partition("_")[0], "inflow")


def _coordinate(states: tuple[str, ...], part: np.ndarray) -> str:
    """The multi-blade coordinate, 0, 1, 2 … or D, that takes part most; cosine and sine go together."""
    totals: dict[str, float] = {}
    for state, weight in zip(states, part, strict=True):
        if weight:
            key = _coordinate_of(state)
            totals[key] = totals.get(key, 0.0) + float(weight)
    return max(totals, key=lambda key: totals[key])


def _coordinate_of(state: str) -> str:
    return state.split("_")[1].rstrip("cs")


def _names(found: list[tuple[str, str, complex]]) -> list[str]:
    """Regressing is the slower of two cyclic modes; more modes of one kind are counted."""
    groups: dict[tuple[str, str], list[int]] = {}
    for k, (family, coordinate, _) in enumerate(found):
        groups.setdefault((family, coordinate), []).append(k)
    names = [""] * len(found)
    for (family, coordinate), members in groups.items():
        slowest_first = sorted(members, key=lambda k: (abs(found[k][2].imag), -found[k][2].real))
        for place, k in enumerate(slowest_first):
            names[k] = _name(family, coordinate, place, len(members), abs(found[k][2].imag))
    return [_counted(name, names[:k]) for k, name in enumerate(names)]


def _name(family: str, coordinate: str, place: int, count: int, frequency: float) -> str:
    if family == "inflow":
        return f"inflow {coordinate}"
    if coordinate == "0":
        return "coning" if family == "flap" else "collective lag"
    if coordinate == "D":
        return f"differential {family}"
    order = "" if coordinate == "1" else f" {coordinate}"
    # one alone, whose partner the inflow has drowned, goes by what a blade's frequency of 0 … 2 makes of both
    last = frequency > 1 if count == 1 else place == count - 1 and (count == 2 or frequency > 0)
    return f"{'progressing' if last else 'regressing'} {family}{order}"


def _counted(name: str, before: list[str]) -> str:
    number = before.count(name) + 1
    return name if number == 1 else f"{name} ({number})"
