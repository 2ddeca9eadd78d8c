"""The coaxial pair of NACA TN 2318 over collective: polar, thrust sharing and induced power beside momentum theory, and
the measured points that a user has.

Momentum theory: two disks in one plane share one slipstream. With the lower rotor in the upper one's contracted far
wake (half of its disk in air at 2v_u), mass and momentum and energy between far above and far below give, with s the
lower disk's mean flow over v_u and τ = T_l/T_u (Leishman & Syal 2008, doi:10.4050/JAHS.53.11, for τ = 1),

    s w = 2(1 + τ),    2τ s = s w²/2 − 2.
"""

import csv
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from matplotlib.figure import Figure

from rotorjax.bench.plotting import FREE_WAKE, INK, VPBFSM, legend_below, new_figure, style
from rotorjax.checks import closest, number_of, shown
from rotorjax.errors import InputError
from rotorjax.io.reading import read_text
from rotorjax.validation.case import Comparison, Subject, ValidationCase, Wakes
from rotorjax.validation.point import Point, point
from rotorjax.validation.row import Against, Row, between, relative
from rotorjax.wake.several import several_wakes
from rotorjax.wake.several_solution import SeveralSolution, solve_several

NAME, ROTOR, SPACING = "coaxial", "tn2318_2", 0.19
COLLECTIVES = (5.0, 7.0, 9.0, 11.0)
KINDS = ("single", "pair")
COLUMNS = ("rotors", "CT", "CQ")
BALANCED = 0.01
"""Difference of the two torques, over the upper one, at which they count as equal."""
MOST = 6
"""Pairs solved for one balance."""
MOMENTUM = Against(
    "momentum theory, in one plane and with the lower rotor in the upper one's far wake",
    "uniform inflow on both disks",
    "0.19 R lies between the two",
)
MEASURED = Against("the user's points, `--measured`", "theirs", "the aim set for this wake, as for the other polars")


class Balanced(NamedTuple):
    """A pair whose rotors take the same torque. gap: by how much they do not, over the upper one's. more: degrees of
    the lower rotor's pitch beyond the upper one's.
    """

    pair: SeveralSolution
    gap: float
    more: float


def far_flow(ratio: float) -> float:
    """Mean flow s through the lower disk over the upper one's, in its far wake; ratio: τ = T_l/T_u.

    >>> bool(abs((1 + far_flow(1.0)) / 2 - 1.281) < 5e-4)  # the pair's induced power over that of two alone
    True
    """
    return (np.sqrt(1 + 4 * ratio * (1 + ratio) ** 2) - 1) / (2 * ratio)


def far_balance() -> float:
    """Share of the upper rotor in the thrust where τ s = 1: equal powers in its far wake. τ (1 + τ)² = 2."""
    return 1 / (1 + float(np.real(np.roots([1, 2, 1, -2])[-1])))


def read_measured(path: str | Path) -> dict[str, list[tuple[float, float]]]:
    """Points (C_T, C_Q) by what they were measured on, `single` or `pair`, of a CSV file with COLUMNS.

    C_T = T/(ρA(ΩR)²) with the area of one disk; a pair's numbers are of both rotors together. Raises InputError, naming
    the line, for other columns, other words and what is no positive number.
    """
    lines = [(i, line) for i, line in enumerate(read_text(path).splitlines(), 1) if line.split("#")[0].strip()]
    head = [word.strip() for word in next(csv.reader([lines[0][1]]))] if lines else []
    if sorted(head) != sorted(COLUMNS):
        raise InputError(f"{path}: the first line must be {','.join(COLUMNS)}, but is {shown(','.join(head))}")
    found: dict[str, list[tuple[float, float]]] = {kind: [] for kind in KINDS}
    for i, line in lines[1:]:
        row = dict(zip(head, (word.strip() for word in next(csv.reader([line]))), strict=False))
        if row.get("rotors") not in KINDS:
            word = row.get("rotors", "")
            raise InputError(
                f"{path}, line {i}: rotors must be single or pair, but is {word!r}: {closest(word, KINDS)}"
            )
        numbers = [number_of(_float(row.get(name, ""))) for name in ("CT", "CQ")]
        if not all(0 < value < 0.1 for value in numbers):
            raise InputError(
                f"{path}, line {i}: CT and CQ must be numbers in (0, 0.1), but are {row.get('CT')}, {row.get('CQ')}"
            )
        found[row["rotors"]].append((numbers[0], numbers[1]))
    if not any(found.values()):
        raise InputError(f"{path}: the file must hold one point or more, but holds none")
    return found


def _float(word: str) -> float:
    try:
        return float(word)
    except ValueError:
        return float("nan")


def points(subject: Subject) -> tuple[Point, ...]:
    """The rotor alone at four collectives."""
    return tuple(point(ROTOR, collective) for collective in COLLECTIVES)


def compare(subject: Subject, wakes: Wakes) -> Comparison:
    """Rows and picture; the pairs are solved here, each from the one before."""
    pairs = balanced_pairs(points(subject), subject.quick)
    found = polar(subject, wakes, pairs)
    return Comparison(
        [*momentum_rows(subject, wakes, pairs), *measured_rows(subject, found)], lambda: draw(subject, found)
    )


def balanced_pairs(tasks: Sequence[Point], quick: bool) -> list[Balanced]:
    """The pair at each mean collective, each from the one before."""
    found: list[Balanced] = []
    for task in tasks:
        found.append(balanced(task, quick, found[-1] if found else None))
    return found


def balanced(task: Point, quick: bool, near: Balanced | None) -> Balanced:
    """The pair at a mean collective, the lower rotor's pitch moved by the secant rule until torques are equal."""
    settings = task.settings(quick)
    pair, more, before = (None, 0.5, None) if near is None else (near.pair, near.more, None)
    for _ in range(MOST):
        pitches = task.collective_deg + 0.5 * more * np.array([-1.0, 1.0])
        model = several_wakes(
            settings.rotor,
            settings.operating,
            [(0, 0, 0), (0, 0, -SPACING)],
            settings=settings.wake,
            collectives_deg=pitches,
        )
        pair = solve_several(model, pair)
        here = Balanced(pair, float(pair.CP[1] / pair.CP[0] - 1), more)
        if abs(here.gap) < BALANCED or not pair.converged:
            break
        step = 0.5 if before is None else -here.gap * (more - before.more) / (here.gap - before.gap)
        before, more = here, more + float(np.clip(step, -2, 2))
    return here


def polar(subject: Subject, wakes: Wakes, pairs: Sequence[Balanced]) -> dict[str, np.ndarray]:
    """C_T and C_Q (N, 2) of the single rotor and of both together, of what converged."""
    alone = [wakes[at] for at in points(subject)]
    single = [(one.CT, one.CP) for one in alone if one.converged]
    both = [(float(b.pair.CT.sum()), float(b.pair.CP.sum())) for b in pairs if b.pair.converged]
    return {"single": np.array(single).reshape(-1, 2), "pair": np.array(both).reshape(-1, 2)}


def momentum_rows(subject: Subject, wakes: Wakes, pairs: Sequence[Balanced]) -> list[Row]:
    """Induced power over that of two rotors alone, each with half of the thrust, and the upper one's share of it."""
    rows, far = [], far_balance()
    factor = (far**1.5 + (1 - far) * far_flow(1 / far - 1) * far**0.5) / 2 / 0.5**1.5
    for at, (pair, gap, _) in zip(points(subject), pairs, strict=True):
        single, nan = wakes[at], float("nan")
        thrust, ok = float(pair.CT.sum()), pair.converged and abs(gap) < BALANCED
        alone = 2 * single.CP_induced * (thrust / 2 / single.CT) ** 1.5
        note = "" if ok else f"pair: {pair.why}, torques differ by {100 * gap:.1f} %"
        ratio, share = float(pair.CP_induced.sum()) / alone, float(pair.CT[0]) / thrust
        where = f"at {at.collective_deg:g}°"
        rows += [
            Row(NAME, f"induced power over two rotors', {where}", ratio if ok else nan, between(factor, np.sqrt(2)),
                MOMENTUM, note),
            Row(NAME, f"upper rotor's share of the thrust, {where}", share if ok else nan, between(0.5, far), MOMENTUM,
                note),
        ]  # fmt: skip
    return rows


def measured_rows(subject: Subject, found: dict[str, np.ndarray]) -> list[Row]:
    """C_Q at each measured C_T within 6 %; it is linear in C_T^1.5 but for the sections' drag."""
    rows = []
    for kind, rows_of in (subject.measured or {}).items():
        ours = found[kind]
        for thrust, torque in rows_of:
            inside = len(ours) > 1 and ours[0, 0] <= thrust <= ours[-1, 0]
            value = float(np.interp(thrust**1.5, ours[:, 0] ** 1.5, ours[:, 1])) if inside else float("nan")
            note = "" if inside else "C_T beyond the collectives that are solved"
            rows.append(Row(NAME, f"C_Q at C_T = {thrust:.5g}, {kind}", value, relative(0.06, torque), MEASURED, note))
    return rows


def draw(subject: Subject, found: dict[str, np.ndarray]) -> Figure:
    """C_T over C_Q of both, with the user's points."""
    labels = {"single": "single rotor", "pair": "pair, equal torques"}
    with style():
        figure = new_figure(6.5, 4.4)
        axes = figure.add_subplot()
        for (kind, label), colour in zip(labels.items(), (VPBFSM, FREE_WAKE), strict=True):
            axes.plot(found[kind][:, 1], found[kind][:, 0], "o-", color=colour, label=label)
            if given := (subject.measured or {}).get(kind):
                thrust, torque = np.array(given).T
                axes.plot(torque, thrust, "s", mfc="none", mec=colour, color=INK, label=f"measured, {kind}")
        axes.set(xlabel="$C_Q$", ylabel="$C_T$", title=f"Coaxial rotors {SPACING:g} R apart")
        legend_below(axes, 2)
    return figure


CASE = ValidationCase(NAME, "The coaxial pair of NACA TN 2318", points, compare)
