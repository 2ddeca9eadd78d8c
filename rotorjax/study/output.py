"""What a study leaves behind: cases.nc, summary.json, figures, the wakes to turn, report.md and the same as a page."""

import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import xarray as xr

from rotorjax.bench.dataset import combine, reference_inflow
from rotorjax.bench.flapping import RIGID
from rotorjax.bench.record import inflow_rms_difference, summary_entry
from rotorjax.bench.settings import StudySettings
from rotorjax.bench.wake_file import case_of, to_solution
from rotorjax.bench.wake_scene import solved_scene
from rotorjax.calibration import apply
from rotorjax.calibration.calibration_file import Calibration
from rotorjax.io import netcdf
from rotorjax.io.atomic import make_folder, write_json, write_text
from rotorjax.io.page import write_page
from rotorjax.io.scene import write_scene
from rotorjax.study.figures import draw_all
from rotorjax.study.report import report


def write_all(
    cases: Sequence[xr.Dataset],
    settings: StudySettings,
    folder: str | Path,
    started: float,
    formats: Sequence[str] = ("png", "pdf"),
    calibration: Calibration | None = None,
) -> xr.Dataset:
    """Write every result of a study into a folder and return the merged data set.

    started: time.perf_counter() at the beginning of this run. formats: of the figures. calibration: of the VPBFSM; the
    calibrated model stands beside the printed one in every file. Raises InputError where the folder cannot be written
    or the calibration is for another model.
    """
    folder = Path(folder)
    if calibration is not None:
        cases = [apply.add_calibrated(d, settings, calibration) if "vpbfsm_tau" in d else d for d in cases]
    merged = combine(cases, settings)
    netcdf.write(folder / "cases.nc", merged)
    drawn, missing = draw_all(merged, folder, formats)
    wall = time.perf_counter() - started
    text = report(merged, drawn, missing, _write_wakes(cases, settings, folder), wall)
    write_text(folder / "report.md", text)
    write_page(folder / "report.html", text)
    write_json(folder / "summary.json", summary(cases, settings, wall, calibration))
    return merged


def _write_wakes(cases: Sequence[xr.Dataset], settings: StudySettings, folder: Path) -> dict[str, str]:
    """A page for each converged wake, of the rigid blades as they are kept; {label of the case: file}."""
    written = {}
    for data in cases:
        if not bool(data["converged"]):
            continue
        rigid = {attribute: float(data[name]) for name, (attribute, _) in RIGID.items() if name in data}
        wake = replace(to_solution(data, settings), **rigid, **({"CP": float("nan")} if rigid else {}))
        written[case_of(data).label] = f"wakes/{case_of(data).name}.html"
        write_scene(make_folder(folder / "wakes") / f"{case_of(data).name}.html", solved_scene(wake, streams=False))
    return written


def summary(
    cases: Sequence[xr.Dataset], settings: StudySettings, wall_time_s: float, calibration: Calibration | None = None
) -> dict[str, Any]:
    """Content of summary.json; wall_time_s: of this run, which may have found finished cases."""
    reference = reference_inflow(cases)

    def entry(data: xr.Dataset) -> dict[str, Any]:
        found = summary_entry(data, reference)
        if calibration is not None and "calibrated_inflow" in data:
            found |= {"calibrated": apply.entry(data, reference, calibration)}
        return found

    return {
        "rotor": settings.rotor.name,
        "collective_deg": round(settings.collective_deg, 9),
        "fingerprint": settings.fingerprint(),
        "mean_inflow_oge": reference,
        "cases": [entry(data) for data in cases],
        "exact_image_inflow_rms_difference": {
            case_of(data).name: inflow_rms_difference(data, reference, "exact_image") for data in cases
        },
        "wall_time_s": wall_time_s,
        "compile_time_s": sum(float(data["compile_time_s"]) for data in cases),
    }
