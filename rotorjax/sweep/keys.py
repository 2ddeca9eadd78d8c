"""What a sweep may vary: keys of the two commands by name, with range, unit and meaning, and those of rotor files."""

from typing import Literal, NamedTuple

from rotorjax.bench.as_flown import SPEED, WEIGHT
from rotorjax.checks import Range, closest
from rotorjax.errors import InputError
from rotorjax.operating import ALTITUDE, RANGES
from rotorjax.rotor.rotor_file import SCHEMA

Command = Literal["inflow", "trim"]


class Quantity(NamedTuple):
    """A number that is varied or found: its unit and meaning, and of what is varied its range."""

    unit: str
    about: str
    range: Range = Range()


FLOWN = {
    "thrust_coefficient": Quantity("1", "wanted thrust T/(ρA(ΩR)²)", Range(0.0, 0.1, above=True)),
    "weight": Quantity("N", "wanted thrust", WEIGHT),
    "height": Quantity(
        "1", "height of the hub over the ground, over R; inf: none", Range(0.0, 1000.0, "R", above=True)
    ),
    "slope_deg": Quantity("degree", "slope of the ground", Range(0.0, 59.9, "deg")),
    "climb": Quantity("1", "vertical speed over ΩR", Range(-0.3, 0.5)),
    "altitude": Quantity("m", "altitude in the standard atmosphere", ALTITUDE),
    "density": Quantity("kg m-3", "density of the air", RANGES["density"]),
}
OF_INFLOW = {"collective_deg": Quantity("degree", "collective pitch", Range(-45.0, 45.0, "deg"))}
OF_TRIM = {
    "advance_ratio": Quantity("1", "horizontal speed over ΩR", Range(0.0, 0.5)),
    "speed": Quantity("m s-1", "horizontal speed", SPEED),
    "tilt_deg": Quantity("degree", "shaft forward", Range(-40.0, 40.0, "deg")),
    "drag_area": Quantity("m2", "drag area of a fuselage", Range(0.0, 1e4, "m2")),
}
NUMBERS: dict[Command, dict[str, Quantity]] = {"inflow": FLOWN | OF_INFLOW, "trim": FLOWN | OF_TRIM}
EITHER: dict[Command, tuple[tuple[str, ...], ...]] = {
    "inflow": (("collective_deg", "thrust_coefficient", "weight"), ("altitude", "density")),
    "trim": (
        ("thrust_coefficient", "weight"),
        ("advance_ratio", "speed"),
        ("tilt_deg", "drag_area"),
        ("altitude", "density"),
    ),
}
"""Keys that say the same in two ways: one of each at most."""
TRIM_NEEDS = ("thrust_coefficient", "weight")


def quantity(name: str, command: Command) -> Quantity:
    """What an axis is. Raises InputError for a name that a command's case and a rotor file do not have."""
    table, dot, key = name.partition(".")
    if not dot:
        if name in NUMBERS[command]:
            return NUMBERS[command][name]
        raise InputError(f"[axes] has the unknown key '{name}' for {command}: {closest(name, every(command))}")
    if name in _ELSEWHERE:
        raise InputError(f"[axes] {name} must be left out, but is varied: take {_ELSEWHERE[name]}")
    if name not in every(command):
        raise InputError(f"[axes] has the unknown key '{name}' for {command}: {closest(name, every(command))}")
    found = SCHEMA[table][key]
    return Quantity(found.range.unit or "1", f"[{table}] {key} of the rotor file", found.range)


def every(command: Command) -> list[str]:
    """Names of all that a command's sweep may vary."""
    rotor = [f"{t}.{k}" for t, keys in SCHEMA.items() for k, key in keys.items() if key.kind in _KINDS]
    return [*NUMBERS[command], *(name for name in rotor if name not in _ELSEWHERE)]


_KINDS = ("number", "whole number", "stations")
_ELSEWHERE = {
    "operating.collective_deg": "collective_deg or a thrust",
    "operating.climb": "climb",
    "rotor.twist_deg": "rotor.linear_twist_deg, for one number of twist_deg only adds to the collective",
}
