import os
import sys

import numpy as np
import pytest
import scipy.io
import xarray as xr

from rotorjax.errors import InputError
from rotorjax.ode.export import save_mat, save_netcdf, to_control
from rotorjax.ode.models import LinearModel, PeriodicModel

RNG = np.random.default_rng(0)
A, B, C, D = RNG.normal(size=(3, 3)) - 3 * np.eye(3), RNG.normal(size=(3, 2)), RNG.normal(size=(1, 3)), np.ones((1, 2))
NAMES = ("flap", "inflow.mean", "inflow[1]"), ("collective", "height"), ("CT",)
LINEAR = LinearModel(A, B, C, D, *NAMES, ("rad", "R"), ("-",))
PERIODIC = PeriodicModel(
    np.arange(4.0) * np.pi / 2,
    2 * np.pi,
    *(np.stack([m, 2 * m, 3 * m, 4 * m]) for m in (A, B, C, D)),
    *NAMES,
    ("-", "-", "-"),
    ("rad", "R"),
    ("-",),
    RNG.normal(size=(4, 3)),
    RNG.normal(size=2),
    RNG.normal(size=(4, 1)),
)


def test_control_has_the_same_response_and_names():
    system = to_control(LINEAR)
    omega = np.array([0.1, 1.0, 10.0])
    np.testing.assert_allclose(np.moveaxis(np.asarray(system(1j * omega)), -1, 0), LINEAR.response(omega), rtol=1e-10)
    assert system.input_labels == ["collective", "height"]
    assert system.state_labels[1] == "inflow_mean"


def test_without_control(monkeypatch):
    monkeypatch.setitem(sys.modules, "control", None)
    with pytest.raises(InputError, match=r"rotorjax\[control\]"):
        to_control(LINEAR)


@pytest.mark.parametrize("model", [LINEAR, PERIODIC])
def test_netcdf(model, tmp_path):
    path = save_netcdf(model, tmp_path / "model.nc")
    with xr.open_dataset(path, engine="h5netcdf") as data:
        np.testing.assert_array_equal(data["A"], model.a)
        np.testing.assert_array_equal(data["D"], model.d)
        assert list(data["input"].values) == list(model.inputs)
        assert list(data["input_unit"].values) == ["rad", "R"]
        assert data["B"].sel(input="height").dims[-1] == "state"
    assert os.listdir(tmp_path) == ["model.nc"]


def test_mat(tmp_path):
    data = scipy.io.loadmat(save_mat(LINEAR, tmp_path / "linear.mat"), simplify_cells=True)
    np.testing.assert_array_equal(data["A"], A)
    assert list(data["inputs"]) == ["collective", "height"]
    data = scipy.io.loadmat(save_mat(PERIODIC, tmp_path / "periodic.mat"), simplify_cells=True)
    np.testing.assert_array_equal(data["A"][:, :, 2], PERIODIC.a[2])
    assert data["period"] == 2 * np.pi


def test_a_failed_write_leaves_the_old_file(tmp_path, monkeypatch):
    path = save_mat(LINEAR, tmp_path / "m.mat")
    before = path.read_bytes()

    def broken(file, content):
        file.write(b"half")
        raise OSError("disk full")

    monkeypatch.setattr(scipy.io, "savemat", broken)
    with pytest.raises(OSError, match="disk full"):
        save_mat(LINEAR, path)
    assert path.read_bytes() == before
    assert os.listdir(tmp_path) == ["m.mat"]


def test_missing_folder(tmp_path):
    with pytest.raises(InputError, match="the file must be writable, but is not: No such file"):
        save_mat(LINEAR, tmp_path / "nowhere" / "m.mat")
