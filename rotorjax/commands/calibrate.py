"""`rotorjax calibrate`: fit the finite-state model to Hayden or to the free wake, the free wake to measurements."""

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from rotorjax.commands.arguments import names_of

if TYPE_CHECKING:
    from rotorjax.calibration.output import Run

LOADINGS = ("elliptic", "uniform", "triangular")


def register(commands: argparse._SubParsersAction) -> None:
    """Add the command with its two targets."""
    parser = commands.add_parser(
        "calibrate",
        help="fit the finite-state model to Hayden or to the free wake, the free wake to a measured rotor",
        description="Fit parameters of a model and write calibration.toml, calibration.json and pictures. Exit code "
        "1 where the fit did not converge or a parameter ended at a bound.",
    )
    targets = parser.add_subparsers(dest="target", metavar="TARGET", required=True, parser_class=type(parser))
    hayden = targets.add_parser("hayden", help="contraction of the wake against Hayden's k_G at constant thrust")
    hayden.add_argument("--heights", nargs="+", type=float, metavar="H", help="over R (0.5 0.75 1 1.5 2 3)")
    hayden.add_argument(
        "--parameters", default="radius,clearance", metavar="NAMES", help="what to fit, by commas (radius,clearance)"
    )
    loads = hayden.add_mutually_exclusive_group()
    loads.add_argument("--loading", choices=LOADINGS, default="elliptic", help="given loading (elliptic)")
    loads.add_argument("--cases", type=Path, metavar="FILE", help="blade loads of a study: cases.nc or its folder")
    hayden.set_defaults(run=run_hayden, free_wake=lambda _: False)
    wake = targets.add_parser("freewake", help="six corrections against the free wake's inflow")
    wake.add_argument("--cases", required=True, type=Path, metavar="FILE", help="a study's cases.nc or its folder")
    wake.add_argument("--parameters", metavar="NAMES", help="what to fit, by commas (all)")
    wake.add_argument("--held", nargs="*", metavar="CASE", help="cases to hold out (every second height and slope)")
    wake.set_defaults(run=run_freewake, free_wake=lambda _: False)  # a study has solved it
    own = targets.add_parser("wake", help="the free wake's own settings against Caradonna and Tung's rotor at 8 deg")
    own.add_argument("--parameters", metavar="NAMES", help="settings to fit, by commas (release)")
    own.add_argument("--fit", metavar="NAMES", help="of CT, lift, r, z, by commas; the others are held out (CT,z)")
    own.add_argument("--quick", action="store_true", help="coarser free wake")
    own.set_defaults(run=run_wake)
    for target in (hayden, wake, own):
        target.add_argument("--out", required=True, type=Path, metavar="DIR", help="folder for all results")


def run_hayden(chosen: argparse.Namespace) -> int:
    """Calibrate against Hayden; the exit code."""
    from rotorjax.calibration import hayden, hayden_run
    from rotorjax.calibration.teacher import find_cases
    from rotorjax.io.atomic import make_folder

    make_folder(chosen.out)  # before the work, not after it
    heights = chosen.heights or hayden.HEIGHTS
    tau = None if chosen.cases is None else hayden_run.loads_of(find_cases(chosen.cases), heights)
    with _Bar("hayden") as bar:
        result = hayden_run.run(heights, names_of(chosen.parameters), chosen.loading, tau, bar.show)
    return _finish(result, chosen.out)


def run_freewake(chosen: argparse.Namespace) -> int:
    """Calibrate against the free wake; the exit code."""
    from rotorjax.calibration import freewake_run
    from rotorjax.calibration.taught import PARAMETERS
    from rotorjax.calibration.teacher import find_cases
    from rotorjax.io.atomic import make_folder

    make_folder(chosen.out)
    names = PARAMETERS.names if chosen.parameters is None else names_of(chosen.parameters)
    merged = find_cases(chosen.cases)
    with _Bar("free wake") as bar:
        result = freewake_run.run(merged, names, chosen.held, progress=bar.show)
    return _finish(result, chosen.out)


def run_wake(chosen: argparse.Namespace) -> int:
    """Calibrate the free wake against measurements; the exit code."""
    from rotorjax.calibration import measured_run
    from rotorjax.io.atomic import make_folder

    names = measured_run.FREE if chosen.parameters is None else names_of(chosen.parameters)
    fitted = measured_run.FITTED if chosen.fit is None else names_of(chosen.fit)
    measured_run.check(names, fitted)
    make_folder(chosen.out)  # before the work, not after it
    with _Bar("wake") as bar:
        result = measured_run.run(names, fitted, chosen.quick, progress=bar.show)
    return _finish(result, chosen.out)


def _finish(result: "Run", folder: Path) -> int:
    """Print and write what was found; the exit code."""
    from rotorjax.calibration.output import report, write

    print(report(result))
    write(result, folder)
    print(f"written: {folder / 'calibration.toml'}")
    return 0 if result.fit.converged else 1


class _Bar:
    """A line on stderr with the step and the rms."""

    def __init__(self, what: str):
        from tqdm import tqdm

        self._bar = tqdm(desc=what, bar_format="{desc}: {elapsed} {postfix}", leave=False, file=sys.stderr)

    def __enter__(self) -> "_Bar":
        return self

    def __exit__(self, *_: object) -> None:
        self._bar.close()

    def show(self, step: int, rms: float) -> None:
        """Show progress."""
        self._bar.set_postfix_str(f"step {step}, rms {rms:.5f}", refresh=False)
        self._bar.update()
