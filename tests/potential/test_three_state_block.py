"""Peters and He's matrices hold Pitt and Peters' three-state model: masses, couplings, skew, and gains in the limit.

In the form [K]α̇ + [V][L]⁻¹α = τ the inflow is Σ α φ with φ = P̄/ν, whose first functions are 1 and r {cos, sin} ψ. What
the two theories mean by a gain is not the same: Pitt and Peters take the area's least squares of the whole flow, one
function a harmonic holds that flow only as well as Galerkin's condition lets it, and its gains are 9/8 and 75/64 of
theirs. Their coupling 15π/64 X belongs to a lift that vanishes at the root.
"""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from rotorjax.inflow.momentum import APPARENT_MASS
from rotorjax.inflow.pitt_peters import GRADIENT_MASS, static_gain
from rotorjax.potential.field import disk_functions
from rotorjax.potential.ground_source import DiskQuadrature
from rotorjax.potential.legendre import k_constant
from rotorjax.potential.matrices import influence
from rotorjax.potential.modes import rotor_modes

X, Y, NU, WEIGHT = DiskQuadrature(16, 8).rule()
AREA = 2 * NU * WEIGHT
ARMS = np.stack([np.ones_like(X), X, Y])
LEAST_SQUARES = np.array([[1.0], [4.0], [4.0]]) * ARMS * AREA
"""From the flow at the points to λ_0, λ_1c, λ_1s."""
MODES = rotor_modes(1, 7)


@pytest.fixture(scope="module")
def every():
    """P̄ at the points for all of MODES."""
    return np.array(jax.jit(lambda x, y: disk_functions(MODES, x, y))(X, Y))


def tables(terms, every):
    """Modes, P̄ at the points (M, N), and τ (M, 3) of unit C_T, C_c, C_s: lift without root, and moments r ν."""
    modes = rotor_modes(1, terms)
    functions = every[[MODES.modes.index(mode) for mode in modes.modes]]
    shapes = np.stack([NU * (1 - NU**2) if terms > 1 else NU, X * NU, Y * NU], axis=1)
    tau = np.where(modes.m == 0, 1, 2)[:, None] * (functions * WEIGHT) @ shapes
    moments = ARMS * AREA @ (2 * functions.T @ tau)
    return modes, functions, tau @ np.linalg.inv(moments)


def gains(terms, x, every):
    """Inflow (3,) of unit C_T, C_c, C_s at V = 1, the flow being Σ (L τ) φ."""
    modes, functions, tau = tables(terms, every)
    return LEAST_SQUARES @ (functions / NU).T @ np.array(influence(modes, modes, jnp.array(x))) @ tau


def test_masses_are_pitt_and_peters(every):
    modes, functions, tau = tables(1, every)
    k = np.diag([k_constant(mode.m, mode.n) for mode in modes.modes])
    mass = np.linalg.inv(tau) @ k @ np.linalg.inv(LEAST_SQUARES @ (functions / NU).T)
    np.testing.assert_allclose(mass, np.diag([APPARENT_MASS, GRADIENT_MASS, GRADIENT_MASS]), atol=1e-13)


@pytest.mark.parametrize("degrees", [0.0, 35.0])
def test_gains_hold_pitt_and_peters(degrees, every):
    x = np.tan(np.deg2rad(degrees) / 2)
    theirs = np.array(static_gain(jnp.array([x, 0.0])))
    diagonal, off = np.eye(3, dtype=bool), ~np.eye(3, dtype=bool)
    one = gains(1, x, every)
    np.testing.assert_allclose(one[diagonal], np.array([9 / 8, 75 / 64, 75 / 64]) * theirs[diagonal], rtol=1e-12)
    np.testing.assert_allclose(one[off], 8 / 5 * theirs[off], atol=1e-13)  # 3π/8 X: lift at the root
    found = {terms: gains(terms, x, every) for terms in (2, 4, 7)}
    for ours in found.values():  # couplings from two terms on, gains in the limit
        np.testing.assert_allclose(ours[off], theirs[off], atol=1e-13)
    missed = np.array([np.abs(ours[diagonal] / theirs[diagonal] - 1).max() for ours in found.values()])
    assert np.all(missed[1:] < 0.4 * missed[:-1])
    assert missed[-1] < 0.01


def test_states_of_the_disks_own_functions_have_the_gains_at_once(every):
    """In hover, with the flow as Σ a P̄ and a = [M]⁻¹[L]τ = τ: what the package marches."""
    _, functions, tau = tables(1, every)
    np.testing.assert_allclose(LEAST_SQUARES @ functions.T @ tau, np.array(static_gain(jnp.zeros(2))), atol=1e-13)
