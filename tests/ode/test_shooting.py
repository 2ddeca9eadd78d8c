import jax
import jax.numpy as jnp
import numpy as np
import pytest
from systems import VAN_DER_POL_PERIOD, peaked, van_der_pol

from rotorjax.errors import InputError
from rotorjax.ode.linear import Krylov
from rotorjax.ode.orbit import orbit_from_march, require_converged
from rotorjax.ode.shooting import shoot
from rotorjax.ode.trajectory import integrate

STILL = jnp.array([0.0, 1.0])
START = {"position": jnp.array(2.0), "rate": jnp.array(0.0)}


def test_order_is_five():
    exact = 1 / (1.5 - 1.0)
    sizes = np.array([64, 90, 128, 180])
    errors = [
        abs(float(shoot(peaked, jnp.array(1.0), 2 * np.pi, int(n), 1.5, tol=1e-14, max_iterations=3).start) - exact)
        for n in sizes
    ]
    assert abs(-np.polyfit(np.log(sizes), np.log(errors), 1)[0] - 5) < 0.2


@pytest.mark.parametrize("linear", [None, Krylov()])
def test_van_der_pol_period(linear):
    orbit = shoot(van_der_pol, START, 6.5, 400, STILL, 1.0, free_period=True, tol=1e-12, linear=linear)
    assert orbit.converged
    assert abs(float(orbit.period) - VAN_DER_POL_PERIOD) < 1e-9
    assert orbit.nodes == 400


def test_symmetry_halves_the_march():
    whole = shoot(van_der_pol, START, 6.5, 400, STILL, 1.0, free_period=True, tol=1e-12)
    half = shoot(
        van_der_pol,
        START,
        6.5,
        200,
        STILL,
        1.0,
        free_period=True,
        tol=1e-12,
        symmetry=lambda x: jax.tree.map(jnp.negative, x),
        copies=2,
    )
    np.testing.assert_allclose(half.x["rate"], whole.x["rate"], atol=1e-9)
    np.testing.assert_allclose(half.period, whole.period, rtol=1e-11)


def test_a_march_becomes_an_orbit_only_where_it_closes():
    exact = integrate(peaked, jnp.array(2.0), 0.0, 2 * np.pi / 400, 400, 1.5)
    orbit = orbit_from_march(exact)
    assert orbit.converged
    assert orbit.nodes == 400
    np.testing.assert_allclose(orbit.period, 2 * np.pi, rtol=1e-14)
    with pytest.raises(InputError, match="must end where it began"):
        orbit_from_march(integrate(peaked, jnp.array(1.0), 0.0, 2 * np.pi / 400, 400, 1.5))


def test_bad_input():
    lost = shoot(van_der_pol, START, 6.5, 50, STILL, 1.0, free_period=True, tol=1e-12, max_iterations=1)
    with pytest.raises(InputError, match="must have converged, but has not: residual"):
        require_converged(lost)
    with pytest.raises(InputError, match="repeat"):
        shoot(peaked, jnp.array(1.0), 6.0, 20, 1.5)
