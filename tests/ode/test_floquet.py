import jax
import jax.numpy as jnp
import numpy as np
import pytest
import scipy.linalg
import scipy.optimize
from systems import F, mathieu, turning, van_der_pol

from rotorjax.errors import InputError
from rotorjax.ode.collocation import collocate
from rotorjax.ode.floquet import floquet, monodromy, multipliers_of
from rotorjax.ode.shooting import shoot

TURN = 2 * np.pi


def rest(rhs, *args):
    """The orbit x = 0 of a linear homogeneous system."""
    return collocate(rhs, jnp.zeros((5, 2)), TURN, *args, tol=1e-12)


def hill(delta, epsilon, harmonics=24):
    """Floquet exponents of Mathieu's equation from Hill's infinite determinant, cut off at `harmonics`.

    x = e^{st} Σ c_k e^{ikt} turns x'' + (δ + ε cos t) x = 0 into a quadratic eigenvalue problem in s, solved here by
    linearisation; independent of any time march.
    """
    k = np.arange(-harmonics, harmonics + 1)
    n = k.size
    stiffness = np.diag(delta - k**2.0) + epsilon / 2 * (np.eye(n, k=1) + np.eye(n, k=-1))
    damping = np.diag(2j * k)
    companion = np.block([[np.zeros((n, n)), np.eye(n)], [-stiffness, -damping]])
    values = np.linalg.eigvals(companion)
    # Truncation spoils the far copies s + ik; those with the smallest imaginary part are right.
    return values[np.argsort(np.abs(values.imag))][:2]


@pytest.mark.parametrize(("delta", "epsilon"), [(0.25, 0.2), (0.6, 0.3), (-0.1, 0.4), (1.3, 0.9)])
def test_mathieu_exponents(delta, epsilon):
    found = multipliers_of(monodromy(mathieu, rest(mathieu, delta, epsilon), 600, delta, epsilon), TURN)
    exact = np.exp(TURN * hill(delta, epsilon))
    exact = np.concatenate([exact, 1 / exact])
    for value in found.multipliers:
        assert np.abs(value - exact).min() / abs(value) < TURN * 1e-8
    # Exponents themselves, modulo i
    gap = np.subtract.outer(found.exponents, np.concatenate([hill(delta, epsilon), -hill(delta, epsilon)]))
    gap = gap.real + 1j * (gap.imag - np.round(gap.imag))
    assert np.abs(gap).min(axis=1).max() < 1e-8


def test_mathieu_stability_boundary():
    """First tongue: edges δ = ¼ ± ε/2 − ε²/8 ∓ ε³/32 − ε⁴/384 + O(ε⁵), the trace of the monodromy is −2 there."""
    epsilon = 0.1

    def trace(delta):
        return np.trace(monodromy(mathieu, rest(mathieu, 0.25, 0.0), 300, delta, epsilon)) + 2

    for sign in (1, -1):
        series = 0.25 + sign * epsilon / 2 - epsilon**2 / 8 - sign * epsilon**3 / 32 - epsilon**4 / 384
        edge = scipy.optimize.brentq(trace, series - 0.01, series + 0.01, xtol=1e-10)
        assert abs(edge - series) < epsilon**5


def test_closed_form_monodromy():
    rate = jnp.array(0.7)
    matrix = monodromy(turning, rest(turning, rate), 400, rate)
    exact = scipy.linalg.expm(TURN * 0.7 * np.array(F))
    np.testing.assert_allclose(matrix, exact, atol=1e-9)
    found = multipliers_of(matrix, TURN)
    np.testing.assert_allclose(found.multipliers, np.linalg.eigvals(exact)[[0, 1]], rtol=1e-8)
    assert found.residuals.max() < 1e-13
    np.testing.assert_allclose(sorted(found.exponents.real), sorted(0.7 * np.linalg.eigvals(F).real), rtol=1e-8)


def test_order_is_five():
    rate = jnp.array(0.7)
    exact = scipy.linalg.expm(TURN * 0.7 * np.array(F))
    orbit, sizes = rest(turning, rate), np.array([64, 90, 128, 180])
    errors = [np.linalg.norm(monodromy(turning, orbit, int(n), rate) - exact) for n in sizes]
    assert abs(-np.polyfit(np.log(sizes), np.log(errors), 1)[0] - 5) < 0.2


def chain(t, x, n):
    """A damped chain with periodic stiffness: many states for Arnoldi."""
    q, v = x["q"], x["v"]
    stiff = 1 + 0.3 * jnp.cos(t + jnp.arange(30.0) * 0.2)
    left = jnp.concatenate([jnp.zeros(1), q[:-1]])
    right = jnp.concatenate([q[1:], jnp.zeros(1)])
    return {"q": v, "v": -stiff * q + 0.2 * (left - 2 * q + right) - 0.05 * (1 + jnp.arange(30.0) / 10) * v}


def test_arnoldi_agrees_with_dense():
    orbit = collocate(chain, {"q": jnp.zeros((5, 30)), "v": jnp.zeros((5, 30))}, TURN, 0.0, tol=1e-12)
    dense = multipliers_of(monodromy(chain, orbit, 60, 0.0, chunk=16), TURN)
    few = floquet(chain, orbit, 60, 0.0, count=6, tol=1e-12)
    np.testing.assert_allclose(np.abs(few.multipliers), np.abs(dense.multipliers[:6]), rtol=1e-8)
    assert few.residuals.max() < 1e-8


def test_limit_cycle_has_the_multiplier_one():
    """Along the flow of an autonomous system μ = 1; the other is exp ∫ μ(1 − x²) dt by Liouville's formula."""
    still = jnp.array([0.0, 1.0])
    start = {"position": jnp.array(2.0), "rate": jnp.array(0.0)}
    orbit = shoot(van_der_pol, start, 6.5, 800, still, 1.0, free_period=True, tol=1e-12)
    found = multipliers_of(monodromy(van_der_pol, orbit, 800, still, 1.0), orbit.period)
    np.testing.assert_allclose(found.multipliers[0], 1, atol=1e-8)
    liouville = np.exp(float(orbit.period) * np.mean(1 - np.array(orbit.x["position"]) ** 2))
    np.testing.assert_allclose(found.multipliers[1], liouville, rtol=1e-7)
    half = monodromy(van_der_pol, orbit, 400, still, 1.0, undo=lambda x: jax.tree.map(jnp.negative, x), copies=2)
    np.testing.assert_allclose(sorted(np.linalg.eigvals(half @ half)), sorted(found.multipliers.real), rtol=1e-7)


def test_bad_input():
    orbit = rest(mathieu, 0.3, 0.1)
    with pytest.raises(InputError, match=r"`count` must lie in \[1, 0\] for 2 states, but is 3"):
        floquet(mathieu, orbit, 50, 0.3, 0.1, count=3)
    start = {"position": jnp.array(2.0), "rate": jnp.array(0.0)}
    lost = shoot(van_der_pol, start, 6.5, 50, jnp.array([0.0, 1.0]), 1.0, free_period=True, max_iterations=1)
    with pytest.raises(InputError, match="converged"):
        monodromy(van_der_pol, lost, 50, jnp.array([0.0, 1.0]), 1.0)
