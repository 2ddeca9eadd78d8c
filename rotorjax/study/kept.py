"""Finished cases of a study in files of their own: kept as each is done, taken up again, set aside where damaged."""

from collections.abc import Callable, Sequence
from json import loads
from pathlib import Path

import xarray as xr

from rotorjax.bench.cases import Case
from rotorjax.bench.settings import StudySettings, differences
from rotorjax.bench.wake_file import case_of
from rotorjax.errors import InputError
from rotorjax.io import netcdf
from rotorjax.io.atomic import make_folder

DAMAGED = ".damaged"


def path_of(folder: Path, case: Case) -> Path:
    """File of a case in the folder of a study."""
    return folder / "cases" / f"{case.name}.nc"


def keep(folder: Path, case: Case, data: xr.Dataset) -> None:
    """Keep a finished case. Raises InputError where it cannot be written."""
    netcdf.write(path_of(folder, case), data)


def take_up(
    folder: Path, cases: Sequence[Case], settings: StudySettings, say: Callable[[str], None]
) -> dict[Case, xr.Dataset]:
    """The cases that are kept already; a file that is damaged or another case's is renamed, and `say` hears of it.

    Raises InputError where the folder cannot be written or holds another study.
    """
    make_folder(make_folder(folder) / "cases")
    found = {case: _kept(path_of(folder, case), case, settings, say) for case in cases}
    return {case: data for case, data in found.items() if data is not None}


def _kept(path: Path, case: Case, settings: StudySettings, say: Callable[[str], None]) -> xr.Dataset | None:
    if not path.exists():
        return None
    try:
        data = netcdf.read(path, sealed=True)
        held = case_of(data)
    except (InputError, KeyError):
        return _set_aside(path, "damaged", say)
    _check_study(data, settings, path)
    return data if held == case else _set_aside(path, f"of another case ({held.label})", say)


def _set_aside(path: Path, what: str, say: Callable[[str], None]) -> None:
    aside = path.with_name(path.name + DAMAGED)
    try:
        path.replace(aside)
    except FileNotFoundError:
        return  # another run in this folder was faster
    except OSError as error:
        raise InputError(f"{path}: the file must be whole, but is {what}; delete it ({error.strerror})") from None
    say(f"{path} is {what}: renamed to {aside.name}, the case is solved again")


def _check_study(data: xr.Dataset, settings: StudySettings, path: Path) -> None:
    if data.attrs.get("fingerprint") == settings.fingerprint():
        return
    ours, theirs = settings.table(), loads(data.attrs.get("settings", "{}"))
    what = ", ".join(differences(ours, theirs)[:3]) or "other settings"
    raise InputError(
        f"{path.parent.parent}: the output folder must be new or of the same study, but holds one with {what}"
    )
