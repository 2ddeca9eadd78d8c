import jax
import jax.numpy as jnp
import numpy as np
import pytest
from systems import van_der_pol

from rotorjax.errors import InputError
from rotorjax.ode.collocation import Collocation, FreePeriod
from rotorjax.ode.implicit import attach, implicit_orbit
from rotorjax.ode.newton import newton

N = 12
COUPLING = jnp.array(np.random.default_rng(3).normal(size=(N, N)) / 4)


def residual(x, p):
    y = jnp.concatenate([x["a"], x["b"]])
    f = y + 0.5 * jnp.tanh(COUPLING @ y) - jnp.sin(p["s"] * jnp.arange(float(N))) * p["g"]
    return {"a": f[:5], "b": f[5:]}


def solver(p):
    return newton(residual, {"a": jnp.zeros(5), "b": jnp.zeros(N - 5)}, p, tol=1e-14)


P = {"s": jnp.array(0.7), "g": jnp.array([1.2])}


@pytest.mark.parametrize("method", ["dense", "gmres"])
def test_derivative_ladder(method):
    orbit = implicit_orbit(residual, solver, method=method, chunk=5)

    def output(p):
        x = orbit(p)
        return jnp.sum(x["a"] ** 2) + jnp.prod(jnp.cos(x["b"]))

    forward, reverse = jax.jacfwd(output)(P), jax.jacrev(output)(P)
    for name in P:
        eps = 1e-5
        up, down = ({**P, name: P[name] + e} for e in (eps, -eps))
        difference = (output(up) - output(down)) / (2 * eps)
        np.testing.assert_allclose(jnp.squeeze(forward[name]), difference, rtol=1e-8)
        np.testing.assert_allclose(reverse[name], forward[name], rtol=1e-10)


@pytest.mark.parametrize("method", ["dense", "gmres"])
def test_attach_under_jit_and_vmap(method):
    solution = solver(P).x

    def output(p):
        return attach(residual, solution, p, method=method)["a"]

    eager, jitted = jax.jacfwd(output)(P), jax.jit(jax.jacrev(output))(P)
    np.testing.assert_allclose(jitted["s"], eager["s"], rtol=1e-9)
    many = jax.vmap(lambda d: jax.jvp(output, (P,), ({"s": d, "g": jnp.zeros(1)},))[1])(jnp.arange(3.0))
    np.testing.assert_allclose(many[2], 2 * eager["s"], rtol=1e-9)
    np.testing.assert_array_equal(output(P), solution["a"])


def test_second_derivative():
    def cube(x, p):
        return x**3 - p

    found = jax.hessian(lambda p: attach(cube, jnp.array([2.0]), p)[0])(8.0)
    np.testing.assert_allclose(found, -2 / 9 * 8 ** (-5 / 3), rtol=1e-12)


def test_one_linear_solve_whatever_the_solver_did():
    """The derivative does not unroll: the solver sees concrete numbers and runs once a value, once a derivative."""
    runs = []

    def counted(p):
        runs.append(p)
        return solver(p)

    jax.jacfwd(lambda p: implicit_orbit(residual, counted)(p)["a"])(P)
    assert len(runs) == 1


def test_bad_input():
    orbit = implicit_orbit(residual, solver)
    with pytest.raises(InputError, match="concrete"):
        jax.jit(orbit)(P)
    with pytest.raises(InputError, match="must converge"):
        implicit_orbit(residual, lambda p: newton(residual, solver(p).x, p, tol=1e-30, max_iterations=1))(P)
    with pytest.raises(InputError, match="dense"):
        attach(residual, solver(P).x, P, method="lu")  # type: ignore[arg-type]


def test_derivative_of_a_forced_orbit():
    """Orbit by collocation, its mean square with respect to forcing and damping, against orbits solved again."""
    nodes, period = 41, 2 * np.pi / 1.1
    psi = 2 * np.pi * np.arange(nodes) / nodes
    guess = {"position": jnp.array(2 * np.cos(psi)), "rate": jnp.array(-2 * np.sin(psi))}
    residual, t0, T = Collocation(van_der_pol), jnp.array(0.0), jnp.array(period)

    def solve(u, mu):
        return newton(residual, guess, t0, T, u, mu, tol=1e-13)

    def size(x):
        return jnp.mean(x["position"] ** 2)

    orbit = implicit_orbit(lambda x, u, mu: residual(x, t0, T, u, mu), solve)
    at = (jnp.array([1.5, 1.1]), 0.5)
    forward = jax.jacfwd(lambda *args: size(orbit(*args)), (0, 1))(*at)
    reverse = jax.grad(lambda *args: size(orbit(*args)), (0, 1))(*at)
    eps = 1e-5
    force = jnp.array([eps, 0.0])
    by_force = (size(solve(at[0] + force, 0.5).x) - size(solve(at[0] - force, 0.5).x)) / (2 * eps)
    by_mu = (size(solve(at[0], 0.5 + eps).x) - size(solve(at[0], 0.5 - eps).x)) / (2 * eps)
    np.testing.assert_allclose([forward[0][0], forward[1]], [by_force, by_mu], rtol=1e-6)
    np.testing.assert_allclose(reverse[0], forward[0], rtol=1e-8)
    np.testing.assert_allclose(reverse[1], forward[1], rtol=1e-8)


def test_derivative_of_a_free_period():
    """dT/dμ of the limit cycle: T = 2π(1 + μ²/16 − 5μ⁴/3072 + ...), so 2π(μ/8 − 5μ³/768) at a small μ."""
    mu, nodes = 0.1, 25
    psi = 2 * np.pi * np.arange(nodes) / nodes
    guess = {"position": jnp.array(2 * np.cos(psi)), "rate": jnp.array(-2 * np.sin(psi))}
    residual, t0, still = FreePeriod(Collocation(van_der_pol)), jnp.array(0.0), jnp.array([0.0, 1.0])
    found = newton(residual, (guess, jnp.array(6.3)), t0, guess, still, mu, tol=1e-12)
    assert found.converged
    series = 2 * np.pi * (1 + mu**2 / 16 - 5 * mu**4 / 3072)
    np.testing.assert_allclose(found.x[1], series, atol=2 * np.pi * mu**6 / 100)
    slope = jax.grad(lambda m: attach(lambda z, m: residual(z, t0, guess, still, m), found.x, m)[1])(mu)
    np.testing.assert_allclose(slope, 2 * np.pi * (mu / 8 - 5 * mu**3 / 768), atol=mu**5)


def test_gmres_says_where_it_fails():
    """A cyclic shift: no progress before the last Krylov vector (the textbook case for restarts)."""

    def shift(x, p):
        return jnp.roll(x, 1) - p * jnp.eye(N)[0]

    solution = jnp.eye(N)[-1]
    whole = jax.jacfwd(lambda p: attach(shift, solution, p, method="gmres"))(1.0)
    np.testing.assert_allclose(whole, solution, atol=1e-12)
    cut = jax.jacfwd(lambda p: attach(shift, solution, p, method="gmres", restart=4))(1.0)
    assert bool(jnp.isnan(cut).all())
