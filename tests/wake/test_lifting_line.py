"""The filter on the lifting line's solution: the paper's equilibrium without its stiffness, by the same derivatives."""

from dataclasses import replace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from rotorjax.errors import InputError
from rotorjax.rotor.catalogue import load
from rotorjax.wake.biot_savart import segment_velocity
from rotorjax.wake.dynamics import inputs_of
from rotorjax.wake.equilibrium import full_state
from rotorjax.wake.field import node_velocities
from rotorjax.wake.lifting_line import bound_line
from rotorjax.wake.model import free_wake
from rotorjax.wake.settings import wake_settings
from rotorjax.wake.start import prescribed

TINY = {"panels": 16, "age_step_deg": 30.0, "near_wake_deg": 120.0, "closure_turns": 1, "closure_bundles": 0}


def model_of(bound_filter):
    rotor, operating = load("uh60")
    operating = eqx.tree_at(lambda o: o.collective, operating, jnp.asarray(0.3))
    return free_wake(rotor, operating, settings=wake_settings(**TINY, bound_filter=bound_filter))


PASS, SOLUTION = model_of("pass"), model_of("solution")


@pytest.fixture(scope="module")
def state():
    return full_state(PASS, prescribed(PASS))[0]


@eqx.filter_jit
def wanted(model, state, gamma):
    """What the bound circulation follows in a wake whose own is gamma (K, R)."""
    state = replace(state, gamma_bound=gamma)
    return bound_line(model, node_velocities(model, state).control, state, inputs_of(model)).gamma


def test_the_equilibrium_is_that_of_the_fixed_point(state):
    gamma = state.gamma_bound
    for _ in range(12):
        gamma = wanted(SOLUTION, state, gamma)
    np.testing.assert_allclose(wanted(PASS, state, gamma), gamma, atol=1e-13)
    # and it is no equilibrium where the fixed point has none
    assert float(jnp.max(jnp.abs(wanted(PASS, state, 1.01 * gamma) - gamma))) > 1e-4


def test_no_rate_is_beyond_the_filter_s(state):
    def rates(model):
        slope = eqx.filter_jit(jax.jacfwd(lambda g: wanted(model, state, g)))(state.gamma_bound)[0, :, 0]
        return np.linalg.eigvals(np.asarray(slope) - np.eye(16)).real

    assert rates(PASS).min() < -4
    found = rates(SOLUTION)
    assert -1.2 < found.min() < found.max() < -0.3
    assert abs(np.median(found) + 1) < 0.02


def test_derivatives_of_the_solution(state):
    """Forward against central differences, reverse against forward; away from the equilibrium, by state and core."""
    keys = iter(jax.random.split(jax.random.key(0), 20))
    way = jax.tree.map(lambda v: jax.random.normal(next(keys), v.shape) * 0.1, state)
    cover, core = jnp.linspace(1.0, 2.0, 16), SOLUTION.settings.control_core
    air = jnp.full((1, 16, 3), -0.05)

    @jax.jit
    def value(x, core):
        model = eqx.tree_at(lambda m: m.settings.control_core, SOLUTION, core)
        return bound_line(model, air, x, inputs_of(model)).gamma[0] @ cover

    step = 1e-6
    ends = [value(jax.tree.map(lambda a, b, s=s: a + s * b, state, way), core * (1 + s)) for s in (step, -step)]
    forward = jax.jvp(value, (state, core), (way, core))[1]
    back = jax.grad(value, (0, 1))(state, core)
    reverse = sum(jnp.vdot(a, b) for a, b in zip(jax.tree.leaves(back), jax.tree.leaves((way, core)), strict=True))
    assert float(forward) == pytest.approx(float(ends[0] - ends[1]) / (2 * step), rel=1e-6)
    assert float(reverse) == pytest.approx(float(forward), rel=1e-10)


def test_an_unknown_filter_is_refused():
    with pytest.raises(InputError, match=r"`bound_filter` must be one of \('pass', 'solution'\), but is 'explicit'"):
        wake_settings(bound_filter="explicit")  # pyright: ignore[reportArgumentType]


@pytest.mark.parametrize(("dtype", "most"), [(np.float64, 1e-12), (np.float32, 1e-4)])
def test_sums_by_products(dtype, most):
    """Against rows of double precision: points among segments with cores of .01, on a node, far away."""
    rng = np.random.default_rng(0)
    start = np.cumsum(0.05 * rng.normal(size=(150, 3)), axis=0)
    args = [start + 0.003, start[:-1], start[1:], rng.normal(size=149), np.full(149, 0.01)]
    args[0][0], args[0][1] = start[3], (20.0, 0.0, 5.0)
    rows = segment_velocity(*map(jnp.asarray, args))
    products = segment_velocity(*(jnp.asarray(a, dtype) for a in args), products=True)
    assert products.dtype == dtype
    scale = float(jnp.max(jnp.abs(rows)))
    np.testing.assert_allclose(products, rows, rtol=0, atol=most * scale)
