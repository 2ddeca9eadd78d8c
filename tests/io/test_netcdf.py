"""Data sets survive the file; what is no file, or was changed after it was sealed, is one line."""

import numpy as np
import pytest
import xarray as xr

from rotorjax.errors import InputError
from rotorjax.io import netcdf


@pytest.fixture
def data():
    values = np.random.default_rng(0).normal(size=(30, 7))
    found = xr.Dataset({"a": (("x", "y"), values, {"units": "1"}), "b": ((), 3.0)})
    return found.assign(s=("x", ["δ"] * 30)).assign_attrs(title="t")


@pytest.mark.parametrize("sealed", [False, True])
def test_round_trip(tmp_path, data, sealed):
    netcdf.write(tmp_path / "a.nc", data)
    xr.testing.assert_identical(netcdf.read(tmp_path / "a.nc", sealed=sealed), data)
    xr.testing.assert_identical(xr.load_dataset(tmp_path / "a.nc"), data)  # the seal is in nobody's way


@pytest.mark.parametrize("content", [None, b"not a file", b""])
@pytest.mark.parametrize("sealed", [False, True])
def test_what_cannot_be_read(tmp_path, content, sealed):
    if content is not None:
        (tmp_path / "a.nc").write_bytes(content)
    with pytest.raises(InputError, match=r"a\.nc: the file must be") as caught:
        netcdf.read(tmp_path / "a.nc", sealed=sealed)
    assert "\n" not in str(caught.value)


def test_any_damage_to_a_sealed_file_is_found(tmp_path, data):
    path, draw = tmp_path / "a.nc", np.random.default_rng(1)
    netcdf.write(path, data)
    whole = path.read_bytes()
    flipped = [whole[:at] + bytes([whole[at] ^ 8]) + whole[at + 1 :] for at in draw.integers(len(whole), size=60)]
    for content in (*flipped, *(whole[:at] for at in draw.integers(len(whole), size=20)), whole + b"x"):
        path.write_bytes(content)
        with pytest.raises(InputError, match="damaged"):
            netcdf.read(path, sealed=True)


def test_files_of_others_have_no_seal_and_are_read_unless_one_is_asked_for(tmp_path, data):
    data.to_netcdf(tmp_path / "a.nc", engine="h5netcdf")
    xr.testing.assert_identical(netcdf.read(tmp_path / "a.nc"), data)
    with pytest.raises(InputError, match="damaged"):
        netcdf.read(tmp_path / "a.nc", sealed=True)


def test_changed_content_under_an_old_seal_is_refused(tmp_path, data):
    netcdf.write(tmp_path / "a.nc", data)
    whole = bytearray((tmp_path / "a.nc").read_bytes())
    whole[len(whole) // 2] ^= 8
    (tmp_path / "a.nc").write_bytes(whole)
    with pytest.raises(InputError, match="damaged"):
        netcdf.read(tmp_path / "a.nc")
