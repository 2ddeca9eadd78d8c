import jax
import jax.numpy as jnp
import numpy as np
import pytest

from rotorjax.errors import InputError
from rotorjax.potential.dynamics import costates, hover_inputs
from rotorjax.potential.field import axial_functions
from rotorjax.potential.model import finite_state_model, steady_state
from rotorjax.potential.window import delayed_costates, flow_over_window, forgetting_rate, require_window

MODEL = finite_state_model()
TAU = jnp.array([np.sqrt(3) / 4 * 0.006, 3e-4, 1e-4])
SPEED = np.sqrt(0.003)
PSI = jnp.linspace(0, 120, 601)
A = steady_state(MODEL, TAU).a


def window(swing):
    a = A * (1 + swing * jnp.sin(0.2 * PSI))[:, None]
    return a, hover_inputs(TAU * (1 + swing * jnp.sin(0.2 * PSI + 0.4))[:, None])


def test_causal_form_forgets_the_future_at_the_slowest_rate():
    """Error against delay: a straight line in the logarithm, with the slope of the slowest state."""
    a, inputs = window(0.0)
    inputs = hover_inputs(inputs.tau * (1 + 0.2 * jnp.sin(0.2 * PSI))[:, None])
    whole = costates(PSI, a, inputs, MODEL, skewed=False)
    errors = []
    delays = np.array([25, 50, 100, 150])
    for steps in delays:
        found = delayed_costates(PSI, a, inputs, MODEL, int(steps))[: 601 - 250]
        errors.append(float(jnp.sqrt(jnp.mean((found - whole[: 601 - 250]) ** 2))))
    slopes = -np.diff(np.log(errors)) / np.diff(delays * 0.2)
    rate = forgetting_rate(A, jax.tree.map(lambda v: v[0], inputs), MODEL)
    np.testing.assert_allclose(slopes[1:], rate, rtol=0.1)
    assert errors[3] < 0.1 * errors[0]


def test_flow_in_steady_motion_is_the_steady_field():
    a, inputs = window(0.0)
    points = jnp.array([[0.3, 0.2, 0.4], [0.3, 0.2, -0.7], [1.4, 0.0, -0.3]])
    times = jnp.array([60.0, 90.0])
    flow = flow_over_window(PSI, a, inputs, times, points, SPEED, MODEL)
    np.testing.assert_allclose(flow, jnp.stack([A @ axial_functions(MODEL.modes, points)] * 2), rtol=1e-9)


def test_flow_does_not_depend_on_a_longer_window():
    """Future beyond what the slowest state remembers does not matter."""
    a, inputs = window(0.2)
    points, times = jnp.array([[0.3, 0.2, -0.7]]), jnp.array([30.0, 40.0])
    short = slice(None, 501)
    cut = jax.tree.map(lambda v: v[short], inputs)
    first = flow_over_window(PSI, a, inputs, times, points, SPEED, MODEL)
    second = flow_over_window(PSI[short], a[short], cut, times, points, SPEED, MODEL)
    rate = forgetting_rate(A, jax.tree.map(lambda v: v[0], inputs), MODEL)
    np.testing.assert_allclose(first, second, atol=0.1 * np.exp(-rate * 60))


def test_bad_input():
    a, inputs = window(0.0)
    with pytest.raises(InputError, match=r"transit time 200 rad .* spans 120"):
        require_window(PSI, 10.0, 0.05)
    with pytest.raises(InputError, match="must increase"):
        require_window(PSI[::-1], 1.0, 0.05)
    with pytest.raises(InputError, match="`speed` must be positive"):
        require_window(PSI, 1.0, 0.0)
    with pytest.raises(InputError, match="the window less"):
        flow_over_window(PSI, a, inputs, jnp.array([1.0]), jnp.array([[0.0, 0.0, -1.0]]), SPEED, MODEL)
    with pytest.raises(InputError, match="but is 601"):
        delayed_costates(PSI, a, inputs, MODEL, 601)
