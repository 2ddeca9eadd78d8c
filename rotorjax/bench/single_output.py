"""One case on the screen."""

from pathlib import Path

import numpy as np
import xarray as xr

from rotorjax.bench.azimuth import valley_side
from rotorjax.bench.record import inflow_rms_difference
from rotorjax.bench.settings import StudySettings
from rotorjax.bench.wake_file import case_of, lost_at
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
    lines = [f"{settings.rotor.name}, collective {settings.collective_deg:g} deg, {title_of(data)}", ""]
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
    columns = [along(data[FIELDS[m][0]].to_numpy(), side) for m in models for side in sides.values()]
    for i, r in enumerate(data["radius"].to_numpy()):
        lines.append(_row([f"{r:.3f}", *(f"{column[i]:.5f}" for column in columns)]))
    return "\n".join(lines)


def title_of(data: xr.Dataset) -> str:
    """Label of the case whose numbers a data set holds, which is another than asked for where the wake was lost."""
    label, lost = case_of(data).label, lost_at(data)
    if lost is not None:
        return f"{lost} (NOT the case: the wake was lost there, on the way to {label})"
    return label if bool(data.get("converged", 1)) else f"{label} (not converged)"


def along(field: np.ndarray, side: int | None) -> np.ndarray:
    """Mean over ψ (None), or the mountain (0) or valley (1) side of (K, R)."""
    return field.mean(axis=0) if side is None else valley_side(field) if side else field[0]


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
