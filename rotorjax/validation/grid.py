"""Grid: what changes with twice the panels, ages or free turns, in free air, and with more turns near ground.

Near the ground it is C_T and mean inflow; over a slope also what the slope alone makes, the first harmonics.
"""

from collections.abc import Callable

import numpy as np
from matplotlib.figure import Figure

from rotorjax.bench.plotting import FREE_WAKE, INK, VPBFSM, new_figure, style
from rotorjax.validation.case import Comparison, Subject, ValidationCase, Wakes
from rotorjax.validation.measure import first_harmonic
from rotorjax.validation.point import Point, point
from rotorjax.validation.row import Against, Row, between, relative
from rotorjax.wake.settings import hover_settings, quick_settings
from rotorjax.wake.solution import Solution

NAME = "grid"
COARSE = Against(
    "the same with the settings of all other rows", "the solver's tolerance, 1e-7", "the aim set for this wake"
)
WORDS = {"panels": "panels", "age_step_deg": "age step", "free_turns": "free turns"}
HEIGHTS, SLOPED = (2.0, 1.5, 1.0, 0.75, 0.5), 1.0
SLOPES_DEG = (10.0, 20.0, 30.0)
"""Slopes over which first harmonics are compared, too."""
THRUST, INFLOW, HARMONIC = 0.007, 0.01, 0.1
"""Most that C_T, mean inflow and a first harmonic may change by, of themselves."""


def points(subject: Subject) -> tuple[Point, ...]:
    """All wakes once: each with the default settings, and with one number of them refined."""
    return tuple(dict.fromkeys(at for base, finer in pairs(subject) for at in (base, finer)))


def pairs(subject: Subject) -> list[tuple[Point, Point]]:
    """Wakes with the default settings beside the same with one number refined; near the ground, where the wake ends."""
    (free,) = subject.hovers(point("caradonna_tung"))
    found = [(free, _with(free, n, v)) for n, v in refined(subject.quick).items()]
    if subject.quick:
        return found
    (rotor,) = subject.hovers(point("uh60"))
    name, turns = "free_turns", refined(False)["free_turns"]
    grounds = [(None, 0.0), *((h, 0.0) for h in HEIGHTS), *((SLOPED, s) for s in SLOPES_DEG)]
    near = [Point(rotor.rotor, rotor.collective_deg, h, (), s) for h, s in grounds]
    return found + [(at, _with(at, name, turns)) for at in near]


def _with(at: Point, name: str, value: float) -> Point:
    return Point(at.rotor, at.collective_deg, at.height, ((name, value),), at.slope_deg)


def refined(quick: bool) -> dict[str, float]:
    """Twice the panels, half the age step, twice the free turns."""
    default = (quick_settings if quick else hover_settings)()
    return {
        "panels": 2 * default.panels,
        "age_step_deg": default.age_step_deg / 2,
        "free_turns": 2 * default.free_turns,
    }


def compare(subject: Subject, wakes: Wakes) -> Comparison:
    """Rows and picture."""
    return Comparison(rows(subject, wakes), lambda: draw(subject, wakes))


def rows(subject: Subject, wakes: Wakes) -> list[Row]:
    """Change of C_T below 0.7 %, of mean inflow below 1 %, of first harmonics over a slope below 10 %."""
    return [row for pair in pairs(subject) for row in _rows_of(*pair, wakes)]


def _rows_of(base: Point, finer: Point, wakes: Wakes) -> list[Row]:
    before, after = wakes[base], wakes[finer]
    name, value = finer.changes[0]
    where = f"with {WORDS[name]} {value:g}, {base.label}"
    found = [
        (f"C_T {where}", after.CT, relative(THRUST, before.CT)),
        (f"mean inflow {where}", after.mean_inflow, relative(INFLOW, before.mean_inflow)),
    ]
    if base.slope_deg:
        for of, field in FIRST.items():
            title = f"change of the first harmonic of {of}, of itself, {where}"
            found.append((title, harmonic_change(before, after, field), between(0, HARMONIC)))
    labels = base.label, finer.label
    return [Row(NAME, title, ours, limits, COARSE, wakes=labels) for title, ours, limits in found]


FIRST: dict[str, Callable[[Solution], np.ndarray]] = {"inflow": lambda s: s.inflow, "loading": lambda s: s.dct_dr}
"""What a slope gives a first harmonic over azimuth."""


def harmonic_change(before: Solution, after: Solution, field: Callable[[Solution], np.ndarray]) -> float:
    """By how much a first harmonic changes, cosine and sine together, over its size before."""
    one, other = (first_harmonic(s, field(s)) for s in (before, after))
    return abs(other - one) / abs(one)


def draw(subject: Subject, wakes: Wakes) -> Figure:
    """Change of C_T and mean inflow by each refinement; the first harmonic of inflow over slope, with both.

    What did not converge has its name and no bar or point.
    """
    found = pairs(subject)
    names = [f.label.replace(", ", "\n") + ("" if wakes[f].converged else "\nnot converged") for _, f in found]

    def read(at: Point, of: Callable[[Solution], float]) -> float:
        return of(wakes[at]) if wakes[at].converged else np.nan

    def first(wake: Solution) -> float:
        return abs(first_harmonic(wake, wake.inflow)) / wake.mean_inflow

    with style():
        figure = new_figure(12.0, 4.6)
        axes, slopes = figure.subplots(1, 2, width_ratios=(3, 1))
        axes.axhspan(-100 * THRUST, 100 * THRUST, color=INK, alpha=0.08, lw=0, label="allowed, $C_T$")
        at = np.arange(len(found))
        for shift, colour, label, of in (
            (-0.2, FREE_WAKE, r"$C_T$", lambda s: s.CT),
            (0.2, VPBFSM, "mean inflow", lambda s: s.mean_inflow),
        ):
            changes = [100 * (read(f, of) / read(b, of) - 1) for b, f in found]
            axes.bar(at + shift, changes, 0.4, color=colour, zorder=3, label=label)
        axes.axhline(0, color=INK, lw=0.8)
        axes.set_xticks(at, names, rotation=60, ha="right", fontsize=6)
        axes.set(ylabel="change, %")
        axes.legend(loc="best")
        for k, colour in ((0, FREE_WAKE), (1, VPBFSM)):
            sloped = [pair[k] for pair in found if pair[0].slope_deg]
            size = [read(p, first) for p in sloped]
            slopes.plot([p.slope_deg for p in sloped], size, "o-", color=colour, label=("default", "refined")[k])
        slopes.set(xlabel="slope, deg", ylabel="first harmonic of inflow over its mean")
        slopes.legend(loc="best")
    return figure


KNOWN = (
    "Four free turns end on the plane, the old ones in long steps and mixed, and repeated turns run out along it at "
    "a steady speed (docs/free_wake.md). Eight in their place change C_T by 0.01 % at h = 1, 0.3 % at 1.5, 0.2 % at "
    "0.75, over 30° of slope 0.4 %. First harmonics over a slope, 0.6 to 1.7 % of mean inflow, change by 0.1 to 0.3 % "
    "of it: by 36, 8 and 16 % of themselves over 10°, 20° and 30°, the loading's by 45, 6 and 24 %, nearly all of it "
    "the sine. Old turns run downhill along the plane and still count; over 10° eight still lower them. A jet whose "
    "edge gives way has no more than that 1 % (docs/theory/ground.md): a first harmonic from the ground fades by "
    "e^{-3.8 h}, h in radii of the wake, and what is asked for to a tenth of itself is the rest of opposite parts of "
    "13 to 27 %."
)
CASE = ValidationCase(NAME, "Grid", points, compare, KNOWN)
