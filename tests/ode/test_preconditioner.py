import jax
import jax.numpy as jnp
import numpy as np
import pytest

from rotorjax.errors import InputError
from rotorjax.ode.age_difference import five_point_upwind
from rotorjax.ode.anderson import anderson
from rotorjax.ode.collocation import collocate
from rotorjax.ode.fourier import fourier_differentiation, fourier_nodes
from rotorjax.ode.linear import Krylov
from rotorjax.ode.newton import newton
from rotorjax.ode.preconditioner import periodic_inverse

AGES = 36
SPACING = np.deg2rad(10)
MATRIX, BOUNDARY = five_point_upwind(AGES)
LINEAR = -MATRIX / SPACING


@pytest.mark.parametrize("nodes", [1, 2, 7, 8])
def test_is_the_inverse_of_collocation(nodes):
    period = 3.0
    inverse = periodic_inverse(LINEAR, nodes, period)
    f = jnp.array(np.random.default_rng(0).normal(size=(nodes, AGES, 2)))
    x = inverse(f)
    slope = jnp.tensordot(jnp.array(fourier_differentiation(nodes)) * 2 * np.pi / period, x, axes=1)
    np.testing.assert_allclose(slope - jnp.einsum("ab,kbs->kas", jnp.array(LINEAR), x), f, atol=1e-9)


def nonlinear(t, x):
    """What is added to transport: an inflow value that changes with the time, and a smooth source."""
    return jnp.array(-BOUNDARY / SPACING) * (1 + 0.3 * jnp.cos(t)) + 0.3 * jnp.sin(x) / (1 + jnp.mean(x**2))


def transport(t, x):
    return jnp.array(LINEAR) @ x + nonlinear(t, x)


def test_orbit_of_a_transport_equation():
    """Three ways to one orbit; the preconditioned residual needs few Krylov vectors."""
    nodes = 15
    times = jnp.array(fourier_nodes(nodes))
    inverse = periodic_inverse(LINEAR, nodes, 2 * np.pi)

    def g(x):
        return inverse(jax.vmap(nonlinear)(times, x))

    start = jnp.ones((nodes, AGES))
    fixed = anderson(g, start, tol=1e-12, mixing=0.7)
    krylov = newton(lambda x: g(x) - x, start, tol=1e-12, linear=Krylov(restart=40))
    dense = collocate(transport, start, 2 * np.pi, tol=1e-11)
    assert fixed.converged
    assert krylov.converged
    assert dense.converged
    np.testing.assert_allclose(krylov.x, fixed.x, atol=1e-10)
    np.testing.assert_allclose(dense.x, fixed.x, atol=1e-8)


def test_bad_input():
    with pytest.raises(InputError, match="square"):
        periodic_inverse(np.zeros((2, 3)), 4, 1.0)
    with pytest.raises(InputError, match="harmonic 1 has no unique answer"):
        periodic_inverse(np.array([[-0.0, 1.0], [-1.0, 0.0]]), 5, 2 * np.pi)
