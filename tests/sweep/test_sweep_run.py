"""A sweep's run with made-up points: kept, resumed, failures named; processes and a cluster give the same table."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from made_up_points import SPEEDS, deadly, made_up, picky, swept

from rotorjax.cli import main
from rotorjax.errors import ArgumentError, InputError
from rotorjax.io import netcdf
from rotorjax.sweep.case import sweep_case
from rotorjax.sweep.pools import Cluster, Processes, packed, unpacked
from tests.browser import opens

TESTS = Path(__file__).parents[1]


@pytest.fixture(autouse=True)
def importable(monkeypatch):
    """Workers find the made-up solver."""
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(TESTS), os.environ.get("PYTHONPATH", "")]))


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    return swept(tmp_path_factory.mktemp("whole"))


def test_each_point_starts_from_its_nearest_neighbour(whole):
    assert whole["CP"].dims == ("advance_ratio", "thrust_coefficient")
    assert set(whole["verdict"].to_numpy().ravel()) == {"converged"}
    trace = whole["residual"].to_numpy() / 1e-9 - 1
    assert np.sum(np.abs(trace) < 1e-12) == 1  # the first alone from nothing
    near = whole["CP"].to_numpy()[:-1, 0]
    np.testing.assert_allclose(trace[1:, 0], near, rtol=1e-6)


class Stopping:
    """Makes points up, some of them."""

    def __init__(self, stop_after):
        self.left, self.calls = stop_after, 0

    def __call__(self, prepared, start=None, progress=None):
        if self.left == self.calls:
            raise KeyboardInterrupt
        self.calls += 1
        return made_up(prepared, start, progress)


@pytest.mark.parametrize("stop", [1, 6])
def test_what_was_stopped_goes_on_and_ends_alike(tmp_path, whole, stop):
    with pytest.raises(KeyboardInterrupt):
        swept(tmp_path, Stopping(stop))
    assert len(list((tmp_path / "points").iterdir())) == stop
    again = Stopping(99)
    xr.testing.assert_identical(swept(tmp_path, again), whole)
    assert again.calls == 14 - stop


def test_a_damaged_file_is_set_aside_and_a_strangers_folder_refused(tmp_path, whole, capsys):
    swept(tmp_path)
    first, second = sorted((tmp_path / "points").iterdir())[:2]
    content = first.read_bytes()
    first.write_bytes(content[:-100])
    second.write_bytes(content)  # sound, but another point's
    xr.testing.assert_identical(swept(tmp_path), whole)
    said = capsys.readouterr().err
    assert f"{first} is damaged" in said
    assert "is of another point (advance_ratio" in said
    assert len(list((tmp_path / "points").glob("*.damaged"))) == 2
    heavier = sweep_case("trim", {"advance_ratio": SPEEDS, "thrust_coefficient": [0.004, 0.006]}, inflow="pitt-peters")
    with pytest.raises(InputError, match=r"of the same sweep, but holds one with case\.inflow uniform instead of"):
        swept(tmp_path, case=heavier)


def test_a_longer_axis_takes_up_what_is_there(tmp_path):
    swept(tmp_path)
    longer = sweep_case(
        "trim", {"advance_ratio": SPEEDS, "thrust_coefficient": [0.004, 0.005, 0.006]}, inflow="uniform"
    )
    again = Stopping(99)
    swept(tmp_path, again, longer)
    assert again.calls == 7


def test_failures_are_named_left_out_and_nothing_starts_from_them(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr("rotorjax.sweep.trims.solve", picky)
    (tmp_path / "case.toml").write_text(
        '[case]\ncommand = "trim"\ninflow = "uniform"\nthrust_coefficient = 0.005\n[axes]\n'
        "advance_ratio = [0.0, 0.05, 0.1, 0.15, 0.2]\n"
    )
    out = tmp_path / "out"
    line = ["sweep", "--case", str(tmp_path / "case.toml"), "--out", str(out)]
    assert main(line) == 1
    printed, said = capsys.readouterr()
    assert "3 of 5 points converged" in printed
    assert "not converged: advance_ratio 0.1: no solution (made up to fail)" in said
    data = netcdf.read(out / "sweep.nc")
    assert list(np.isfinite(data["CT"].to_numpy())) == [True, True, False, True, True]
    assert str(data["verdict"][3].item()) == "stalled (loads within 0.0003: made up to stall)"
    np.testing.assert_allclose(data["residual"][4], 1e-9 * (1 + float(data["CP"][1])))  # not from the two before it
    assert {p.name for p in out.iterdir()} >= {"report.html", "over_advance_ratio.png", "sweep.nc", "points"}
    page = (out / "report.html").read_text()
    assert "made up to fail" in page
    assert "data:image/png" in page
    assert opens(out / "report.html", tmp_path)
    assert main([*line, "--table", str(tmp_path / "t.txt")]) == 2
    assert "2 of 5 did not" in capsys.readouterr().err


def test_no_allowed_point_is_bad_input(tmp_path, capsys):
    (tmp_path / "case.toml").write_text(
        '[case]\ncommand = "inflow"\ncollective_deg = 16.0\nheight = 0.35\n[axes]\nslope_deg = [30.0, 40.0]\n'
    )
    assert main(["sweep", "--case", str(tmp_path / "case.toml"), "--out", str(tmp_path / "out")]) == 2
    assert "No point of the sweep is allowed; at slope_deg 30" in capsys.readouterr().err
    assert not (tmp_path / "out" / "points").exists()


def test_an_interrupt_says_what_is_kept(tmp_path, monkeypatch, capsys):
    def interrupted(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr("rotorjax.sweep.trims.solve", interrupted)
    (tmp_path / "case.toml").write_text('[case]\ncommand="trim"\nweight=5e4\n[axes]\nspeed=[0.0, 10.0]\n')
    assert main(["sweep", "--case", str(tmp_path / "case.toml"), "--out", str(tmp_path / "out")]) == 130
    assert "interrupted; finished points are kept, and the same command continues" in capsys.readouterr().err


KILLED = f"""
import sys
sys.path.insert(0, {str(TESTS)!r})
import jax
jax.config.update("jax_enable_x64", True)
from made_up_points import slow, swept
swept(sys.argv[1], slow)
"""


@pytest.mark.slow
def test_a_killed_sweep_ends_alike(tmp_path, whole):
    for _ in range(int(os.environ.get("ROTORJAX_KILLS", "1"))):
        before = len(list(tmp_path.glob("points/*.nc")))
        process = subprocess.Popen([sys.executable, "-c", KILLED, str(tmp_path)], stderr=subprocess.DEVNULL)
        while process.poll() is None and len(list(tmp_path.glob("points/*.nc"))) < before + 2:
            time.sleep(0.005)
        process.send_signal(signal.SIGKILL)
        process.wait(60)
    xr.testing.assert_identical(swept(tmp_path), whole)


@pytest.mark.slow
def test_two_processes_give_the_same_and_one_that_dies_loses_nothing(tmp_path, whole, monkeypatch, capsys):
    monkeypatch.setenv("MADE_UP_DEATH", str(tmp_path / "dead"))
    pools = []
    found = swept(tmp_path / "out", deadly, pool=lambda line: pools.append(Processes(2, line.say)) or pools[0])
    assert (tmp_path / "dead").exists()
    assert [process.exitcode for process, _ in pools[0]._idle] == [0, 0]  # a killed one's semaphores are warned of
    assert "its job is done again" in capsys.readouterr().err
    xr.testing.assert_identical(found, whole)


@pytest.mark.slow
@pytest.mark.filterwarnings("default")  # of the cluster's event loop and sockets, not of ours
def test_a_cluster_gives_the_same_and_a_worker_that_dies_loses_nothing(tmp_path, whole, monkeypatch):
    pytest.importorskip("distributed")
    monkeypatch.setenv("MADE_UP_DEATH", str(tmp_path / "dead"))
    found = swept(tmp_path / "out", deadly, pool=lambda line: Cluster("local", 2))
    assert (tmp_path / "dead").exists()
    xr.testing.assert_identical(found, whole)


def test_without_dask_it_is_one_line(tmp_path, monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "distributed", None)
    (tmp_path / "case.toml").write_text('[case]\ncommand="trim"\nweight=5e4\n[axes]\nspeed=[0.0, 10.0]\n')
    line = ["sweep", "--case", str(tmp_path / "case.toml"), "--out", str(tmp_path / "out"), "--scheduler", "local"]
    assert main(line) == 2
    assert "rotorjax[cluster]" in capsys.readouterr().err
    assert main([*line[:-2], "--jobs", "0"]) == 2


def test_an_arguments_error_comes_back_from_another_process_as_it_was():
    met = ArgumentError("height", "be positive", "-1")
    with pytest.raises(ArgumentError, match="Argument `height` must be positive, but is -1") as raised:
        unpacked(packed(met))
    assert str(raised.value.under("Key `h` of case.toml")) == "Key `h` of case.toml must be positive, but is -1"
