"""Swirl profiles and core growth."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.optimize import minimize_scalar

from rotorjax.wake.vortex_core import LAMB_OSEEN, core_radius, scully_swirl, vatistas_swirl


def test_lamb_oseen_constant_is_where_the_swirl_peaks():
    peak = minimize_scalar(
        lambda x: -(1 - np.exp(-x * x)) / x, bounds=(0.5, 2), method="bounded", options={"xatol": 1e-12}
    )
    assert peak.x**2 == pytest.approx(LAMB_OSEEN, abs=1e-5)


@pytest.mark.parametrize("n", [1, 1.5, 2, 5])
def test_swirl_is_that_of_a_line_vortex_far_out_and_solid_inside(n):
    assert vatistas_swirl(jnp.array(1e3), jnp.array(0.01), n) == pytest.approx(1 / (2 * np.pi * 1e3), rel=1e-9)
    assert vatistas_swirl(jnp.array(1e-8), jnp.array(0.1), n) == pytest.approx(1e-8 / (2 * np.pi * 0.01), rel=1e-9)


@pytest.mark.parametrize("n", [1, 2, 5])
def test_swirl_peaks_at_the_core_radius(n):
    slope = jax.grad(lambda r: vatistas_swirl(r, jnp.array(0.3), n))
    assert abs(slope(jnp.array(0.3))) < 1e-14
    assert vatistas_swirl(jnp.array(0.3), jnp.array(0.3), n) == pytest.approx(2 ** (-1 / n) / (2 * np.pi * 0.3))


def test_scully_is_vatistas_one():
    r = jnp.linspace(0, 2, 7)
    np.testing.assert_allclose(scully_swirl(r, jnp.array(0.2)), r / (2 * np.pi * (r**2 + 0.04)), rtol=1e-14)


def test_growth_follows_eq_16():
    """UH-60 at a medium thrust, SI: Γ = 17 m²/s in air gives δ = 1 + a₁Γ/ν near 230."""
    nu, gamma, omega, age = 1.48e-5, 17.0, 27.0, 2.0
    delta = 1 + 2e-4 * gamma / nu
    assert 220 < delta < 240
    radius = core_radius(jnp.array(age), jnp.array(0.05), jnp.array(gamma), jnp.array(nu), 2e-4, omega)
    assert radius**2 == pytest.approx(0.05**2 + 4 * 1.25643 * delta * nu * age / omega, rel=1e-14)
    assert core_radius(jnp.array(0.0), jnp.array(0.05), jnp.array(gamma), jnp.array(nu)) == pytest.approx(0.05)


def test_growth_does_not_depend_on_the_sense_of_rotation():
    args = jnp.array(1.0), jnp.array(0.01)
    assert core_radius(*args, jnp.array(-0.02), jnp.array(1e-8)) == core_radius(*args, jnp.array(0.02), jnp.array(1e-8))


@pytest.mark.parametrize("argument", range(4))
def test_growth_derivatives(argument):
    args = [jnp.array(2.0), jnp.array(0.02), jnp.array(-0.03), jnp.array(1e-4)]
    h = 1e-6 * abs(args[argument])
    up, down = ([a + s * h * (i == argument) for i, a in enumerate(args)] for s in (1, -1))
    difference = (core_radius(*up) - core_radius(*down)) / (2 * h)
    for mode in (jax.jacfwd, jax.jacrev):
        assert mode(core_radius, argument)(*args) == pytest.approx(float(difference), rel=1e-6)


def test_growth_keeps_float32():
    args = [jnp.ones((), jnp.float32)] * 4
    assert core_radius(*args).dtype == jnp.float32
    assert vatistas_swirl(*args[:2], 2).dtype == jnp.float32
