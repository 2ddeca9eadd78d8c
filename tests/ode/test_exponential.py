"""The exponential step: its functions, its order where a state is stiff, fixed points, and the classical method."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from rotorjax.ode.exponential import phis, told_step
from rotorjax.ode.runge_kutta import RK4, step

KAPPA = 10.0


def rhs(t, x):
    """Something slow that something fast follows."""
    slow, fast = x
    return (jnp.cos(t) * fast, -KAPPA * (fast - jnp.tanh(slow))), fast


def marched(count, decay, end=2.0):
    x, dt = (jnp.array(0.3), jnp.array(0.9)), end / count
    advance = jax.jit(lambda t, x: told_step(rhs, t, x, dt, decay)[0])
    for i in range(count):
        x = advance(i * dt, x)
    return np.array(x)


def test_the_functions_are_their_series_and_their_closed_forms():
    for z in (-1e-9, -0.3, -0.4999, -0.5001, -3.0, -40.0):
        one, two, three = phis(jnp.asarray(z))
        exact = np.expm1(np.longdouble(z)) / np.longdouble(z)
        np.testing.assert_allclose(one, float(exact), rtol=1e-14)
        if abs(z) > 0.1:
            np.testing.assert_allclose(two, float((exact - 1) / z), rtol=1e-12)
            np.testing.assert_allclose(three, float(((exact - 1) / z - 0.5) / z), rtol=1e-11)
    np.testing.assert_allclose(phis(jnp.zeros(())), [1, 1 / 2, 1 / 6], rtol=1e-15)


def test_fourth_order():
    fine = marched(2560, (0.0, KAPPA))
    coarse, finer = (np.abs(marched(count, (0.0, KAPPA)) - fine).max() for count in (160, 320))
    assert 3.7 < np.log2(coarse / finer) < 4.4


def test_without_decay_it_is_the_classical_method():
    x = (jnp.array(0.3), jnp.array(0.9))
    found, told = told_step(rhs, 0.1, x, 0.05, (0.0, 0.0))
    np.testing.assert_allclose(found, step(lambda t, x: rhs(t, x)[0], 0.1, x, 0.05, tableau=RK4), rtol=1e-14)
    assert told == x[1]


@pytest.mark.parametrize("kappa", [1.0, 26.0, 1e4])
def test_a_decay_is_exact_and_a_goal_is_kept(kappa):
    """y' = κ(g − y) over one step, for any step."""
    goal, start = 2.0, 5.0
    found, _ = told_step(lambda t, y: (kappa * (goal - y), ()), 0.0, jnp.array(start), 0.1, kappa)
    np.testing.assert_allclose(found, goal + (start - goal) * np.exp(-0.1 * kappa), rtol=1e-12)


def test_derivatives():
    """By the decay too, forward and reverse, against differences."""

    def end(kappa):
        return told_step(lambda t, y: (kappa * (jnp.sin(y) - y), ()), 0.0, jnp.array(0.7), 0.2, kappa)[0]

    step_ = 1e-6
    difference = (end(8 + step_) - end(8 - step_)) / (2 * step_)
    np.testing.assert_allclose([jax.jacfwd(end)(8.0), jax.grad(end)(8.0)], difference, rtol=1e-7)
