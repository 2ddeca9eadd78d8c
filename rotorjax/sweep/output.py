"""What a sweep leaves behind: sweep.nc, pictures, report.html and, where asked for, a table for simulators."""

from pathlib import Path

import xarray as xr

from rotorjax.io import netcdf
from rotorjax.sweep.figures import draw_all
from rotorjax.sweep.report import write_report
from rotorjax.sweep.run import Swept
from rotorjax.sweep.table import dataset


def failed_lines(swept: Swept) -> list[str]:
    """A line for each point that did not converge."""
    return [f"{point.label}: {one.verdict}" for point, one in swept.failures]


def write_all(swept: Swept, folder: str | Path) -> xr.Dataset:
    """Write the table, pictures and the page into a folder; returns the table. Raises InputError where it cannot."""
    folder, data = Path(folder), dataset(swept)
    netcdf.write(folder / "sweep.nc", data)
    write_report(data, draw_all(data, folder), failed_lines(swept), folder)
    return data
