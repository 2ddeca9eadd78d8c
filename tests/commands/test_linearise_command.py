"""`rotorjax linearise` end to end on a coarse wake; bad input."""

import json
from dataclasses import replace

import matplotlib.image
import numpy as np
import pytest
import scipy.io
from wakes import COARSE, made_up

from rotorjax.cli import main
from rotorjax.io import netcdf
from rotorjax.linearisation import flight
from rotorjax.wake import solution
from rotorjax.wake.settings import wake_settings
from tests.browser import opens


@pytest.fixture(autouse=True)
def coarse(monkeypatch):
    monkeypatch.setattr(
        "rotorjax.bench.settings.quick_settings", lambda **more: wake_settings(**COARSE | {"azimuths": 4} | more)
    )


@pytest.mark.slow
def test_it_writes_everything(tmp_path, capsys):
    out = tmp_path / "out"
    names = ["--inputs", "collective,height", "--outputs", "CT,lambda0"]
    assert main(["linearise", "--quick", "--height", "1", *names, "--order", "40", "--out", str(out)]) == 0
    pictures = {f"{name}.{ending}" for name in ("residuals", "bode", "steps", "stability") for ending in ("png", "pdf")}
    models = {f"{name}.{end}" for name in ("full", "reduced_frequency", "reduced_time") for end in ("nc", "mat")}
    assert {path.name for path in out.iterdir()} == pictures | models | {"linearise.json", "report.md", "report.html"}
    found = json.loads((out / "linearise.json").read_text())
    assert found["orbit"]["converged"]
    assert found["orbit"]["residual"] < 1e-8
    assert found["orbit"]["rhs_residual"] < 1e-8
    assert found["full_order"] == netcdf.read(out / "full.nc").sizes["state"]
    assert found["reduced_order"] == scipy.io.loadmat(out / "reduced_frequency.mat")["A"].shape[0] <= 40
    assert found["bode_error_db"]["CT"]["collective"] < 1
    assert found["reduced_models"]["time"]["step_error"]["CT"]["collective"] < 0.05
    assert found["step_error"].keys() == {"CT", "lambda0"}
    modes = found["floquet_multipliers"]
    assert modes[0]["magnitude"] == pytest.approx(np.exp(2 * np.pi * modes[0]["growth"]))
    assert found["pairing"]["rate"]["smallest"] <= found["pairing"]["rate"]["median"]
    assert matplotlib.image.imread(out / "bode.png").std() > 0.05
    assert "CT per collective" in capsys.readouterr().out
    assert "| CT (-) | collective (rad) |" in (out / "report.md").read_text()


def test_a_trimmed_rotor_at_one_speed_and_over_two(tmp_path, capsys):
    line = ["linearise", "--weight", "72000", "--inflow", "uniform", "--azimuths", "16", "--inputs", "theta_0,w"]
    line += ["--outputs", "CT,Z,beta_0,lambda_0", "--order", "13"]
    assert main([*line, "--advance-ratio", "0.1", "--out", str(tmp_path / "one")]) == 0
    assert main([*line, "--speed", "0", "20", "--time", "azimuth", "--out", str(tmp_path / "two")]) == 0
    assert "coning" in capsys.readouterr().out
    files = {f"{name}.{end}" for name in ("reduced", "full", "periodic") for end in ("mat", "nc")}
    files |= {"README.md", "report.md", "report.html", "linearise.json", "roots.png", "roots.pdf"}
    assert {path.name for path in (tmp_path / "one").iterdir()} == files
    assert opens(tmp_path / "one" / "report.html", tmp_path)
    found = json.loads((tmp_path / "one" / "linearise.json").read_text())
    model = scipy.io.loadmat(tmp_path / "one" / "full.mat", simplify_cells=True)
    # seconds: the same poles, Ω times as fast; forces in newtons
    poles = np.linalg.eigvals(model["A"]) / found["omega_rad_s"]
    coning = next(mode for mode in found["modes"] if mode["name"] == "coning")
    assert np.abs(poles - (coning["growth"] + 1j * coning["frequency"])).min() < 0.03
    assert model["time"] == "seconds"
    assert list(model["output_units"]) == ["-", "N", "rad", "m/s"]
    assert model["y0"][1] == pytest.approx(-72000, rel=0.1)
    assert "theta_0" in (tmp_path / "one" / "README.md").read_text()
    stitched = netcdf.read(tmp_path / "two" / "scheduled.nc")
    assert stitched.sizes["flight"] == 2
    assert np.isfinite(stitched.growth.sel(mode="coning")).all()
    assert stitched.attrs["time"] == "azimuth (rad)"
    own = {"advance_0_free_air", f"advance_{stitched.advance_ratio.values[1]:g}_free_air"}
    files = {"scheduled.nc", "README.md", "report.md", "report.html", "linearise.json", "roots.png", "roots.pdf"}
    assert {path.name for path in (tmp_path / "two").iterdir()} == files | own
    assert all((tmp_path / "two" / name / "reduced.mat").exists() for name in own)
    assert "| coning | -" in (tmp_path / "two" / "report.md").read_text()
    assert opens(tmp_path / "two" / "report.html", tmp_path)


def test_an_interrupted_sweep_leaves_the_flights_that_are_done_and_goes_on(tmp_path, monkeypatch, capsys):
    line = ["linearise", "--weight", "72000", "--inflow", "uniform", "--azimuths", "16", "--inputs", "theta_0"]
    line += ["--outputs", "CT", "--advance-ratio", "0.1", "0.2", "--out", str(tmp_path)]
    whole, done, flown = flight.linearise_trim, [], {}

    def stopped(request, *rest):
        if done == [0.1] and request.advance > 0.15:
            done.append("interrupted")
            raise KeyboardInterrupt
        done.append(request.advance)
        if request.advance not in flown:  # once: what is done anew is told by `done`
            flown[request.advance] = whole(request, *rest)
        return flown[request.advance]

    monkeypatch.setattr("rotorjax.linearisation.schedule.linearise_trim", stopped)
    monkeypatch.setattr("rotorjax.bench.plotting.save", lambda *_: [])  # the test before looks at the pictures
    assert main([*line, "--order", "13"]) == 130
    first = netcdf.read(tmp_path / "scheduled.nc")
    assert first.sizes["flight"] == 1
    assert (tmp_path / "advance_0.1_free_air" / "report.md").exists()
    told = json.loads((tmp_path / "linearise.json").read_text())["flights"][0]
    assert main([*line, "--order", "14"]) == 0  # of the small model, which is made anew
    assert done == [0.1, "interrupted", 0.2]
    both = netcdf.read(tmp_path / "scheduled.nc")
    np.testing.assert_array_equal(both.A[0], first.A[0])
    again = json.loads((tmp_path / "linearise.json").read_text())["flights"][0]
    anew = {"stages_s", *(key for key in told if key.startswith("reduced_"))}
    assert {k: v for k, v in again.items() if k not in anew} == {k: v for k, v in told.items() if k not in anew}
    capsys.readouterr()
    for change, key in (("72500", "thrust"), ("72000", "azimuths")):
        other = [change if one == "72000" else one for one in line]
        assert main([*other, *([] if key == "thrust" else ["--azimuths", "20"]), "--order", "13"]) == 2
        assert f"of the same sweep, but holds one with {key}" in capsys.readouterr().err
    kept = tmp_path / "advance_0.2_free_air" / "flight.nc"
    kept.write_bytes(kept.read_bytes()[:-9])
    assert main([*line, "--order", "13"]) == 0
    assert "damaged" in capsys.readouterr().err
    assert done[3:] == [0.2]


def test_a_wake_that_is_lost_gives_exit_code_1(tmp_path, monkeypatch, capsys):
    def lost(model, start, progress, tol):
        return replace(made_up(model), converged=False, why="made up to fail")

    monkeypatch.setattr(solution, "solve", lost)
    assert main(["linearise", "--quick", "--out", str(tmp_path)]) == 1
    assert "made up to fail" in capsys.readouterr().out
    assert json.loads((tmp_path / "linearise.json").read_text())["orbit"]["converged"] is False


BAD = {
    "--inputs colective": "'colective'",
    "--inputs height": "'height'",
    "--inputs ,": "must name at least one",
    "--outputs CX": "'CX'",
    "--order 0": "but is 0",
    "--order 100000": "but is 100000",
    "--harmonics 1": "--harmonics must be 0 where the wake does not change",
    "--height 1 --slope 5 --harmonics -1": "but is -1",
    "--slope 5": "`height` must be given",
    "--height 1 --climb 0.01": "--climb must be 0 over ground",
    "--order x": "invalid int value: 'x'",
    "--advance-ratio 0.1": "--advance-ratio must be left out",
    "--inflow vpbfsm": "`thrust_coefficient` or `weight` must be given",
    "--height 1 2": "--height must be one",
    "--thrust-coefficient 0.005": "--quick must be left out",
    "--thrust-coefficient 0.005 --inflow freewake --advance-ratio 0.1 --inputs slope": "has 'slope'",
    "--thrust-coefficient 0.005 --inflow freewake --advance-ratio 0.1 0 --tilt 2": "--tilt must be 0 in hover",
    "--thrust-coefficient 0.005 --inflow freewake --azimuths 24": "--azimuths must be left out",
}


@pytest.mark.parametrize("line", BAD)
def test_bad_input_is_one_line_and_exit_code_2(line, tmp_path, capsys):
    try:
        code = main(["linearise", "--quick", "--out", str(tmp_path), *line.split()])
    except SystemExit as stop:
        code = stop.code
    printed = capsys.readouterr()
    assert code == 2
    assert printed.out == ""
    assert len(printed.err.strip().splitlines()) == 1
    assert BAD[line] in printed.err
