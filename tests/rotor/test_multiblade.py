"""Multi-blade coordinates: round trip, derivatives of the transform, and dynamics against those of single blades."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from rotorjax.ode.trajectory import integrate
from rotorjax.rotor import multiblade


@pytest.mark.parametrize("blades", [1, 2, 3, 4, 5, 7])
def test_round_trip(blades):
    rng = np.random.default_rng(blades)
    angle, rate = rng.normal(size=(2, blades))
    psi, speed = jnp.asarray(0.7), jnp.asarray(1.1)
    q, q_dot = multiblade.from_blades(jnp.asarray(angle), jnp.asarray(rate), psi, speed)
    back = multiblade.to_blades(q, q_dot, psi, speed)
    np.testing.assert_allclose(back, (angle, rate), atol=1e-14)
    np.testing.assert_allclose(
        multiblade.inverse(psi, blades) @ multiblade.transform(psi, blades), np.eye(blades), atol=1e-14
    )


@pytest.mark.parametrize("blades", [2, 3, 4, 5])
def test_the_generator_is_the_derivative(blades):
    psi = jnp.asarray(0.3)
    slope = jax.jacfwd(lambda p: multiblade.transform(p, blades))(psi)
    np.testing.assert_allclose(slope, multiblade.transform(psi, blades) @ multiblade.generator(blades), atol=1e-14)


def test_names_are_those_of_eq_10():
    assert multiblade.names(4) == ("0", "1c", "1s", "D")
    assert multiblade.names(5) == ("0", "1c", "1s", "2c", "2s")


def blade_law(angle, rate, psi):
    """A periodic, coupled, nonlinear stand-in for a blade."""
    return -1.07 * angle - (0.3 + 0.1 * jnp.sin(psi)) * rate + 0.2 * jnp.cos(psi) - angle**3


@pytest.mark.parametrize("blades", [3, 4])
def test_dynamics_are_those_of_the_blades(blades):
    """March the blades and the coordinates for a turn while the rotor speeds up: 1e-10 apart."""
    gain = 0.02

    def omega(t):
        return 1 + gain * t

    def psi(t):
        return t + gain * t**2 / 2

    def single(t, x):
        angle, rate = x
        return rate, blade_law(angle, rate, multiblade.azimuths(psi(t), blades))

    def joint(t, x):
        q, q_dot = x
        angle, rate = multiblade.to_blades(q, q_dot, psi(t), omega(t))
        force = blade_law(angle, rate, multiblade.azimuths(psi(t), blades))
        return q_dot, multiblade.accelerations(force, q, q_dot, psi(t), omega(t), jnp.asarray(gain))

    rng = np.random.default_rng(0)
    start = tuple(jnp.asarray(v) for v in 0.3 * rng.normal(size=(2, blades)))
    steps = 400
    dt = 2 * np.pi / steps
    of_blades = jax.jit(lambda x: integrate(single, x, 0.0, dt, steps).last)(start)
    q = multiblade.from_blades(*start, psi(0.0), omega(0.0))
    found = jax.jit(lambda x: integrate(joint, x, 0.0, dt, steps).last)(q)
    end = 2 * np.pi
    np.testing.assert_allclose(multiblade.to_blades(*found, psi(end), omega(end)), of_blades, atol=1e-10)
