"""The inverse of transport against exact wakes and against the marched equations."""

import jax.numpy as jnp
import numpy as np
import pytest

from rotorjax.wake.age_grid import age_grid
from rotorjax.wake.transport import ORDER, age_operator, dampings, harmonics, lag, solve_nodes, solve_scalar


def test_uniform_axial_flow_makes_a_helix_of_its_pitch():
    ages, step, down = 48, np.deg2rad(7.5), 0.05
    operator = age_operator(ages, step)
    velocity = jnp.zeros((1, 1, ages, 3)).at[..., 2].set(-down)
    inlet = jnp.array([[[0.9, 0.0, 0.0]]])
    nodes = solve_nodes(operator, velocity, inlet)[0, 0]
    age = step * np.arange(1, ages + 1)
    exact = np.stack([0.9 * np.cos(age), -0.9 * np.sin(age), -down * age], axis=-1)
    # transport is exact for z, fourth order for the turning
    np.testing.assert_allclose(nodes[:, 2], exact[:, 2], rtol=1e-12)
    np.testing.assert_allclose(nodes, exact, atol=1e-3)


def test_turning_is_fourth_order_in_the_age_step():
    errors, counts = [], np.array([24, 48, 96])
    for ages in counts:
        operator = age_operator(ages, 2 * np.pi / ages)
        nodes = solve_nodes(operator, jnp.zeros((1, 1, ages, 3)), jnp.array([[[1.0, 0.0, 0.0]]]))[0, 0]
        age = 2 * np.pi / ages * np.arange(1, ages + 1)
        errors.append(np.max(np.abs(nodes[:, 0] - np.cos(age))))
    order = -np.polyfit(np.log(counts), np.log(errors), 1)[0]
    assert abs(order - 4) < 0.2


def test_long_steps_wind_a_helix_exactly_and_keep_the_order():
    """What goes round with the blade is no function of age to difference; what is left is of fourth order."""
    errors, turns = [], np.array([48, 96, 192])
    for turn in turns:
        grid = age_grid(4 * turn, turn, 2)
        count, age = len(grid.nodes) - 1, 2 * np.pi / turn * grid.nodes[1:]
        assert age[-1] == pytest.approx(8 * np.pi)
        operator = age_operator(count, 2 * np.pi / turn, grid)
        still = solve_nodes(operator, jnp.zeros((1, 1, count, 3)), jnp.array([[[1.0, 0.0, 0.0]]]))[0, 0]
        np.testing.assert_allclose(still[:, 0], np.cos(age), atol=1e-11)
        grown = solve_scalar(operator, jnp.asarray(0.1 * np.exp(0.1 * age))[None, None], jnp.ones((1, 1)))[0, 0]
        errors.append(np.max(np.abs(grown - np.exp(0.1 * age))))
    order = -np.polyfit(np.log(turns), np.log(errors), 1)[0]
    assert abs(order - 4) < 0.25


def test_steps_of_one_length_are_the_operator_without_a_grid():
    plain, on_grid = age_operator(48, 0.2), age_operator(48, 0.2, age_grid(48, 24, 1))
    np.testing.assert_array_equal(on_grid.matrix, plain.matrix)
    np.testing.assert_array_equal(on_grid.inlet, plain.inlet)


def test_a_harmonic_of_bound_circulation_is_carried_back_unchanged():
    slices, ages = 12, 48
    operator = age_operator(ages, np.deg2rad(5.0))
    psi = 2 * np.pi / slices * np.arange(slices)
    inlet = jnp.asarray(np.cos(psi))[:, None]
    found = solve_scalar(operator, jnp.zeros((slices, 1, ages)), inlet)[:, 0]
    age = np.deg2rad(5.0) * np.arange(1, ages + 1)
    np.testing.assert_allclose(found, np.cos(psi[:, None] - age), atol=3e-5)


@pytest.mark.parametrize(("slices", "rate"), [(12, 0.3 * (4 / 6) ** ORDER), (24, 0.3 * (4 / 12) ** ORDER)])
def test_damping_takes_a_harmonic_away_with_age_as_the_order_says(slices, rate):
    ages, step = 192, np.deg2rad(1.25)
    inlet = jnp.asarray(np.cos(4 * 2 * np.pi / slices * np.arange(slices)))[:, None]
    plain, damped = (
        np.fft.fft(solve_scalar(age_operator(ages, step, damping=d), jnp.zeros((slices, 1, ages)), inlet)[:, 0], axis=0)
        for d in (0.0, 0.3)
    )
    np.testing.assert_allclose(damped[4] / plain[4], np.exp(-rate * step * np.arange(1, ages + 1)), rtol=1e-5)


def test_filter_delays_a_harmonic_as_a_first_order_lag_does():
    slices, tau = 8, 0.3
    psi = 2 * np.pi / slices * np.arange(slices)
    found = lag(jnp.asarray(np.cos(psi))[:, None], jnp.asarray(tau))[:, 0]
    gain, phase = 1 / np.hypot(1, tau), np.arctan(tau)
    np.testing.assert_allclose(found, gain * np.cos(psi - phase), atol=1e-14)


def test_the_lone_highest_harmonic_counts_as_zero():
    assert harmonics(4).tolist() == [0, 1, 0, -1]
    assert harmonics(1).tolist() == [0]
    assert dampings(4, 16.0).tolist() == [0, 1, 0, 1]
