"""Rotor files: TOML with the tables [rotor], [airfoil], [operating] and, for an articulated blade, [hinge].

A user's own file works as the catalogue's do: rotorjax/rotor/data/uh60.toml shows every key. Paths in it are relative
to it. Every mistake is refused in one line that names the file, the key, the value and what is allowed.
"""

import tomllib
from pathlib import Path
from typing import Any

import numpy as np

from rotorjax.checks import closest
from rotorjax.errors import InputError
from rotorjax.operating import OperatingPoint, operating_point
from rotorjax.rotor import airfoil_io, geometry
from rotorjax.rotor.airfoil import AirfoilTable, airfoil_table

# key: (required, type). "table" is a number or {r = [...], value = [...]}; "number" is an int or a float but no bool.
_KEYS: dict[str, dict[str, tuple[bool, str]]] = {
    "rotor": {
        "name": (True, "text"),
        "blades": (True, "whole number"),
        "radius": (True, "number"),
        "root_cutout": (True, "number"),
        "tip_loss": (False, "number"),
        "chord": (True, "table"),
        "twist_deg": (False, "table"),
        "sweep_deg": (False, "table"),
    },
    "airfoil": {
        "name": (False, "text"),
        "file": (False, "text"),
        "lift_file": (False, "text"),
        "drag_file": (False, "text"),
        "full_range_file": (False, "text"),
        "symmetric": (False, "true or false"),
        "prandtl_glauert": (False, "true or false"),
    },
    "operating": {
        "rpm": (True, "number"),
        "density": (False, "number"),
        "sound_speed": (False, "number"),
        "viscosity": (False, "number"),
        "collective_deg": (True, "number"),
        "climb": (False, "number"),
    },
    "hinge": {
        "offset": (True, "number"),
        "blade_mass": (True, "number"),
        "first_moment": (True, "number"),
        "flap_inertia": (True, "number"),
        "delta3_deg": (False, "number"),
        "precone_deg": (False, "number"),
        "flap_spring": (False, "number"),
        "lag_spring": (False, "number"),
        "lag_damper_file": (False, "text"),
        "lag_damper_arm": (False, "number"),
    },
}
_REQUIRED_TABLES = ("rotor", "airfoil", "operating")


def read_rotor(path: str | Path) -> tuple[geometry.Rotor, OperatingPoint]:
    """Read a rotor and its nominal operating point from a TOML file.

    Raises InputError, naming file, key and value, for a file that is not there or not TOML, a key that is missing,
    misspelt or of the wrong type, a value out of range, or a table that has gaps or does not cover the blade.
    """
    path = Path(path)
    data = _parse(path)
    try:
        return _build(data, path.parent)
    except InputError as error:
        raise InputError(f"{path}: {error}") from None


def _parse(path: Path) -> dict[str, Any]:
    try:
        return tomllib.loads(path.read_text())
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: the file must be readable text, but is not: {error}") from None
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"{path}: the file must be TOML, but is not: {error}") from None


def _build(data: dict[str, Any], folder: Path) -> tuple[geometry.Rotor, OperatingPoint]:
    _check_keys(data)
    body, air = data["rotor"], data["operating"]
    rotor = geometry.rotor(
        name=body["name"],
        blades=body["blades"],
        radius=body["radius"],
        root_cutout=body["root_cutout"],
        tip_loss=body.get("tip_loss", 1.0),
        chord=_stations("chord", body["chord"]),
        twist=_in_radians(_stations("twist_deg", body.get("twist_deg", 0.0))),
        sweep=_in_radians(_stations("sweep_deg", body.get("sweep_deg", 0.0))),
        airfoil=_airfoil(data["airfoil"], folder),
        hinge=_hinge(data["hinge"], folder) if "hinge" in data else None,
    )
    optional = {k: air[k] for k in ("density", "sound_speed", "viscosity", "climb") if k in air}
    omega = air["rpm"] * 2 * np.pi / 60
    return rotor, operating_point(omega, collective=float(np.deg2rad(air["collective_deg"])), **optional)


def _check_keys(data: dict[str, Any]) -> None:
    for table in data:
        if table not in _KEYS:
            raise InputError(f"[{table}] is not a known table: {closest(table, _KEYS)}")
    for table in _REQUIRED_TABLES:
        if table not in data:
            raise InputError(f"table [{table}] is missing; it must hold {', '.join(_KEYS[table])}")
    for table, values in data.items():
        if not isinstance(values, dict):
            raise InputError(f"[{table}] must be a table, but is {values!r}")
        for key in values:
            if key not in _KEYS[table]:
                raise InputError(f"[{table}] has the unknown key '{key}': {closest(key, _KEYS[table])}")
        for key, (required, kind) in _KEYS[table].items():
            if required and key not in values:
                raise InputError(f"[{table}] must have the key '{key}' ({kind}), but it is missing")
            if key in values:
                _check_kind(f"[{table}] {key}", values[key], kind)


def _check_kind(where: str, value: Any, kind: str) -> None:
    number = isinstance(value, int | float) and not isinstance(value, bool)
    right = {
        "text": isinstance(value, str),
        "whole number": isinstance(value, int) and not isinstance(value, bool),
        "number": number and bool(np.isfinite(value)),
        "true or false": isinstance(value, bool),
        "table": number or (isinstance(value, dict) and set(value) == {"r", "value"}),
    }[kind]
    if not right:
        words = {
            "table": "a number or a table of the two lists r and value",
            "number": "a finite number",
            "text": "text in quotes",
            "whole number": "a whole number",
        }.get(kind, kind)
        raise InputError(f"{where} must be {words}, but is {value!r}")


def _stations(name: str, value: Any) -> Any:
    if not isinstance(value, dict):
        return value
    try:
        return [float(x) for x in value["r"]], [float(x) for x in value["value"]]
    except (TypeError, ValueError):
        raise InputError(f"[rotor] {name} must be two lists of numbers, r and value, but is {value!r}") from None


def _in_radians(value: Any) -> Any:
    return (value[0], np.deg2rad(value[1])) if isinstance(value, tuple) else float(np.deg2rad(value))


def _airfoil(section: dict[str, Any], folder: Path) -> AirfoilTable:
    single, pair = "file" in section, {"lift_file", "drag_file"} & set(section)
    if single == bool(pair) or (pair and len(pair) < 2):
        given = ", ".join(k for k in section if k.endswith("file")) or "neither"
        raise InputError(f"[airfoil] must have either 'file' or both 'lift_file' and 'drag_file', but has {given}")
    alpha, mach, cl, cd = _single(section, folder) if single else _pair(section, folder)
    return airfoil_table(alpha, mach, cl, cd, section.get("name", ""), section.get("prandtl_glauert", False))


def _single(section: dict[str, Any], folder: Path) -> tuple[np.ndarray, ...]:
    path = folder / section["file"]
    if path.suffix.lower() == ".c81":
        return airfoil_io.c81_tables(airfoil_io.read_c81(path))
    alpha, cl, cd = airfoil_io.read_polar(path)
    if section.get("symmetric", False):
        alpha, cl, cd = airfoil_io.mirror(alpha, cl, cd)
    return alpha, np.zeros(1), cl[:, None], cd[:, None]


def _pair(section: dict[str, Any], folder: Path) -> tuple[np.ndarray, ...]:
    lift, drag = (airfoil_io.read_alpha_mach(folder / section[k]) for k in ("lift_file", "drag_file"))
    if "full_range_file" in section:
        alpha, cl, cd = airfoil_io.read_polar(folder / section["full_range_file"])
        lift, drag = airfoil_io.extend(lift, alpha, cl), airfoil_io.extend(drag, alpha, cd)
    return airfoil_io.common_grid(lift, drag)


def _hinge(section: dict[str, Any], folder: Path) -> geometry.Hinge:
    numbers = {k: section[k] for k in ("offset", "blade_mass", "first_moment", "flap_inertia")}
    angles = {
        k.removesuffix("_deg"): float(np.deg2rad(section[k])) for k in ("delta3_deg", "precone_deg") if k in section
    }
    damper = (
        airfoil_io.read_columns(folder / section["lag_damper_file"], ("rate", "force"))
        if "lag_damper_file" in section
        else None
    )
    springs = {k: section[k] for k in ("flap_spring", "lag_spring") if k in section}
    arm = section.get("lag_damper_arm", 0.0)
    return geometry.hinge(**numbers, **angles, **springs, damper_arm=arm, damper=damper)
