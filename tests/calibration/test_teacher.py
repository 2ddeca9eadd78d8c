"""Lessons read off a study whose answer is known."""

import json
from functools import partial

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest
from known_study import TRUTH, known_study

from rotorjax.bench.record import rms_difference
from rotorjax.calibration import freewake_run, teacher
from rotorjax.calibration.calibration_file import load
from rotorjax.calibration.drivers import linearised
from rotorjax.calibration.fit import conclude, judge
from rotorjax.calibration.taught import PARAMETERS
from rotorjax.cli import main
from rotorjax.errors import InputError
from rotorjax.io import netcdf


@pytest.fixture(scope="module")
def taught(study):
    return freewake_run.run(study)


def test_the_fit_finds_the_known_corrections(taught):
    assert taught.fit.converged, taught.fit.why
    np.testing.assert_allclose(taught.values, PARAMETERS.vector(TRUTH), rtol=1e-5)
    assert np.max(taught.taught) < 1e-6
    assert taught.mean(taught.printed, True) > 0.1
    assert taught.halved


def test_held_out_cases_lie_between_the_taught_ones(taught):
    assert taught.held == ("h0.75", "h1.5", "h1-slope20", "h1.5-slope30", "h0.9-slope30")
    assert not set(taught.held) & set(taught.about["cases"])


def test_the_difference_is_the_studys(taught, study):
    """And the fit's rms is that of the cases it was taught."""
    for i, name in enumerate(taught.data.names):
        theirs = study["free_wake_inflow"].sel(case=name).to_numpy() / 0.06
        both = taught.inflow_printed[i], theirs
        assert taught.printed[i] == pytest.approx(rms_difference(*both, np.full(9, 0.0975)))
    assert taught.fit.history[0] == pytest.approx(np.sqrt(np.mean(taught.printed[~taught.is_held] ** 2)))


def test_out_of_ground_effect_ignores_the_ground(taught):
    strong = PARAMETERS.vector({"clearance": 3.5, "slope_share": 0.0})
    fields = teacher.inflow(strong, taught.data)
    np.testing.assert_allclose(fields[0], taught.inflow_printed[0], rtol=1e-7)
    assert np.max(np.abs(fields[1] - taught.inflow_printed[1])) > 0.1


def verdict_on(data, values):
    """From one evaluation with its Jacobian, by the program of the fit."""
    return judge(PARAMETERS, *map(np.asarray, linearised(teacher.residual, values, data)))


def test_covariance_shrinks_as_the_noise_does(taught):
    """At the truth, which the ends of fits are near."""

    def deviations(noise):
        data, _ = teacher.lessons(known_study(noise))
        lessons = data.choose([name for name in data.names if name not in taught.held])
        return np.sqrt(np.diag(verdict_on(lessons, PARAMETERS.vector(TRUTH)).covariance))

    np.testing.assert_allclose(deviations(1e-2) / deviations(1e-3), 10, rtol=0.1)


def test_level_cases_cannot_teach_the_slope(taught, study):
    """Reported, not made up; what was not to be fitted keeps its printed value."""
    lessons = taught.data.choose([name for name in taught.data.names if name not in taught.held])
    level = eqx.tree_at(lambda d: d.slopes, lessons, jnp.zeros_like(lessons.slopes))
    converged, why = conclude(PARAMETERS, np.asarray(taught.values), verdict_on(level, jnp.asarray(taught.values)))
    assert not converged
    assert "do not determine" in why
    fewer, chosen = teacher.lessons(study, ("mean_gain", "slope_share"))
    values = PARAMETERS.complete(jnp.asarray([1.2, 0.5]), fewer.free, fewer.fixed)
    kept = [PARAMETERS.names.index(n) for n in PARAMETERS.names if n not in chosen.names]
    np.testing.assert_array_equal(values[np.array(kept)], PARAMETERS.printed[kept])


@pytest.mark.slow
def test_the_command_writes_a_picture_of_every_held_out_case(taught, study, tmp_path, capsys, monkeypatch):
    """With the programs of the fit above."""
    monkeypatch.setattr(freewake_run, "gradient_cost", partial(freewake_run.gradient_cost, repeats=1))
    netcdf.write(tmp_path / "cases.nc", study)
    out = tmp_path / "out"
    assert main(["calibrate", "freewake", "--cases", str(tmp_path), "--out", str(out)]) == 0
    found = json.loads((out / "calibration.json").read_text())
    assert found["held_out"]["halved"]
    assert found["parameters"]["radius"] == pytest.approx(0.82, rel=1e-4)
    assert len(found["parameters"]) <= 8
    assert found["gradient_cost"]["gradient_s"] > 0
    pictures = {p.name for p in out.glob("*.png")}
    assert pictures == {"rms.png"} | {f"held_{name}.png" for name in found["held_out"]["cases"]}
    assert load(out / "calibration.toml").set == "freewake"
    assert "at least halved" in capsys.readouterr().out


@pytest.mark.slow
def test_gradient_of_the_objective_costs_less_than_four_evaluations(study):
    """Counted by the compiler in floating-point operations, which no busy machine can change."""
    data, parameters = teacher.lessons(study)
    level = data.choose([n for n in data.names if "slope" not in n])
    start = jnp.asarray(parameters.printed)

    plain, gradient = (f.lower(start, level) for f in (freewake_run._objective, freewake_run._gradient))
    flops = [f.compile().compiled.cost_analysis()["flops"] for f in (plain, gradient)]
    assert 1 < flops[1] / flops[0] <= 4


def test_a_case_that_did_not_converge_teaches_nothing(study):
    converged = study["converged"].copy(data=np.where(study["case"] == "h2", 0.0, 1.0))
    data, _ = teacher.lessons(study.assign(converged=converged))
    assert "h2" not in data.names
    assert "h1.5" in data.names


def test_a_file_or_its_folder(study, tmp_path):
    netcdf.write(tmp_path / "cases.nc", study)
    for path in (tmp_path, tmp_path / "cases.nc"):
        assert teacher.find_cases(path)["reference_inflow"] == study["reference_inflow"]


BAD = {
    "must hold the case out of ground effect": lambda s: teacher.lessons(s.assign(reference_inflow=np.nan)),
    "none did converge": lambda s: teacher.lessons(s.assign(converged=0 * s["converged"])),
    "but holds 'roll_up'": lambda s: teacher.lessons(s, ("roll_up",)),
    "lacks vpbfsm.harmonics": lambda s: teacher.lessons(s.assign_attrs(settings='{"vpbfsm.radial_terms": 3}')),
    "`held` must name cases among": lambda s: freewake_run.run(s, held=("h7",)),
    "leave at least one case": lambda s: freewake_run.run(s, held=tuple(map(str, s["case"].to_numpy()))),
}


@pytest.mark.parametrize("message", BAD)
def test_bad_input_is_named(message, study):
    with pytest.raises(InputError, match=message):
        BAD[message](study)


def test_a_file_that_is_no_study_is_refused(study, tmp_path):
    netcdf.write(tmp_path / "other.nc", study.drop_vars("vpbfsm_tau"))
    with pytest.raises(InputError, match=r"must be the cases\.nc of a study, but lacks vpbfsm_tau"):
        teacher.find_cases(tmp_path / "other.nc")
    with pytest.raises(InputError, match="must be readable"):
        teacher.find_cases(tmp_path / "missing.nc")
