"""Finished work in files of its own: taken up again, set aside where damaged or of something else."""

import hashlib
from collections.abc import Callable
from json import loads
from pathlib import Path
from typing import Any

import xarray as xr

from rotorjax.bench.settings import differences
from rotorjax.errors import InputError
from rotorjax.io import netcdf

DAMAGED = ".damaged"


def taken_up(
    path: Path, stranger: Callable[[xr.Dataset], str | None], say: Callable[[str], None], noun: str = "case"
) -> xr.Dataset | None:
    """What a file keeps, or None where it is not there, damaged, or keeps something else: then it is renamed.

    stranger(data): what else it holds in words, None where it is what was looked for; a KeyError says damaged. `say`
    hears of a file that is set aside. noun: of what is solved again. Raises InputError where it cannot be renamed.
    """
    if not path.exists():
        return None
    try:
        data = netcdf.read(path, sealed=True)
    except InputError:
        return _set_aside(path, "damaged", say, noun)
    try:
        other = stranger(data)
    except KeyError:
        return _set_aside(path, "damaged", say, noun)
    return data if other is None else _set_aside(path, f"of another {noun} ({other})", say, noun)


def fingerprint(table: dict[str, Any]) -> str:
    """Twelve characters that change with anything of a table of settings."""
    return hashlib.sha256(repr(sorted(table.items())).encode()).hexdigest()[:12]


def check_same(data: xr.Dataset, ours: str, table: dict[str, Any], folder: Path, noun: str) -> None:
    """Raise InputError where a file was made with other settings than these; noun: of what the folder is for."""
    if data.attrs.get("fingerprint") == ours:
        return
    what = ", ".join(differences(table, loads(data.attrs.get("settings", "{}")))[:3]) or "other settings"
    raise InputError(f"{folder}: the output folder must be new or of the same {noun}, but holds one with {what}")


def _set_aside(path: Path, what: str, say: Callable[[str], None], noun: str) -> None:
    aside = path.with_name(path.name + DAMAGED)
    try:
        path.replace(aside)
    except FileNotFoundError:
        return  # another run in this folder was faster
    except OSError as error:
        raise InputError(f"{path}: the file must be whole, but is {what}; delete it ({error.strerror})") from None
    say(f"{path} is {what}: renamed to {aside.name}, the {noun} is solved again")
