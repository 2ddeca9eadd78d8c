from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from rotorjax.errors import InputError
from rotorjax.potential.dynamics import InflowInputs, costates, hover_inputs
from rotorjax.potential.field import field_functions, pressure_functions
from rotorjax.potential.matrices import apparent_mass, damping
from rotorjax.potential.model import finite_state_model, steady_state
from rotorjax.potential.modes import rotor_modes
from rotorjax.potential.window import delayed_costates, flow_over_window, forgetting_rate, require_window, velocity_at

cylinder_model = partial(finite_state_model, printed=True, strengths="closed")  # the linear flow of a cylinder

MODEL = cylinder_model()
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
    steady = jnp.einsum("cmn,m->nc", field_functions(MODEL.modes, points), A)
    np.testing.assert_allclose(flow, jnp.stack([steady] * 2), rtol=1e-9, atol=1e-14)


def along_streamline(x, z, omega, time):
    """∫ ∇Φ₁ sin ω(t−s) ds along the path of the fluid particle: the exact linear flow at unit speed, x and z."""
    node, weight = np.polynomial.legendre.leggauss(40)
    node, weight = (node + 1) / 2, weight / 2
    edges = np.concatenate([np.linspace(0, 5 + abs(z), 11), np.linspace(5 + abs(z), 180, 60)[1:]])
    edges = np.sort(np.append(edges, max(-z, 0)))
    s = (edges[:-1, None] + np.diff(edges)[:, None] * node).ravel()
    step = (np.diff(edges)[:, None] * weight).ravel()
    points = jnp.stack([jnp.full(s.size, x), jnp.zeros(s.size), jnp.array(z + s)], axis=-1)
    slope = jax.vmap(jax.grad(lambda p: pressure_functions(rotor_modes(0, 1), p)[0]))(points)
    return (step * np.sin(omega * (time - s))) @ np.array(slope)


@pytest.mark.slow
@pytest.mark.parametrize("omega", [0.3, 1.0])
def test_both_components_against_integration_along_streamlines(omega):
    time, places = 120.0, [(0.4, 0.5), (0.4, -0.5), (0.6, -2.0), (1.5, -1.0)]
    exact = np.array([along_streamline(x, z, omega, time) for x, z in places])
    points, errors = jnp.array([[x, 0.0, z] for x, z in places]), []
    psi = jnp.linspace(0, 200, 4001)
    for odd, even in ((2, 0), (4, 3), (7, 7)):
        model = cylinder_model(radial_terms=odd, even_terms=even)
        d, mass = damping(model.modes, model.modes), apparent_mass(model.modes, model.modes)
        response = np.linalg.solve(1j * omega * mass + d, d[:, 0]) * 1e-7
        a = jnp.array((np.exp(1j * omega * np.array(psi))[:, None] * response).imag)
        tau = jnp.zeros_like(a).at[:, 0].set(1e-7 * jnp.sin(omega * psi))
        delta = costates(psi, a, InflowInputs(tau, jnp.zeros_like(psi), jnp.ones_like(psi)), model, skewed=False)
        mine = velocity_at(jnp.array(time), points, psi, a, delta, jnp.array(1.0), model) * 1e7
        errors.append(np.abs(mine - exact).max(axis=0)[[0, 2]])
    assert np.all(errors[2] < errors[0])
    assert np.all(errors[2] < 0.04)  # of amplitudes of about 1 and 2.5


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
