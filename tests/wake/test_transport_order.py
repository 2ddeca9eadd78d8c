"""Observed orders on the wake's own transport equation: 5PBU4 in age, Dormand–Prince in time."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax.flatten_util import ravel_pytree
from scipy.integrate import solve_ivp

from rotorjax.ode.runge_kutta import step
from rotorjax.wake.dynamics import inputs_of, rates
from rotorjax.wake.field import Velocities
from rotorjax.wake.model import WakeState, free_wake
from rotorjax.wake.settings import wake_settings
from rotorjax.wake.transport import age_operator, solve_nodes

SINK, SPREAD = -0.05, 0.02


def flow(points):
    """An axisymmetric stagnation flow above z = −1, over ΩR: a wake that spreads as it goes down."""
    x, y, z = points[..., 0], points[..., 1], points[..., 2]
    return jnp.stack([SPREAD * x, SPREAD * y, SINK - 2 * SPREAD * (z + 1)], axis=-1)


def carried(r, age):
    """Where that flow and the blade's turning carry a point of the blade: the wake's steady shape, in closed form."""
    u = r * np.exp((SPREAD - 1j) * age)
    rest = -1 + SINK / (2 * SPREAD)
    return np.stack([u.real, u.imag, rest - rest * np.exp(-2 * SPREAD * age)], axis=-1)


def model_of(uh60, age_step, **changes):
    return free_wake(
        *uh60, None, wake_settings(panels=4, age_step_deg=age_step, near_wake_deg=120.0, free_turns=2.0, **changes)
    )


def in_the_flow(model, state):
    """Rates of a wake in the analytic flow, the lifting line included."""
    control = flow(jnp.stack([model.stations, 0 * model.stations, 0 * model.stations], axis=-1))[None]
    return rates(state, Velocities(control, flow(state.near), flow(state.far)), inputs_of(model), model)


def steady(model):
    """The wake of the closed form, all of one strength."""
    settings, edges = model.settings, np.asarray(model.edges)
    near = np.stack([carried(r, settings.lattice_ages[1:]) for r in edges])
    stations = (float(settings.release), *settings.inboard)
    far = np.stack([carried(r, settings.filament_ages[1:]) for r in stations])
    ones = np.full((1, settings.panels, settings.near_ages), 0.01)
    return WakeState(
        jnp.asarray(near)[None],
        jnp.asarray(far)[None],
        jnp.asarray(ones),
        jnp.full((1, settings.filaments, settings.far_ages), 0.01),
        jnp.asarray(ones[..., 0]),
    )


def order_of(steps, errors):
    return np.polyfit(np.log(steps), np.log(errors), 1)[0]


def test_rates_are_of_fourth_order_in_the_age_step(uh60):
    """Rates at the exact steady wake, near and far nodes: what is left is the truncation error of 5PBU4."""

    @eqx.filter_jit
    def nodes_and_strengths(model, state):
        rate = in_the_flow(model, state)
        return rate.near, rate.far, rate.gamma_near

    steps, errors = (10.0, 7.5, 5.0), []
    for age_step in steps:
        model = model_of(uh60, age_step)
        found = [float(jnp.abs(a).max()) for a in nodes_and_strengths(model, steady(model))]
        # the flow is linear, so that a release between two trailers starts on the closed form, too
        errors.append(found[:2])
        assert found[2] < 1e-12
    for of_one in np.transpose(errors):
        assert order_of(steps, of_one) == pytest.approx(4, abs=0.2)


def test_the_steady_wake_is_of_fourth_order_in_the_age_step():
    """Nodes that given velocities produce over one turn, against the closed form."""
    counts, errors = (36, 48, 72), []
    for ages in counts:
        age_step = 2 * np.pi / ages
        exact = jnp.asarray(carried(0.9, age_step * np.arange(1, ages + 1)))[None, None]
        found = solve_nodes(age_operator(ages, age_step), flow(exact), jnp.array([[[0.9, 0.0, 0.0]]]))
        errors.append(float(jnp.abs(found - exact).max()))
    assert -order_of(counts, errors) == pytest.approx(4, abs=0.2)


@pytest.fixture(scope="module")
def disturbed(uh60):
    """A model whose filter of the bound circulation is no stiffer than transport, and a wake away from its rest."""
    model = model_of(uh60, 20.0, circulation_lag=1.0)
    return model, jax.tree.map(lambda a: a * (1 + 0.05 * jnp.cos(jnp.arange(a.size)).reshape(a.shape)), steady(model))


def test_order_in_time_of_the_march(disturbed):
    """The Runge–Kutta march of all states against an eighth-order code at a tolerance near rounding."""
    model, start = disturbed
    flat, unravel = ravel_pytree(start)

    @eqx.filter_jit
    def slope(v):
        return ravel_pytree(in_the_flow(model, unravel(v)))[0]

    end = 1.2
    exact = solve_ivp(lambda t, v: np.asarray(slope(v)), (0, end), np.asarray(flat), "DOP853", rtol=1e-13, atol=1e-15)
    leap = jax.jit(lambda v, dt: step(lambda t, w: slope(w), 0.0, v, dt))
    counts, errors = (12, 16, 24), []
    for count in counts:
        found = flat
        for _ in range(count):
            found = leap(found, end / count)
        errors.append(float(np.linalg.norm(np.asarray(found) - exact.y[:, -1])))
    assert -order_of(counts, errors) == pytest.approx(5, abs=0.2)
