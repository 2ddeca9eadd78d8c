"""Labelled arrays in NetCDF-4 files."""

import hashlib
import io
from pathlib import Path
from typing import TYPE_CHECKING

from rotorjax.errors import InputError
from rotorjax.io.atomic import write_bytes
from rotorjax.io.reading import read_bytes

if TYPE_CHECKING:
    import xarray as xr

SEAL = b"rotorjax-sha256:"
SEAL_SIZE = len(SEAL) + hashlib.sha256().digest_size


def write(path: str | Path, dataset: "xr.Dataset") -> None:
    """Write a whole NetCDF-4 file, arrays compressed. Raises InputError where it cannot be written.

    It is made in memory, for on a full disk the HDF5 library ends the process, and sealed: at its end, where other
    readers of NetCDF do not look, stands a digest.
    """
    packed = {k: {"zlib": True} for k, v in dataset.variables.items() if v.dtype.kind in "fi" and v.size > 64}
    content = bytes(dataset.to_netcdf(engine="h5netcdf", encoding=packed))
    write_bytes(path, content + _seal(content))


def read(path: str | Path, *, sealed: bool = False) -> "xr.Dataset":
    """Read a NetCDF-4 file into memory. sealed: refuse what has no seal, be it sound or not.

    Raises InputError where it is not there, not NetCDF-4 or not as its seal says: the HDF5 library would take some
    damaged files for sound, crash at others or read them for ever.
    """
    import xarray as xr

    content = read_bytes(path)
    body, seal = content[:-SEAL_SIZE], content[-SEAL_SIZE:]
    if (sealed or seal.startswith(SEAL)) and seal != _seal(body):
        raise InputError(f"{path}: the file must be as it was written, but is damaged")
    try:
        return xr.load_dataset(io.BytesIO(content), engine="h5netcdf")
    except Exception as error:  # h5py, h5netcdf and xarray raise what they meet: KeyError, RuntimeError, OSError …
        reason = (str(error).splitlines() or [type(error).__name__])[0]
        raise InputError(f"{path}: the file must be NetCDF-4, but cannot be read: {reason}") from None


def _seal(content: bytes) -> bytes:
    return SEAL + hashlib.sha256(content).digest()
