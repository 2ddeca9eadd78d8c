"""`rotorjax trim`: controls, blade motion and power of a rotor in steady flight."""

import argparse
from pathlib import Path


def register(commands: argparse._SubParsersAction) -> None:
    """Add the command."""
    parser = commands.add_parser(
        "trim",
        help="controls, flapping and power of a rotor in hover or forward flight",
        description="Find the controls that give a thrust without cyclic flapping (or hub moments), with the periodic "
        "motion of the blades and the inflow. Exit code 1 where it did not converge.",
    )
    add = parser.add_argument
    add("--rotor", default="uh60", metavar="NAME|FILE", help="catalogue name or TOML file (uh60)")
    add("--thrust-coefficient", required=True, type=float, metavar="CT", help="T/(ρA(ΩR)²), along the shaft")
    add("--advance-ratio", type=float, default=0.0, metavar="MU", help="horizontal speed over ΩR (0)")
    add("--height", type=float, metavar="H", help="hub over ground, over R (none: out of ground effect)")
    add("--slope", type=float, default=0.0, metavar="DEG", help="slope of the ground in degrees (0)")
    add("--climb", type=float, default=0.0, metavar="V", help="vertical speed over ΩR (0)")
    add("--inflow", default="pitt-peters", metavar="MODEL", help="uniform, pitt-peters (default) or vpbfsm")
    add("--for", dest="aim", choices=("flapping", "moments"), default="flapping", help="what cyclic pitch takes away")
    shaft = parser.add_mutually_exclusive_group()
    shaft.add_argument("--tilt", type=float, default=0.0, metavar="DEG", help="shaft forward (0)")
    shaft.add_argument(
        "--drag-area", type=float, metavar="M2", help="of a fuselage; the shaft tilts to balance its drag"
    )
    add("--json", type=Path, metavar="FILE", help="all numbers")
    parser.set_defaults(run=run)


def run(chosen: argparse.Namespace) -> int:
    """Trim and print; the exit code."""
    from rotorjax.io.atomic import make_folder, write_json
    from rotorjax.trim.run import Request, numbers, table
    from rotorjax.trim.run import run as run_trim

    request = Request(
        rotor=chosen.rotor,
        thrust=chosen.thrust_coefficient,
        inflow=chosen.inflow,
        advance=chosen.advance_ratio,
        height=chosen.height,
        slope_deg=chosen.slope,
        climb=chosen.climb,
        tilt_deg=chosen.tilt,
        drag_area=chosen.drag_area,
        aim=chosen.aim,
    )
    if chosen.json is not None:
        make_folder(chosen.json.parent)
    found = numbers(run_trim(request, progress=True))
    print(table(found))
    if chosen.json is not None:
        write_json(chosen.json, found)
    return 0 if found["converged"] else 1
