"""`rotorjax calibrate` end to end; bad input is one line and exit code 2."""

import json
from functools import partial

import pytest

from rotorjax.calibration import freewake_run, hayden_run
from rotorjax.calibration.calibration_file import load
from rotorjax.cli import main


@pytest.mark.slow
def test_hayden_writes_everything(tmp_path, capsys, monkeypatch):
    """With two of three drivers and as many starts as tests/calibration/test_hayden.py, whose programs it takes."""
    fewer = partial(hayden_run.run, drivers=("least_squares", "lbfgs"), starts=4)
    monkeypatch.setattr(hayden_run, "run", fewer)
    out = tmp_path / "out"
    assert main(["calibrate", "hayden", "--out", str(out)]) == 0
    printed = capsys.readouterr().out
    found = json.loads((out / "calibration.json").read_text())
    assert found["converged"]
    assert found["rms_error"] <= 0.02 < found["rms_error_printed_factor"]
    assert found["largest_difference_of_drivers"] <= 1e-4
    assert found["starts"]["converged"] == 4
    assert found["starts"]["spread"] < 1e-5
    assert len(found["covariance"]) == 2
    saved = load(out / "calibration.toml")
    assert saved.parameters == pytest.approx({n: found[n] for n in ("radius", "clearance")})
    assert (out / "hayden.png").stat().st_size > 10000
    assert "default" in printed
    assert "converged: " in printed


@pytest.mark.slow
def test_freewake_writes_a_picture_of_every_held_out_case(tmp_path, capsys, known, monkeypatch):
    monkeypatch.setattr(freewake_run, "gradient_cost", partial(freewake_run.gradient_cost, repeats=1))
    out = tmp_path / "out"
    assert main(["calibrate", "freewake", "--cases", str(known), "--out", str(out)]) == 0
    found = json.loads((out / "calibration.json").read_text())
    assert found["held_out"]["halved"]
    assert found["parameters"]["radius"] == pytest.approx(0.82, rel=1e-4)
    assert len(found["parameters"]) <= 8
    assert found["gradient_cost"]["gradient_s"] > 0
    pictures = {p.name for p in out.glob("*.png")}
    assert pictures == {"rms.png"} | {f"held_{name}.png" for name in found["held_out"]["cases"]}
    assert load(out / "calibration.toml").set == "freewake"
    assert "at least halved" in capsys.readouterr().out


@pytest.fixture
def known(tmp_path):
    from known_study import known_study

    from rotorjax.io import netcdf

    netcdf.write(tmp_path / "cases.nc", known_study())
    return tmp_path


BAD = {
    "calibrate": "TARGET",
    "calibrate hayden": "--out",
    "calibrate hayden --out {tmp}/a --heights 0.1": "but holds 0.1",
    "calibrate hayden --out {tmp}/a --heights 9": "but holds 9",
    "calibrate hayden --out {tmp}/a --parameters radius,q": "but holds 'q'",
    "calibrate hayden --out {tmp}/a --heights 1": "there are 2 (radius, clearance) and 1 data",
    "calibrate hayden --out {tmp}/a --loading square": "invalid choice: 'square'",
    "calibrate hayden --out {tmp}/file/a": "must be writable",
    "calibrate freewake --out {tmp}/a": "--cases",
    "calibrate freewake --out {tmp}/a --cases {tmp}/none.nc": "must be readable",
    "calibrate freewake --out {tmp}/a --cases {tmp} --held h9": "but holds 'h9'",
    "calibrate freewake --out {tmp}/a --cases {tmp} --parameters core": "but holds 'core'",
    "calibrate hayden --out {tmp}/a --cases {tmp} --heights 1.2": "h1.2 is not",
}


@pytest.mark.parametrize("line", BAD)
def test_bad_input_is_one_line_and_exit_code_2(line, tmp_path, capsys, known):
    (tmp_path / "file").write_text("")
    try:
        code = main(line.format(tmp=tmp_path).split())
    except SystemExit as stop:
        code = stop.code
    printed = capsys.readouterr()
    assert code == 2
    assert printed.out == ""
    assert BAD[line] in printed.err.strip().splitlines()[-1]
