"""What a study leaves behind: cases.nc, summary.json, figures and report.md."""

import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import xarray as xr

from rotorjax.io import netcdf
from rotorjax.io.atomic import write_json, write_text
from rotorjax.study.dataset import combine, reference_inflow
from rotorjax.study.figures import draw_all
from rotorjax.study.record import inflow_rms_difference, summary_entry
from rotorjax.study.report import report
from rotorjax.study.settings import StudySettings
from rotorjax.study.wake_file import case_of


def write_all(
    cases: Sequence[xr.Dataset],
    settings: StudySettings,
    folder: str | Path,
    started: float,
    formats: Sequence[str] = ("png", "pdf"),
) -> xr.Dataset:
    """Write every result of a study into a folder and return the merged data set.

    started: time.perf_counter() at the beginning of this run. formats: of the figures. Raises InputError where the
    folder cannot be written.
    """
    folder = Path(folder)
    merged = combine(cases, settings)
    netcdf.write(folder / "cases.nc", merged)
    drawn, missing = draw_all(merged, folder, formats)
    wall = time.perf_counter() - started
    write_text(folder / "report.md", report(merged, drawn, missing, wall))
    write_json(folder / "summary.json", summary(cases, settings, wall))
    return merged


def summary(cases: Sequence[xr.Dataset], settings: StudySettings, wall_time_s: float) -> dict[str, Any]:
    """Content of summary.json; wall_time_s: of this run, which may have found finished cases."""
    reference = reference_inflow(cases)
    return {
        "rotor": settings.rotor.name,
        "collective_deg": round(settings.collective_deg, 9),
        "fingerprint": settings.fingerprint(),
        "mean_inflow_oge": reference,
        "cases": [summary_entry(data, reference) for data in cases],
        "exact_image_inflow_rms_difference": {
            case_of(data).name: inflow_rms_difference(data, reference, "exact_image") for data in cases
        },
        "wall_time_s": wall_time_s,
        "compile_time_s": sum(float(data["compile_time_s"]) for data in cases),
    }
