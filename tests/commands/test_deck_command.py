"""`rotorjax deck` end to end."""

import json

import matplotlib.image
import numpy as np
import pytest

from rotorjax.cli import main
from rotorjax.io import netcdf
from tests.browser import opens

LANDING = """
[rotor]
name = "{rotor}"
[model]
variant = "{variant}"
radial_terms = 2
[time]
duration = {duration}
steps_per_turn = 12
[path]
t = [0.0, {duration}]
height = [1.4, 1.0]
{edge}
[deck]
heave = 0.05
heave_period = {duration}
"""


def case(tmp_path, variant="quasi-steady", duration=0.5, edge="", rotor="caradonna_tung"):
    path = tmp_path / "case.toml"
    path.write_text(LANDING.format(variant=variant, duration=duration, edge=edge, rotor=rotor))
    return path


@pytest.mark.slow
def test_landing_writes_everything(tmp_path, capsys):
    out = tmp_path / "out"
    assert main(["deck", "--case", str(case(tmp_path)), "--out", str(out), "--gif"]) == 0
    pictures = {"histories.png", "histories.pdf", "disk.png", "disk.pdf", "animation.gif"}
    assert {p.name for p in out.iterdir()} == {"history.nc", "report.json", "report.html"} | pictures
    assert (out / "report.html").read_text().count("data:image/") == 3
    assert opens(out / "report.html", tmp_path)
    report = json.loads((out / "report.json").read_text())
    data = netcdf.read(out / "history.nc")
    assert report["histories"]["uniform"]["last"] == pytest.approx(float(data["uniform"][-1]))
    # the ground takes inflow and gives thrust: steady from end to end; on the way once the descent's start is over
    assert data["static_uniform"][-1] < 0.97 * data["static_uniform"][0]
    assert data["static_thrust"][-1] > 1.04 * data["static_thrust"][0]
    middle = data.sizes["time"] // 2
    assert data["uniform"][-1] < 0.97 * data["uniform"][middle]
    assert data["thrust"][-1] > 1.03 * data["thrust"][middle]
    assert report["ground_residual_max"] < 0.03
    np.testing.assert_allclose(data["uniform"][0], data["static_uniform"][0], rtol=0.02)
    assert data["uniform"].attrs["units"] == "ΩR"
    assert "beta_0" not in data  # the rotor has no hinges
    assert matplotlib.image.imread(out / "histories.png").std() > 0.05
    assert "is left on the deck at most" in capsys.readouterr().out


@pytest.mark.slow
def test_flight_over_an_edge_with_flapping_blades(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("rotorjax.bench.plotting.save", lambda figure, stem: [])  # the landing's are looked at
    out = tmp_path / "out"
    path = case(tmp_path, "dynamic", 4.0, "edge = [-1.4, 0.6]", "uh60")
    assert main(["deck", "--case", str(path), "--out", str(out)]) == 0
    data = netcdf.read(out / "history.nc")
    assert data["cosine"].max() > 0.001  # more inflow aft, where there is no deck
    assert data["uniform"][-1] < data["uniform"][0]
    assert float(data["ground_residual"].max()) < 0.05
    most = int(np.abs(data["beta_1s"].values).argmax())
    tilt, inflow = float(data["beta_1s"][most]), np.rad2deg(float(data["cosine"][most]))
    assert tilt == pytest.approx(-inflow, rel=0.2)  # down to starboard, a quarter turn after the inflow aft
    assert data["beta_1s"].attrs == {"units": "deg", "long_name": "tilt of the tip-path plane, up to starboard"}
    np.testing.assert_allclose(data["beta_0"][0], data["static_beta_0"][0], rtol=0.02)
    assert "beta_1s  first" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "match"),
    [
        (["--case", "{tmp}/none.toml", "--out", "{tmp}/out"], "No such file"),
        (["--case", "{tmp}/case.toml", "--out", "{tmp}/case.toml/out"], "must be writable"),
        (["--out", "{tmp}/out"], "--case"),
    ],
)
def test_bad_input_is_one_line_and_exit_code_2(arguments, match, tmp_path, capsys):
    case(tmp_path)
    try:
        code = main(["deck", *(a.format(tmp=tmp_path) for a in arguments)])
    except SystemExit as stop:
        code = stop.code
    printed = capsys.readouterr()
    assert code == 2
    assert len(printed.err.strip().splitlines()) == 1
    assert match in printed.err
