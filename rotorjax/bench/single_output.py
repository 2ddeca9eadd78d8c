"""One case on the screen and as a picture."""

from pathlib import Path

import numpy as np
import xarray as xr

from rotorjax.bench.plotting import (
    MODEL_STYLE,
    across,
    diameter_axes,
    legend_below,
    new_figure,
    polar_contour,
    save_file,
    shared_levels,
    style,
)
from rotorjax.bench.record import inflow_rms_difference
from rotorjax.bench.settings import StudySettings
from rotorjax.bench.wake_file import case_of
from rotorjax.errors import InputError

ENDINGS = (".png", ".pdf", ".svg")
FIELDS = {
    "free_wake": ("free_wake_inflow", "free wake"),
    "vpbfsm": ("vpbfsm_inflow", "VPBFSM"),
    "exact_image": ("exact_image_inflow", "exact image"),
}


def check_picture(path: Path | None) -> None:
    """Raise InputError where a picture's name ends in nothing that can be drawn."""
    if path is not None and path.suffix.lower() not in ENDINGS:
        raise InputError(f"Argument `plot` must end in {', '.join(ENDINGS)}, but is '{path}'")


def table(data: xr.Dataset, settings: StudySettings, reference: float | None) -> str:
    """Numbers and inflow along the radius as aligned text; inflow over ΩR, induced, positive down."""
    case = case_of(data)
    lines = [f"{settings.rotor.name}, collective {settings.collective_deg:g} deg, {case.label}", ""]
    lines += [f"{name:<42}{value}" for name, value in _numbers(data, reference)]
    models = [
        model
        for model, (name, _) in FIELDS.items()
        if name in data and not (case.height is None and model == "exact_image")
    ]
    sides = {"": None} if not case.slope_deg else {"mean": None, "mountain": 0, "valley": 1}
    lines += [
        "",
        "Inflow over ΩR, positive down",
        _row(["r/R", *(f"{FIELDS[m][1]} {s}".strip() for m in models for s in sides)]),
    ]
    columns = [_along(data[FIELDS[m][0]].to_numpy(), side) for m in models for side in sides.values()]
    for i, r in enumerate(data["radius"].to_numpy()):
        lines.append(_row([f"{r:.3f}", *(f"{column[i]:.5f}" for column in columns)]))
    return "\n".join(lines)


def picture(data: xr.Dataset, reference: float | None, path: Path) -> None:
    """Inflow across the disk and, on a slope, contours of the free wake's loading (or the VPBFSM's inflow)."""
    case, scale = case_of(data), reference or 1.0
    label = "inflow / mean OGE inflow of the free wake" if reference else "inflow over ΩR"
    with style():
        figure = new_figure(10.5 if case.slope_deg else 6.0, 4.0)
        axes = figure.add_subplot(1, 2 if case.slope_deg else 1, 1)
        for model, (name, _) in FIELDS.items():
            if name not in data or (case.height is None and model == "exact_image"):
                continue
            field = data[name].to_numpy() / scale
            axes.plot(*across(data["radius"].to_numpy(), _along(field, 0), _along(field, 1)), **MODEL_STYLE[model])
        diameter_axes(axes, label, sides=case.slope_deg > 0)
        axes.set_title(case.label, pad=18 if case.slope_deg else 6)
        legend_below(axes, 3)
        if case.slope_deg:
            wake = "free_wake_inflow" in data
            field = data["free_wake_inflow" if wake else "vpbfsm_inflow"].to_numpy() / scale
            psi = data["azimuth" if wake else "station_azimuth"].to_numpy()
            disk = figure.add_subplot(1, 2, 2, projection="polar")
            filled = polar_contour(disk, data["radius"].to_numpy(), psi, field, shared_levels([field]))
            disk.set_title("free wake" if wake else "VPBFSM", pad=18)
            figure.colorbar(filled, ax=disk, label=label, shrink=0.8, pad=0.1)
    save_file(figure, path)


def _along(field: np.ndarray, side: int | None) -> np.ndarray:
    """Mean over ψ (None), or the mountain (0) or valley (1) side of (K, R)."""
    return field.mean(axis=0) if side is None else field[side * (field.shape[0] // 2)]


def _row(cells: list[str]) -> str:
    return "".join(f"{cell:>{8 if i == 0 else 22}}" for i, cell in enumerate(cells))


def _numbers(data: xr.Dataset, reference: float | None) -> list[tuple[str, str]]:
    names = {
        "CT": "C_T = T/(ρA(ΩR)²)",
        "CP": "C_P = P/(ρA(ΩR)³)",
        "CP_induced": "C_P, induced",
        "free_wake_mean_inflow": "mean inflow/ΩR, free wake",
        "vpbfsm_mean_inflow": "mean inflow/ΩR, VPBFSM",
        "printed_mean_inflow": "mean inflow/ΩR, VPBFSM as printed",
        "exact_image_mean_inflow": "mean inflow/ΩR, cylinder, exact image",
        "free_wake_residual": "free wake: residual/R",
        "free_wake_ground_normal_velocity_rms": "free wake: flow through the ground",
        "vpbfsm_ground_normal_velocity_rms": "VPBFSM: flow through the ground",
        "wall_time_s": "time/s",
        "compile_time_s": "of which compiling/s",
    }
    rows = [(text, f"{float(data[name]):.5g}") for name, text in names.items() if name in data]
    rows = [(text, value) for text, value in rows if value != "nan"]
    if "converged" in data:
        rows.append(("free wake", "converged" if bool(data["converged"]) else f"NOT CONVERGED: {data.attrs['why']}"))
    if reference:
        for model, title in (("vpbfsm", "VPBFSM"), ("printed", "as printed"), ("exact_image", "exact image")):
            value = inflow_rms_difference(data, reference, model)
            if value is not None:
                rows.append((f"rms difference of the inflow, {title}", f"{value:.4f}"))
    return rows
