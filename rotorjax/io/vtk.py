"""Points, lines and surfaces for ParaView (.vtk) and, cut into segments, for meshio too (.vtu); plain text."""

import html
import itertools
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
    """Write one whole .vtk file, or a .vtu. lines, polygons: indices of their points. data: a number a point, by name.

    Raises InputError where the path ends otherwise (readers go by the ending), a name has blanks, an array is not as
    long as the points, or the file cannot be written.
    Source: The VTK User's Guide, "Simple legacy formats" and "XML file formats".
    """
    if (ending := Path(path).suffix.lower()) not in (".vtk", ".vtu"):
        raise InputError(f"Argument `path` must end in .vtk (for ParaView) or .vtu (for meshio too), but is '{path}'")
    for name, values in data.items():
        if not name or any(c.isspace() for c in name) or len(values) != len(points):
            raise InputError(
                f"Argument `data` must hold one number a point ({len(points)}) under a name without blanks, but "
                f"{name!r} holds {len(values)}"
            )
    if ending == ".vtu":
        return write_text(path, _unstructured(points, [*_segments(lines), *polygons], data))
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


CELLS = {2: 3, 3: 5, 4: 9}  # numbers of points and VTK's types: line, triangle, quad; more are a polygon, 7


def _segments(lines: Sequence[Sequence[int]]) -> list[tuple[int, int]]:
    return [pair for line in lines for pair in itertools.pairwise(line)]


def _unstructured(points: np.ndarray, cells: Sequence[Sequence[int]], data: Mapping[str, np.ndarray]) -> str:
    """An XML file of type UnstructuredGrid."""

    def array(name: str, kind: str, rows: Iterable[str], parts: int = 1) -> str:
        head = f'<DataArray type="{kind}" Name="{html.escape(name)}" NumberOfComponents="{parts}" format="ascii">'
        return "\n".join([head, *rows, "</DataArray>"])

    types, ends = (CELLS.get(len(c), 7) for c in cells), itertools.accumulate(len(c) for c in cells)
    values = [array(name, "Float64", _rows(np.asarray(v)[:, None])) for name, v in data.items()]
    return "\n".join(
        [
            '<?xml version="1.0"?>',
            '<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian"><UnstructuredGrid>',
            f'<Piece NumberOfPoints="{len(points)}" NumberOfCells="{len(cells)}">',
            "<Points>" + array("points", "Float64", _rows(points), 3) + "</Points>",
            "<Cells>" + array("connectivity", "Int64", (" ".join(map(str, c)) for c in cells)),
            array("offsets", "Int64", map(str, ends)) + array("types", "UInt8", map(str, types)) + "</Cells>",
            "<PointData>" + "\n".join(values) + "</PointData>",
            "</Piece></UnstructuredGrid></VTKFile>\n",
        ]
    )


def write_series(path: str | Path, names: Iterable[str], times: Iterable[float]) -> None:
    """Write a .vtk.series file, which tells ParaView the time (s) of each file beside it."""
    files = [{"name": name, "time": float(time)} for name, time in zip(names, times, strict=True)]
    write_text(path, json.dumps({"file-series-version": "1.0", "files": files}, indent=1) + "\n")


def _rows(values: Float[np.ndarray, "N C"]) -> list[str]:
    return [" ".join(f"{v:.9g}" for v in row) for row in values]
