"""`rotorjax study`: the paper's evaluation with both models, as figures, data and a report."""

import argparse
import sys
import time
from pathlib import Path

from rotorjax.commands.arguments import add_calibration, add_harmonics, add_rotor, calibration_of, introduce


def register(commands: argparse._SubParsersAction) -> None:
    """Add the command."""
    parser = commands.add_parser(
        "study",
        help="the paper's evaluation in ground effect with both models",
        description="Solve every case with the free wake and the VPBFSM and write figures, cases.nc, summary.json and "
        "report.md. Finished cases are kept: the same command continues where it stopped. Exit code 1 where a case did "
        "not converge.",
    )
    parser.add_argument("--out", required=True, type=Path, metavar="DIR", help="folder for all results")
    parser.add_argument(
        "--config",
        type=Path,
        metavar="FILE",
        help="a case of your own instead: several rotors, ground, walls, roofs (`rotorjax new several` writes one)",
    )
    parser.add_argument("--quick", action="store_true", help="fewer cases, coarser free wake, rigid blades, no PDF")
    parser.add_argument("--rigid", action="store_true", help="blades that do not flap")
    parser.add_argument("--heights", nargs="*", type=float, metavar="H", help="level heights over R")
    parser.add_argument("--slopes", nargs="*", type=float, metavar="DEG", help="slopes at h = 1, in degrees")
    add_rotor(parser)
    add_harmonics(parser)
    add_calibration(parser)
    parser.set_defaults(run=run, kept="; finished cases are kept, and the same command continues")


def run(chosen: argparse.Namespace) -> int:
    """Run the study; the exit code."""
    from rotorjax.bench.cases import HEIGHTS, QUICK_HEIGHTS, QUICK_SLOPES_DEG, SLOPES_DEG, study_cases
    from rotorjax.bench.settings import study_settings
    from rotorjax.bench.single import check_case
    from rotorjax.io.atomic import make_folder
    from rotorjax.study.output import write_all
    from rotorjax.study.run import solve_cases

    if chosen.config is not None:
        return _arranged(chosen)
    started = time.perf_counter()
    heights = (QUICK_HEIGHTS if chosen.quick else HEIGHTS) if chosen.heights is None else chosen.heights
    slopes = (QUICK_SLOPES_DEG if chosen.quick else SLOPES_DEG) if chosen.slopes is None else chosen.slopes
    cases = study_cases(heights, slopes)
    calibration = calibration_of(chosen)
    changes = {} if calibration is None else calibration.wake_settings
    settings = study_settings(
        chosen.rotor,
        chosen.collective,
        harmonics=chosen.harmonics,
        quick=chosen.quick,
        flapping=not (chosen.rigid or chosen.quick),
        **changes,
    )
    for case in cases:
        check_case(case, settings, "both")
    make_folder(chosen.out)  # before the work, not after it
    introduce(settings.rotor, settings.operating, moves=settings.flapping)
    result = solve_cases(cases, settings, chosen.out)
    # a PDF's fonts take longer than its picture, and a first look needs none
    formats = ("png",) if chosen.quick else ("png", "pdf")
    write_all(result.cases, settings, chosen.out, started, formats, None if changes else calibration)
    print(f"{len(result.cases)} cases in {time.perf_counter() - started:.0f} s: {chosen.out / 'report.html'}")
    if result.diverged:
        print("not converged: " + ", ".join(result.diverged))
    return 1 if result.diverged else 0


def _arranged(chosen: argparse.Namespace) -> int:
    """Solve a case file by both models; the exit code."""
    from tqdm import tqdm

    from rotorjax.errors import InputError
    from rotorjax.io.atomic import make_folder
    from rotorjax.study.arranged import solve_arrangement, write_arranged
    from rotorjax.study.arrangement import read_arrangement

    beside = {"rigid": chosen.rigid, "collective": chosen.collective is not None}
    beside |= {name: getattr(chosen, name) is not None for name in ("heights", "slopes", "calibration")}
    if given := [name for name, there in beside.items() if there]:
        raise InputError(f"Argument `{given[0]}` must be left out with --config, whose file says what is solved")
    case = read_arrangement(chosen.config, chosen.quick)
    folder = make_folder(chosen.out)
    introduce(case.settings.rotor, case.settings.operating)
    with tqdm(desc="study", unit="step", file=sys.stderr) as bar:

        def progress(stage: str, residual: float) -> None:
            bar.set_postfix_str(f"{stage}, residual {residual:.1e}", refresh=False)
            bar.update(1)

        found = solve_arrangement(case, progress)
    write_arranged(found, folder)
    print(f"{len(case.places)} rotors in {found.seconds:.0f} s: {folder / 'report.html'}")
    if not found.wake.converged:
        print(f"not converged: {found.wake.why}")
    return 0 if found.wake.converged else 1
