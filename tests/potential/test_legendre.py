import jax
import jax.numpy as jnp
import mpmath as mp
import numpy as np
import pytest
import scipy.special

from rotorjax.potential.legendre import h_constant, k_constant, legendre_p, legendre_q, reduced_legendre_p, rho

PAIRS = tuple((m, n) for n in range(16) for m in range(n + 1))
ETA = np.array([1e-6, 0.01, 0.1, 0.3, 0.5, 0.7, 1.0, 2.0, 5.0, 17.0, 50.0])


def exact_q(m, n, eta):
    """Q̄ from the hypergeometric series in 1/(1+η²), 50 digits."""
    f, g = mp.hyp2f1, mp.gamma
    a, b, c, t = mp.mpf(n - m + 1) / 2, mp.mpf(n + m + 1) / 2, n + mp.mpf(3) / 2, 1 / (1 + mp.mpf(eta) ** 2)
    return (
        t ** (mp.mpf(n + 1) / 2)
        * f(a, b, c, t)
        / (g(c) * mp.sqrt(mp.pi) / (g(b + mp.mpf(1) / 2) * g(a + mp.mpf(1) / 2)))
    )


@pytest.fixture(scope="module")
def exact():
    with mp.workdps(50):
        return np.array([[float(exact_q(m, n, e)) for e in ETA] for m, n in PAIRS])


def test_q_to_machine_precision(exact):
    np.testing.assert_allclose(legendre_q(PAIRS, jnp.array(ETA)), exact, rtol=1e-13)


@pytest.mark.parametrize(("m", "n", "eta"), [(0, 0, 0.4), (1, 2, 0.1), (2, 2, 1.5), (3, 6, 0.7), (0, 9, 2.0)])
def test_q_is_the_type_3_function_over_its_disk_value(m, n, eta):
    with mp.workdps(50):
        q = mp.legenq(n, m, mp.mpc(0, eta), type=3) / mp.legenq(n, m, mp.mpc(0, "1e-40"), type=3)
        assert abs(q.imag) < 1e-30
    np.testing.assert_allclose(legendre_q(((m, n),), jnp.array(eta))[0], float(q.real), rtol=1e-13)


def test_q_is_one_on_the_disk_with_slope_minus_one_over_k():
    np.testing.assert_allclose(legendre_q(PAIRS, jnp.array(0.0)), 1, rtol=1e-13)
    slope = jax.jacfwd(lambda e: legendre_q(PAIRS, e))(0.0)
    np.testing.assert_allclose(slope, [-1 / k_constant(m, n) for m, n in PAIRS], rtol=1e-13)


def test_neighbouring_k_multiply_to_rational():
    for m, n in PAIRS:
        if 0 < m <= n:
            np.testing.assert_allclose(k_constant(m, n) * k_constant(m - 1, n), 1 / ((n + m) * (n - m + 1)), rtol=1e-14)
    assert h_constant(0, 1) == 1


@pytest.mark.parametrize("jacobian", [jax.jacfwd, jax.jacrev])
def test_q_derivative_against_mpmath(jacobian):
    points = [(0, 1, 0.2), (3, 4, 0.5), (1, 8, 2.0), (7, 15, 1.0), (15, 15, 10.0), (0, 15, 50.0)]
    for m, n, eta in points:
        with mp.workdps(50):
            slope = float(mp.diff(lambda e, m=m, n=n: exact_q(m, n, e), eta))
        np.testing.assert_allclose(jacobian(lambda e, m=m, n=n: legendre_q(((m, n),), e)[0])(eta), slope, rtol=1e-12)


def test_q_second_derivative_satisfies_the_legendre_equation():
    @jax.jit
    def q(e):
        return legendre_q(PAIRS, e)

    m, n = np.array(PAIRS).T
    for eta in (0.0, 0.3, 1.0, 6.0, 50.0):
        first, second = jax.jacfwd(q)(eta), jax.jacfwd(jax.jacfwd(q))(eta)
        value = (n * (n + 1) - m**2 / (1 + eta**2)) * q(eta)
        scale = (1 + eta**2) * np.abs(second) + 2 * eta * np.abs(first) + np.abs(value)
        assert np.all(np.abs((1 + eta**2) * second + 2 * eta * first - value) <= 1e-11 * (scale + 1e-1))
        np.testing.assert_allclose(jax.jacrev(jax.jacfwd(q))(eta), second, rtol=1e-10, atol=1e-14)


def test_p_against_scipy():
    nu = np.linspace(-1, 1, 41)
    mine = np.array(legendre_p(PAIRS, jnp.array(nu)))
    for (m, n), row in zip(PAIRS, mine, strict=True):
        expected = (-1) ** m * scipy.special.lpmv(m, n, nu) / rho(m, n)
        np.testing.assert_allclose(row * (1 - nu**2) ** (m / 2), expected, atol=1e-13 * np.abs(expected).max())


def test_p_against_mpmath_to_twelve_digits():
    nu = np.array([0.05, 0.31, 0.77, 0.999])
    mine = np.array(legendre_p(PAIRS[::5], jnp.array(nu)))
    with mp.workdps(50):
        for (m, n), row in zip(PAIRS[::5], mine, strict=True):
            for x, value in zip(nu, row, strict=True):
                z = mp.mpf(float(x))
                norm = mp.sqrt(mp.factorial(n + m) / mp.factorial(n - m) / (2 * n + 1)) * (1 - z**2) ** (mp.mpf(m) / 2)
                exact = float((-1) ** m * mp.legenp(n, m, z, type=2) / norm)
                size = np.sqrt(2 * n + 1) if m == 0 else abs(exact)  # near a zero only the absolute error is small
                assert abs(value - exact) <= 1e-12 * max(abs(exact), size)


def test_p_orthonormal_within_a_parity():
    node, weight = np.polynomial.legendre.leggauss(24)
    nu, weight = (node + 1) / 2, weight / 2
    for m in range(0, 15, 3):
        for first in (m, m + 1):
            pairs = tuple((m, n) for n in range(first, 16, 2))
            p = np.array(legendre_p(pairs, jnp.array(nu))) * (1 - nu**2) ** (m / 2)
            np.testing.assert_allclose(p * weight @ p.T, np.eye(len(pairs)), atol=1e-13)


def test_reduced_p_is_a_polynomial_in_nu_squared():
    nu = jnp.linspace(0.1, 1, 7)
    odd = jnp.array([(n - m) % 2 for m, n in PAIRS])[:, None]
    np.testing.assert_allclose(reduced_legendre_p(PAIRS, nu**2) * nu**odd, legendre_p(PAIRS, nu), rtol=1e-14)
    assert np.all(np.isfinite(jax.jacrev(lambda x: reduced_legendre_p(PAIRS, x))(0.0)))


def test_p_derivative_and_second_derivative_satisfy_the_legendre_equation():
    m, n = np.array(PAIRS).T

    @jax.jit
    def p(x):
        return legendre_p(PAIRS, x)

    for nu in (-1.0, -0.4, 0.0, 0.2, 1.0):  # (1−ν²)p″ − 2(m+1)νp′ + (n−m)(n+m+1)p = 0 for P̄ = (1−ν²)^{m/2} p
        first, second = jax.jacrev(p)(nu), jax.jacfwd(jax.jacrev(p))(nu)
        terms = [(1 - nu**2) * second, -2 * (m + 1) * nu * first, (n - m) * (n + m + 1) * p(nu)]
        assert np.all(np.abs(sum(terms)) <= 1e-11 * (1 + sum(np.abs(t) for t in terms)))


def test_float32_neither_underflows_nor_overflows():
    eta = jnp.array([0.0, 0.5, 50.0, 1e4], jnp.float32)
    q = legendre_q(((0, 0), (0, 1), (3, 8)), eta)
    assert q.dtype == jnp.float32
    np.testing.assert_allclose(q, legendre_q(((0, 0), (0, 1), (3, 8)), eta.astype(float)), rtol=1e-5, atol=1e-30)
