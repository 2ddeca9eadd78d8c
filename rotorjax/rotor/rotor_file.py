"""Rotor files: TOML with the tables [rotor], [airfoil], [operating] and, for an articulated blade, [hinge].

A user's own file works as the catalogue's do: rotorjax/rotor/data/uh60.toml shows most keys. Paths in it are relative
to it. Every mistake is refused in one line that names the file, the key, the value and what is allowed; so is a key
that would have no effect beside the others. Further keys:

    [rotor]
    linear_twist_deg = -8.0      # in place of twist_deg: from axis to tip, zero at 0.75 R
    rotation = "clockwise"       # seen from above; else counter-clockwise. Azimuth counts in the direction of rotation
    [airfoil]
    full_range = "flat plate"    # beyond the table's angles, where no full_range_file is at hand
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from rotorjax.checks import Range
from rotorjax.errors import InputError
from rotorjax.io.toml_file import Key, Schema, Tables, read_toml
from rotorjax.operating import OperatingPoint, operating_point
from rotorjax.rotor import geometry
from rotorjax.rotor.airfoil import AirfoilTable, airfoil_table
from rotorjax.rotor.airfoil_io import Section, read_columns, read_section
from rotorjax.rotor.derived import check_rotor
from rotorjax.rotor.full_range import FLAT_PLATE, completed
from rotorjax.rotor.geometry import ROTATIONS

_RPM = Range(0.0, 200_000.0, "1/min", above=True, hint='a clockwise rotor has rotation = "clockwise" in [rotor]')
_LENGTH = Range(0.0, 100.0, "m")
SCHEMA: Schema = {
    "rotor": {
        "name": Key("text", required=True),
        "blades": Key("whole number", Range(1, geometry.MOST_BLADES), required=True),
        "radius": Key("number", geometry.RADIUS, required=True),
        "root_cutout": Key("number", Range(0.0, 0.95, "R"), required=True),
        "tip_loss": Key("number", Range(0.0, 1.0, "R", above=True)),
        "chord": Key("stations", geometry.CHORD, required=True),
        "twist_deg": Key("stations", Range(-90.0, 90.0, "deg")),
        "linear_twist_deg": Key("number", Range(-60.0, 60.0, "deg")),
        "sweep_deg": Key("stations", Range(-79.0, 79.0, "deg")),
        "rotation": Key("text", choices=ROTATIONS),
    },
    "airfoil": {
        "name": Key("text"),
        "file": Key("text"),
        "lift_file": Key("text"),
        "drag_file": Key("text"),
        "full_range_file": Key("text"),
        "full_range": Key("text", choices=(FLAT_PLATE,)),
        "symmetric": Key("true or false"),
        "prandtl_glauert": Key("true or false"),
    },
    "operating": {
        "rpm": Key("number", _RPM, required=True),
        "density": Key("number", Range(1e-3, 2000.0, "kg/m3")),
        "sound_speed": Key("number", Range(100.0, 3000.0, "m/s")),
        "viscosity": Key("number", Range(1e-8, 1e-1, "m2/s")),
        "collective_deg": Key("number", Range(-45.0, 45.0, "deg"), required=True),
        "climb": Key("number", Range(-200.0, 200.0, "m/s")),
    },
    "hinge": {
        "offset": Key("number", _LENGTH, required=True),
        "blade_mass": Key("number", Range(0.0, 1e5, "kg", above=True), required=True),
        "first_moment": Key("number", Range(0.0, 1e7, "kg m", above=True), required=True),
        "flap_inertia": Key("number", Range(0.0, 1e9, "kg m2", above=True), required=True),
        "delta3_deg": Key("number", Range(-80.0, 80.0, "deg")),
        "precone_deg": Key("number", Range(-30.0, 30.0, "deg")),
        "flap_spring": Key("number", Range(0.0, 1e10, "N m/rad")),
        "lag_spring": Key("number", Range(0.0, 1e10, "N m/rad")),
        "lag_damper_file": Key("text"),
        "lag_damper_arm": Key("number", Range(0.0, 10.0, "m", above=True)),
    },
}
_NAMES = {
    **{"twist": "[rotor] twist_deg", "sweep": "[rotor] sweep_deg", "omega": "[operating] rpm"},
    **{"hinge.damper": "[hinge] lag_damper_file", "hinge.damper_arm": "[hinge] lag_damper_arm"},
}


_EITHER = {"twist_deg": "linear_twist_deg", "linear_twist_deg": "twist_deg"}


def read_rotor(
    path: str | Path, changes: Mapping[str, Mapping[str, Any]] | None = None
) -> tuple[geometry.Rotor, OperatingPoint]:
    """Read a rotor and its nominal operating point from a TOML file.

    changes: values by table and key in place of the file's, as {"rotor": {"chord": 0.5}}; a linear twist takes the
    place of a table of twist, and the other way round.

    Raises InputError, naming file, key and value, for a file that is not there or not TOML, a key that is missing,
    misspelt, of the wrong type or without effect beside the others, a value out of range, a table that has gaps or does
    not cover the blade, and a rotor whose solidity or tip Mach number no rotor has.
    """
    changed = {table: dict(values) for table, values in (changes or {}).items()}
    for key in _EITHER.keys() & changed.get("rotor", {}).keys():
        changed["rotor"].setdefault(_EITHER[key], None)
    return read_toml(path, SCHEMA, _build, _NAMES, optional=("hinge",), changes=changed)


def _build(data: Tables, folder: Path) -> tuple[geometry.Rotor, OperatingPoint]:
    body, air = data["rotor"], data["operating"]
    rotor = geometry.rotor(
        name=body["name"],
        blades=body["blades"],
        radius=body["radius"],
        root_cutout=body["root_cutout"],
        tip_loss=body.get("tip_loss", geometry.TIP_LOSS),
        chord=body["chord"],
        twist=_in_radians(_twist(body)),
        sweep=_in_radians(body.get("sweep_deg", 0.0)),
        airfoil=_airfoil(data["airfoil"], folder),
        hinge=_hinge(data["hinge"], folder) if "hinge" in data else None,
        rotation=body.get("rotation", ROTATIONS[0]),
    )
    optional = {k: air[k] for k in ("density", "sound_speed", "viscosity", "climb") if k in air}
    omega = air["rpm"] * 2 * np.pi / 60
    operating = operating_point(omega, collective=float(np.deg2rad(air["collective_deg"])), **optional)
    check_rotor(rotor, operating)
    return rotor, operating


def _twist(body: dict[str, Any]) -> Any:
    given = body.get("twist_deg", 0.0)
    if "linear_twist_deg" in body:
        if "twist_deg" in body:
            raise InputError("[rotor] must have twist_deg or linear_twist_deg, but has both")
        return [0.0, 1.0], [-0.75 * body["linear_twist_deg"], 0.25 * body["linear_twist_deg"]]
    if isinstance(given, float) and given != 0:
        raise InputError(
            f"[rotor] twist_deg must be a table over the span, but is {given:g}, which only adds to the collective: "
            f"for {given:g} deg from axis to tip write linear_twist_deg = {given:g} (zero at 0.75 R)"
        )
    return given


def _in_radians(value: Any) -> Any:
    return (value[0], np.deg2rad(value[1])) if isinstance(value, tuple) else float(np.deg2rad(value))


def _airfoil(section: dict[str, Any], folder: Path) -> AirfoilTable:
    single, pair = "file" in section, {"lift_file", "drag_file"} & set(section)
    if single == bool(pair) or (pair and len(pair) < 2):
        given = ", ".join(k for k in section if k.endswith("file")) or "neither"
        raise InputError(f"[airfoil] must have either 'file' or both 'lift_file' and 'drag_file', but has {given}")
    if "full_range" in section and "full_range_file" in section:
        raise InputError("[airfoil] must have 'full_range_file' or 'full_range', but has both")
    paths = [folder / section[k] for k in ("file", "lift_file", "drag_file") if k in section]
    lift, drag = read_section(*paths)
    outer: Section | str | None = section.get("full_range")
    if "full_range_file" in section:
        outer = read_section(folder / section["full_range_file"])
    alpha, mach, cl, cd = completed(lift, drag, outer, symmetric=section.get("symmetric", False))
    name = section.get("name", paths[0].stem)
    if isinstance(outer, str):  # said wherever the section is named
        name += f", {outer} beyond {lift[0][0] if lift[0][0] < 0 else -lift[0][-1]:g} to {lift[0][-1]:g} deg"
    return airfoil_table(alpha, mach, cl, cd, name, section.get("prandtl_glauert", False))


def _hinge(section: dict[str, Any], folder: Path) -> geometry.Hinge:
    numbers = {k: section[k] for k in ("offset", "blade_mass", "first_moment", "flap_inertia")}
    angles = {
        k.removesuffix("_deg"): float(np.deg2rad(section[k])) for k in ("delta3_deg", "precone_deg") if k in section
    }
    springs = {k: section[k] for k in ("flap_spring", "lag_spring") if k in section}
    given = {"lag_damper_file", "lag_damper_arm"} & set(section)
    if len(given) == 1:
        missing = ({"lag_damper_file", "lag_damper_arm"} - given).pop()
        raise InputError(f"[hinge] {given.pop()} must come with {missing}, without which it has no effect")
    if not given:
        return geometry.hinge(**numbers, **angles, **springs)
    damper = read_columns(folder / section["lag_damper_file"], ("rate", "force"))
    return geometry.hinge(**numbers, **angles, **springs, damper_arm=section["lag_damper_arm"], damper=damper)
