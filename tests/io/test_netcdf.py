"""Data sets survive the file; what is no file is one line."""

import numpy as np
import pytest
import xarray as xr

from rotorjax.errors import InputError
from rotorjax.io import netcdf


def test_round_trip(tmp_path):
    data = xr.Dataset(
        {"a": (("x", "y"), np.random.default_rng(0).normal(size=(30, 7)), {"units": "1"}), "b": ((), 3.0)}
    )
    data = data.assign(s=("x", ["δ"] * 30)).assign_attrs(title="t")
    netcdf.write(tmp_path / "a.nc", data)
    xr.testing.assert_identical(netcdf.read(tmp_path / "a.nc"), data)


@pytest.mark.parametrize("content", [None, b"not a file"])
def test_what_cannot_be_read(tmp_path, content):
    if content is not None:
        (tmp_path / "a.nc").write_bytes(content)
    with pytest.raises(InputError, match=r"must be NetCDF-4, but cannot be read") as caught:
        netcdf.read(tmp_path / "a.nc")
    assert "\n" not in str(caught.value)
