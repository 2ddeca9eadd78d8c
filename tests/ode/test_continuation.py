import jax.numpy as jnp
import numpy as np
import pytest

from rotorjax.errors import InputError
from rotorjax.ode.continuation import Steps, continuation, critical_direction, follow
from rotorjax.ode.jacobian import dense_jacobian
from rotorjax.ode.linear import Dense
from rotorjax.ode.newton import newton


def cubic(x, p):
    """p = x³ − 3x at both components: folds at x = ∓1, p = ±2."""
    return x**3 - 3 * x - p


def solve(x, p, memory):
    return newton(cubic, x, p, tol=1e-12, max_iterations=8)


def test_reaches_the_end_where_there_is_no_fold():
    branch = continuation(solve, jnp.full(2, 2.5), 8.0, -1.5, steps=Steps(first=3.0))
    assert branch.reached
    assert branch.parameters[0] == 8.0
    assert branch.parameters[-1] == -1.5
    assert all(o.converged for o in branch.outcomes)
    np.testing.assert_allclose(branch.last.x, np.roots([1, 0, -3, 1.5]).max(), rtol=1e-10)


def test_carry_moves_what_is_known():
    """x = 100 p + small(p): with the main part carried over there are fewer iterations."""

    def residual(x, p):
        return x - 100 * p - 0.5 * jnp.sin(x - 99 * p)

    def step(x, p, memory):
        return newton(residual, x, p, tol=1e-12)

    branch = continuation(step, jnp.full(2, 100.0), 1.0, 3.0, carry=lambda x, here, there: x + 100 * (there - here))
    plain = continuation(step, jnp.full(2, 100.0), 1.0, 3.0)
    assert branch.reached
    carried, bare = (sum(o.iterations for o in b.outcomes) for b in (branch, plain))
    assert carried < bare
    p = branch.parameters[-1]
    rest = np.array(branch.last.x) - 100 * p
    np.testing.assert_allclose(rest, 0.5 * np.sin(rest + p), atol=1e-8)


def test_stops_at_a_fold_and_says_where():
    branch = continuation(lambda x, p, m: newton(cubic, x, p, tol=1e-9), jnp.full(2, 2.5), 8.0, -2.5)
    assert not branch.reached
    assert abs(branch.parameters[-1] + 2) < 0.02
    assert "lost at -1.9" in branch.why
    assert branch.failed is not None
    assert not branch.failed.converged


def test_an_interrupt_ends_the_branch():
    """One is enough, though the solver inside keeps it to itself."""
    calls = []

    def measure(f, x):
        calls.append(1)
        if len(calls) == 20:
            raise KeyboardInterrupt
        return float(np.abs(f).max())

    branch = continuation(
        lambda x, p, m: newton(cubic, x, p, tol=1e-12, measure=measure),
        jnp.full(2, 2.5),
        8.0,
        -1.5,
        steps=Steps(largest=0.3),
    )
    assert len(calls) == 20
    assert not branch.reached
    assert "interrupted" in branch.why
    assert len(branch.outcomes) > 2


def test_factors_are_handed_on():
    seen = []

    def chord(x, p, memory):
        seen.append(memory is not None)
        return newton(cubic, x, p, tol=1e-10, linear=Dense(reuse="chord"), memory=memory)

    assert continuation(chord, jnp.full(2, 2.5), 8.0, 6.0).reached
    assert not seen[0]
    assert any(seen[1:])


def test_follow_goes_round_both_folds():
    first, second = (solve(jnp.full(2, 2.5), p, None).x for p in (4.0, 3.8))
    branch = follow(
        cubic, (first, 4.0), (second, 3.8), points=400, steps=Steps(largest=0.2), between=(-3.0, 4.5), tol=1e-11
    )
    assert branch.reached
    x = np.array([float(o.x[0][0]) for o in branch.outcomes])
    p = np.array(branch.parameters)
    np.testing.assert_allclose(x**3 - 3 * x, p, atol=1e-9)
    assert x.min() < -2
    assert len(branch.folds) == 2
    np.testing.assert_allclose(p[list(branch.folds)], [-2, 2], atol=0.02)


def test_critical_direction_at_a_fold():
    def pair(x):
        return jnp.array([x[0] ** 2 + x[1], x[1]])

    jacobian = dense_jacobian(pair, jnp.array([1e-9, 0.0]))
    value, right, left = critical_direction(jacobian)
    assert value < 1e-8
    np.testing.assert_allclose(np.abs(right), [1, 0], atol=1e-6)
    np.testing.assert_allclose(np.abs(left), [np.sqrt(0.5)] * 2, atol=1e-6)


def test_bad_input():
    with pytest.raises(InputError, match="the two ends must differ"):
        continuation(solve, jnp.ones(1), 1.0, 1.0)
    x = jnp.ones(1)
    with pytest.raises(InputError, match="the two ends must differ"):
        follow(cubic, (x, 1.0), (x, 1.0))
    lost = continuation(lambda x, p, m: newton(lambda x: x**2 + 1, x), x, 0.0, 1.0)
    assert not lost.reached
    assert "no solution at the start" in lost.why
