"""`rotorjax trim`: controls, blade motion and power of a rotor in steady flight."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from rotorjax.commands.arguments import add_flight

if TYPE_CHECKING:
    from rotorjax.trim.run import Request, Result


def register(commands: argparse._SubParsersAction) -> None:
    """Add the command."""
    parser = commands.add_parser(
        "trim",
        help="controls, flapping and power of a rotor in hover or forward flight",
        description="Find the controls that give a thrust without cyclic flapping (or hub moments), with the periodic "
        "motion of the blades and the inflow. Several speeds or heights make a curve at constant thrust. Exit code 1 "
        "where one did not converge.",
    )
    add = parser.add_argument
    add("--rotor", default="uh60", metavar="NAME|FILE", help="catalogue name or TOML file (uh60)")
    add_flight(parser, required=True)
    add("--height", type=float, nargs="+", metavar="H", help="hub over ground, over R (none: out of ground effect)")
    add("--slope", type=float, default=0.0, metavar="DEG", help="slope of the ground in degrees (0)")
    add("--climb", type=float, default=0.0, metavar="V", help="vertical speed over ΩR (0)")
    add("--inflow", default="pitt-peters", metavar="MODEL", help="uniform, pitt-peters (default), vpbfsm or freewake")
    add("--for", dest="aim", choices=("flapping", "moments"), default="flapping", help="what cyclic pitch takes away")
    shaft = parser.add_mutually_exclusive_group()
    shaft.add_argument("--tilt", type=float, default=0.0, metavar="DEG", help="shaft forward (0)")
    shaft.add_argument(
        "--drag-area", type=float, metavar="M2", help="of a fuselage; the shaft tilts to balance its drag"
    )
    add("--json", type=Path, metavar="FILE", help="all numbers; of a curve a list of them under `points`")
    add("--plot", type=Path, metavar="FILE", help="picture of a curve: .png, .pdf or .svg")
    add("--html", type=Path, metavar="FILE", help="report that opens offline: the answer, the curve, all points")
    parser.set_defaults(run=run, free_wake=lambda chosen: chosen.inflow == "freewake")


def run(chosen: argparse.Namespace) -> int:
    """Trim and print; the exit code."""
    from rotorjax.commands.arguments import introduce_flights
    from rotorjax.io.atomic import write_json
    from rotorjax.trim.curve import curve
    from rotorjax.trim.run import numbers, table

    wanted, free = _asked(chosen)
    introduce_flights(wanted)
    results = curve([*wanted, *free])
    points, alone = results[: len(wanted)], results[-1] if free else None
    found = [numbers(result) for result in points]
    print("\n\n".join(table(one) for one in found))
    if chosen.json is not None:
        write_json(chosen.json, found[0] if len(found) == 1 else {"points": found})
    _draw(chosen, points, alone)
    return 0 if all(one["converged"] for one in found) else 1


def _asked(chosen: argparse.Namespace) -> "tuple[list[Request], list[Request]]":
    """The trims asked for and, where a curve over heights is drawn, the one in free air beside it.

    Raises InputError before any work, also where a file cannot be written or a picture would have one point.
    """
    from rotorjax.bench.single_output import check_picture
    from rotorjax.commands.arguments import flown
    from rotorjax.errors import InputError
    from rotorjax.io.atomic import check_output
    from rotorjax.trim.curve import requests
    from rotorjax.trim.run import request

    base = request(
        rotor=chosen.rotor,
        thrust=1e-3,
        inflow=chosen.inflow,
        slope_deg=chosen.slope,
        climb=chosen.climb,
        tilt_deg=chosen.tilt,
        drag_area=chosen.drag_area,
        aim=chosen.aim,
    )
    base, speeds = flown(chosen, base)
    heights = [None] if chosen.height is None else chosen.height
    wanted = requests(base, speeds, heights)
    check_picture(chosen.plot)
    if chosen.plot is not None and len(wanted) == 1:
        raise InputError("Argument `plot` must come with several speeds or heights, but there is one point")
    for path in (chosen.json, chosen.plot, chosen.html):
        check_output(path)
    pictured = chosen.plot is not None or chosen.html is not None
    return wanted, requests(base, speeds, [None]) if pictured and len(heights) > 1 else []


def _draw(chosen: argparse.Namespace, points: "list[Result]", alone: "Result | None") -> None:
    """The picture and the page that are asked for."""
    if chosen.plot is not None:
        from rotorjax.bench.plotting import save_file  # matplotlib takes half a second to load
        from rotorjax.trim.curve_picture import draw

        save_file(draw(points, alone), chosen.plot)
    if chosen.html is not None:
        from rotorjax.trim.report import write_report

        write_report(chosen.html, points, alone)
