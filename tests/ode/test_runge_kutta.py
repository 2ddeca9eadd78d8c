from fractions import Fraction

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
import pytest
import scipy.linalg

from rotorjax.errors import InputError
from rotorjax.ode.age_difference import INTERIOR, five_point_upwind
from rotorjax.ode.runge_kutta import RK4, RK5, ButcherTableau, step, told_step


def pendulum(t, x, strength):
    return {"angle": x["rate"], "rate": -strength * jnp.sin(x["angle"]) + jnp.cos(t)}


def test_step_agrees_with_diffrax():
    x = {"angle": jnp.array([0.3, -0.2]), "rate": jnp.array([1.0, 0.5])}
    ours = step(pendulum, 0.2, x, 0.1, 2.0)
    term = diffrax.ODETerm(pendulum)  # type: ignore[arg-type]
    solver = diffrax.Dopri5()
    state = solver.init(term, 0.2, 0.3, x, 2.0)
    theirs = solver.step(term, 0.2, 0.3, x, 2.0, state, made_jump=False)[0]
    for a, b in zip(jax.tree.leaves(ours), jax.tree.leaves(theirs), strict=True):
        np.testing.assert_allclose(a, b, rtol=1e-14)


def test_a_step_tells_what_the_rhs_tells_at_its_start():
    x, told = told_step(lambda t, x: (-x, (x, t)), 0.5, jnp.array([1.0, 2.0]), 0.1, tableau=RK4)
    np.testing.assert_array_equal(x, step(lambda t, x: -x, 0.5, jnp.array([1.0, 2.0]), 0.1, tableau=RK4))
    np.testing.assert_array_equal(told[0], [1.0, 2.0])
    assert float(told[1]) == 0.5


@pytest.mark.parametrize(("tableau", "order"), [(RK4, 4), (RK5, 5)])
def test_stability_polynomial_is_the_exponential_to_the_order(tableau, order):
    factorial = 1
    for power, coefficient in enumerate(tableau.stability_polynomial()[: order + 1]):
        factorial *= max(power, 1)
        assert coefficient == Fraction(1, factorial)


def largest_cfl(tableau):
    """Largest c with |R(-c σ(θ))| ≤ 1 over all wave numbers, σ the symbol of the interior stencil."""
    first, numerators = INTERIOR
    theta = np.linspace(0, np.pi, 4001)[1:]
    symbol = sum(w / 12 * np.exp(1j * (first + k) * theta) for k, w in enumerate(numerators))
    growth = [float(r) for r in tableau.stability_polynomial()]

    def stable(c):
        return np.abs(np.polynomial.polynomial.polyval(-c * symbol, growth)).max() <= 1 + 1e-12

    low, high = 0.1, 3.0
    for _ in range(40):
        middle = (low + high) / 2
        low, high = (middle, high) if stable(middle) else (low, middle)
    return low


@pytest.mark.parametrize(("tableau", "limit"), [(RK5, 1.239), (RK4, 1.044)])
def test_largest_cfl_of_upwind_transport(tableau, limit):
    assert largest_cfl(tableau) == pytest.approx(limit, abs=1e-3)


def test_transport_is_bounded_below_the_limit_and_not_above():
    """With inflow and outflow rows, by powers of R(-c A): above the limit waves grow until they leave."""
    ages = 144
    matrix, _ = five_point_upwind(ages)

    def growth(c, steps):
        power, total = np.eye(ages), np.zeros((ages, ages))
        for r in RK5.stability_polynomial():
            total, power = total + float(r) * power, -c * matrix @ power
        return scipy.linalg.norm(np.linalg.matrix_power(total, steps), 2)

    assert max(growth(1.2, n) for n in (1, 4, 16, 64)) < 10
    assert growth(1.2, 1024) < 1e-6
    assert growth(1.5, 16) > 1e6


def test_float32_stays_float32():
    x = {"angle": jnp.float32(0.3), "rate": jnp.float32(1.0)}
    with jax.enable_x64(False):
        after = step(pendulum, 0.0, x, 0.1, 2.0)
    assert {leaf.dtype for leaf in jax.tree.leaves(after)} == {jnp.dtype("float32")}


def test_wrong_tableaus_are_refused():
    third, half = Fraction(1, 3), Fraction(1, 2)
    with pytest.raises(ValueError, match="order 2 fails"):
        ButcherTableau("bad", 2, ((), (third,)), (half, half), (Fraction(0), third))
    with pytest.raises(ValueError, match="row sums"):
        ButcherTableau("bad", 2, ((), (third,)), (half, half), (Fraction(0), half))
    with pytest.raises(ValueError, match="order 5 fails"):
        ButcherTableau("bad", 5, RK4.a, RK4.b, RK4.c)


def test_wrong_structure_is_refused():
    x = jnp.ones(3)
    with pytest.raises(InputError, match=r"must return shape \(3,\)"):
        step(lambda t, x: x[:2], 0.0, x, 0.1)
    with pytest.raises(InputError, match="structure"):
        step(lambda t, x: (x, x), 0.0, x, 0.1)
    with pytest.raises(InputError, match="float64"):
        step(lambda t, x: x.astype(jnp.float32), 0.0, x, 0.1)
