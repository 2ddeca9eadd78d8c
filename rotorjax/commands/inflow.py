"""`rotorjax inflow`: one case, in or out of ground effect, with one model or both; or thrust and power over heights."""

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rotorjax.commands.arguments import (
    add_calibration,
    add_harmonics,
    add_place,
    add_rotor,
    calibration_of,
    case_of,
    introduce,
)

if TYPE_CHECKING:
    import xarray as xr

    from rotorjax.bench.settings import StudySettings


def register(commands: argparse._SubParsersAction) -> None:
    """Add the command."""
    parser = commands.add_parser(
        "inflow",
        help="inflow of one case, thrust and power over heights",
        description="Solve one steady case and print thrust, power and inflow; at several heights thrust and power of "
        "each model with its own blade loads, with --plot as curves. Exit code 1 where a case did not converge.",
    )
    add_rotor(parser)
    add_place(parser)
    parser.add_argument(
        "--model",
        choices=("vpbfsm", "freewake", "both"),
        default="both",
        help="vpbfsm: with its own blade loads (both)",
    )
    parser.add_argument("--quick", action="store_true", help="coarser free wake")
    parser.add_argument("--plot", type=Path, metavar="FILE", help="picture: .png, .pdf or .svg")
    parser.add_argument("--html", type=Path, metavar="FILE", help="page in which the free wake can be turned, offline")
    parser.add_argument("--json", type=Path, metavar="FILE", help="numbers, with the keys of a case of summary.json")
    parser.add_argument("--netcdf", type=Path, metavar="FILE", help="all arrays, labelled")
    add_harmonics(parser)
    add_calibration(parser)
    parser.set_defaults(run=run, free_wake=lambda chosen: chosen.model != "vpbfsm")


def run(chosen: argparse.Namespace) -> int:
    """Solve what was asked for; the exit code."""
    return (_one if chosen.height is None or len(chosen.height) == 1 else _over_heights)(chosen)


def _over_heights(chosen: argparse.Namespace) -> int:
    """Solve all heights with each model, print them and write what was asked for."""
    from tqdm import tqdm

    from rotorjax.bench.settings import study_settings
    from rotorjax.bench.single import Model, check_case, single_case
    from rotorjax.bench.single_output import check_picture
    from rotorjax.errors import InputError
    from rotorjax.io.atomic import check_output, write_json

    for name in ("html", "netcdf", "calibration"):
        if getattr(chosen, name) is not None:
            raise InputError(f"Argument `{name}` goes with one height, but --height has {len(chosen.height)}")
    models: tuple[Model, ...] = ("vpbfsm", "freewake") if chosen.model == "both" else (chosen.model,)
    cases = [case_of(height, chosen.slope) for height in chosen.height]
    settings = study_settings(
        chosen.rotor, chosen.collective, chosen.climb, chosen.harmonics, chosen.quick, flapping=False
    )
    for case in cases:
        check_case(case, settings, chosen.model)
    check_picture(chosen.plot)
    for path in (chosen.plot, chosen.json):
        check_output(path)
    introduce(settings.rotor, settings.operating)
    solved = [
        (single_case(case, settings, model)[0], model)
        for model in models
        for case in tqdm(cases, desc=model, unit="case", leave=False, file=sys.stderr)
    ]

    from rotorjax.bench.over_heights import draw, point, table
    from rotorjax.bench.plotting import save_file

    points = [point(data, model, settings) for data, model in solved]
    print(table(points))
    if chosen.json is not None:
        write_json(chosen.json, {"points": points})
    if chosen.plot is not None:
        save_file(draw(points, settings), chosen.plot)
    return 0 if all(one["converged"] for one in points) else 1


def _one(chosen: argparse.Namespace) -> int:
    """Solve the case, print it and write what was asked for."""
    from tqdm import tqdm

    from rotorjax.bench.record import summary_entry
    from rotorjax.bench.settings import study_settings
    from rotorjax.bench.single import check_case, single_case
    from rotorjax.bench.single_output import check_picture, table
    from rotorjax.errors import InputError
    from rotorjax.io.atomic import check_output

    case = case_of(None if chosen.height is None else chosen.height[0], chosen.slope)
    calibration = calibration_of(chosen)
    changes = {} if calibration is None else calibration.wake_settings
    settings = study_settings(
        chosen.rotor, chosen.collective, chosen.climb, chosen.harmonics, chosen.quick, flapping=False, **changes
    )
    check_case(case, settings, chosen.model)
    check_picture(chosen.plot)
    if chosen.html is not None and chosen.model == "vpbfsm":
        raise InputError("Argument `--html` shows a free wake, but --model is vpbfsm: take freewake or both")
    for path in (chosen.plot, chosen.html, chosen.json, chosen.netcdf):
        check_output(path)  # before the work, not after it
    introduce(settings.rotor, settings.operating)
    with tqdm(desc=case.label, bar_format="{desc}: {elapsed} {postfix}", leave=False, file=sys.stderr) as bar:

        def progress(stage: str, residual: float) -> None:
            bar.set_postfix_str(f"{stage}, residual {residual:.1e}")

        data, reference = single_case(case, settings, chosen.model, progress)
    print(table(data, settings, reference))
    entry = summary_entry(data, reference)
    if calibration is not None and not changes and "vpbfsm_tau" in data:
        from rotorjax.calibration import apply

        data = apply.add_calibrated(data, settings, calibration)
        print(apply.table(data, reference, calibration))
        entry |= {"calibrated": apply.entry(data, reference, calibration)}
    _write(chosen, data, entry, reference)
    if chosen.html is not None:
        _write_wake(chosen.html, data, settings)
    return 0 if bool(data.get("converged", 1)) else 1


def _write(chosen: argparse.Namespace, data: "xr.Dataset", entry: dict[str, Any], reference: float | None) -> None:
    """The files that were asked for; what only one of them needs is imported for it alone."""
    from rotorjax.io import netcdf
    from rotorjax.io.atomic import write_json

    if chosen.json is not None:
        write_json(chosen.json, entry)
    if chosen.netcdf is not None:
        netcdf.write(chosen.netcdf, data.set_coords(["height", "slope_deg"]))
    if chosen.plot is not None:
        from rotorjax.bench.single_picture import picture

        picture(data, reference, chosen.plot)


def _write_wake(path: Path, data: "xr.Dataset", settings: "StudySettings") -> None:
    from rotorjax.bench.wake_file import to_solution
    from rotorjax.bench.wake_scene import solved_scene
    from rotorjax.io.scene import write_scene

    write_scene(path, solved_scene(to_solution(data, settings)))
