"""Hayden's factor, and the wake's radius and clearance fitted to it."""

import json
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from rotorjax.calibration import hayden, hayden_run
from rotorjax.calibration.calibration_file import load
from rotorjax.calibration.fit import calibrate, calibrate_many, even_starts
from rotorjax.cli import main
from rotorjax.errors import InputError
from rotorjax.ground import plane
from rotorjax.potential import loading
from rotorjax.potential.contraction import contraction
from rotorjax.potential.ground_source import DiskQuadrature
from rotorjax.potential.model import finite_state_model, mean_inflow, steady_state
from rotorjax.reference import published


@pytest.fixture(scope="module")
def both():
    data, parameters = hayden.hayden_data()
    return data, parameters, calibrate(hayden.residual, parameters, data)


def test_hayden_factor_is_the_published_one():
    np.testing.assert_allclose(
        published.hayden_factor(jnp.asarray(hayden.HEIGHTS)), [0.625, 0.792, 0.874, 0.943, 0.970, 0.991], atol=6e-4
    )
    assert published.hayden_factor(jnp.asarray(6.0)) == 1.0  # the printed formula exceeds 1 from z = 4.53 R
    assert abs(1 / (0.9926 + 0.0379 * (2 / hayden.HIGHEST) ** 2) - 1) < 2e-5


def test_one_azimuth_of_the_quadrature_is_exact():
    """The ratio is that of the model as users make it, at several heights and three pressure terms."""
    data, _ = hayden.hayden_data((0.5, 2.0), shape="triangular")
    ours = hayden.inflow_ratio(data, jnp.asarray(0.8), jnp.asarray(0.7))
    fine = DiskQuadrature(32, 12)
    free = finite_state_model(quadrature=fine)
    alone = mean_inflow(steady_state(free, data.tau[0]), free)
    for height, ratio in zip((0.5, 2.0), ours, strict=True):
        wake = contraction(0.8, clearance=0.7)
        model = finite_state_model(plane(height), ground_radial_terms=5, wake=wake, quadrature=fine)
        np.testing.assert_allclose(mean_inflow(steady_state(model, data.tau[0]), model) / alone, ratio, rtol=1e-9)


def test_the_default_follows_hayden_without_a_fit():
    """With the UH-60's loads of the free wake out of ground effect at 18°."""
    tau = np.array([2.632e-3, -1.652e-3, 6.03e-4])
    data, parameters = hayden.hayden_data(tau=(np.tile(tau, (6, 1)), tau))
    assert float(jnp.sqrt(jnp.mean(hayden.residual(jnp.asarray(parameters.printed), data) ** 2))) < 0.03


def test_the_clearance_alone_at_one_height_is_the_same_from_every_start():
    data, parameters = hayden.hayden_data((0.5,), ("clearance",))
    many = calibrate_many(hayden.residual, parameters, data, np.linspace(0.1, 3.5, 5)[:, None])
    assert np.ptp(many.values) < 1e-6
    assert many.converged.all()
    ratio = hayden.inflow_ratio(data, jnp.asarray(hayden.PARAMETERS.printed[0]), many.values[0, 0])
    np.testing.assert_allclose(ratio, 1 / (0.9926 + 0.0379 * 16), atol=1e-6)


def test_two_parameters_follow_hayden_over_six_heights(both):
    data, parameters, fit = both
    printed = jnp.sqrt(jnp.mean(hayden.residual(jnp.asarray(parameters.printed), data) ** 2))
    assert fit.converged, fit.why
    assert fit.rms <= 0.02 < printed
    assert np.all(np.linalg.eigvalsh(fit.covariance) > 0)


def test_drivers_agree(both):
    """By gradients alone; Adam, slower, is held to the textbook's line (test_fit.py)."""
    data, parameters, fit = both
    other = calibrate(hayden.residual, parameters, data, method="lbfgs")
    assert other.converged, other.why
    np.testing.assert_allclose(other.values, fit.values, atol=1e-4)


def test_covariance_is_the_spread_over_disturbed_targets(both):
    """Targets with random errors of the fit's own size, refitted: the parameters spread as the Jacobian says."""
    data, _, fit = both
    sigma = fit.rms * np.sqrt(6 / 4)
    errors = sigma * np.random.default_rng(1).standard_normal((200, 6))
    exact = hayden.residual(jnp.asarray(fit.values), data)

    def disturbed(error):
        return np.asarray(fit.values) - np.linalg.lstsq(jacobian, np.asarray(error), rcond=None)[0]

    jacobian = np.asarray(jax.jacrev(hayden.residual)(jnp.asarray(fit.values), data))
    np.testing.assert_allclose(jacobian.T @ np.asarray(exact), 0, atol=1e-6)  # the end is a minimum
    spread = np.cov(np.array([disturbed(e) for e in errors]).T)
    np.testing.assert_allclose(np.sqrt(np.diag(spread)), fit.deviations, rtol=0.15)


def test_every_start_ends_at_the_same_place(both):
    data, parameters, fit = both
    many = calibrate_many(hayden.residual, parameters, data, even_starts(parameters, 4))
    np.testing.assert_allclose(many.values, np.tile(fit.values, (4, 1)), atol=1e-5)
    assert many.converged.all()


@pytest.mark.slow
def test_the_command_writes_everything(tmp_path, capsys, monkeypatch):
    """With two of three drivers and four starts."""
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


def test_measured_loads_are_brought_to_one_thrust():
    data, _ = hayden.hayden_data((1.0, 2.0), ("clearance",), shape="triangular")
    tau = np.asarray(data.tau)
    scaled, _ = hayden.hayden_data((1.0, 2.0), ("clearance",), tau=(tau * np.array([[1.3], [0.8]]), tau[0]))
    values = jnp.asarray(0.7), jnp.asarray(0.8)
    np.testing.assert_allclose(hayden.inflow_ratio(scaled, *values), hayden.inflow_ratio(data, *values), rtol=1e-12)
    modes = data.model.modes
    thrust = [loading.thrust_coefficient(t, modes) for t in scaled.tau]
    np.testing.assert_allclose(thrust, loading.thrust_coefficient(jnp.asarray(tau[0]), modes), rtol=1e-12)


BAD = {
    r"in \[0.3, 4.53\] \(over R\), where Hayden's factor holds, but holds 0.2": ((0.2,),),
    "but holds 5": ((1.0, 5.0),),
    "but holds nan": ((float("nan"),),),
    "at least one height": ((),),
    "must not repeat": ((1.0, 1.0),),
    "but holds 'q'": ((1.0,), ("radius", "q")),
    "`shape` must be one of": ((1.0,), ("clearance",), "square"),
    "positive thrust": ((1.0,), ("clearance",), "elliptic", (np.array([[-1.0]]), np.array([1.0]))),
    "must have shapes": ((1.0,), ("clearance",), "elliptic", (np.array([[1.0, 0.0]]), np.array([1.0]))),
}


@pytest.mark.parametrize("message", BAD)
def test_bad_input_is_named(message):
    with pytest.raises(InputError, match=message):
        hayden.hayden_data(*BAD[message])


def test_targets_out_of_reach_are_refused():
    """With so much load taken off by τ₃ the model's ground effect is too weak for Hayden's factor with any values."""
    tau = np.array([[1e-3, -2e-3, 0.0]])
    with pytest.raises(InputError, match=r"where the model can reach Hayden's factor, but at 0\.5"):
        hayden.hayden_data((0.5,), ("clearance",), tau=(tau, tau[0]))


def test_more_parameters_than_heights_are_refused():
    data, parameters = hayden.hayden_data((1.0,))
    with pytest.raises(InputError, match="there are 2"):
        calibrate(hayden.residual, parameters, data)
