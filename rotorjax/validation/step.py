"""Step of collective in hover, marched with the nonlinear wake: the inflow's lag and the thrust's overshoot."""

import numpy as np
from jaxtyping import Float
from matplotlib.figure import Figure

from rotorjax.bench.plotting import FREE_WAKE, VPBFSM, new_figure, style
from rotorjax.errors import InputError
from rotorjax.linearisation.marching import nonlinear_step
from rotorjax.reference import published as reference
from rotorjax.rotor.geometry import solidity
from rotorjax.validation.case import Comparison, Subject, ValidationCase, Wakes
from rotorjax.validation.point import Point, as_marched, point
from rotorjax.validation.row import Against, Row, relative
from rotorjax.wake.solution import Solution

NAME, SOURCE = "step", "Carpenter & Fridovich, NACA TN 3044, for a small step"
SIZE_DEG = 0.5
TURNS, SAMPLES, STEPS = 0.75, 24, 24
"""Revolutions that are marched, samples in a turn, and steps between two of them (the tip panels are stiff)."""
OTHER = 1 - reference.OTHER_MASS / reference.MASS
TIME = Against(
    SOURCE,
    f"{100 * OTHER:.0f} %: the other apparent mass in use, 0.543 (Pitt & Peters 1981), is so much less",
    "the uncertainty of the reference",
)
THRUST = Against(
    SOURCE, "no shed vorticity, lift slope 5.73 everywhere", "what the filter of the bound circulation still holds back"
)
FILTERED = 0.07
"""exp(−0.262/0.1): the share of a step that a filter of 0.1 rad still holds back after 15°."""


def points(subject: Subject) -> tuple[Point, ...]:
    """A rotor in hover before and after the step."""
    (base,) = subject.hovers(point("uh60"))
    both = base, point(base.rotor, base.collective_deg + SIZE_DEG)
    return tuple(as_marched(at, subject.quick) for at in both)


def compare(subject: Subject, wakes: Wakes) -> Comparison:
    """Rows and picture; the march is made once for both."""
    before, after = (wakes[at] for at in points(subject))
    marched = response(before, after)
    return Comparison(rows(subject, before, marched), lambda: draw(before, marched))


def response(before: Solution, after: Solution) -> Float[np.ndarray, "3 N"]:
    """Azimuth (rad), and changes of mean inflow and C_T over their final changes; NaN where the march fails."""
    try:
        found = nonlinear_step(
            before, "collective", float(np.deg2rad(SIZE_DEG)), turns=TURNS, samples=SAMPLES, steps=STEPS
        )
    except InputError:
        return np.full((3, round(TURNS * SAMPLES) + 1), np.nan)
    inflow = np.asarray(found.outputs.lambda0) / (after.mean_inflow - before.mean_inflow)
    return np.stack([found.psi, inflow, np.asarray(found.outputs.CT) / (after.CT - before.CT)])


def rows(subject: Subject, before: Solution, marched: Float[np.ndarray, "3 N"]) -> list[Row]:
    """Revolutions to 63 % of the final inflow, and thrust 15° after the step over its final change."""
    base, _ = points(subject)
    psi, inflow, thrust = marched
    where = f"{base.label}, step of {SIZE_DEG:g}°"
    fine = np.linspace(0, 12, 4001)
    wanted = first_time(fine, _theory(before, fine)[0])
    early = float(_theory(before, psi[1:2])[1][0]) if np.isfinite(psi[1]) else float("nan")
    named = f"revolutions to 63 % of the inflow's change, {where}"
    found = [Row(NAME, named, first_time(psi, inflow), relative(OTHER, wanted), TIME)]
    named = f"change of C_T 15° after the step over its final change, {where}"
    return [*found, Row(NAME, named, float(thrust[1]), relative(FILTERED, early), THRUST)]


def first_time(psi: Float[np.ndarray, " N"], share: Float[np.ndarray, " N"]) -> float:
    """Revolutions at which a response first reaches 1 − 1/e, linear between samples; NaN where it does not."""
    level = 1 - np.exp(-1)
    above = np.flatnonzero(share >= level)
    if not above.size or not above[0]:
        return float("nan")
    k = above[0]
    part = (level - share[k - 1]) / (share[k] - share[k - 1])
    return float((psi[k - 1] + part * (psi[k] - psi[k - 1])) / (2 * np.pi))


def draw(before: Solution, marched: Float[np.ndarray, "3 N"]) -> Figure:
    """Inflow and thrust after the step, marched and by theory."""
    psi = np.linspace(0, 2 * np.pi * TURNS, 200)
    with style():
        figure = new_figure(9.0, 3.6)
        names = ("mean inflow over its final change", r"$C_T$ over its final change")
        for k, (axes, name) in enumerate(zip(figure.subplots(1, 2), names, strict=True)):
            axes.plot(marched[0, 1:] / (2 * np.pi), marched[k + 1, 1:], "o-", color=FREE_WAKE, label="free wake")
            axes.plot(psi / (2 * np.pi), _theory(before, psi)[k], color=VPBFSM, label="apparent mass 0.849")
            other = _theory(before, psi, reference.OTHER_MASS)[k]
            axes.plot(psi / (2 * np.pi), other, color=VPBFSM, ls=":", label="apparent mass 0.543")
            axes.set(xlabel="revolutions after the step", ylabel=name)
        axes.legend(loc="best")
    return figure


def _theory(before: Solution, psi: Float[np.ndarray, " N"], mass: float = reference.MASS) -> tuple[np.ndarray, ...]:
    return reference.step_response(psi, before.mean_inflow, float(solidity(before.model.rotor)), mass)


CASE = ValidationCase(NAME, "Step of collective", points, compare)
