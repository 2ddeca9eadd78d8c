"""Finished cases of a study in files of their own: kept as each is done, taken up again, set aside where damaged."""

from collections.abc import Callable, Sequence
from pathlib import Path

import xarray as xr

from rotorjax.bench.cases import Case
from rotorjax.bench.kept import check_same, taken_up
from rotorjax.bench.settings import StudySettings
from rotorjax.bench.wake_file import case_of
from rotorjax.io import netcdf
from rotorjax.io.atomic import make_folder


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
    found = {case: _kept(folder, case, settings, say) for case in cases}
    return {case: data for case, data in found.items() if data is not None}


def _kept(folder: Path, case: Case, settings: StudySettings, say: Callable[[str], None]) -> xr.Dataset | None:
    def stranger(data: xr.Dataset) -> str | None:
        held = case_of(data)
        check_same(data, settings.fingerprint(), settings.table(), folder, "study")
        return None if held == case else held.label

    return taken_up(path_of(folder, case), stranger, say)
