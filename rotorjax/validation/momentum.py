"""Momentum theory over a range of thrust: mean inflow and induced power in hover."""

from collections.abc import Callable

import numpy as np
from matplotlib.figure import Figure

from rotorjax.plotting import FREE_WAKE, INK, VPBFSM, new_figure, style
from rotorjax.validation import reference
from rotorjax.validation.case import Comparison, Subject, ValidationCase, Wakes
from rotorjax.validation.point import Point, point
from rotorjax.validation.row import Against, Row, between, relative
from rotorjax.wake.solution import Solution

NAME = "momentum"
MEAN = Against(
    "momentum theory, uniform inflow", "exact where the inflow is uniform, which it is not", "the aim set for this wake"
)
POWER = Against(
    "momentum theory, ideal induced power",
    "none: no actuator disk without swirl needs less than 1",
    "the aim set for this wake",
)
LOWEST, HIGHEST = 0.002, 0.010
"""C_T between which momentum theory is asked for."""
SWEEP = {"uh60": (18.0, 16.0, 14.0, 13.25, 20.0, 22.0), "caradonna_tung": (8.0, 5.0, 11.0, 13.0)}
QUICK = {"uh60": (18.0, 15.0, 21.0), "caradonna_tung": (8.0,)}


def points(subject: Subject) -> tuple[Point, ...]:
    """Collectives of the UH-60, twisted, and of Caradonna and Tung's rotor, untwisted."""
    sweep = QUICK if subject.quick else SWEEP
    return subject.hovers(*(point(rotor, c) for rotor, collectives in sweep.items() for c in collectives))


def compare(subject: Subject, wakes: Wakes) -> Comparison:
    """Rows and picture."""
    return Comparison(rows(subject, wakes), lambda: draw(subject, wakes))


def rows(subject: Subject, wakes: Wakes) -> list[Row]:
    """Mean inflow within 8 % of √(C_T/2) and induced power 1 to 1.25 times the ideal, from C_T = 0.002 to 0.010."""
    found = []
    for at in sorted(points(subject), key=lambda p: (p.rotor, p.collective_deg)):
        solution = wakes[at]
        if not LOWEST <= solution.CT <= HIGHEST and subject.rotor is None:
            continue
        where = f"{at.rotor} at {at.collective_deg:g}°, C_T = {solution.CT:.5f}"
        found.append(Row(NAME, f"mean inflow over √(C_T/2), {where}", _inflow(solution), relative(0.08, 1.0), MEAN))
        found.append(Row(NAME, f"induced power factor, {where}", _factor(solution), between(1.0, 1.25), POWER))
    return found


def draw(subject: Subject, wakes: Wakes) -> Figure:
    """Both ratios over thrust."""
    panels: tuple[tuple[str, Callable[[Solution], float], float, float], ...] = (
        (r"mean inflow over $\sqrt{C_T/2}$", _inflow, 0.92, 1.08),
        (r"induced power factor $\kappa$", _factor, 1.0, 1.25),
    )
    colours = {"uh60": FREE_WAKE, "caradonna_tung": VPBFSM}
    with style():
        figure = new_figure(10.0, 4.0)
        for axes, (name, ratio, low, high) in zip(figure.subplots(1, 2), panels, strict=True):
            axes.axhspan(low, high, color=INK, alpha=0.08, lw=0, label="allowed")
            axes.axhline(1, color=INK, lw=0.8)
            for rotor in dict.fromkeys(p.rotor for p in points(subject)):
                sweep = sorted((wakes[p].CT, ratio(wakes[p])) for p in points(subject) if p.rotor == rotor)
                axes.plot(*np.array(sweep).T, marker="o", color=colours.get(rotor, FREE_WAKE), label=rotor)
            axes.set(xlabel=r"$C_T$", ylabel=name)
        axes.legend(loc="best")
    return figure


def _inflow(solution: Solution) -> float:
    return solution.mean_inflow / reference.momentum_inflow(abs(solution.CT))


def _factor(solution: Solution) -> float:
    return reference.induced_power_factor(abs(solution.CT), solution.CP_induced)


KNOWN = (
    "Above C_T = 0.006 both ratios grow with thrust on both rotors. Caradonna and Tung's two untwisted blades have "
    "the higher ones at every thrust."
)
CASE = ValidationCase(NAME, "Momentum theory", points, compare, KNOWN)
