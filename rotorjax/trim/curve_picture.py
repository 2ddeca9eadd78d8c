"""Power and controls over speed or height as a picture."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from rotorjax.bench import plotting
from rotorjax.reference.published import hayden_factor
from rotorjax.trim.run import Result, numbers

_PARTS = {"CP_induced": "induced", "CP_profile": "profile", "CP_parasite": "parasite"}


def draw(found: Sequence[Result], out_of_ground: Result | None = None) -> Figure:
    """Power and its parts, and controls, over speed or height; over height beside Hayden's where OGE is given."""
    rows = [numbers(result) for result in found]
    rows = [row for row in rows if row["converged"]]
    over_height = len({row["height"] for row in rows}) > 1
    x = np.array([row["height"] if over_height else row["advance_ratio"] for row in rows], float)
    tip = float(found[0].request.operating.tip_speed(found[0].request.rotor.radius))
    speed = (lambda ratio: ratio * tip), (lambda metres: metres / tip)
    with plotting.style():
        figure = plotting.new_figure(9.0, 4.3)
        power, controls = figure.subplots(1, 2)
        if over_height and out_of_ground is not None:
            _in_ground_effect(power, x, rows, numbers(out_of_ground))
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
            plotting.legend_below(axes, 2)
            if not over_height:
                axes.secondary_xaxis("top", functions=speed).set_xlabel("speed, m/s")
        power.set_title(rf"{rows[0]['rotor']}, {rows[0]['inflow']}, $C_T$ = {rows[0]['CT']:.5f}")
    return figure


def _in_ground_effect(axes: Any, x: np.ndarray, rows: list[dict[str, Any]], free: dict[str, Any]) -> None:
    """Induced power over that out of ground effect, with Hayden's fit."""
    axes.plot(x, [row["CP_induced"] / free["CP_induced"] for row in rows], marker="o", label="induced power")
    axes.plot(x, [row["CP"] / free["CP"] for row in rows], marker="s", ls="--", label="power")
    fine = np.linspace(x.min(), x.max(), 100)
    axes.plot(fine, np.asarray(hayden_factor(fine)), color=plotting.INK, ls=":", label="Hayden, induced power")
    axes.set(ylabel="over that out of ground effect")
