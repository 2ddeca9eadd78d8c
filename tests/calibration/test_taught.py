import jax.numpy as jnp
import numpy as np
import pytest

from rotorjax.calibration.taught import PARAMETERS, taught_model, taught_state
from rotorjax.ground import plane
from rotorjax.potential.contraction import LENGTH, MOMENTUM
from rotorjax.potential.model import disk_inflow, finite_state_model, steady_state, wake_over
from rotorjax.potential.wake_edge import left_of_tilt

PRINTED = jnp.asarray(PARAMETERS.printed)
TAU = jnp.zeros(9).at[:4].set(jnp.array([2.6e-3, 6e-4, 3e-4, 1e-4]))
X, Y = jnp.array([-0.7, 0.1, 0.9]), jnp.array([0.2, -0.5, 0.0])


def changed(name, value):
    return PRINTED.at[PARAMETERS.names.index(name)].set(value)


def inflow(model, values, tau=TAU, climb=0.0):
    model = taught_model(model, values)
    return disk_inflow(taught_state(model, tau, values, climb), X, Y, model)


@pytest.mark.parametrize("ground", [None, plane(0.7), plane(1.2, 25.0)])
def test_printed_values_are_the_default_model(ground):
    model = finite_state_model(ground, harmonics=1, ground_harmonics=1)
    np.testing.assert_allclose(inflow(model, PRINTED), disk_inflow(steady_state(model, TAU), X, Y, model), rtol=1e-13)


def test_climb_is_the_studys():
    model = finite_state_model(harmonics=1)
    state = steady_state(model, TAU, jnp.asarray(0.02))
    np.testing.assert_allclose(inflow(model, PRINTED, climb=0.02), disk_inflow(state, X, Y, model), rtol=1e-13)


@pytest.mark.parametrize("choices", [{}, {"printed": True}])
def test_the_wake_is_that_of_the_values(choices):
    model = taught_model(finite_state_model(plane(1.0), **choices), changed("clearance", 0.6))
    np.testing.assert_allclose([model.wake.radius, model.wake.length, model.wake.clearance], [MOMENTUM, LENGTH, 0.6])


@pytest.mark.parametrize("edge", ["free", "rigid"])
def test_no_share_of_the_slope_is_level_ground(edge):
    slope, level = (
        finite_state_model(plane(1.0, d), harmonics=1, ground_harmonics=1, wake_edge=edge) for d in (20.0, 0.0)
    )
    ours = inflow(slope, changed("slope_share", 0.0))
    np.testing.assert_allclose(ours, inflow(level, PRINTED), rtol=1e-12)
    left = 1.0 if edge == "rigid" else left_of_tilt(wake_over(slope, slope.ground), jnp.zeros(()), jnp.ones(()))
    assert np.max(np.abs(inflow(slope, PRINTED) - ours)) > 1e-3 * left


@pytest.mark.parametrize(("name", "row"), [("mean_gain", 0), ("third_gain", 1)])
def test_gains_scale_one_axisymmetric_state(name, row):
    model = finite_state_model(harmonics=1)
    ratio = taught_state(model, TAU, changed(name, 1.5)).a[:4] / taught_state(model, TAU, PRINTED).a[:4]
    np.testing.assert_allclose(ratio, np.where(np.arange(4) == row, 1.5, 1.0), rtol=1e-13)
