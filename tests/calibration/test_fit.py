"""The drivers on problems with a known answer, and the verdict where there is none."""

import jax.numpy as jnp
import numpy as np
import pytest

from rotorjax.calibration.fit import calibrate, calibrate_many, even_starts
from rotorjax.calibration.parameters import Parameter, ParameterSet
from rotorjax.errors import InputError

LINE = ParameterSet("line", (Parameter("slope", -5.0, 5.0, 1.0, ""), Parameter("offset", -5.0, 5.0, 0.0, "")))
X = jnp.linspace(0.0, 1.0, 7)
Y = 2.0 * X - 1.0 + 0.1 * jnp.sin(9 * X)


def line(values, data):
    x, y = data
    return values[0] * x + values[1] - y


def textbook():
    """Values and covariance of a straight line by numpy."""
    return np.polyfit(X, Y, 1, cov=True)


@pytest.mark.parametrize("method", ["least_squares", "lbfgs", "adam"])
def test_every_driver_finds_the_textbook_line_with_its_covariance(method):
    steps = []
    fit = calibrate(line, LINE, (X, Y), method=method, progress=lambda step, rms: steps.append((step, rms)))
    values, covariance = textbook()
    np.testing.assert_allclose(fit.values, values, atol=1e-5)
    np.testing.assert_allclose(fit.covariance, covariance, rtol=1e-4)
    np.testing.assert_allclose(fit.deviations, np.sqrt(np.diag(covariance)), rtol=1e-4)
    assert fit.converged, fit.why
    assert steps[-1][1] == pytest.approx(fit.rms, rel=1e-3)
    assert fit.history[0] > 5 * fit.rms
    assert fit.at_bound == ()


def test_many_starts_find_one_answer():
    starts = even_starts(LINE, 17)
    assert np.all((starts > LINE.lower) & (starts < LINE.upper))
    assert len(np.unique(starts, axis=0)) == 17
    many = calibrate_many(line, LINE, (X, Y), starts)
    np.testing.assert_allclose(many.values, np.tile(textbook()[0], (17, 1)), atol=1e-6)
    assert many.converged.all()
    assert many.rms[many.best] == many.rms.min()


def test_even_starts_of_one_parameter_run_from_end_to_end():
    np.testing.assert_allclose(even_starts(LINE.subset(["slope"]), 3)[:, 0], [-4.5, 0.0, 4.5])


def test_a_minimum_beyond_the_range_is_reported_not_converged():
    steep = calibrate(line, LINE, (X, 9.0 * X))
    assert not steep.converged
    assert steep.at_bound == ("slope",)
    assert "held by a bound: slope" in steep.why
    assert not calibrate_many(line, LINE, (X, 9.0 * X), even_starts(LINE, 3)).converged.any()


@pytest.mark.parametrize("method", ["least_squares", "lbfgs", "adam"])
def test_what_the_data_do_not_determine_is_reported(method):
    fit = calibrate(lambda v, data: (v[0] + v[1]) * jnp.ones(3) - 1.0, LINE, None, method=method)
    assert not fit.converged
    assert "do not determine" in fit.why
    assert np.all(np.isnan(fit.covariance))


def test_a_fit_that_ran_out_of_steps_knows_it():
    curved = ParameterSet("curved", (Parameter("a", -5.0, 5.0, -4.0, ""),))
    fit = calibrate(lambda v, _: jnp.stack([jnp.exp(v[0]) - 3.0, v[0]]), curved, None, max_steps=1)
    assert not fit.converged
    assert "one more Gauss-Newton step" in fit.why


def test_as_many_data_as_parameters_leave_no_covariance():
    data = X[:2], Y[:2]
    fit = calibrate(line, LINE, data)
    assert fit.converged
    assert fit.rms < 1e-9
    assert np.all(np.isnan(fit.covariance))


BAD = {
    "no more than the data, but there are 2": lambda: calibrate(line, LINE, (X[:1], Y[:1])),
    "`method` must be one of": lambda: calibrate(line, LINE, (X, Y), method="newton"),  # type: ignore[arg-type]
    "`slope` must lie inside": lambda: calibrate(line, LINE, (X, Y), [6.0, 0.0]),
    "must give a finite residual": lambda: calibrate(line, LINE, (X, Y.at[0].set(jnp.nan))),
    "`starts`": lambda: calibrate_many(line, LINE, (X, Y), np.zeros((3, 1))),
}


@pytest.mark.parametrize("message", BAD)
def test_bad_input_is_named(message):
    with pytest.raises(InputError, match=message):
        BAD[message]()
