"""The free wake's own settings against a measured rotor."""

import json

import jax.numpy as jnp
import numpy as np
import pytest

from rotorjax.calibration import measured_run
from rotorjax.calibration.calibration_file import load
from rotorjax.calibration.measured import PARAMETERS, measurements, with_values
from rotorjax.calibration.measured_run import MeasuredRun, _fit, _Wake, record, report
from rotorjax.calibration.output import write
from rotorjax.cli import main
from rotorjax.errors import InputError
from rotorjax.rotor.catalogue import load as rotor
from rotorjax.validation import caradonna_tung
from rotorjax.validation.case import Subject
from rotorjax.wake.model import free_wake
from rotorjax.wake.settings import wake_settings
from rotorjax.wake.solution import solve

COARSE = {"panels": 8, "age_step_deg": 20.0, "near_wake_deg": 100.0, "closure_turns": 1, "closure_bundles": 2}


@pytest.mark.slow
def test_the_wakes_numbers_are_the_validations_and_their_slopes_those_of_solved_wakes():
    model = free_wake(*rotor("caradonna_tung"), None, wake_settings(**COARSE, azimuths=4))
    data = measurements()
    names, values = ("release", "inboard_core"), np.array([0.95, 0.12])
    wake = _Wake(model, data, names, data.rows(("CT", "z")))
    assert wake.residual(values).shape == (7,)
    at_all = dict.fromkeys(caradonna_tung.points(Subject()), wake.solution)
    rows = [row for row in caradonna_tung.rows(Subject(), at_all) if row.quantity in data.names]
    np.testing.assert_allclose(wake.numbers, [row.ours for row in rows], rtol=1e-9)
    margins = [row.limits.high - row.limits.reference for row in rows]
    np.testing.assert_allclose(data.margin, margins, rtol=1e-12)
    step, slopes, base = 1e-4, wake.slopes, wake.solution
    for i in range(2):
        ends = [values + s * step * np.eye(2)[i] for s in (1, -1)]
        up, down = (solve(with_values(model, names, jnp.asarray(v)), base, tol=1e-11) for v in ends)
        difference = (up.CT - down.CT) / (2 * step)
        assert slopes[0, i] == pytest.approx(difference, rel=1e-4)
        nodes = (up.tip_vortex - down.tip_vortex)[0, :, 2] / (2 * step)
        at = np.searchsorted(up.tip_vortex_age, 2 * np.pi - 1e-9)
        assert slopes[-1, i] == pytest.approx(nodes[at], rel=1e-3, abs=1e-5)


@pytest.fixture
def made_up():
    """A wake that is linear in one setting, fitted to thrust and heights."""
    data = measurements()
    taught = data.rows(("CT", "z"))
    before, after = data.target + data.margin, data.target + 0.5 * data.margin
    slopes = np.linspace(1, 2, taught.sum())[:, None]
    end = 0.5 * np.ones(taught.sum())
    end -= slopes[:, 0] * (slopes[:, 0] @ end) / (slopes[:, 0] @ slopes[:, 0])
    chosen = PARAMETERS.subset(["release"])
    fit = _fit(chosen, np.array([0.95]), end, slopes, [1.0, 0.5], 3.0, 1.0)
    return MeasuredRun(data, taught, fit, before, after, None)


def test_the_verdict_is_that_of_the_linear_fit(made_up):
    assert made_up.fit.converged, made_up.fit.why
    assert made_up.rms(made_up.before, True) == pytest.approx(1)
    assert made_up.rms(made_up.after, False) == pytest.approx(0.5)
    assert made_up.fit.covariance.shape == (1, 1)


def test_it_leaves_a_file_that_changes_the_wakes_settings(made_up, tmp_path):
    write(made_up, tmp_path)
    saved = load(tmp_path / "calibration.toml")
    assert saved.set == "wake"
    assert saved.wake_settings["release"] == pytest.approx(0.95)
    assert set(saved.wake_settings) == set(PARAMETERS.names)
    assert float(wake_settings(**saved.wake_settings).release) == pytest.approx(0.95)
    with pytest.raises(InputError, match="of the free wake's settings"):
        saved.apply(None, None)
    found = json.loads((tmp_path / "calibration.json").read_text())
    assert found["rms_over_margin"]["held_out"]["after"] == pytest.approx(0.5)
    assert [row["fitted"] for row in found["rows"]] == made_up.taught.tolist()
    assert record(made_up)["set"] == "wake"
    assert "held out: 1.000 before, 0.500 after" in report(made_up)
    assert (tmp_path / "wake.png").stat().st_size > 10000


BAD = {
    "--parameters relase": "but holds 'relase'",
    "--fit CT,thrust": "but holds 'thrust'",
    "--fit ,": "is empty",
    "--fit CT --parameters release,tip_core": "no more than the data",
}


@pytest.mark.parametrize("line", BAD)
def test_bad_input_is_one_line(line, tmp_path, capsys):
    assert main(["calibrate", "wake", "--out", str(tmp_path / "out"), *line.split()]) == 2
    printed = capsys.readouterr().err
    assert BAD[line] in printed
    assert len(printed.strip().splitlines()) == 1


def test_defaults_are_the_wakes_own():
    assert PARAMETERS.printed[0] == float(wake_settings().release)
    assert set(measured_run.FREE) <= set(PARAMETERS.names)
