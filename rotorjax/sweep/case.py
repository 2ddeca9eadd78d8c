"""A sweep: case files in TOML.

    [case]                     # what every point has; the keys are those of the command's line
    command = "inflow"         # a hover of rigid blades at a collective; or "trim"
    rotor = "uh60"             # of the catalogue, or a rotor file beside this one
    model = "vpbfsm"           # of inflow: vpbfsm or freewake. Of trim: inflow = "pitt-peters" and so on, aim
    collective_deg = 16.0      # or thrust_coefficient, or weight in N

    [axes]                     # what varies: lists, or so many equal steps
    height = [0.6, 0.8, 1.0, 1.5, 2.0, inf]                # inf: out of ground effect
    slope_deg = { from = 0.0, to = 15.0, points = 4 }
    rotor.linear_twist_deg = [-8.0, -12.0]                 # any number of a rotor file, under its table's name

    [design]                   # optional: the full grid if left out
    kind = "random"            # a Latin hypercube between the axes' ends
    points = 40
    seed = 1

Keys of [case] and [axes]. Both commands: height (over R), slope_deg, climb (over ΩR), thrust_coefficient or weight (N),
altitude (m) or density (kg/m³). inflow: collective_deg. trim: advance_ratio or speed (m/s), tilt_deg or drag_area (m²).
A table [wake] may set what `rotorjax.wake.settings.wake_settings` takes, where there is a free wake; `quick = true` in
[case] takes its coarser settings, of inflow; harmonics those of the finite-state model over a slope.
"""

import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, get_args

import numpy as np

from rotorjax.checks import Range, check_range, closest, shown
from rotorjax.errors import InputError
from rotorjax.io.toml_file import OTHERS, Key, Schema, Tables, read_toml
from rotorjax.rotor.catalogue import names
from rotorjax.simulation.case import SCHEMA as FLIGHT_SCHEMA
from rotorjax.sweep.keys import EITHER, NUMBERS, TRIM_NEEDS, Command, quantity
from rotorjax.trim.problem import Aim
from rotorjax.trim.run import FREE_WAKE, INFLOWS
from rotorjax.wake.settings import wake_settings

MODELS = ("vpbfsm", FREE_WAKE)
MOST_POINTS = 100_000
TEXTS = {
    "inflow": {"model": Key("text", choices=MODELS), "quick": Key("true or false")}
    | {"harmonics": Key("whole number", Range(1, 4))},
    "trim": {"inflow": Key("text", choices=INFLOWS), "aim": Key("text", choices=get_args(Aim))},
}
SCHEMA: Schema = {
    "case": {
        "command": Key("text", required=True, choices=tuple(TEXTS)),
        "rotor": Key("text"),
        **TEXTS["inflow"],
        **TEXTS["trim"],
        **{name: Key("number", found.range) for keys in NUMBERS.values() for name, found in keys.items()},
    },
    "axes": {OTHERS: Key("anything")},
    "design": {
        "kind": Key("text", choices=("grid", "random")),
        "points": Key("whole number", Range(1, MOST_POINTS)),
        "seed": Key("whole number", Range(0, 2**31)),
    },
    "wake": FLIGHT_SCHEMA["wake"],
}
_STEPS = {"from", "to", "points"}


@dataclass(frozen=True)
class Axis:
    """What varies. values: each of them, where they are given; else between low and high, for a random design."""

    name: str
    values: tuple[float, ...]
    low: float
    high: float


@dataclass(frozen=True)
class Design:
    """How points are chosen: all combinations of the axes' values, or a seeded random choice of `points`."""

    kind: str = "grid"
    points: int = 0
    seed: int = 0


@dataclass(frozen=True)
class SweepCase:
    """One sweep. fixed: keys of [case] that every point has. axes: in the file's order. wake: settings of it."""

    command: Command
    fixed: dict[str, Any]
    axes: tuple[Axis, ...]
    design: Design = field(default_factory=Design)
    wake: dict[str, Any] = field(default_factory=dict)

    @property
    def model(self) -> str:
        """Name of the inflow model."""
        usual = {"inflow": ("model", "vpbfsm"), "trim": ("inflow", "pitt-peters")}[self.command]
        return self.fixed.get(*usual)

    @property
    def rotor(self) -> str:
        """Name of the rotor in the catalogue, or its file."""
        return self.fixed.get("rotor", "uh60")


def read_case(path: str | Path) -> SweepCase:
    """Read a case file.

    Raises InputError, naming file, key and value, for a file that is not there or not TOML, keys that are unknown, not
    of the command or given twice, values out of range, and axes that are empty or make too many points.
    """
    return read_toml(path, SCHEMA, _build)


def sweep_case(
    command: Command,
    axes: dict[str, Any],
    design: dict[str, Any] | None = None,
    wake: dict[str, Any] | None = None,
    **fixed: Any,
) -> SweepCase:
    """Make a sweep from values, as the tables of a case file hold them. Raises InputError as `read_case` does.

    >>> len(sweep_case("inflow", {"height": [1.0, 2.0]}, model="vpbfsm").axes[0].values)
    2
    """
    tables = {"case": {"command": command, **fixed}, "axes": axes, "design": design or {}, "wake": wake or {}}
    return _build(tables, Path())


def _build(data: Tables, folder: Path) -> SweepCase:
    fixed = dict(data["case"])
    command = fixed.pop("command")
    axes = tuple(_axis(name, value, command) for name, value in _flat(data.get("axes", {})).items())
    if not axes:
        raise InputError("[axes] must hold what varies, but is empty or missing")
    rotor = fixed.get("rotor", "")
    if rotor.endswith(".toml"):
        fixed["rotor"] = str((folder / rotor).resolve())
    elif rotor and rotor not in names():
        raise InputError(f"[case] rotor must be of the catalogue or a .toml file, but is '{rotor}': "
                         f"{closest(rotor, names())}")  # fmt: skip
    design = Design(**data.get("design", {}))
    case = SweepCase(command, fixed, axes, design, dict(data.get("wake", {})))
    _check_keys(case)
    _check_design(case)
    _check_wake(case)
    return case


def _flat(axes: dict[str, Any]) -> dict[str, Any]:
    """Axes by name; what TOML's dots made tables of is one name again."""
    found = {}
    for name, value in axes.items():
        if isinstance(value, dict) and not _STEPS & set(value):
            found |= {f"{name}.{key}": inner for key, inner in value.items()}
        else:
            found[name] = value
    return found


def _axis(name: str, value: Any, command: Command) -> Axis:
    allowed, where = quantity(name, command).range, f"[axes] {name}"
    if isinstance(value, dict):
        return _steps(name, value, allowed)
    if not isinstance(value, list | tuple) or not value:
        raise InputError(f"{where} must be a list of numbers or {{from, to, points}}, but is {shown(value)}")
    numbers = tuple(_number(where, one, allowed, name == "height") for one in value)
    if len(set(numbers)) < len(numbers):
        raise InputError(f"{where} must hold each value once, but is {shown(value)}")
    return Axis(name, numbers, min(numbers), max(numbers))


def _number(where: str, value: Any, allowed: Range, endless: bool = False) -> float:
    if endless and value == math.inf:
        return math.inf
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise InputError(f"{where} must hold numbers, but holds {shown(value)}")
    try:
        return float(check_range(where, value, allowed))
    except InputError:
        raise InputError(f"{where} must be {allowed} throughout, but holds {shown(value)}") from None


def _steps(name: str, given: dict[str, Any], allowed: Range) -> Axis:
    where = f"[axes] {name}"
    if not {"from", "to"} <= set(given) <= _STEPS:
        raise InputError(f"{where} must be {{from, to, points}}, but has {', '.join(given) or 'nothing'}")
    low, high = (_number(f"{where}.{end}", given[end], allowed) for end in ("from", "to"))
    if "points" not in given:
        return Axis(name, (), low, high)
    count = given["points"]
    if isinstance(count, bool) or not isinstance(count, int) or not 2 <= count <= MOST_POINTS or low == high:
        raise InputError(f"{where} must have two or more points between two values, but is {shown(given)}")
    return Axis(name, tuple(float(v) for v in np.linspace(low, high, count)), min(low, high), max(low, high))


def _check_keys(case: SweepCase) -> None:
    """What is fixed and what varies goes together and belongs to the command."""
    allowed = {"rotor", *TEXTS[case.command], *NUMBERS[case.command]}
    for name in case.fixed:
        if name not in allowed:
            raise InputError(f"[case] {name} must be left out with command '{case.command}', which does not have it")
        if name in (axis.name for axis in case.axes):
            raise InputError(f"[case] {name} must be left out where it is an axis, but is {shown(case.fixed[name])}")
    given = [*case.fixed, *(axis.name for axis in case.axes)]
    for same in EITHER[case.command]:
        both = [name for name in same if name in given]
        if len(both) > 1:
            raise InputError(f"[case] and [axes] must hold one of {', '.join(same)}, but hold {' and '.join(both)}")
    if case.command == "trim" and not any(name in given for name in TRIM_NEEDS):
        raise InputError(f"[case] or [axes] must hold {' or '.join(TRIM_NEEDS)} for a trim, but hold neither")
    if "slope_deg" in given and "height" not in given:
        raise InputError("[case] or [axes] must hold height where there is slope_deg, but do not")
    if case.command == "inflow" and case.model == FREE_WAKE and {"thrust_coefficient", "weight"} & set(given):
        raise InputError(
            "[case] and [axes] must hold collective_deg for the free wake of rigid blades, but hold a thrust: take "
            f"command = 'trim' and inflow = '{FREE_WAKE}'"
        )


def _check_design(case: SweepCase) -> None:
    kind, points = case.design.kind, case.design.points
    if kind == "random":
        if not points:
            raise InputError("[design] points must say how many for a random design, but is missing")
        for axis in case.axes:
            if math.inf in axis.values:
                raise InputError(f"[axes] {axis.name} must be finite in a random design, but holds inf")
        return
    if points or case.design.seed:
        raise InputError("[design] points and seed must come with kind = 'random', without which they have no effect")
    for axis in case.axes:
        if not axis.values:
            raise InputError(f"[axes] {axis.name} must have points in a grid, but has only its ends")
    count = math.prod(len(axis.values) for axis in case.axes)
    if count > MOST_POINTS:
        raise InputError(f"[axes] must make at most {MOST_POINTS} points, but make {count}")


def _check_wake(case: SweepCase) -> None:
    if case.model != FREE_WAKE and (case.wake or "quick" in case.fixed):
        what = "[wake]" if case.wake else "[case] quick"
        raise InputError(f"{what} must come with the free wake, but the inflow is that of {case.model}")
    if case.model != "vpbfsm" and "harmonics" in case.fixed:
        raise InputError(f"[case] harmonics must come with model = 'vpbfsm', but the model is '{case.model}'")
    if case.model == FREE_WAKE:
        wake_settings(**case.wake)
