"""Grid: what C_T changes by from the default to twice the default in panels, ages and free turns."""

import numpy as np
from matplotlib.figure import Figure

from rotorjax.bench.plotting import FREE_WAKE, INK, new_figure, style
from rotorjax.validation.case import Comparison, Subject, ValidationCase, Wakes
from rotorjax.validation.point import Point, point
from rotorjax.validation.row import Against, Row, relative
from rotorjax.wake.settings import quick_settings, wake_settings

NAME = "grid"
COARSE = Against("C_T with the settings of all other rows", "the solver's tolerance, 1e-7", "the aim set for this wake")
WORDS = {"panels": "panels", "age_step_deg": "age step", "free_turns": "free turns"}


def points(subject: Subject) -> tuple[Point, ...]:
    """One rotor in hover with the default wake, and with each number of it refined alone."""
    (base,) = subject.hovers(point("caradonna_tung"))
    return (base, *(point(base.rotor, base.collective_deg, None, **{n: v}) for n, v in refined(subject.quick).items()))


def refined(quick: bool) -> dict[str, float]:
    """Twice the panels, half the age step, twice the free turns."""
    default = (quick_settings if quick else wake_settings)()
    return {
        "panels": 2 * default.panels,
        "age_step_deg": default.age_step_deg / 2,
        "free_turns": 2 * default.free_turns,
    }


def compare(subject: Subject, wakes: Wakes) -> Comparison:
    """Rows and picture."""
    return Comparison(rows(subject, wakes), lambda: draw(subject, wakes))


def rows(subject: Subject, wakes: Wakes) -> list[Row]:
    """Change of C_T, each less than 1 %."""
    base, *finer = points(subject)
    limits = relative(0.01, wakes[base].CT)
    found = []
    for at in finer:
        name, value = at.changes[0]
        found.append(Row(NAME, f"C_T with {WORDS[name]} {value:g}, {base.label}", wakes[at].CT, limits, COARSE))
    return found


def draw(subject: Subject, wakes: Wakes) -> Figure:
    """Change of C_T by each refinement."""
    base, *finer = points(subject)
    changes = [100 * (wakes[at].CT / wakes[base].CT - 1) for at in finer]
    names = [f"{WORDS[at.changes[0][0]]}\n{at.changes[0][1]:g}" for at in finer]
    with style():
        figure = new_figure(5.5, 3.6)
        axes = figure.add_subplot()
        axes.axhspan(-1, 1, color=INK, alpha=0.08, lw=0, label="allowed")
        axes.bar(np.arange(len(finer)), changes, 0.5, color=FREE_WAKE, zorder=3)
        axes.axhline(0, color=INK, lw=0.8)
        axes.set_xticks(np.arange(len(finer)), names)
        axes.set(ylabel=r"change of $C_T$, %", title=f"{base.rotor}, {base.collective_deg:g}°")
        axes.legend(loc="best")
    return figure


CASE = ValidationCase(NAME, "Grid", points, compare)
