"""The rotors that ship with the package, and the door for everybody else's.

rotor, operating = load("uh60")
rotor, operating = load("my_rotor.toml")
"""

from collections.abc import Mapping
from importlib import resources
from pathlib import Path
from typing import Any

import jax

from rotorjax.checks import closest, shown
from rotorjax.errors import InputError
from rotorjax.operating import OperatingPoint
from rotorjax.rotor.geometry import Rotor
from rotorjax.rotor.rotor_file import read_rotor


def names() -> tuple[str, ...]:
    """Names of the rotors in the catalogue, in alphabetical order."""
    return tuple(sorted(path.stem for path in _folder().glob("*.toml")))


Changes = Mapping[str, Mapping[str, Any]]


def load(name_or_path: str | Path, changes: Changes | None = None) -> tuple[Rotor, OperatingPoint]:
    """Load a rotor, its aerofoil inside, and its nominal operating point: by name, or from one's own TOML file.

    Anything that ends in .toml or is a `Path` is read as a file. changes: as `read_rotor` takes them.

    Raises InputError for a name that the catalogue does not have, with the closest one, and whatever `read_rotor`
    raises for a file.
    """
    path = name_or_path
    if isinstance(path, Path) or (isinstance(path, str) and path.endswith(".toml")):
        return _read(path, changes)
    if name_or_path not in names():
        hint = closest(str(name_or_path), names())
        raise InputError(
            f"Argument `rotor` must be a rotor of the catalogue or a .toml file, but is {shown(name_or_path)}: {hint}"
        )
    return _read(_folder() / f"{name_or_path}.toml", changes)


def _read(path: str | Path, changes: Changes | None) -> tuple[Rotor, OperatingPoint]:
    """Read a file into concrete numbers, inside of jit too."""
    with jax.ensure_compile_time_eval():
        return read_rotor(path, changes)


def _folder() -> Path:
    return Path(str(resources.files("rotorjax.rotor"))) / "data"
