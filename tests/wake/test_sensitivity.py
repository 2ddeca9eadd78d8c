"""Performance, and its derivative through the periodic wake."""

from dataclasses import replace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from rotorjax.errors import InputError
from rotorjax.ground import plane
from rotorjax.wake import sensitivity
from rotorjax.wake.equilibrium import evaluate
from rotorjax.wake.model import free_wake
from rotorjax.wake.performance import performance
from rotorjax.wake.sensitivity import periodic_wake
from rotorjax.wake.solution import solve

PARAMETERS = {
    "collective": lambda m: m.operating.collective,
    "height": lambda m: m.ground.height,
    "tip core": lambda m: m.settings.tip_core,
    "twist": lambda m: m.rotor.twist.values,
}


@pytest.fixture(scope="module")
def grounded(uh60, coarse):
    return solve(free_wake(*uh60, plane(1.0), coarse), tol=1e-11)


def moved(model, where, step):
    """The model with one parameter moved; the twist at its outboard half."""
    value = where(model)
    change = step if value.ndim == 0 else step * (jnp.arange(value.size) >= value.size // 2)
    return eqx.tree_at(where, model, value + change)


def numbers(model):
    return eqx.filter(model, eqx.is_inexact_array)


@pytest.mark.slow
def test_derivatives_through_the_wake(grounded):
    """Forward against finite differences of converged wakes, and against reverse mode."""
    model, step = grounded.model, 1e-5

    def outputs(m):
        found = performance(m, evaluate(m, periodic_wake(grounded, m)))
        return jnp.stack([found.thrust, found.mean_inflow])

    @eqx.filter_jit
    def gradient(m, weights):
        return eqx.filter_vjp(outputs, m)[1](weights)[0]

    @eqx.filter_jit
    def slope(m, along):
        return eqx.filter_jvp(outputs, (m,), (along,))[1]

    reverse = [gradient(model, weights) for weights in jnp.eye(2)]
    for name, where in PARAMETERS.items():
        along = jax.tree.map(jnp.subtract, numbers(moved(model, where, 1.0)), numbers(model))
        forward = slope(model, along)
        ends = [solve(moved(model, where, s), start=grounded, tol=1e-12) for s in (step, -step)]
        assert all(end.converged for end in ends)
        difference = (np.array([ends[0].CT, ends[0].mean_inflow]) - [ends[1].CT, ends[1].mean_inflow]) / (2 * step)
        np.testing.assert_allclose(forward, difference, rtol=1e-5, err_msg=name)
        dots = [
            sum(float(jnp.vdot(g, t)) for g, t in zip(jax.tree.leaves(r), jax.tree.leaves(along), strict=True))
            for r in reverse
        ]
        np.testing.assert_allclose(dots, forward, rtol=1e-8, err_msg=name)


def test_only_converged_axisymmetric_wakes_have_a_derivative(grounded):
    lost = replace(grounded, converged=False, why="lost")
    with pytest.raises(InputError, match="lost"):
        periodic_wake(lost, grounded.model)


def test_one_thread_would_wait_for_itself(uh60, coarse, monkeypatch):
    """XLA's only thread is the caller's program, which waits for the search's."""
    monkeypatch.setenv("NPROC", "1")
    with pytest.raises(InputError, match="set NPROC=2 in the environment"):
        jax.jit(lambda height: sensitivity.solve(free_wake(*uh60, plane(height), coarse)).CT)(1.0)
