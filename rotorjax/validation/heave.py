"""Heave over level ground: amplitude and phase of inflow and thrust, the free wake against the finite-state model."""

from collections.abc import Callable
from typing import Any, Generic, NamedTuple, TypeVar

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from rotorjax.bench.plotting import EXACT_IMAGE, FREE_WAKE, INK, VPBFSM, new_figure, style
from rotorjax.errors import InputError
from rotorjax.reference import published as reference
from rotorjax.validation.case import Comparison, Subject, ValidationCase, Wakes
from rotorjax.validation.heaving import Heave, Heaving, instants, marched, of_finite_states, of_free_wake
from rotorjax.validation.point import Point, as_marched, point
from rotorjax.validation.row import Against, Row, absolute, relative
from rotorjax.wake.solution import Solution

NAME = "heave"
HEIGHTS = (1.5, 1.0)
"""Over R; the march is made over the last."""
STEADY, EARLY = (0.1, 0.2), (0.5, 1.0)
"""Frequencies over Ω that are read off the transfer function, and off the first revolutions."""
FREQUENCIES = np.geomspace(0.02, 2.0, 49)
DOUBTFUL = 0.3
"""Frequency over Ω from which unstable modes colour the free wake's transfer function."""
SIZE, MARCHED = 1e-4, 0.5
"""ε over R and frequency over Ω of the heave that is marched."""
OTHER = 1 - reference.OTHER_MASS / reference.MASS
LAG_DEG = float(np.rad2deg(np.arctan((1 - OTHER) ** -0.5) - np.arctan((1 - OTHER) ** 0.5)))
"""The most that the phase of a first-order lag changes where its mass is less by OTHER."""
SOURCE = "VPBFSM, dynamic ground, the same rotor, collective and sections"
INFLOW = Against(
    SOURCE,
    f"{100 * OTHER:.0f} %: the other apparent mass in use, 0.543 (Pitt & Peters 1981), is so much less; {LAG_DEG:.0f}° "
    "is the most that a lag's phase changes with it",
    "the uncertainty of the reference",
)
GAIN = Against(
    SOURCE,
    "the slopes over height of the measured curve, Hayden's and Cheeseman and Bennett's formula differ by so much",
    "the uncertainty of ground effect",
)
LINEAR = Against(
    "the free wake's own linear model",
    "rounding",
    "curvature: what is left grows with the size of the heave",
)


T = TypeVar("T")
S = TypeVar("S")


class Each(NamedTuple, Generic[T]):
    """One of each for the free wake and both variants of the finite-state model."""

    free: T
    quasi_steady: T
    dynamic: T

    def each(self, f: Callable[[T], S]) -> "Each[S]":
        """The same of each."""
        return Each(f(self.free), f(self.quasi_steady), f(self.dynamic))


class HeaveChanges(NamedTuple):
    """Changes (N, 2) of induced mean inflow and C_T: the nonlinear wake's, the linear one's, the dynamic VPBFSM's."""

    nonlinear: Float[np.ndarray, "N 2"]
    linear: Float[np.ndarray, "N 2"]
    dynamic: Float[np.ndarray, "N 2"]


def points(subject: Subject) -> tuple[Point, ...]:
    """A rotor over level ground, from the highest place down."""
    (base,) = subject.hovers(point("uh60"))
    return tuple(as_marched(Point(base.rotor, base.collective_deg, h), subject.quick) for h in HEIGHTS)


def compare(subject: Subject, wakes: Wakes) -> Comparison:
    """Rows and picture; models and march are made once for both."""
    at = points(subject)
    solved = [wakes[p] for p in at]
    if not all(s.converged for s in solved):  # there is nothing to linearise
        return Comparison([Row(NAME, "heave", float("nan"), absolute(0, 0), INFLOW)], _nothing)
    free = [of_free_wake(s) for s in solved]
    others = [of_finite_states([s.model for s in solved], v) for v in ("quasi-steady", "dynamic")]
    models = [Each(*three) for three in zip(free, *others, strict=True)]
    march = in_time(solved[-1], models[-1])
    found = [row for p, m in zip(at, models, strict=True) for row in rows(p, m)]
    return Comparison([*found, march_row(at[-1], march)], lambda: draw(at, models, march))


def in_time(solution: Solution, models: Each[Heaving]) -> HeaveChanges:
    """A small heave from rest; NaN where the march fails."""
    heave, psi = Heave(jnp.asarray(SIZE), jnp.asarray(MARCHED)), instants()
    try:
        nonlinear = marched(solution, heave)
    except InputError:
        nonlinear = np.full((psi.size, 2), np.nan)
    return HeaveChanges(nonlinear, models.free.history(heave), models.dynamic.history(heave))


def rows(at: Point, models: Each[Heaving]) -> list[Row]:
    """Gain at rest, amplitude and phase of the inflow at four frequencies, amplitude of C_T at the fast ones."""
    height = float(at.height or 0)
    slow = models.each(lambda m: m.response(np.array([0.0, *STEADY])))
    fast = [models.each(lambda m, f=f: m.early(f)) for f in EARLY]
    gain = slow.each(lambda z: abs(z[0, 0]))
    found = [_row(f"dλ₀/dh at rest, h = {height:g}", gain, GAIN, _slopes_differ(height))]
    both = [(f"{f:g}/rev", slow.each(lambda z, k=k: z[k])) for k, f in enumerate(STEADY, 1)]
    both += [(f"{f:g}/rev, from rest", z) for f, z in zip(EARLY, fast, strict=True)]
    for name, z in both:
        inflow = z.each(lambda v: complex(v[0]))
        found.append(_row(f"size of δλ₀/δh at {name}, h = {height:g}", inflow.each(abs), INFLOW, OTHER))
        found.append(_phase_row(f"phase of δλ₀/δh, degrees, at {name}, h = {height:g}", inflow))
    for f, z in zip(EARLY, fast, strict=True):
        name = f"size of δC_T/δh at {f:g}/rev, from rest, h = {height:g}"
        found.append(_row(name, z.each(lambda v: abs(v[1])), INFLOW, OTHER))
    return found


def march_row(at: Point, march: HeaveChanges) -> Row:
    """Largest difference of the inflow between march and linear model, over the largest change."""
    apart = np.abs(march.nonlinear - march.linear)[:, 0].max() / np.abs(march.linear[:, 0]).max()
    name = f"march of {SIZE:g} R at {MARCHED:g}/rev against the linear model, over its largest δλ₀, h = {at.height:g}"
    return Row(NAME, name, float(apart), absolute(0.03, 0.0), LINEAR)


def _row(name: str, z: Each[float], against: Against, share: float) -> Row:
    named = f"{name} (quasi-steady {z.quasi_steady:.3g})"
    return Row(NAME, named, float(z.free), relative(share, float(z.dynamic)), against)


def _phase_row(name: str, z: Each[complex]) -> Row:
    """Phases within half a turn of the reference's."""
    wanted = float(np.rad2deg(np.angle(z.dynamic)))
    free, quasi_steady = (wanted + float(np.rad2deg(np.angle(v / z.dynamic))) for v in (z.free, z.quasi_steady))
    return Row(NAME, f"{name} (quasi-steady {quasi_steady:.0f})", free, absolute(LAG_DEG, wanted), INFLOW)


def _slopes_differ(height: float) -> float:
    """Share by which the slopes of what is known of ground effect over height differ, of their mean."""
    step = 0.1  # as far apart as the measured curve's points
    known = (reference.hayden, reference.cheeseman_bennett, reference.isolated_rotors)
    ends = np.array([[f(height + step), f(height - step)] for f in known], float)  # NaN beyond a curve's end
    slopes = ends[:, 0] - ends[:, 1]
    return float(np.ptp(slopes) / np.mean(slopes))


LOOKS: Each[dict[str, Any]] = Each(
    {"color": FREE_WAKE, "label": "free wake"},
    {"color": EXACT_IMAGE, "label": "VPBFSM, quasi-steady", "ls": "--"},
    {"color": VPBFSM, "label": "VPBFSM, dynamic"},
)


def draw(at: tuple[Point, ...], models: list[Each[Heaving]], march: HeaveChanges) -> Figure:
    """Size and phase over frequency: the inflow at each height, C_T at the last; and the march."""
    with style():
        figure = new_figure(16.0, 6.4)
        grid = figure.subplots(2, len(at) + 2)
        for column, (p, here) in enumerate(zip(at, models, strict=True)):
            _bode(grid[:, column], here, 0)
            grid[0, column].set(title=rf"$\delta\lambda_0/\delta h$, h = {p.height:g}")
        _bode(grid[:, -2], models[-1], 1)
        grid[0, -2].set(title=rf"$\delta C_T/\delta h$, h = {at[-1].height:g}")
        grid[0, 0].legend(loc="lower right")
        turns = instants() / (2 * np.pi)
        for k, name in enumerate((r"$\delta\lambda_0$ over $\epsilon$", r"$\delta C_T$ over $\epsilon$")):
            axes = grid[k, -1]
            axes.plot(turns, march.nonlinear[:, k] / SIZE, "o", color=FREE_WAKE, label="free wake, marched")
            axes.plot(turns, march.linear[:, k] / SIZE, color=FREE_WAKE, label="its linear model")
            axes.plot(turns, march.dynamic[:, k] / SIZE, color=VPBFSM, label="VPBFSM, dynamic")
            axes.set(xlabel="revolutions from rest", ylabel=name)
        grid[0, -1].set(title=rf"h = {at[-1].height:g}, $\epsilon(1 - \cos\omega\psi)$ at {MARCHED:g}/rev")
        grid[1, -1].legend(loc="lower right")
    return figure


def _bode(axes: tuple[Axes, Axes], models: Each[Heaving], output: int) -> None:
    """One output over frequency; circles are read off the first revolutions. Phases lie near the dynamic model's."""
    early = np.geomspace(*EARLY, 3)
    waves = models.each(lambda m: m.response(FREQUENCIES)[:, output])
    first = models.each(lambda m: np.array([m.early(f)[output] for f in early]))
    base = np.unwrap(np.angle(waves.dynamic))
    for model, z, near, look in zip(models, waves, first, LOOKS, strict=True):
        shown = (FREQUENCIES < DOUBTFUL) | (model is not models.free)
        axes[0].loglog(FREQUENCIES[shown], np.abs(z[shown]), **look)
        axes[0].loglog(early, np.abs(near), "o", color=look["color"], mfc="none", ms=5)
        axes[0].loglog(FREQUENCIES[~shown], np.abs(z[~shown]), color=look["color"], lw=0.7, ls=":")
        axes[1].semilogx(FREQUENCIES[shown], np.rad2deg(base + np.angle(z / waves.dynamic))[shown], **look)
        there = np.interp(early, FREQUENCIES, base) + np.angle(near / np.interp(early, FREQUENCIES, waves.dynamic))
        axes[1].semilogx(early, np.rad2deg(there), "o", color=look["color"], mfc="none", ms=5)
    for axis, name in zip(axes, ("size", "phase, degrees"), strict=True):
        axis.axvline(DOUBTFUL, color=INK, lw=0.6)
        axis.set(ylabel=name)
    axes[1].set(xlabel="frequency, 1/rev; circles: first revolutions")


def _nothing() -> Figure:
    with style():
        return new_figure(13.0, 6.4)


KNOWN = (
    "The march of 1e-4 R follows its linear model to 0.6 %: curvature, for with 14 panels one of 5e-4 R did to 2 % "
    "and one of 0.002 R to 7 %; C_T rises steeply at h = 1. Why the free wake lags more at 1/rev (the numbers that "
    "follow were measured with one inboard filament and an end to the wake): fast heave is climb. The free wake's "
    "inflow falls by 0.19 of a sudden climb at once (near wake), 0.35 after a quarter of a revolution, and 0.74 only "
    "after three quarters, when turns of the new pitch lie under the disk; the finite states' mass flow changes at "
    "once, for one exponential fall to 0.61 and back to 0.52. If the ground comes up at once and stays (h = 1), the "
    "free wake feels 0.066 ΩR over R before it moves and the finite states 0.039; it then spreads and takes all of "
    "that back within a revolution, while their cylinder keeps 0.029. With repeated turns that got faster and faster "
    "along the plane phases at h = 1.5 were out at all frequencies."
)
CASE = ValidationCase(NAME, "Heave over level ground", points, compare, KNOWN, length=5.0)
"""Free wake and finite-state model in one case: no measurement, but two models that share nothing but the sections."""
