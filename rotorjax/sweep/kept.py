"""Finished points in files of their own: one for a point, or for the points that were solved at once."""

import hashlib
import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from rotorjax.bench.kept import check_same, fingerprint, taken_up
from rotorjax.io import netcdf
from rotorjax.io.atomic import make_folder
from rotorjax.sweep.design import DesignPoint
from rotorjax.sweep.found import QUANTITIES, Found

STATE = "state_"


@dataclass(frozen=True)
class PointShelf:
    """The folder of a sweep's finished points. table: what they were made with."""

    folder: Path
    table: dict[str, Any]

    @property
    def fingerprint(self) -> str:
        """Twelve characters that change with anything of the table."""
        return fingerprint(self.table)

    def open(self) -> None:
        """Make the folder. Raises InputError where it cannot be written."""
        make_folder(make_folder(self.folder) / "points")

    def path(self, points: Sequence[DesignPoint]) -> Path:
        """File of points that were solved at once; its name is theirs."""
        name = points[0].name
        if len(points) > 1:
            name = hashlib.sha256("".join(point.name for point in points).encode()).hexdigest()[:16]
        return self.folder / "points" / f"{name}.nc"

    def keep(self, points: Sequence[DesignPoint], found: Sequence[Found]) -> None:
        """Keep finished points. Raises InputError where they cannot be written."""
        netcdf.write(self.path(points), _dataset(points, found, self.fingerprint, self.table))

    def take_up(self, points: Sequence[DesignPoint], say: Callable[[str], None]) -> list[Found] | None:
        """What is kept of points, None where nothing is; a file that is damaged or of other points is set aside.

        Raises InputError where it was made with other settings.
        """

        def stranger(data: xr.Dataset) -> str | None:
            check_same(data, self.fingerprint, self.table, self.folder, "sweep")
            held, wanted = list(data["label"].to_numpy()), [point.label for point in points]
            return None if held == wanted else "; ".join(map(str, held[:3]))

        data = taken_up(self.path(points), stranger, say, "point")
        return None if data is None else _founds(data)


def _dataset(
    points: Sequence[DesignPoint], found: Sequence[Found], fingerprint: str, table: dict[str, Any]
) -> xr.Dataset:
    """Points along `point`; states only of one alone."""
    data = xr.Dataset(
        {
            "label": ("point", [point.label for point in points]),
            "verdict": ("point", [one.verdict for one in found]),
            **{
                name: ("point", [one.values.get(name, np.nan) for one in found], _about(name))
                for name in QUANTITIES
                if any(name in one.values for one in found)
            },
        },
        attrs={"fingerprint": fingerprint, "settings": json.dumps(table, ensure_ascii=False)},
    )
    for name, values in found[0].state.items() if len(found) == 1 else ():
        dims = tuple(f"{STATE}{name}_{axis}" for axis in range(values.ndim))
        data[STATE + name] = (dims, values)
    return data


def _about(name: str) -> dict[str, str]:
    return {"units": QUANTITIES[name].unit, "long_name": QUANTITIES[name].about}


def _founds(data: xr.Dataset) -> list[Found]:
    names = [name for name in QUANTITIES if name in data]
    state = {str(n).removeprefix(STATE): data[n].to_numpy() for n in data.data_vars if str(n).startswith(STATE)}
    verdicts = [str(verdict) for verdict in data["verdict"].to_numpy()]
    rows = [{name: float(data[name][k]) for name in names} for k in range(len(verdicts))]
    return [
        Found({} if verdict.startswith("no solution") else row, verdict, state)
        for row, verdict in zip(rows, verdicts, strict=True)
    ]
