"""Points, lines and surfaces for ParaView: legacy VTK files in plain text."""

import json
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

import numpy as np
from jaxtyping import Float

from rotorjax.errors import InputError
from rotorjax.io.atomic import write_text


def write_polydata(
    path: str | Path,
    points: Float[np.ndarray, "N 3"],
    lines: Sequence[Sequence[int]],
    polygons: Sequence[Sequence[int]],
    data: Mapping[str, Float[np.ndarray, " N"]],
    title: str = "rotorjax",
) -> None:
    """Write one whole .vtk file. lines, polygons: indices of their points. data: a number a point, by name.

    Raises InputError where a name has blanks, an array is not as long as the points, or the file cannot be written.
    Source: The VTK User's Guide, "Simple legacy formats".
    """
    for name, values in data.items():
        if not name or any(c.isspace() for c in name) or len(values) != len(points):
            raise InputError(
                f"Argument `data` must hold one number a point ({len(points)}) under a name without blanks, but "
                f"{name!r} holds {len(values)}"
            )
    text = ["# vtk DataFile Version 3.0", title.replace("\n", " ")[:255], "ASCII", "DATASET POLYDATA"]
    text += [f"POINTS {len(points)} double", *_rows(points)]
    for keyword, cells in (("LINES", lines), ("POLYGONS", polygons)):
        if len(cells):
            text.append(f"{keyword} {len(cells)} {sum(len(c) + 1 for c in cells)}")
            text += [" ".join(map(str, (len(c), *c))) for c in cells]
    if data:
        text.append(f"POINT_DATA {len(points)}")
    for name, values in data.items():
        text += [f"SCALARS {name} double 1", "LOOKUP_TABLE default", *_rows(np.asarray(values)[:, None])]
    write_text(path, "\n".join(text) + "\n")


def write_series(path: str | Path, names: Iterable[str], times: Iterable[float]) -> None:
    """Write a .vtk.series file, which tells ParaView the time (s) of each file beside it."""
    files = [{"name": name, "time": float(time)} for name, time in zip(names, times, strict=True)]
    write_text(path, json.dumps({"file-series-version": "1.0", "files": files}, indent=1) + "\n")


def _rows(values: Float[np.ndarray, "N C"]) -> list[str]:
    return [" ".join(f"{v:.9g}" for v in row) for row in values]
