import jax
import jax.numpy as jnp
import numpy as np
import pytest

from rotorjax.errors import InputError
from rotorjax.potential import loading
from rotorjax.potential.legendre import double_factorial as f
from rotorjax.potential.legendre import h_constant
from rotorjax.potential.modes import ground_modes, rotor_modes

NODE, WEIGHT = np.polynomial.legendre.leggauss(40)
NU, NU_WEIGHT = jnp.array((NODE + 1) / 2), jnp.array(WEIGHT / 2)
R = jnp.sqrt(1 - NU**2)
R_WEIGHT = NU_WEIGHT * NU / R  # dr = ν dν/r: exact for the square root at the tip
PSI = jnp.arange(16) * 2 * np.pi / 16


def he(m, n, r):
    """He's shaping function (He 1989)."""
    terms = [r**q * (-1) ** ((q - m) // 2) * f(n + q) / (f(q - m) * f(q + m) * f(n - q - 1)) for q in range(m, n, 2)]
    return np.sqrt((2 * n + 1) * h_constant(m, n)) * sum(terms)


def test_shaping_is_he_s_function():
    modes, r = rotor_modes(4, 3), np.linspace(0, 1, 11)
    expected = np.stack([he(mode.m, mode.n, r) for mode in modes.modes])
    np.testing.assert_allclose(loading.shaping(modes, jnp.array(r)), expected, rtol=1e-11, atol=1e-12)


def test_round_trip_of_loadings_in_the_span():
    modes = rotor_modes(2, 3)
    tau = jnp.linspace(0.003, -0.001, len(modes))
    dct_dr = loading.distribution(tau, R, PSI, modes)
    np.testing.assert_allclose(loading.from_distribution(dct_dr, R, R_WEIGHT, PSI, modes), tau, atol=1e-16)


def test_thrust_coefficient_is_the_integral_of_the_loading():
    modes = rotor_modes(1, 3)
    tau = jnp.linspace(0.003, -0.001, len(modes))
    total = jnp.mean(loading.distribution(tau, R, PSI, modes), axis=0) @ R_WEIGHT
    np.testing.assert_allclose(loading.thrust_coefficient(tau, modes), total, rtol=1e-12)


def test_axisymmetric_is_the_same_without_harmonics():
    modes = rotor_modes(1, 2)
    dct_dr = 0.01 * R**2
    both = loading.from_distribution(jnp.broadcast_to(dct_dr, (16, 40)), R, R_WEIGHT, PSI, modes)
    np.testing.assert_allclose(loading.from_axisymmetric(dct_dr, R, R_WEIGHT, modes), both, atol=1e-17)


def test_blades_averaged_over_a_turn_give_the_distribution():
    modes = rotor_modes(2, 2)
    r, w, blades = jnp.linspace(0.2, 0.95, 9), jnp.full(9, 0.09), 4

    def lift(psi):
        return (1 + 0.3 * jnp.cos(psi) + 0.2 * jnp.sin(2 * psi))[:, None] * r**2 * 0.01

    def instant(turn):
        psi = turn + jnp.arange(blades) * 2 * np.pi / blades
        return loading.from_blades(lift(psi), r, w, psi, modes)

    mean = jax.vmap(instant)(PSI).mean(axis=0)
    whole = loading.from_distribution(blades / np.pi * lift(PSI), r, w, PSI, modes)
    np.testing.assert_allclose(mean, whole, rtol=1e-12, atol=1e-17)


def test_even_modes_carry_no_load():
    modes, dct_dr = rotor_modes(0, 2, even_terms=2), 0.01 * R**2
    tau = loading.from_axisymmetric(dct_dr, R, R_WEIGHT, modes)
    np.testing.assert_allclose(tau[:2], loading.from_axisymmetric(dct_dr, R, R_WEIGHT, rotor_modes(0, 2)))
    assert not np.any(tau[2:])


def test_bad_input_is_refused():
    with pytest.raises(InputError, match="carry a load"):
        loading.shaping(ground_modes(0, 1), R)
    with pytest.raises(InputError, match="shape"):
        loading.from_distribution(jnp.ones((3, 40)), R, R_WEIGHT, PSI, rotor_modes())
    with pytest.raises(InputError, match="azimuths"):
        loading.from_distribution(jnp.ones((2, 40)), R, R_WEIGHT, PSI[:2], rotor_modes(1))
