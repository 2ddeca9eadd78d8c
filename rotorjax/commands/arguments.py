"""Arguments that several commands share."""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rotorjax.bench.cases import Case
    from rotorjax.calibration.calibration_file import Calibration
    from rotorjax.operating import OperatingPoint
    from rotorjax.rotor.geometry import Rotor
    from rotorjax.trim.run import Request


def commands_of(top: argparse.ArgumentParser) -> dict[str, argparse.ArgumentParser]:
    """The parsers of all commands, by name."""
    (commands,) = (action for action in top._actions if isinstance(action, argparse._SubParsersAction))
    return dict(commands.choices)


def add_rotor(parser: argparse.ArgumentParser) -> None:
    """--rotor and --collective."""
    parser.add_argument("--rotor", default="uh60", metavar="NAME|FILE", help="catalogue name or TOML file (uh60)")
    parser.add_argument(
        "--collective",
        type=float,
        metavar="DEG",
        help="collective pitch (the rotor file's: 18 for uh60)",
    )


def add_place(parser: argparse.ArgumentParser) -> None:
    """--height (one or several), --slope and --climb."""
    about = "hub over ground, over R (none: out of ground effect)"
    parser.add_argument("--height", type=float, nargs="+", metavar="H", help=about)
    parser.add_argument("--slope", type=float, default=0.0, metavar="DEG", help="slope of the ground in degrees (0)")
    parser.add_argument("--climb", type=float, default=0.0, metavar="V", help="climb velocity over ΩR (0)")


def add_flight(parser: argparse.ArgumentParser, required: bool) -> None:
    """Thrust, speed and air, each by its coefficient or as users have it; required: the thrust."""
    thrust = parser.add_mutually_exclusive_group(required=required)
    thrust.add_argument("--thrust-coefficient", type=float, metavar="CT", help="T/(ρA(ΩR)²), along the shaft")
    thrust.add_argument("--weight", type=float, metavar="N", help="thrust in newtons")
    speed = parser.add_mutually_exclusive_group()
    speed.add_argument("--advance-ratio", type=float, nargs="+", metavar="MU", help="horizontal speed over ΩR (0)")
    speed.add_argument("--speed", type=float, nargs="+", metavar="V", help="horizontal speed in m/s")
    air = parser.add_mutually_exclusive_group()
    air.add_argument("--altitude", type=float, metavar="M", help="in the standard atmosphere (the rotor file's air)")
    air.add_argument("--density", type=float, metavar="RHO", help="of the air in kg/m³")


def flown(chosen: argparse.Namespace, base: "Request") -> "tuple[Request, list[float]]":
    """A request with the air and the thrust that `add_flight` asks for, and its advance ratios."""
    from dataclasses import replace

    from rotorjax.bench.as_flown import advance_ratio, in_air, thrust_coefficient

    rotor, operating = base.rotor, in_air(base.operating, chosen.altitude, chosen.density)
    thrust = chosen.thrust_coefficient
    if thrust is None:
        thrust = thrust_coefficient(chosen.weight, rotor, operating)
    speeds = chosen.advance_ratio or [advance_ratio(speed, rotor, operating) for speed in chosen.speed or [0.0]]
    return replace(base, operating=operating, thrust=thrust), speeds


def case_of(height: float | None, slope: float) -> "Case":
    """The case that a --height and --slope ask for. Raises InputError where there is none."""
    from rotorjax.bench.cases import Case
    from rotorjax.errors import InputError

    if height is None and slope:
        raise InputError(f"Argument `height` must be given with a slope, but only `slope` is: {slope:g} deg")
    case = Case(height, slope)
    _ = case.ground
    return case


def introduce(rotor: "Rotor", operating: "OperatingPoint", moves: bool = False, about: Sequence[str] = ()) -> None:
    """The rotor's derived numbers at the top of a run, and on stderr doubts of them, notes on moving blades, more."""
    from rotorjax.rotor.derived import describe, doubts, notes

    print(describe(rotor, operating))
    for note in (*doubts(rotor, operating), *(notes(rotor) if moves else ()), *about):
        print(f"note: {note}", file=sys.stderr)


def introduce_flights(requests: "Sequence[Request]") -> None:
    """The same for trims of one rotor."""
    from rotorjax.limits import of_the_instant

    about = dict.fromkeys(note for one in requests if (note := of_the_instant(one.advance, one.slope_deg)))
    introduce(requests[0].rotor, requests[0].operating, moves=True, about=tuple(about))


def names_of(text: str) -> tuple[str, ...]:
    """Names given by commas, each once."""
    return tuple(dict.fromkeys(n.strip() for n in text.split(",") if n.strip()))


def add_harmonics(parser: argparse.ArgumentParser) -> None:
    """--harmonics."""
    parser.add_argument(
        "--harmonics", type=int, default=1, metavar="N", help="harmonics of the VPBFSM on a slope, 1 to 4 (1)"
    )


def add_calibration(parser: argparse.ArgumentParser) -> None:
    """--calibration."""
    parser.add_argument(
        "--calibration",
        type=Path,
        metavar="FILE",
        help="calibration.toml: the calibrated VPBFSM beside the printed one, or the free wake with its settings",
    )


def calibration_of(chosen: argparse.Namespace) -> "Calibration | None":
    """The calibration that --calibration names. Raises InputError where it is none."""
    if chosen.calibration is None:
        return None
    from rotorjax.calibration.calibration_file import load

    return load(chosen.calibration)
