import jax.numpy as jnp
import numpy as np
import pytest

from rotorjax.errors import InputError
from rotorjax.ode.anderson import _Window, anderson
from rotorjax.ode.linear import Dense, Krylov

RNG = np.random.default_rng(1)
SPREAD = jnp.array(np.diag(np.linspace(-3, 0.9, 40)) + 0.05 * RNG.normal(size=(40, 40)))
TRACES = []


def affine(x, matrix, b):
    TRACES.append(1)
    return {"x": matrix @ x["x"] + b}


def test_expansive_affine_map():
    """Plain iteration diverges (eigenvalues down to −3); a full window is GMRES in exact arithmetic."""
    b = jnp.array(RNG.normal(size=40))
    exact = jnp.linalg.solve(jnp.eye(40) - SPREAD, b)
    out = anderson(affine, {"x": jnp.zeros(40)}, SPREAD, b, window=40, mixing=0.3, tol=1e-12)
    assert out.converged
    assert "within" in out.why
    assert out.residual == min(out.residuals) <= 1e-12
    assert out.iterations == len(out.residuals) - 1
    np.testing.assert_allclose(out.x["x"], exact, rtol=1e-9)


def test_beats_plain_mixing():
    def g(x):
        return x - jnp.array([0.1, 0.5, 1.0]) * jnp.tan(x - 0.3)

    fast = anderson(g, jnp.zeros(3), tol=1e-12, mixing=0.5)
    x, plain = jnp.zeros(3), 0
    while float(jnp.linalg.norm(g(x) - x)) > 1e-12 * float(jnp.linalg.norm(x)):
        x, plain = x + 0.5 * (g(x) - x), plain + 1
    assert fast.converged
    assert fast.iterations < plain / 2


def test_new_numbers_do_not_compile_again():
    TRACES.clear()
    for k in range(3):
        anderson(affine, {"x": jnp.zeros(40)}, SPREAD / (2 + k), jnp.ones(40) * k, max_iterations=3)
    assert len(TRACES) <= 1


def test_divergence_keeps_the_best():
    out = anderson(lambda x: x + jnp.exp(x * x), jnp.array([0.3]), mixing=1.0, max_iterations=500)
    assert not out.converged
    assert bool(jnp.isfinite(out.x).all())
    assert out.residual == min(out.residuals)
    assert out.why


def test_wild_excursions_are_taken_back():
    """exp throws the second iterate to 1e40; the safeguard returns and finds a root all the same."""
    out = anderson(lambda x: 0.1 * jnp.exp(x), jnp.array([6.0]), mixing=1.0, tol=1e-12, max_iterations=100)
    assert out.converged
    np.testing.assert_allclose(out.x, 0.1 * jnp.exp(out.x), rtol=1e-10)


def test_interrupt_keeps_what_it_had():
    calls = []

    def g(x):
        return 0.5 * jnp.cos(x)

    def measure(f, x):
        calls.append(1)
        if len(calls) == 3:
            raise KeyboardInterrupt
        return float(np.abs(f).max())

    out = anderson(g, jnp.ones(2), measure=measure, mixing=0.01)
    assert not out.converged
    assert out.interrupted
    assert "interrupted" in out.why
    assert out.iterations == 1


@pytest.mark.parametrize("bad", [{"window": 0}, {"mixing": 0.0}, {"mixing": 1.5}, {"safeguard": 1.0}])
def test_bad_settings(bad):
    with pytest.raises(InputError, match="window"):
        anderson(jnp.cos, jnp.zeros(1), **bad)


def test_bad_start():
    with pytest.raises(InputError, match="finite"):
        anderson(jnp.cos, jnp.array([jnp.nan]))
    with pytest.raises(InputError, match="int"):
        anderson(jnp.cos, jnp.array([1]))
    with pytest.raises(InputError, match="shape"):
        anderson(lambda x: x[:1], jnp.zeros(2))


@pytest.mark.parametrize("linear", [Dense(), Krylov()])
def test_a_residual_for_newton_gives_the_same_iterates(linear):
    b = jnp.linspace(-1, 1, 40)

    def difference(x, *args):
        return {"x": affine(x, *args)["x"] - x["x"]}

    one = anderson(affine, {"x": jnp.zeros(40)}, SPREAD, b, mixing=0.3, tol=1e-10)
    other = anderson(difference, {"x": jnp.zeros(40)}, SPREAD, b, mixing=0.3, tol=1e-10, linear=linear)
    assert one.converged
    np.testing.assert_allclose(one.residuals, other.residuals, rtol=1e-6, atol=1e-12)


def test_differences_that_hardly_disagree_do_not_throw_the_iterate():
    """What is left between two parallel ones is curvature: solved for, it makes a step of 10⁴."""
    past = _Window(5, 2)
    for change in ([-1.0, 0.0], [-1.0, 1e-4]):
        past.push(np.array([1.0, 0.0]), np.array(change))
    np.testing.assert_allclose(past.advance(np.zeros(2), np.array([0.0, 1.0]), 0.1), [0.0, 0.1], atol=1e-3)
