"""`rotorjax simulate`: a flight of the coupled rotor with histories of controls and hub motion."""

import argparse
import sys
import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rotorjax.simulation.pace import Pace


def register(commands: argparse._SubParsersAction) -> None:
    """Add the command."""
    parser = commands.add_parser(
        "simulate",
        help="the coupled rotor under histories of controls and hub motion",
        description="March flap, lag and inflow from a trim and write history.nc, report.html, report.json, "
        "histories.png and, on request, animation.gif; of a free wake also wake.png, wake.html to turn and a folder "
        "vtk for ParaView. `rotorjax.simulation.case` shows a case file.",
    )
    parser.add_argument("--case", required=True, type=Path, metavar="FILE", help="case in TOML")
    parser.add_argument("--out", required=True, type=Path, metavar="DIR", help="folder for all results")
    parser.add_argument("--gif", action="store_true", help="write the animation too")
    parser.add_argument(
        "--real-time",
        action="store_true",
        help="march a free wake by the clock, in single precision unless the case says otherwise: a line for each "
        "twelfth of a revolution, late ones counted",
    )
    parser.set_defaults(run=run)


def run(chosen: argparse.Namespace) -> int:
    """Fly and write; the exit code."""
    from tqdm import tqdm

    from rotorjax.commands.arguments import introduce
    from rotorjax.errors import InputError
    from rotorjax.io.atomic import make_folder
    from rotorjax.simulation.case import read_case
    from rotorjax.simulation.files import write_all
    from rotorjax.simulation.pace import Pace
    from rotorjax.simulation.run import fly
    from rotorjax.trim.run import FREE_WAKE

    case = read_case(chosen.case)
    if chosen.real_time and case.request.inflow != FREE_WAKE:
        raise InputError(
            f'--real-time must come with inflow = "{FREE_WAKE}" in [flight], but it is "{case.request.inflow}"'
        )
    out = make_folder(chosen.out)
    pace = Pace(print) if chosen.real_time else None
    introduce(case.request.rotor, case.request.operating, moves=True)
    with tqdm(desc="simulate", bar_format="{desc}: {elapsed} {postfix}", leave=False, file=sys.stderr) as bar:
        with warnings.catch_warnings():
            warnings.showwarning = _warn
            found = fly(case, bar.set_postfix_str, pace)
        bar.set_postfix_str("files")
        told = write_all(found, out, animated=chosen.gif)
    _tell(told, out / "report.json", pace)
    if not found.finished:
        print(f"the march ended early: {found.why}")
    return 0 if found.finished else 1


def _tell(told: dict[str, Any], report: Path, pace: "Pace | None") -> None:
    """Say what was flown, and how fast."""
    for name, row in told["histories"].items():
        print(f"{name:14s} " + "  ".join(f"{key} {row[key]:9.5f}" for key in ("first", "last", "min", "max")))
    print(
        f"{told['simulated_s']:.2f} s, {told['revolutions']:.1f} revolutions in {told['march_s']:.2f} s "
        f"({told['march_s_per_revolution']:.3f} s a revolution, {told['real_time_factor']:.2f} times real time): "
        f"{report}"
    )
    if pace is not None:
        print(f"{pace.late} of {pace.frames} frames late, by up to {1e3 * pace.worst:.0f} ms")
    if "wake_change_last" in told:
        last, most = told["wake_change_last"], told["wake_change_max"]
        print(f"wake nodes moved over the last revolution by {last:.2e} R (rms), over any by up to {most:.2e} R")
    if told["vortex_ring_s"]:
        print(
            f"note: {told['vortex_ring_s']:.2f} s in the vortex ring state, where no inflow model holds",
            file=sys.stderr,
        )


def _warn(message: Warning | str, *_) -> None:
    """Tell of a warning in a line of its own, without the place in the code that Python names."""
    from tqdm import tqdm

    tqdm.write(f"rotorjax simulate: warning: {message}", file=sys.stderr)
