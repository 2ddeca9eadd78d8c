from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import scipy.integrate

from rotorjax.errors import InputError
from rotorjax.ode.runge_kutta import RK4, RK5
from rotorjax.ode.trajectory import checkpointed_scan, integrate, integrate_checkpointed, march


def rotor_free(t, x, p):
    """A forced pendulum on a pytree."""
    angle, rate = x
    return rate, -p * jnp.sin(angle) + jnp.cos(2 * t)


START = (jnp.array(0.5), jnp.array(-0.3))


def final(p, steps=64, run=integrate):
    return run(rotor_free, START, 0.0, 4.0 / steps, steps, p, save_every=steps).last[0]


@pytest.mark.parametrize(("tableau", "order"), [(RK4, 4), (RK5, 5)])
def test_order(tableau, order):
    exact = scipy.integrate.solve_ivp(
        lambda t, x: np.array(rotor_free(t, x, 2.0)), (0, 4), np.array(START), method="DOP853", rtol=1e-13, atol=1e-13
    ).y[:, -1]
    sizes = np.array([80, 112, 160, 224])
    found = [integrate(rotor_free, START, 0.0, 4.0 / n, int(n), 2.0, tableau=tableau).last for n in sizes]
    errors = np.linalg.norm(np.array(found) - exact, axis=1)
    measured = -np.polyfit(np.log(sizes), np.log(errors), 1)[0]
    assert abs(measured - order) < 0.2


def test_saved_states_are_those_of_the_full_march():
    every = integrate(rotor_free, START, 1.0, 0.05, 60, 2.0)
    some = integrate(rotor_free, START, 1.0, 0.05, 60, 2.0, save_every=15)
    np.testing.assert_allclose(some.t, every.t[::15], rtol=1e-15)
    np.testing.assert_allclose(some.t, 1 + 0.75 * np.arange(5), rtol=1e-15)
    np.testing.assert_allclose(some.x[0], every.x[0][::15], rtol=1e-14)
    assert every.x[0].shape == (61,)
    assert every.x[0][0] == START[0]


@pytest.mark.parametrize("save_every", [1, 6, 60])
def test_checkpointed_equals_plain(save_every):
    def run(way, p):
        x = way(rotor_free, START, 0.0, 0.05, 60, p, save_every=save_every).x
        return jnp.sum(jnp.sin(x[0]) * x[1])

    plain, kept = (jax.jit(jax.value_and_grad(partial(run, way))) for way in (integrate, integrate_checkpointed))
    np.testing.assert_allclose(kept(2.0), plain(2.0), rtol=1e-13)


def test_checkpointed_scan_is_scan():
    def f(carry, x):
        return carry * 0.9 + jnp.sin(x), {"y": carry * x}

    xs = jnp.linspace(0, 3, 30)
    for kwargs in ({"xs": xs}, {"xs": xs[:7]}, {"xs": xs, "length": 30}):
        a, b = (scan(f, jnp.array(0.1), **kwargs) for scan in (jax.lax.scan, checkpointed_scan))
        for u, v in zip(jax.tree.leaves(a), jax.tree.leaves(b), strict=True):
            np.testing.assert_allclose(u, v, rtol=1e-15)
    last, ys = checkpointed_scan(lambda c, _: (c + 1, c), 0, length=12)
    assert last == 12
    np.testing.assert_array_equal(ys, np.arange(12))


def test_derivative_ladder():
    p, eps = 2.0, 1e-5
    forward = jax.jit(jax.jacfwd(final))(p)
    reverse = jax.jit(jax.jacrev(final))(p)
    difference = (final(p + eps) - final(p - eps)) / (2 * eps)
    np.testing.assert_allclose(forward, difference, rtol=1e-7)
    np.testing.assert_allclose(reverse, forward, rtol=1e-13)


def test_vmap():
    p = jnp.array([1.0, 2.0, 3.0])
    np.testing.assert_allclose(jax.vmap(final)(p), [final(v) for v in p], rtol=1e-13)


def test_bad_input():
    with pytest.raises(InputError, match=r"multiple of `save_every` = 4, but is 10: try 8"):
        integrate(rotor_free, START, 0.0, 0.1, 10, 2.0, save_every=4)
    with pytest.raises(InputError, match="structure"):
        integrate(lambda t, x: jnp.zeros(2), START, 0.0, 0.1, 10)


def test_watched_march_is_integrate():
    watched = march(rotor_free, START, 1.0, 0.05, 60, 2.0, save_every=15, progress=False)
    plain = integrate(rotor_free, START, 1.0, 0.05, 60, 2.0, save_every=15)
    assert watched.finished
    np.testing.assert_allclose(watched.t, plain.t, rtol=1e-15)
    np.testing.assert_allclose(watched.x[0], plain.x[0], rtol=1e-13)


def test_a_march_that_runs_away_keeps_what_it_had():
    """x' = x² from 1 is infinite at t = 1."""
    run = march(lambda t, x: x**2, jnp.array(1.0), 0.0, 0.05, 200, save_every=10, progress=False)
    assert not run.finished
    assert "not finite between steps" in run.why
    assert bool(jnp.isfinite(run.x).all())
    assert run.t.size == run.x.size >= 2


def test_an_interrupted_march_keeps_what_it_had(monkeypatch):
    calls, real = [], jnp.isfinite

    def isfinite(x):
        calls.append(1)
        if len(calls) > 20:
            raise KeyboardInterrupt
        return real(x)

    monkeypatch.setattr(jnp, "isfinite", isfinite)
    run = march(lambda t, x: -x, jnp.array(1.0), 0.0, 0.1, 50, progress=False)
    assert not run.finished
    assert run.why == "interrupted after step 20"
    assert run.t.size == 21
