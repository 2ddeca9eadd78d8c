"""Thrust and power over height at one collective, each model with its own blade loads."""

from collections.abc import Sequence
from typing import Any

import xarray as xr
from matplotlib.figure import Figure

from rotorjax.bench import plotting
from rotorjax.bench.settings import StudySettings
from rotorjax.bench.wake_file import case_of, lost_at

MODELS = {"freewake": "free_wake", "vpbfsm": "vpbfsm"}  # as the command line has them: as pictures have them


def point(data: xr.Dataset, model: str, settings: StudySettings) -> dict[str, Any]:
    """Numbers of one solved case (`bench.single`) by name; SI in newtons and watts."""
    force, tip = (float(of(settings.rotor.radius)) for of in (settings.operating.force, settings.operating.tip_speed))
    thrust, power = float(data["CT"]), float(data["CP"])
    case = case_of(data)
    return {
        "model": model,
        "height": case.height,
        "slope_deg": case.slope_deg,
        "CT": thrust,
        "CP": power,
        "thrust_newton": thrust * force,
        "power_watt": power * force * tip,
        "mean_inflow": float(data[f"{MODELS[model]}_mean_inflow"]),
        "converged": bool(data.get("converged", 1)) and lost_at(data) is None,
        "why": data.attrs.get("why", ""),
    }


def table(points: Sequence[dict[str, Any]]) -> str:
    """A line a point, as aligned text; of both models how far apart they are."""
    lines = [f"{'model':<10}{'h/R':>7}{'thrust, N':>12}{'power, kW':>12}{'C_T':>10}{'inflow/ΩR':>11}"]
    for one in points:
        forces = f"{one['thrust_newton']:12.0f}{one['power_watt'] / 1e3:12.1f}"
        lost = "" if one["converged"] else f"  NOT CONVERGED: {one['why']}"
        lines.append(f"{one['model']:<10}{one['height']:7g}{forces}{one['CT']:10.5f}{one['mean_inflow']:11.5f}{lost}")
    by_model = [{p["height"]: p["CT"] for p in points if p["model"] == model and p["converged"]} for model in MODELS]
    ratios = [by_model[1][h] / by_model[0][h] for h in by_model[0] if h in by_model[1]]
    if ratios:
        lines.append(f"thrust of the VPBFSM over the free wake's: {min(ratios):.3f} to {max(ratios):.3f}")
        lines.append("both models beside measurements: VALIDATION.md")
    return "\n".join(lines)


def draw(points: Sequence[dict[str, Any]], settings: StudySettings) -> Figure:
    """Thrust and power over height; what did not converge is left out."""
    with plotting.style():
        figure = plotting.new_figure(9.0, 4.0)
        thrust, power = figure.subplots(1, 2)
        for model, name in MODELS.items():
            good = sorted((p for p in points if p["model"] == model and p["converged"]), key=lambda p: p["height"])
            look = plotting.MODEL_STYLE[name] | {"marker": "o"}
            heights = [p["height"] for p in good]
            if good:
                thrust.plot(heights, [p["thrust_newton"] / 1e3 for p in good], **look)
                power.plot(heights, [p["power_watt"] / 1e3 for p in good], **look)
        thrust.set(xlabel="height of the hub, h/R", ylabel="thrust, kN")
        power.set(xlabel="height of the hub, h/R", ylabel="power, kW")
        thrust.legend()
        slope = f", slope {points[0]['slope_deg']:g}°" if points[0]["slope_deg"] else ""
        figure.suptitle(f"{settings.rotor.name}, collective {settings.collective_deg:g}°{slope}", fontsize=10)
    return figure
