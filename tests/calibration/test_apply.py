"""A calibration beside a solved case; the printed values must give the study's own numbers."""

import json

import numpy as np
import pytest
from wakes import made_up

from rotorjax.bench.cases import Case
from rotorjax.bench.dataset import combine
from rotorjax.bench.settings import study_settings
from rotorjax.bench.single import single_case
from rotorjax.calibration import apply, hayden, taught
from rotorjax.calibration.calibration_file import Calibration, save
from rotorjax.cli import main
from rotorjax.errors import InputError
from rotorjax.study.output import summary
from rotorjax.study.report import report

PRINTED = {
    "hayden": Calibration("hayden", hayden.PARAMETERS.table(hayden.PARAMETERS.printed), True, 0.18),
    "freewake": Calibration("freewake", taught.PARAMETERS.table(taught.PARAMETERS.printed), True, 0.3),
}
# a wake that contracts much, near the ground too: less ground effect
FITTED = Calibration("hayden", {"radius": 0.52, "clearance": 0.05}, False, 0.004)


@pytest.fixture(scope="module")
def settings():
    return study_settings(quick=True)


@pytest.fixture(scope="module")
def solved(settings):
    return single_case(Case(1.0, 15.0), settings, "both", solver=made_up)


@pytest.mark.parametrize("name", PRINTED)
def test_printed_values_give_the_studys_inflow(solved, settings, name):
    data, reference = solved
    found = apply.add_calibrated(data, settings, PRINTED[name])
    np.testing.assert_allclose(found["calibrated_inflow"], data["vpbfsm_inflow"], rtol=1e-12)
    assert float(found["calibrated_mean_inflow"]) == pytest.approx(float(data["vpbfsm_mean_inflow"]), rel=1e-12)
    assert "NOT CONVERGED" not in apply.table(found, reference, PRINTED[name])


def test_a_fitted_factor_changes_the_numbers_and_says_that_it_did_not_converge(solved, settings):
    data, reference = solved
    found = apply.add_calibrated(data, settings, FITTED)
    assert float(found["calibrated_mean_inflow"]) > 1.1 * float(data["vpbfsm_mean_inflow"])
    entry = apply.entry(found, reference, FITTED)
    assert entry["inflow_rms_difference"] > 0
    assert "NOT CONVERGED" in apply.table(found, reference, FITTED)


@pytest.mark.slow
def test_loads_of_the_calibrated_inflow_reproduce_themselves(tmp_path, capsys):
    """Alone, with the printed values: the thrust that the model finds by itself. Fitted: less ground effect, less."""
    thrust = {}
    for name, calibration in {"printed": PRINTED["hayden"], "fitted": FITTED}.items():
        save(tmp_path / "a.toml", calibration)
        arguments = ["--height", "1", "--json", str(tmp_path / "a.json"), "--calibration", str(tmp_path / "a.toml")]
        assert main(["inflow", "--model", "vpbfsm", *arguments]) == 0
        found = json.loads((tmp_path / "a.json").read_text())
        thrust[name] = found["calibrated"]["CT"]
        thrust["own"] = found["vpbfsm"]["CT"]
    assert thrust["printed"] == pytest.approx(thrust["own"], rel=1e-8)
    assert thrust["fitted"] < 0.99 * thrust["own"]
    assert "VPBFSM calibrated: hayden, radius 0.52, clearance 0.05" in capsys.readouterr().out


def test_an_unsolved_case_is_refused(solved, settings):
    with pytest.raises(InputError, match="must be applied to a case that was solved"):
        apply.add_calibrated(solved[0].drop_vars("vpbfsm_tau"), settings, FITTED)


def test_a_file_that_is_no_calibration_is_refused_before_the_work(tmp_path, capsys):
    (tmp_path / "a.toml").write_text("[other]\n")
    assert main(["inflow", "--height", "1", "--calibration", str(tmp_path / "a.toml")]) == 2
    assert "[other] is not a known table" in capsys.readouterr().err


def test_a_study_holds_the_calibrated_model_beside_the_printed_one(solved, settings):
    cases = [apply.add_calibrated(solved[0], settings, PRINTED["hayden"])]
    found = summary(cases, settings, 1.0, PRINTED["hayden"])["cases"][0]["calibrated"]
    assert found["set"] == "hayden"
    assert found["mean_inflow"] == pytest.approx(float(solved[0]["vpbfsm_mean_inflow"]), rel=1e-12)
    merged = combine(cases, settings).assign(reference_inflow=0.05)
    np.testing.assert_allclose(merged["calibrated_inflow"], merged["vpbfsm_inflow"], rtol=1e-12)
    assert "calibrated_inflow_rms_difference" in merged
    text = report(merged, [], [], {}, 1.0)
    assert "## Calibrated model" in text
    assert "calibrated: mean/ΩR" in text
