from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from rotorjax.errors import InputError
from rotorjax.ode.jacobian import dense_jacobian
from rotorjax.ode.linear import Dense, Krylov
from rotorjax.ode.newton import newton

N = 60
TRACES = []


def bratu(x, strength):
    """u'' + λ e^u = 0 on (0, 1), u = 0 at both ends, second-order differences; lower branch for λ < 3.51."""
    TRACES.append(1)
    u = jnp.concatenate([jnp.zeros(1), x["u"], jnp.zeros(1)])
    return {"u": (u[2:] - 2 * u[1:-1] + u[:-2]) * (N + 1) ** 2 + strength * jnp.exp(u[1:-1])}


def poisson_inverse(v, x, strength):
    laplace = (N + 1) ** 2 * (jnp.eye(N, k=1) - 2 * jnp.eye(N) + jnp.eye(N, k=-1))
    return {"u": jnp.linalg.solve(laplace, v["u"])}


START = {"u": jnp.zeros(N)}
SOLVERS = [Dense(), Dense(reuse="chord"), Dense(reuse="broyden"), Krylov(), Krylov(precondition=poisson_inverse)]


@pytest.mark.parametrize("linear", SOLVERS)
def test_bratu(linear):
    """Exact solution u = −2 ln[cosh((s − ½)θ/2)/cosh(θ/4)], θ = √(2λ) cosh(θ/4)."""
    strength, theta = 2.0, 1.0
    for _ in range(200):
        theta = np.sqrt(2 * strength) * np.cosh(theta / 4)
    s = np.arange(1, N + 1) / (N + 1)
    exact = -2 * np.log(np.cosh((s - 0.5) * theta / 2) / np.cosh(theta / 4))
    out = newton(bratu, START, strength, linear=linear, tol=1e-9)
    assert out.converged
    np.testing.assert_allclose(out.x["u"], exact, atol=2e-4)
    assert out.iterations <= 12
    again = newton(bratu, START, strength, tol=1e-9)
    np.testing.assert_allclose(out.x["u"], again.x["u"], atol=1e-9)


def test_convergence_is_quadratic():
    out = newton(bratu, START, 3.0, tol=1e-9)
    logs = np.log10(np.array(out.residuals[1:-1]))
    assert np.any(logs[1:] < 1.7 * logs[:-1])


def test_broyden_needs_fewer_jacobians():
    made = {}
    for reuse in ("none", "broyden", "chord"):
        TRACES.clear()
        linear = Counted(Dense(reuse=reuse))
        assert newton(bratu, START, 3.0, linear=linear, tol=1e-9).converged
        made[reuse] = linear.fresh
    assert made["broyden"] < made["none"]
    assert made["chord"] < made["none"]


class Counted:
    def __init__(self, inner):
        self.inner, self.fresh = inner, 0
        self.at, self.gauge, self.learn, self.retry = inner.at, inner.gauge, inner.learn, inner.retry

    def direction(self, place, value, memory):
        self.fresh += memory is None
        return self.inner.direction(place, value, memory)


def test_memory_goes_on_from_one_solve_to_the_next():
    linear = Counted(Dense(reuse="chord"))
    first = newton(bratu, START, 1.0, linear=linear, tol=1e-9)
    made = linear.fresh
    second = newton(bratu, first.x, 1.02, linear=linear, tol=1e-9, memory=first.memory)
    assert second.converged
    assert linear.fresh == made


@pytest.mark.parametrize("linear", [Dense(), Krylov()])
def test_new_numbers_do_not_compile_again(linear):
    newton(bratu, START, 1.0, linear=linear)
    TRACES.clear()
    newton(bratu, START, 1.5, linear=linear)
    newton(bratu, START, jnp.array(1.6), linear=linear)
    assert len(TRACES) == 0


def test_line_search_holds_where_full_steps_run_away():
    """Full Newton steps for arctan diverge from |x| > 1.39."""
    out = newton(lambda x: jnp.arctan(x), jnp.array([8.0]), tol=1e-12, measure=lambda f, x: float(abs(f[0])))
    assert out.converged
    assert all(b < a for a, b in zip(out.residuals[:-1], out.residuals[1:], strict=True))


def test_a_search_that_can_take_less_of_its_way_gives_up_early():
    """The same start, of whose first step a sixteenth would do."""
    here = {"tol": 1e-12, "measure": lambda f, x: float(abs(f[0]))}
    out = newton(lambda x: jnp.arctan(x), jnp.array([8.0]), smallest_step=0.5, **here)
    assert not out.converged
    assert out.iterations == 0
    assert "down to 5e-01 of it" in out.why


def test_no_root_ends_with_a_reason():
    out = newton(bratu, START, 5.0, tol=1e-9)
    assert not out.converged
    assert "residual" in out.why
    assert bool(jnp.isfinite(out.x["u"]).all())
    assert out.residual <= out.residuals[0]


def test_start_that_is_not_finite():
    out = newton(lambda x: jnp.log(x), jnp.array([-1.0]))
    assert not out.converged
    assert "not finite at the start" in out.why


@pytest.mark.parametrize("chunk", [1, 7, 64])
def test_dense_jacobian(chunk):
    x = {"u": jnp.linspace(0, 1, N)}
    found = dense_jacobian(bratu, x, 2.0, chunk=chunk)
    np.testing.assert_allclose(found, jax.jacrev(lambda u: bratu({"u": u}, 2.0)["u"])(x["u"]), rtol=1e-12)


def test_bad_input():
    with pytest.raises(InputError, match="structure"):
        newton(lambda x: (x, x), jnp.zeros(3))
    with pytest.raises(InputError, match="reuse"):
        Dense(reuse="often")  # type: ignore[arg-type]
    with pytest.raises(InputError, match="chunk"):
        dense_jacobian(jnp.sin, jnp.zeros(3), chunk=0)


def test_a_natural_gauge_takes_the_steps_that_a_bad_scale_forbids():
    """Newton's iterates do not change as equations are mixed, A f = 0; nor does what the line search makes of them."""

    def residual(x, mixed):
        return mixed @ jnp.array([x[1] - x[0] ** 2, x[0] - 2.0])

    def inverse(v, x, mixed):
        return jnp.linalg.solve(jax.jacobian(residual)(x, mixed), v)

    start, bad = jnp.array([1.5, 2.25]), jnp.array([[1e3, 0.0], [1e3, 1.0]])
    linear = Krylov(precondition=inverse, natural=True, forcing=1e-9)
    even, mixed = (newton(residual, start, a, linear=linear) for a in (jnp.eye(2), bad))
    assert even.converged
    assert mixed.converged
    assert even.iterations == mixed.iterations == 2
    assert mixed.residuals[1] > 100 * mixed.residuals[0]
    assert newton(residual, start, bad, linear=replace(linear, natural=False)).iterations > 4


def test_krylov_solves_tighter_where_a_loose_direction_leads_nowhere():
    """Badly scaled rows: GMRES at a tolerance of 0.9 finds a direction that does not lower the measure used."""
    scale = jnp.array([1e4, 1.0, 1e-3])

    def residual(x):
        return scale * (x + 0.1 * jnp.roll(x, 1) ** 2 - jnp.array([1.0, 2.0, 3.0]))

    def measure(f, x):
        return float(np.abs(f / np.array(scale)).max())

    linear = Counted(Krylov(forcing=0.9))
    out = newton(residual, jnp.zeros(3), linear=linear, tol=1e-10, measure=measure)
    assert out.converged
