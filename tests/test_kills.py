"""Killed at any moment, alone or with another run in the same folder, a study loses no finished case.

The wakes are made up and written slowly, so that kills hit waits and writes; as often as one likes with
`ROTORJAX_KILLS=30 pytest tests/test_kills.py`.
"""

import multiprocessing
import os
import random
import signal
import sys
import time
from pathlib import Path

import jax
import pytest
import xarray as xr
from wakes import made_up

from rotorjax.bench.cases import study_cases
from rotorjax.bench.settings import study_settings
from rotorjax.cli import main, script
from rotorjax.io import netcdf
from rotorjax.study import run
from rotorjax.study.run import solve_cases

KILLS = int(os.environ.get("ROTORJAX_KILLS", "4"))
HEIGHTS, SLOPES = [3.0, 2.0, 1.5, 1.0, 0.75], [5.0, 10.0]
FORKS = multiprocessing.get_context("forkserver")  # what takes seconds to import is imported once, jax not yet started
FORKS.set_forkserver_preload(["rotorjax.study.run", "rotorjax.bench.settings", "rotorjax.bench.dataset"])


def slow(model, start, progress):
    time.sleep(0.05)
    return made_up(model, start, progress)


def in_halves(self, content):
    with open(self, "wb") as file:
        for part in (content[: len(content) // 2], content[len(content) // 2 :]):
            file.write(part)
            file.flush()
            time.sleep(0.03)


def study(folder):
    """In a process of its own: all cases, slowly, without a word."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stderr.fileno())
    jax.config.update("jax_enable_x64", True)
    Path.write_bytes = in_halves
    run.add_finite_state = lambda data, settings: data
    solve_cases(study_cases(HEIGHTS, SLOPES), study_settings(), folder, show=False, solver=slow)


def started(folder):
    process = FORKS.Process(target=study, args=(folder,))
    process.start()
    return process


def ended(process):
    """Its exit code."""
    process.join(120)
    return process.exitcode


def kept(folder):
    """Content of each kept file by name, none of them damaged."""
    return {path.name: netcdf.read(path, sealed=True) for path in sorted((folder / "cases").iterdir())}


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """The study that nobody interrupts."""
    folder = tmp_path_factory.mktemp("whole")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(run, "add_finite_state", lambda data, settings: data)
        solve_cases(study_cases(HEIGHTS, SLOPES), study_settings(), folder, show=False, solver=made_up)
    return kept(folder)


def same(ours, theirs):
    assert ours.keys() == theirs.keys()
    for name, data in ours.items():
        xr.testing.assert_identical(data, theirs[name])


def kill_when_some_are_done(folder, chance, how):
    """Kill a run once it has kept a case more, a moment later. Returns the files that were there then."""
    process, before = started(folder), len(list(folder.glob("cases/*.nc")))
    while process.is_alive() and len(list(folder.glob("cases/*.nc"))) == before:
        time.sleep(0.005)
    time.sleep(chance.uniform(0.0, 0.15))
    finished = {path.name: path.read_bytes() for path in folder.glob("cases/*.nc")}
    if process.is_alive():  # where the machine is busy the run may be at its end by now
        os.kill(process.pid, how)
    ended(process)
    return finished


@pytest.mark.slow
def test_kills_at_random_moments_lose_no_finished_case(tmp_path, whole):
    chance, signals = random.Random(7), [signal.SIGKILL, signal.SIGTERM, signal.SIGINT]
    folders = [tmp_path / str(k) for k in range(-(-KILLS // 4))]
    for k in range(KILLS):
        folder = folders[k // 4]
        folder.mkdir(exist_ok=True)
        finished = kill_when_some_are_done(folder, chance, signals[k % 3])
        for name, content in finished.items():
            assert (folder / "cases" / name).read_bytes() == content
    for folder in folders:
        assert ended(started(folder)) == 0
        same(kept(folder), whole)  # no temporary file either


@pytest.mark.slow
def test_two_runs_in_one_folder_end_alike(tmp_path, whole):
    both = [started(tmp_path), started(tmp_path)]
    assert [ended(process) for process in both] == [0, 0]
    same(kept(tmp_path), whole)


STUBS = {
    "simulate": ("rotorjax.simulation.run.fly", ["--case", "{tmp}/case.toml"]),
    "calibrate": ("rotorjax.calibration.hayden_run.run", ["hayden"]),
}
FLIGHT = "[flight]\nthrust_coefficient = 0.00575\n[time]\nduration = 0.1\n"


@pytest.mark.parametrize("command", STUBS)
def test_commands_that_keep_nothing_leave_nothing_and_say_nothing_of_it(tmp_path, command, monkeypatch, capsys):
    def interrupted(*_, **__):
        raise KeyboardInterrupt

    place, arguments = STUBS[command]
    monkeypatch.setattr(place, interrupted)
    (tmp_path / "case.toml").write_text(FLIGHT)
    arguments = [one.format(tmp=tmp_path) for one in arguments]
    assert main([command, *arguments, "--out", str(tmp_path / "out")]) == 130
    assert capsys.readouterr().err.strip().endswith(f"rotorjax {command}: interrupted")
    assert not list((tmp_path / "out").iterdir())


def test_a_cluster_that_asks_to_end_interrupts_a_march(tmp_path, monkeypatch, capsys):
    def asked_to_end(*_, **__):
        os.kill(os.getpid(), signal.SIGTERM)
        time.sleep(60.0)

    def left(code):
        raise SystemExit(code)

    place, arguments = STUBS["simulate"]
    (tmp_path / "case.toml").write_text(FLIGHT)
    monkeypatch.setattr(place, asked_to_end)
    arguments = [one.format(tmp=tmp_path) for one in arguments]
    monkeypatch.setattr(sys, "argv", ["rotorjax", "simulate", *arguments, "--out", str(tmp_path / "out")])
    monkeypatch.setattr(os, "_exit", left)
    usual = signal.getsignal(signal.SIGTERM)
    try:
        with pytest.raises(SystemExit, match="130"):
            script()
    finally:
        signal.signal(signal.SIGTERM, usual)
    assert capsys.readouterr().err.strip().endswith("rotorjax simulate: interrupted")


@pytest.mark.skipif(os.geteuid() == 0, reason="nothing is read-only to root")
def test_a_read_only_folder_is_one_line(tmp_path, capsys):
    tmp_path.chmod(0o500)
    assert main(["study", "--out", str(tmp_path), "--quick"]) == 2
    assert capsys.readouterr().err.count("\n") == 1
