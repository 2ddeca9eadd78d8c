"""A case file of rotors, ground and surfaces, for both models (`rotorjax study --config`).

[rotors]                        # hubs over R: x aft, y to starboard, z up
rotor = "knight_hefner_2"
collective_deg = 8.0
x = [0.0, 0.0]
y = [-1.2, 1.2]

[ground]
height = 1.0                    # of the origin over the ground, over R

[wall]                          # and [box], [slab], [mesh]
distance = 2.5
bottom = -1.0
top = 1.0
azimuth_deg = 90.0
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import reduce
from operator import add
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from rotorjax.bench.settings import WAKE_KEYS, StudySettings, study_settings
from rotorjax.checks import Range
from rotorjax.errors import InputError
from rotorjax.ground import Plane, plane
from rotorjax.io.toml_file import Key, Schema, Tables, read_toml
from rotorjax.panels.shapes import box, slab, wall
from rotorjax.panels.stl import read_stl
from rotorjax.panels.surface import Panels
from rotorjax.wake.model import AMONG
from rotorjax.wake.several import SeveralWakes, several_wakes

MOST = 8
"""Rotors of a case."""

_LENGTH, _PANEL = Range(-1e3, 1e3, "R"), Range(0.01, 10.0, "R")
_SIZE = Range(0.0, 1e3, "R", above=True)
_CORNER = Key("numbers", _LENGTH, required=True)
SCHEMA: Schema = {
    "rotors": {
        "rotor": Key("text"),
        "collective_deg": Key("number", Range(-45.0, 45.0, "deg")),
        **{axis: Key("numbers", _LENGTH, required=axis != "z", least=1) for axis in "xyz"},
        "senses": Key("numbers", Range(-1.0, 1.0), least=1),
    },
    "ground": {"height": Key("number", Range(0.0, 100.0, "R", above=True), required=True)},
    "wall": {
        "distance": Key("number", _LENGTH, required=True),
        "bottom": Key("number", _LENGTH, required=True),
        "top": Key("number", _LENGTH, required=True),
        "length": Key("number", _SIZE),
        "azimuth_deg": Key("number", Range(-360.0, 360.0, "deg")),
        "thickness": Key("number", _SIZE),
        "panel": Key("number", _PANEL),
    },
    "box": {"low": _CORNER, "high": _CORNER, "panel": Key("number", _PANEL)},
    "slab": {
        "low": _CORNER,
        "high": _CORNER,
        "top": Key("number", _LENGTH, required=True),
        "thickness": Key("number", _SIZE),
        "panel": Key("number", _PANEL),
    },
    "mesh": {
        "file": Key("text", required=True),
        "scale": Key("number", Range(0.0, 1e6, above=True)),
        "place": Key("numbers", _LENGTH),
        "open": Key("true or false"),
    },
    "wake": WAKE_KEYS,
}


@dataclass(frozen=True)
class Arrangement:
    """Rotors of one kind, the ground under the common origin, and surfaces. settings: rotor, operating point, wake and
    the finite states' harmonics. places (N, 3): hubs over R. senses (N,): 1 counter-clockwise, −1 not.
    """

    name: str
    settings: StudySettings
    places: Float[np.ndarray, "N 3"]
    senses: Float[np.ndarray, " N"]
    ground: Plane | None
    surfaces: Panels | None
    tables: Tables = field(default_factory=dict)

    @property
    def wakes(self) -> SeveralWakes:
        """The free wake of all. Raises InputError where disks meet, cut the ground or a surface."""
        body, operating, wake = self.settings.rotor, self.settings.operating, self.settings.wake
        return several_wakes(
            body, operating, self.places.tolist(), self.senses.tolist(), self.ground, wake, surfaces=self.surfaces
        )


def read_arrangement(path: str | Path, quick: bool = False) -> Arrangement:
    """Read a case file; quick: coarser wakes.

    Raises InputError, naming file and key, for a file that is not there or not TOML, unknown or missing keys, values
    that are not allowed, and rotors, ground and surfaces that do not go together.
    """

    def build(tables: Tables, folder: Path) -> Arrangement:
        found = _build(Path(path).stem, tables, folder, quick)
        _ = found.wakes  # what does not go together is refused here, under the file's name
        return found

    names = {"places": "[rotors] x, y, z", "senses": "[rotors] senses", "surfaces": "the surfaces"}
    return read_toml(path, SCHEMA, build, names, optional=tuple(set(SCHEMA) - {"rotors"}))


def _build(name: str, tables: Tables, folder: Path, quick: bool) -> Arrangement:
    rotors = tables["rotors"]
    places = _places(rotors)
    senses = rotors.get("senses", [1.0 - 2 * (i % 2) for i in range(len(places))])
    if len(senses) != len(places):
        raise InputError(f"[rotors] senses must hold {len(places)} numbers, one a rotor, but holds {len(senses)}")
    kind = rotors.get("rotor", "uh60")
    surfaces = [_SHAPES[table](values, folder) for table, values in tables.items() if table in _SHAPES]
    wake = (AMONG if surfaces else {}) | tables.get("wake", {})
    return Arrangement(
        name,
        study_settings(
            str(folder / kind) if kind.endswith(".toml") else kind, rotors.get("collective_deg"), quick=quick, **wake
        ),
        places,
        np.array(senses, float),
        plane(tables["ground"]["height"]) if "ground" in tables else None,
        reduce(add, surfaces) if surfaces else None,
        tables,
    )


def _places(rotors: dict[str, Any]) -> Float[np.ndarray, "N 3"]:
    """Hubs of the three lists, which are of one length; z is zero where it is not given."""
    x, y = rotors["x"], rotors["y"]
    z = rotors.get("z", [0.0] * len(x))
    if not len(x) == len(y) == len(z) or not 1 <= len(x) <= MOST:
        lengths = ", ".join(str(len(v)) for v in (x, y, z))
        raise InputError(f"[rotors] x, y and z must hold as many numbers, 1 to {MOST}, but hold {lengths}")
    return np.stack([x, y, z], axis=1)


def _mesh(values: dict[str, Any], folder: Path) -> Panels:
    more = {"open_" if name == "open" else name: value for name, value in values.items() if name != "file"}
    return read_stl(folder / values["file"], **more)


_SHAPES: dict[str, Callable[[dict[str, Any], Path], Panels]] = {
    "wall": lambda values, _: wall(**values),
    "box": lambda values, _: box(**values),
    "slab": lambda values, _: slab(**values),
    "mesh": _mesh,
}
