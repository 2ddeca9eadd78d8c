"""A sweep as one labelled table, in memory, in sweep.nc and on the screen."""

import json

import numpy as np
import xarray as xr

from rotorjax.sweep.design import grid_shape
from rotorjax.sweep.found import QUANTITIES
from rotorjax.sweep.keys import quantity
from rotorjax.sweep.run import Swept

SHOWN = ("CT", "CP", "figure_of_merit", "lambda_0", "lambda_1c", "collective_deg", "power")
HEADS = {
    "CT": "C_T",
    "CP": "C_P",
    "figure_of_merit": "FM",
    "lambda_0": "λ₀",
    "lambda_1c": "λ₁c",
    "collective_deg": "θ₀, deg",
    "power": "power, kW",
}
LONGEST = 60
"""Rows that the screen gets; the file has all."""


def dataset(swept: Swept) -> xr.Dataset:
    """The table: of a grid with a dimension for each axis, of a random design with `point` alone.

    Values are NaN where there is no solution; `verdict` says why, and how good the loads are where a point stalled.
    """
    random = swept.case.design.kind == "random"
    dims = ("point",) if random else tuple(axis.name for axis in swept.case.axes)
    shape = grid_shape(swept.case)
    data = xr.Dataset(attrs=_attributes(swept))
    for k, axis in enumerate(swept.case.axes):
        values = [point.values[k][1] for point in swept.points] if random else list(axis.values)
        found = quantity(axis.name, swept.case.command)
        about = {"units": found.unit, "long_name": found.about}
        data = data.assign_coords({axis.name: ("point" if random else axis.name, values, about)})
    for name, about in QUANTITIES.items():
        column = [one.values.get(name, np.nan) for one in swept.found]
        if name not in data.coords and any(name in one.values for one in swept.found):
            data[name] = (dims, np.reshape(column, shape), {"units": about.unit, "long_name": about.about})
    verdicts = np.reshape(np.array([one.verdict for one in swept.found], object), shape)
    data["verdict"] = (dims, verdicts, {"long_name": "converged, stalled (accuracy of the loads) or no solution (why)"})
    return data


def _attributes(swept: Swept) -> dict[str, str]:
    return {
        "title": f"{swept.case.command} of {swept.table['rotor']}, {swept.case.model}",
        "rotor": str(swept.table["rotor"]),
        "command": swept.case.command,
        "model": swept.case.model,
        "design": swept.case.design.kind,
        "settings": json.dumps(swept.table, ensure_ascii=False),
    }


def rows(data: xr.Dataset) -> tuple[list[str], list[list[float | str]]]:
    """Head and rows of a table for readers: axes, the numbers that are looked at first, verdict."""
    axes = axes_of(data)
    names = [name for name in SHOWN if name in data.data_vars and np.isfinite(data[name]).any()]
    flat = data.stack(row=list(data["verdict"].dims), create_index=False) if data["verdict"].ndim > 1 else data
    columns = [flat[name].to_numpy() for name in axes] + [
        flat[name].to_numpy() / (1e3 if name == "power" else 1.0) for name in names
    ]
    verdicts = [str(verdict) for verdict in flat["verdict"].to_numpy()]
    head = [*axes, *(HEADS[name] for name in names), "verdict"]
    return head, [[*(float(column[k]) for column in columns), verdict] for k, verdict in enumerate(verdicts)]


def axes_of(data: xr.Dataset) -> list[str]:
    """Names of the axes."""
    return [str(name) for name in data.coords]


def text(data: xr.Dataset) -> str:
    """The table for the screen."""
    head, lines = rows(data)
    cells = [head, *([*(f"{value:.5g}" for value in line[:-1]), str(line[-1])] for line in lines[:LONGEST])]
    widths = [max(len(line[k]) for line in cells) for k in range(len(head))]
    out = [
        "  ".join([*(f"{cell:>{width}}" for cell, width in zip(line[:-1], widths, strict=False)), line[-1]])
        for line in cells
    ]
    if len(lines) > LONGEST:
        out.append(f"… and {len(lines) - LONGEST} more in sweep.nc")
    return "\n".join(out)


def verdicts(data: xr.Dataset) -> dict[str, int]:
    """How many points have which verdict, by its first words."""
    kinds = [str(verdict).partition(" (")[0] for verdict in data["verdict"].to_numpy().ravel()]
    return {kind: kinds.count(kind) for kind in ("converged", "stalled", "no solution") if kind in kinds}
