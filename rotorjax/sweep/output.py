"""What a sweep leaves behind: sweep.nc, pictures, report.html and, where asked for, a table for simulators."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import xarray as xr

from rotorjax.bench.markdown import table
from rotorjax.io import netcdf
from rotorjax.io.page import write_page
from rotorjax.sweep.figures import draw_all
from rotorjax.sweep.run import Swept
from rotorjax.sweep.table import axes_of, dataset, rows, verdicts


def failed_lines(swept: Swept) -> list[str]:
    """A line for each point that did not converge."""
    return [f"{point.label}: {one.verdict}" for point, one in swept.failures]


def write_all(swept: Swept, folder: str | Path) -> xr.Dataset:
    """Write the table, pictures and the page into a folder; returns the table. Raises InputError where it cannot."""
    folder, data = Path(folder), dataset(swept)
    netcdf.write(folder / "sweep.nc", data)
    write_report(data, draw_all(data, folder), failed_lines(swept), folder)
    return data


MOST_ROWS = 2000


def write_report(data: xr.Dataset, drawn: Mapping[str, str], failed: Sequence[str], folder: Path) -> None:
    """Write the page. drawn: pictures in the folder with their captions. failed: a line for each point."""
    write_page(folder / "report.html", markdown(data, drawn, failed))


def markdown(data: xr.Dataset, drawn: Mapping[str, str], failed: Sequence[str]) -> str:
    """The report in Markdown."""
    head, lines = rows(data)
    cut = f"\n\nThe first {MOST_ROWS} of {len(lines)}; sweep.nc has all." if len(lines) > MOST_ROWS else ""
    parts = [
        f"# Sweep: {data.attrs['title']}",
        answer(data),
        *(["## Pictures", *(f"![{name}]({name})\n\n{caption}" for name, caption in drawn.items())] if drawn else []),
        *(["## Points that did not converge", "\n".join(f"- {line}" for line in failed)] if failed else []),
        "## Table\n\n" + table(head, lines[:MOST_ROWS]) + cut,
        "## Settings\n\n" + table(("setting", "value"), json.loads(data.attrs["settings"]).items()),
    ]
    return "\n\n".join(parts) + "\n"


def answer(data: xr.Dataset) -> str:
    """How many points converged, and the best ones."""
    counts = ", ".join(f"{count} {kind}" for kind, count in verdicts(data).items())
    found = [f"{data['verdict'].size} points over {', '.join(axes_of(data))}: {counts}."]
    for name, words, best in (
        ("figure_of_merit", "Greatest figure of merit", np.nanargmax),
        ("CP", "Least C_P", np.nanargmin),
    ):
        if name in data and np.isfinite(data[name]).any():
            values = data[name].to_numpy()
            place = np.unravel_index(int(best(values)), values.shape)
            at = data.isel(dict(zip(data[name].dims, map(int, place), strict=True)))
            where = ", ".join(f"{axis} = {float(at[axis]):.5g}" for axis in axes_of(data))
            found.append(f"{words}: {float(values[place]):.5g} at {where}.")
    return "\n".join(f"- {line}" for line in found)
