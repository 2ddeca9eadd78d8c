"""What linear rotors in hover and in flight tell alike: title, errors by name, modes, roots."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from rotorjax.bench.plotting import INK, new_figure, series_colours, style
from rotorjax.linearisation.found import LinearRotor
from rotorjax.linearisation.modes import RotorMode
from rotorjax.ode.models import LinearModel
from rotorjax.trim.run import FREE_WAKE

MOST_TOLD = 4
"""States of a mode that are told in a table."""
ALIKE = 0.06
"""Of exponents that share a place in the picture of roots, per radian."""


def title_of(found: LinearRotor) -> str:
    """The flight in words."""
    request = found.result.request
    inflow = "in its free wake" if request.inflow == FREE_WAKE else request.inflow
    flies = f"advance ratio {request.advance:g}" if request.advance else "hover"
    place = "out of ground effect" if request.height is None else f"h = {request.height:g} R"
    place += f", slope {request.slope_deg:g}°" if request.slope_deg else ""
    return f"{request.rotor.name}, {inflow}, C_T = {found.result.means.CT:.5f}, {flies}, {place}"


def by_name(model: LinearModel, values: np.ndarray) -> dict[str, dict[str, float | None]]:
    """Values (q, m) by output, then input, None where absent."""
    clean = [[None if np.isnan(v) else float(v) for v in row] for row in values]
    rows = [dict(zip(model.inputs, row, strict=True)) for row in clean]
    return dict(zip(model.outputs, rows, strict=True))


def signals(names: Sequence[str], units: Sequence[str], values: np.ndarray) -> dict[str, dict[str, Any]]:
    """Unit and trim value of each."""
    return {n: {"unit": u, "trim": float(v)} for n, u, v in zip(names, units, values, strict=True)}


def pairs(model: LinearModel, told: np.ndarray, *columns: np.ndarray) -> list[tuple]:
    """A row for each response of which `told` (q, m) is a number, with its values in the columns."""
    return [
        (f"{out} per {name}", *(column[q, m] for column in columns))
        for m, name in enumerate(model.inputs)
        for q, out in enumerate(model.outputs)
        if not np.isnan(told[q, m])
    ]


def part_of(mode: RotorMode) -> str:
    """Who takes part."""
    return ", ".join(f"{k} {v:.2f}" for k, v in list(mode.states.items())[:MOST_TOLD])


def mode_content(mode: RotorMode) -> dict[str, Any]:
    """A mode as linearise.json has it."""
    return {
        "name": mode.name,
        "growth": mode.exponent.real,
        "frequency": mode.exponent.imag,
        "damping_ratio": mode.damping,
        "shares": mode.shares,
        "states": mode.states,
    }


def roots(by_value: dict[float, tuple[RotorMode, ...]], label: str = "advance ratio", where: str = "") -> Figure:
    """Exponents in the plane, one colour a flight, those of the wake hollow; the modes of the one in the middle have
    their names beside them. A line goes with each of the blades' from flight to flight; the wake's, which are only
    numbered, the least damped first, are others in every flight, and have their names where there is one alone.
    """
    paths: dict[str, list[complex]] = {}
    for modes in by_value.values():
        for mode in filter(_of_blades, modes):
            paths.setdefault(mode.name, []).append(mode.exponent)
    middle = list(by_value.values())[len(by_value) // 2]
    with style():
        figure = new_figure(8.5, 5.0)
        axes = figure.subplots()
        axes.axvline(0, color=INK, lw=0.8)
        for values in paths.values():
            axes.plot(np.real(values), np.imag(values), "-", color=INK, lw=0.6, alpha=0.4)
        for (value, modes), colour in zip(by_value.items(), series_colours(len(by_value)), strict=True):
            for mode in modes:
                fill = colour if _of_blades(mode) else "none"
                axes.plot(mode.exponent.real, mode.exponent.imag, "o", color=colour, mfc=fill, ms=4.5)
            axes.plot([], [], "o", color=colour, ms=4.5, label=f"{label} {value:g}")
        if not all(map(_of_blades, middle)):
            axes.plot([], [], "o", color=INK, mfc="none", ms=4.5, label="of the wake")
        _name(axes, middle if len(by_value) == 1 else list(filter(_of_blades, middle)))
        axes.set(xlabel="growth per radian", ylabel="frequency, 1/rev", title=where)
        axes.legend(loc="upper left")
    return figure


def _of_blades(mode: RotorMode) -> bool:
    return not mode.name.startswith("wake")


def _name(axes: Axes, modes: Sequence[RotorMode]) -> None:
    """Names beside exponents, one under the other where several share a place; slanted at frequencies near zero."""
    places: dict[tuple[float, float], list[RotorMode]] = {}
    for mode in modes:
        places.setdefault((round(mode.exponent.real / ALIKE), round(mode.exponent.imag / ALIKE)), []).append(mode)
    for alike in places.values():
        at = alike[0].exponent
        look: dict[str, Any] = {"xytext": (-7, 0), "va": "center", "ha": "right"}
        if at.real > max(mode.exponent.real for mode in modes) - ALIKE:  # the least damped, towards the free side
            look = {"xytext": (7, 0), "va": "center", "ha": "left"}
        if abs(at.imag) < ALIKE:
            look = {"xytext": (0, 5), "va": "bottom", "ha": "left", "rotation": 55, "rotation_mode": "anchor"}
        names = "\n".join(mode.name for mode in alike)
        axes.annotate(names, (at.real, at.imag), textcoords="offset points", fontsize=8.5, **look)
