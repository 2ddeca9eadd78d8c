"""Level ground: inflow at constant thrust against Hayden and Cheeseman-Bennett, thrust, and where the wake goes."""

from itertools import pairwise

import numpy as np
from matplotlib.figure import Figure

from rotorjax.bench.plotting import FREE_WAKE, INK, VPBFSM, new_figure, series_colours, style
from rotorjax.reference import published as reference
from rotorjax.validation.case import Comparison, Subject, ValidationCase, Wakes
from rotorjax.validation.measure import clearance, tip_path
from rotorjax.validation.point import Point, point
from rotorjax.validation.row import Against, Row, above_zero, absolute, between
from rotorjax.wake.solution import Solution

NAME = "ground"
HEIGHTS, QUICK = (0.5, 0.75, 1.0, 1.5, 2.0, 3.0), (1.0, 2.0)
NEAR = 1.0
"""Height over R up to which the tip vortex has to run out along the ground."""
FAR_EXCESS = 1 / 0.9926 - 1
"""By how much Hayden's formula exceeds 1 far from the ground."""
HAYDEN = Against(
    "Hayden, AHS 32nd Forum, 1976",
    "not stated; Cheeseman and Bennett's formula (ARC R&M 3021) beside it",
    "what the two formulas differ by, and 0.0075 by which Hayden's exceeds 1 far from the ground",
)
RISE = Against("ground effect", "none: a sign", "thrust rises as the ground comes near")
SOLID = Against("the ground is solid", "none: a sign", "no node may pass through it")
ALONG = Against(
    "the flow along the ground", "none: a direction", "the wake contracts first, then runs out beyond the disk"
)
OUTSIDE = between(1.0, np.inf)


def points(subject: Subject) -> tuple[Point, ...]:
    """One rotor out of ground effect, then from the highest place down."""
    (free,) = _free(subject)
    heights = sorted(QUICK if subject.quick else HEIGHTS, reverse=True)
    return (free, *(Point(free.rotor, free.collective_deg, h) for h in heights))


def compare(subject: Subject, wakes: Wakes) -> Comparison:
    """Rows and picture."""
    return Comparison(rows(subject, wakes), lambda: draw(subject, wakes))


def rows(subject: Subject, wakes: Wakes) -> list[Row]:
    """Inflow ratio at each height, C_T rising all the way down, nodes above the ground, tip vortex along it."""
    free, *grounded = points(subject)
    alone = wakes[free]
    found = [_ratio_row(at, wakes[at], alone) for at in reversed(grounded)]
    least = min(b - a for a, b in pairwise([alone.CT, *(wakes[at].CT for at in grounded)]))
    lowest = min(clearance(wakes[at]) for at in grounded)
    found.append(
        Row(NAME, "least rise of C_T to the next lower height, constant collective", least, above_zero(), RISE)
    )
    found.append(Row(NAME, "height over R of the lowest wake node above the ground", lowest, above_zero(), SOLID))
    return found + [_spread(at, wakes[at]) for at in reversed(grounded) if _height(at) <= NEAR]


def inflow_ratio(near: Solution, alone: Solution) -> float:
    """Mean inflow over √C_T near the ground over the same far from it: the ratio at constant thrust."""
    return float(near.mean_inflow / np.sqrt(near.CT) / (alone.mean_inflow / np.sqrt(alone.CT)))


def _ratio_row(at: Point, near: Solution, alone: Solution) -> Row:
    wanted, other = reference.hayden(_height(at)), reference.cheeseman_bennett(_height(at))
    name = f"inflow at constant thrust over OGE, h = {_height(at):g} (Cheeseman-Bennett {other:.3f})"
    return Row(NAME, name, inflow_ratio(near, alone), absolute(abs(wanted - other) + FAR_EXCESS, wanted), HAYDEN)


def _spread(at: Point, solution: Solution) -> Row:
    ours = float(tip_path(solution).r[-1])
    return Row(
        NAME, f"radius over R of the tip vortex at its last free node, h = {_height(at):g}", ours, OUTSIDE, ALONG
    )


def _height(at: Point) -> float:
    assert at.height is not None
    return at.height


def draw(subject: Subject, wakes: Wakes) -> Figure:
    """Inflow ratio and thrust ratio over height, and the tip vortices in the plane through the shaft."""
    free, *grounded = points(subject)
    alone = wakes[free]
    heights = np.array([at.height for at in grounded], float)
    fine = np.linspace(min(heights.min(), 0.5), max(heights.max(), 3.0), 100)
    with style():
        figure = new_figure(11.0, 3.8)
        inflow, thrust, paths = figure.subplots(1, 3, width_ratios=(1, 1, 1.3))
        ours = [inflow_ratio(wakes[at], alone) for at in grounded]
        inflow.plot(heights, ours, "o-", color=FREE_WAKE, label="free wake")
        inflow.plot(fine, [reference.hayden(h) for h in fine], color=VPBFSM, label="Hayden")
        other = [reference.cheeseman_bennett(h) for h in fine]
        inflow.plot(fine, other, color=INK, ls="--", label="Cheeseman & Bennett")
        inflow.set(xlabel=r"$h/R$", ylabel="mean inflow at constant thrust over OGE")
        inflow.legend(loc="lower right")
        thrust.plot(heights, [wakes[at].CT / alone.CT for at in grounded], "o-", color=FREE_WAKE)
        thrust.axhline(1, color=INK, lw=0.8)
        thrust.set(xlabel=r"$h/R$", ylabel=r"$C_T$ over OGE, constant collective")
        for at, colour in zip(grounded, series_colours(len(grounded)), strict=True):
            path = tip_path(wakes[at])
            paths.plot(path.r, path.z + at.height, color=colour, label=f"h = {at.height:g}")
        paths.axhline(0, color=INK, lw=1.2)
        paths.set(xlabel=r"$r/R$", ylabel="height above ground over R", title="tip vortices")
        paths.legend(loc="best")
    return figure


def _free(subject: Subject) -> tuple[Point, ...]:
    return subject.hovers(point("caradonna_tung", 8.0) if subject.quick else point("uh60"))


KNOWN = (
    "At h = 1 the tip vortex has contracted and runs out again, but its two free turns end before it has passed the "
    "rim; the turns that repeat the last one go on from there."
)
CASE = ValidationCase(NAME, "Level ground", points, compare, KNOWN)
