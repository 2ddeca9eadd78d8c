"""Labelled arrays in NetCDF-4 files."""

from pathlib import Path

import xarray as xr

from rotorjax.errors import InputError
from rotorjax.io.atomic import whole_file


def write(path: str | Path, dataset: xr.Dataset) -> None:
    """Write a whole NetCDF-4 file, arrays compressed. Raises InputError where it cannot be written."""
    packed = {k: {"zlib": True} for k, v in dataset.variables.items() if v.dtype.kind in "fi" and v.size > 64}
    with whole_file(path) as temporary:
        dataset.to_netcdf(temporary, engine="h5netcdf", encoding=packed)


def read(path: str | Path) -> xr.Dataset:
    """Read a NetCDF-4 file into memory. Raises InputError where it is not there or not one."""
    try:
        return xr.load_dataset(path, engine="h5netcdf")
    except (OSError, ValueError) as error:
        reason = str(error).splitlines()[0]
        raise InputError(f"{path}: the file must be NetCDF-4, but cannot be read: {reason}") from None
