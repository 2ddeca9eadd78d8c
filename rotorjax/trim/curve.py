"""Power at constant thrust over speed or height: one trim after the other, each from the last."""

import sys
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from tqdm import tqdm

from rotorjax.bench import plotting
from rotorjax.errors import InputError
from rotorjax.reference.published import hayden_factor
from rotorjax.trim.dispatch import check_request, numbers_of, trim_request
from rotorjax.trim.in_wake_run import WakeResult
from rotorjax.trim.run import Request, Result

_PARTS = {"CP_induced": "induced", "CP_profile": "profile", "CP_parasite": "parasite"}


def requests(base: Request, speeds: Sequence[float], heights: Sequence[float | None]) -> list[Request]:
    """Requests of a curve. Raises InputError where both vary, or one of them is not allowed."""
    if len(speeds) > 1 and len(heights) > 1:
        raise InputError(
            f"Arguments `advance_ratio` and `height` must not both have several values, but have {len(speeds)} and "
            f"{len(heights)}"
        )
    found = [replace(base, advance=mu, height=h) for mu in speeds for h in heights]
    for request in found:
        check_request(request)  # what cannot be had is refused before the first trim
    return found


def curve(wanted: Sequence[Request], progress: bool = True) -> list[Result | WakeResult]:
    """Trims in order; each starts from the last one that converged."""
    found: list[Result | WakeResult] = []
    last = None
    with tqdm(wanted, desc="trim", unit="point", disable=not progress, file=sys.stderr) as bar:

        def show(stage: str, residual: float) -> None:
            bar.set_postfix_str(f"{stage}, residual {residual:.1e}")

        for request in bar:
            near = last if last is not None and (last.request.height is None) == (request.height is None) else None
            result = trim_request(request, None if near is None else near.z, show)
            if near is not None and not result.trimmed.outcome.converged:
                result = trim_request(request, None, show)
            if isinstance(result, Result) and result.trimmed.outcome.converged:
                last = result
            found.append(result)
    return found


def draw(found: Sequence[Result | WakeResult], out_of_ground: Result | WakeResult | None = None) -> Figure:
    """Power and its parts, and controls, over speed or height; over height beside Hayden's where OGE is given."""
    rows = [numbers_of(result) for result in found]
    rows = [row for row in rows if row["converged"]]
    over_height = len({row["height"] for row in rows}) > 1
    x = np.array([row["height"] if over_height else row["advance_ratio"] for row in rows], float)
    with plotting.style():
        figure = plotting.new_figure(9.0, 3.8)
        power, controls = figure.subplots(1, 2)
        if over_height and out_of_ground is not None:
            _in_ground_effect(power, x, rows, numbers_of(out_of_ground))
        else:
            power.plot(x, [row["CP"] for row in rows], color=plotting.INK, marker="o", label="power")
            for key, line in zip(_PARTS, ("--", ":", "-."), strict=True):
                power.plot(x, [row[key] for row in rows], ls=line, label=_PARTS[key])
            power.set(ylabel=r"$C_P$", ylim=(0, None))
        for key, label in (("collective_deg", r"$\theta_0$"), ("theta_1c_deg", r"$\theta_{1c}$")):
            controls.plot(x, [row[key] for row in rows], marker="o", label=label)
        controls.plot(x, [row["theta_1s_deg"] for row in rows], marker="o", label=r"$\theta_{1s}$")
        controls.plot(x, [row["tilt_deg"] for row in rows], ls="--", label="shaft, forward")
        controls.set(ylabel="deg")
        for axes in (power, controls):
            axes.set_xlabel("height over $R$" if over_height else "advance ratio")
            axes.legend(loc="best", fontsize=8)
        power.set_title(rf"{rows[0]['rotor']}, {rows[0]['inflow']}, $C_T$ = {rows[0]['CT']:.5f}")
    return figure


def _in_ground_effect(axes: Any, x: np.ndarray, rows: list[dict[str, Any]], free: dict[str, Any]) -> None:
    """Induced power over that out of ground effect, with Hayden's fit."""
    axes.plot(x, [row["CP_induced"] / free["CP_induced"] for row in rows], marker="o", label="induced power")
    axes.plot(x, [row["CP"] / free["CP"] for row in rows], marker="s", ls="--", label="power")
    fine = np.linspace(x.min(), x.max(), 100)
    axes.plot(fine, np.asarray(hayden_factor(fine)), color=plotting.INK, ls=":", label="Hayden, induced power")
    axes.set(ylabel="over that out of ground effect")
