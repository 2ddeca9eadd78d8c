"""Caradonna and Tung's hovering rotor at 8°: thrust, section lift, path of the tip vortex; thrust at 5° and 12°."""

import numpy as np
from matplotlib.figure import Figure

from rotorjax.bench.plotting import FREE_WAKE, VPBFSM, new_figure, style
from rotorjax.reference import published as reference
from rotorjax.reference.published import Path
from rotorjax.validation.case import Comparison, Subject, ValidationCase, Wakes
from rotorjax.validation.measure import far_pitch, section_lift, tip_path
from rotorjax.validation.measured_power import measured_power_factor
from rotorjax.validation.point import Point, point
from rotorjax.validation.row import Against, Row, absolute, relative

NAME, SOURCE = "caradonna-tung", "Caradonna & Tung, NASA TM-81232"
AGES_DEG = (60, 120, 180, 240, 300, 360)
AT = point("caradonna_tung", 8.0)
HELD_OUT = tuple(point("caradonna_tung", pitch) for pitch in (5.0, 12.0))
UNSTATED = "not in the data used"
PATH = "±0.003 from reading the figure; the scatter about the authors' curve is not in the data used"
POWER = Against(
    "the measured lift, by the blade's own sections (measured_power.py)",
    "±0.05 for ±3 % of the measured lift",
    "that uncertainty",
)
MARGIN = 0.03
"""In the tip vortex's place over R."""
AIM = "the aim set for this wake; no setting is tuned for a rotor"


def points(subject: Subject) -> tuple[Point, ...]:
    """The rotor as it was measured, and at two collectives that chose no setting."""
    return (AT, *HELD_OUT)


def compare(subject: Subject, wakes: Wakes) -> Comparison:
    """Rows and picture."""
    return Comparison(rows(subject, wakes), lambda: draw(subject, wakes))


def rows(subject: Subject, wakes: Wakes) -> list[Row]:
    """C_T within 3 % (5 % at 5° and 12°), lift within 8 %, tip vortex within 0.03 R up to 360°, its pitch within 10 %.

    And the induced power that goes with the measured lift: what momentum theory's limits are to be read against.
    """
    solution, measured = wakes[AT], reference.caradonna_tung()
    loads, path_read = Against(SOURCE, UNSTATED, AIM), Against(SOURCE, PATH, AIM)
    found = [Row(NAME, "C_T", solution.CT, relative(0.03, measured.thrust), loads)]
    for at in HELD_OUT:
        limits = relative(0.05, reference.caradonna_tung_thrust()[at.collective_deg])
        found.append(Row(NAME, f"C_T at {at.collective_deg:g}°", wakes[at].CT, limits, loads))
    for r, ours, lift in zip(measured.r, section_lift(solution, measured.r), measured.lift, strict=True):
        found.append(Row(NAME, f"c_l at r/R = {r:.2f}", float(ours), relative(0.08, float(lift)), loads))
    factor = reference.induced_power_factor(solution.CT, solution.CP_induced)
    asked = measured_power_factor(solution.model.rotor, solution.model.operating, measured)
    found.append(Row(NAME, "induced power factor", factor, absolute(0.05, asked), POWER))
    path, wanted = tip_path(solution), reference.caradonna_tung_path()
    for part in ("r", "z"):
        for age in AGES_DEG:
            ours, theirs = (float(np.interp(np.deg2rad(age), p.age, getattr(p, part))) for p in (path, wanted))
            found.append(Row(NAME, f"tip vortex {part}/R at {age}°", ours, absolute(MARGIN, theirs), path_read))
    measured_there = path.age <= wanted.age[-1] + 1e-9
    ours, theirs = (far_pitch(p, 2) for p in (Path(*(part[measured_there] for part in path)), wanted))
    found.append(Row(NAME, "pitch beyond 180° (z/R a radian)", ours, relative(0.1, theirs), path_read))
    return found


def draw(subject: Subject, wakes: Wakes) -> Figure:
    """Section lift over the span, radius and height of the tip vortex over age, computed and measured."""
    solution, measured, wanted = wakes[AT], reference.caradonna_tung(), reference.caradonna_tung_path()
    path = tip_path(solution)
    inside = path.age <= 2.2 * np.pi
    with style():
        figure = new_figure(10.5, 3.6)
        lift, radius, height = figure.subplots(1, 3)
        lift.plot(solution.r, section_lift(solution, solution.r), color=FREE_WAKE, marker="o", label="free wake")
        lift.errorbar(
            measured.r, measured.lift, 0.08 * measured.lift, fmt="s", color=VPBFSM, capsize=3, label="measured, ±8 %"
        )
        lift.set(xlabel=r"$r/R$", ylabel=r"section lift $c_l$", xlim=(0, 1), ylim=(0, None))
        title = f"C_T = {solution.CT:.5f}, measured {measured.thrust:.5f}"
        lift.set_title(title.replace("C_T", r"$C_T$"))
        for axes, part in ((radius, "r"), (height, "z")):
            theirs = getattr(wanted, part)
            axes.plot(np.rad2deg(path.age[inside]), getattr(path, part)[inside], color=FREE_WAKE, marker="o")
            axes.plot(np.rad2deg(wanted.age), theirs, "s", color=VPBFSM)
            axes.fill_between(np.rad2deg(wanted.age), theirs - MARGIN, theirs + MARGIN, color=VPBFSM, alpha=0.15, lw=0)
            axes.set(xlabel="wake age, deg", ylabel=f"tip vortex ${part}/R$", title=f"band: measured ±{MARGIN:g}")
            axes.set_xticks(range(0, 361, 90))
        lift.legend(loc="lower right")
    return figure


KNOWN = (
    "At 5° the thrust is 12 % above the measurement, which is 0.3° of collective, at 8° 3 % and at 12° 5 %: the "
    "settings were chosen at 8°. C_T at 12°, lift at 0.89 R and the height at 360° are out by a tenth of what is "
    "allowed. The tip vortex contracts more than was measured, as it does in Landgrebe's fit to other rotors: at 360° "
    "the two measurements are 0.054 R apart. Part of it is the price of fading: an inboard filament that fades takes "
    "impulse with it. With all of that kept (impulse_kept = 1) the vortex is 0.040 R inside at 360°, but C_T is 7 % "
    "too large; no other setting takes more than 0.012 R away (cores, filaments, panels, near wake; a draught through "
    "the rotor of 1 m/s takes 0.007 R). A lattice of 120° whose trailers go over to the filaments by and by "
    "(roll_up_start = 0.5, release at 0.962 R, impulse_kept = 0.7) has all rows of 8° and 12° but the radius at 360°, "
    "−0.039 R; it is not the default for what it does to heave at 1/rev and to the search. How lift is read between "
    "control points is worth 3 % at 0.89 R (docs/free_wake.md)."
)
CASE = ValidationCase(NAME, "Caradonna and Tung's rotor at 8°", points, compare, KNOWN)
