import jax
import jax.numpy as jnp
import numpy as np
import pytest
from systems import VAN_DER_POL_PERIOD, peaked, van_der_pol, van_der_pol_cycle

from rotorjax.errors import InputError
from rotorjax.ode.collocation import collocate
from rotorjax.ode.linear import Krylov
from rotorjax.ode.trajectory import integrate


def circle(nodes, turn=2 * np.pi):
    psi = turn * np.arange(nodes) / nodes
    return {"position": jnp.array(2 * np.cos(psi)), "rate": jnp.array(-2 * np.sin(psi))}


STILL = jnp.array([0.0, 1.0])


def test_van_der_pol_period():
    """A limit cycle of unknown period, against an independent march."""
    period, amplitude = van_der_pol_cycle()
    assert abs(period - VAN_DER_POL_PERIOD) < 1e-11
    orbit = collocate(van_der_pol, circle(81), 6.5, STILL, 1.0, free_period=True, tol=1e-11)
    assert orbit.converged
    assert abs(float(orbit.period) - VAN_DER_POL_PERIOD) < 1e-10
    fine = orbit.at(np.linspace(0, 7, 20001))["position"]
    assert float(jnp.max(fine)) == pytest.approx(amplitude, abs=1e-6)


def test_van_der_pol_with_symmetry():
    """x(t + T/2) = −x(t): half the unknowns, the same orbit."""
    half = circle(41, np.pi)
    orbit = collocate(
        van_der_pol,
        half,
        6.5,
        STILL,
        1.0,
        free_period=True,
        symmetry=lambda x: jax.tree.map(jnp.negative, x),
        copies=2,
        tol=1e-11,
    )
    assert orbit.converged
    assert orbit.nodes == 82
    assert abs(float(orbit.period) - VAN_DER_POL_PERIOD) < 1e-10


@pytest.mark.parametrize("linear", [None, Krylov()])
def test_period_fixed_by_the_forcing(linear):
    """Forced and locked: the period is the forcing's; checked by marching the orbit's start for ten periods."""
    u = jnp.array([1.5, 1.1])
    period = 2 * np.pi / 1.1
    orbit = collocate(van_der_pol, circle(81), period, u, 0.5, tol=1e-11, linear=linear)
    assert orbit.converged
    after = integrate(van_der_pol, orbit.start, 0.0, period / 400, 4000, u, 0.5, save_every=4000).last
    np.testing.assert_allclose(after["position"], orbit.x["position"][0], atol=1e-9)


def test_convergence_is_geometric():
    """Error against the exact orbit falls as ρ^(K/2), ρ = a − √(a² − 1) = 0.382 at a = 1.5."""
    sizes = np.array([9, 13, 17, 21, 25])
    errors = []
    for nodes in sizes:
        orbit = collocate(peaked, jnp.zeros(nodes), 2 * np.pi, 1.5, tol=1e-13)
        errors.append(float(jnp.abs(orbit.x - 1 / (1.5 - jnp.cos(orbit.t))).max()))
    rate = np.exp(np.polyfit(sizes / 2, np.log(errors), 1)[0])
    assert rate == pytest.approx(1.5 - np.sqrt(1.25), rel=0.05)


def test_float32():
    with jax.enable_x64(False):
        orbit = collocate(peaked, jnp.zeros(25), 2 * np.pi, 1.5, tol=1e-5)
        exact = 1 / (1.5 - np.cos(np.array(orbit.t)))
    assert orbit.converged
    assert orbit.x.dtype == jnp.float32
    np.testing.assert_allclose(orbit.x, exact, rtol=1e-4)


def test_started_elsewhere_in_time():
    orbit = collocate(peaked, jnp.zeros(33), 2 * np.pi, 1.5, t0=0.7, tol=1e-12)
    np.testing.assert_allclose(orbit.x, 1 / (1.5 - jnp.cos(orbit.t)), atol=1e-6)
    np.testing.assert_allclose(orbit.at([0.1, 5.0]), 1 / (1.5 - np.cos([0.1, 5.0])), atol=1e-5)


def test_bad_input():
    with pytest.raises(InputError, match="must repeat after the period 6"):
        collocate(peaked, jnp.zeros(9), 6.0, 1.5)
    with pytest.raises(InputError, match="structure"):
        collocate(lambda t, x: (x, x), jnp.zeros(9), 6.0)
    with pytest.raises(InputError, match="copies"):
        collocate(peaked, jnp.zeros(9), 6.0, 1.5, copies=2)
    assert not collocate(van_der_pol, circle(21), 6.5, STILL, 1.0, free_period=True, max_iterations=1).converged
