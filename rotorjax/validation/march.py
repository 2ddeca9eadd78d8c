"""The paper's march against the equilibrium: what a small disturbance of the periodic wake grows into."""

import jax.numpy as jnp
import numpy as np
from matplotlib.figure import Figure

from rotorjax.bench.plotting import FREE_WAKE, INK, VPBFSM, new_figure, series_colours, style
from rotorjax.validation.case import Comparison, Subject, ValidationCase, Wakes
from rotorjax.validation.disturbance import Disturbed, Fastest, disturbed, fastest, thrust
from rotorjax.validation.point import Point, as_marched, point
from rotorjax.validation.row import Against, Row, absolute, between, relative
from rotorjax.wake.solution import Solution

NAME = "march"
SIZE, TURNS = 1e-5, 5.0
"""Random displacement of the nodes at the start (rms over R), and revolutions that are marched."""
LINEAR = 1e-3
"""Displacement up to which the disturbance counts as small."""
SPECTRUM = Against(
    "the linear wake's fastest mode (rotorjax linearise), in the same discretisation",
    "rounding moves its exponent by less than 1e-9",
    "the march's curvature where the disturbance is no longer small",
)
PAIRING = Against(
    "pairing of a row of vortices, πΓ/4b² (Lamb 1932, §156), with the tip vortex's Γ and median spacing b; the fastest "
    "mode below",
    "a plane row, endless and without cores",
    "disturbances grow while they are carried down, by pairing at most, and then leave",
)
WHAT = (
    "growth of the fastest mode in the march, per radian",
    "frequency of the fastest mode in the march, 1/rev",
    "steepest growth of all nodes' displacement over half a turn, per radian",
)


def points(subject: Subject) -> tuple[Point, ...]:
    """One rotor in hover."""
    return tuple(as_marched(at, subject.quick) for at in subject.hovers(point("caradonna_tung")))


def compare(subject: Subject, wakes: Wakes) -> Comparison:
    """Rows and picture; the march is made once for both."""
    (at,) = points(subject)
    base = wakes[at]
    if not base.converged:  # what there is to compare with is not there either
        nan = float("nan")
        return Comparison(
            [Row(NAME, f"{what}, {at.label}", nan, absolute(0, nan), SPECTRUM) for what in WHAT], _nothing
        )
    along = fastest(base)
    marched = disturbed(base, along, SIZE, TURNS)
    return Comparison(rows(at, along, marched), lambda: draw(base, along, marched))


def rows(at: Point, along: Fastest, marched: Disturbed) -> list[Row]:
    """Growth of the fastest mode within 2 %, its frequency within 0.02/rev; the whole disturbance grows faster for a
    while, but no faster than a row of vortices pairs.
    """
    found, wanted, pairing = marched.exponent(LINEAR), along.mode.exponent, along.pairing.rate[1]
    named = [f"{what}, {at.label}" for what in WHAT]
    return [
        Row(NAME, named[0], found.real, relative(0.02, wanted.real), SPECTRUM),
        Row(NAME, named[1], abs(found.imag), absolute(0.02, abs(wanted.imag)), SPECTRUM),
        Row(NAME, named[2], marched.steepest(LINEAR), between(wanted.real, pairing), PAIRING),
    ]


def draw(base: Solution, along: Fastest, marched: Disturbed) -> Figure:
    """Displacement of the nodes and share of the fastest mode, and thrust, over the revolutions."""
    turns = marched.psi / (2 * np.pi)
    growth = np.exp(along.mode.exponent.real * marched.psi)
    with style():
        figure = new_figure(10.0, 4.2)
        left, right = figure.subplots(1, 2)
        waves = marched.displacement.shape[1]
        for wave, colour in zip(range(waves), series_colours(waves), strict=True):
            left.semilogy(
                turns, marched.displacement[:, wave], color=colour, lw=1, label=f"all nodes, wave number {wave}"
            )
        scale = SIZE * np.abs(marched.share)
        left.semilogy(turns, scale, "o", color=FREE_WAKE, label="fastest mode's share, marched")
        left.semilogy(turns, SIZE * growth, color=INK, ls="--", label="fastest mode, linear")
        left.axhline(LINEAR, color=INK, lw=0.6, label="small below")
        left.set(xlabel="revolutions", ylabel="rms displacement over R", ylim=(SIZE / 3, 1))
        left.legend(loc="upper left")
        ratio = np.asarray(thrust(jnp.asarray(marched.psi), marched.states, base.model)) / base.CT
        right.plot(turns, ratio, color=FREE_WAKE, label="marched")
        right.axhline(1, color=VPBFSM, ls="--", label="periodic wake")
        right.set(xlabel="revolutions", ylabel=r"$C_T$ over that of the periodic wake")
        right.legend(loc="upper left")
        rate = np.exp(2 * np.pi * along.mode.exponent.real)
        figure.suptitle(f"Fastest mode: wave number {along.mode.wave}, × {rate:.2f} a revolution", fontsize=10)
    return figure


def _nothing() -> Figure:
    with style():
        return new_figure(10.0, 4.2)


CASE = ValidationCase(NAME, "March from the equilibrium", points, compare, length=5.0)
