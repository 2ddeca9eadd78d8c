import jax.numpy as jnp
import numpy as np
import pytest

from rotorjax.calibration import taught
from rotorjax.calibration.calibration_file import Calibration, load, save
from rotorjax.errors import InputError
from rotorjax.ground import plane
from rotorjax.potential.contraction import contraction
from rotorjax.potential.model import finite_state_model, mean_inflow, steady_state

TAU = jnp.array([2.6e-3, 6e-4, 3e-4])
HAYDEN = Calibration(
    "hayden", {"radius": 0.7125, "clearance": 0.65}, True, 0.00355, {"loading": "elliptic", "heights": [0.5, 1.0]}
)
TAUGHT = Calibration(
    "freewake",
    taught.PARAMETERS.table(jnp.asarray([0.8, 0.3, 0.5, 1.1, 0.9, 0.4])),
    False,
    0.12,
    {"radial_terms": 3, "source_terms": 5, "cases": ["oge", "h1"], "note": 'a "quoted" \\ name'},
)


@pytest.mark.parametrize("calibration", [HAYDEN, TAUGHT], ids=["hayden", "freewake"])
def test_a_file_gives_back_what_was_saved(calibration, tmp_path):
    save(tmp_path / "a.toml", calibration)
    assert load(tmp_path / "a.toml") == calibration


def test_hayden_sets_the_wake():
    model = finite_state_model(plane(1.0))
    calibrated, state = HAYDEN.apply(model, TAU)
    theirs = finite_state_model(plane(1.0), wake=contraction(0.7125, clearance=0.65))
    np.testing.assert_allclose(
        mean_inflow(state, calibrated), mean_inflow(steady_state(theirs, TAU), theirs), rtol=1e-13
    )


def test_the_taught_model_is_applied():
    model = finite_state_model(plane(1.0), ground_radial_terms=5)
    calibrated, state = TAUGHT.apply(model, TAU)
    values = taught.PARAMETERS.vector(TAUGHT.parameters)
    ours = taught.taught_model(model, values)
    np.testing.assert_array_equal(state.a, taught.taught_state(ours, TAU, values).a)
    assert calibrated.wake.length == ours.wake.length


def test_a_model_of_other_terms_is_refused():
    with pytest.raises(InputError, match="source_terms = 7, but has 5"):
        TAUGHT.apply(finite_state_model(plane(1.0), ground_radial_terms=7), TAU)


CHANGES = {
    "must be for model version 2, but is for 1": ("model_version = 2", "model_version = 1"),
    "must be one of hayden, freewake, wake, but is 'other'": ('set = "hayden"', 'set = "other"'),
    r"\[parameters\] must hold radius, length": ('set = "hayden"', 'set = "freewake"'),
    "must hold radius, clearance, but holds radius, q": ("clearance = ", "q = "),
    "must hold radius, clearance, but holds radius, q, cl": ("clearance = ", "q = 1.0\nclearance = "),
    r"\[parameters\] radius must be a number in \[0.5, 1\], but is 5": ("radius = 0.7125", "radius = 5.0"),
    r"\[parameters\] radius must be a finite number, but is nan": ("radius = 0.7125", "radius = nan"),
    r"\[parameters\] radius must be a finite number, but is 'x'": ("radius = 0.7125", 'radius = "x"'),
    "must have the key 'converged'": ("converged = true\n", ""),
    "did you mean 'parameters'": ("[parameters]", "[parametres]"),
    "must be TOML, but is not": ("[parameters]", "[parameters"),
    "converged must be true or false, but is 'no'": ("converged = true", 'converged = "no"'),
    r"rms_error must be a finite number of at least 0, but is nan": ("rms_error = 0.00355", "rms_error = nan"),
    r"\[foo\] is not a known table": ("[parameters]", "[foo]\nx = 1\n[parameters]"),
    r"set must be text in quotes, but is \['hayden'\]": ('set = "hayden"', 'set = ["hayden"]'),
}


@pytest.mark.parametrize("message", CHANGES)
def test_a_file_that_is_not_ours_is_refused(message, tmp_path):
    path = tmp_path / "a.toml"
    save(path, HAYDEN)
    text = path.read_text()
    old, new = CHANGES[message]
    assert old in text
    path.write_text(text.replace(old, new))
    with pytest.raises(InputError, match=message):
        load(path)


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(InputError, match=r"none\.toml"):
        load(tmp_path / "none.toml")
