from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from rotorjax.potential.ellipsoidal import ellipsoidal
from rotorjax.potential.field import (
    axial_functions,
    disk_functions,
    field_functions,
    pressure_functions,
    velocity_functions,
    velocity_potentials,
)
from rotorjax.potential.legendre import legendre_p, legendre_q
from rotorjax.potential.modes import Mode, ModeTable, ground_modes, mode_table, rotor_modes

ROTOR = rotor_modes(3, 3)
GROUND = ground_modes(5, 3)
ABOVE = jnp.array([[0.3, 0.2, 0.4], [-0.7, 0.1, 0.05], [1.3, -0.8, 0.6], [0, 0, 1.0], [2.0, 1.0, 0], [0.4, -0.3, 7.0]])
AXIAL, FIELD = jax.jit(axial_functions, static_argnums=0), jax.jit(field_functions, static_argnums=0)
TABLES = pytest.mark.parametrize("modes", [ROTOR, GROUND], ids=["rotor", "ground"])
BOTH = rotor_modes(1, 2, even_terms=2)


@TABLES
def test_pressure_functions_are_the_product_in_ellipsoidal_coordinates(modes):
    points = ABOVE.at[:, 2].multiply(jnp.array([1, -1, 1, -1, 1, 1]))
    at, psi = ellipsoidal(points), jnp.arctan2(points[:, 1], points[:, 0])
    pairs = tuple((mode.m, mode.n) for mode in modes.modes)
    angle = modes.m[:, None] * psi
    sine = np.array([mode.kind == "sin" for mode in modes.modes])[:, None]
    p = legendre_p(pairs, at.nu) * (1 - at.nu**2) ** (modes.m[:, None] / 2)
    expected = p * legendre_q(pairs, at.eta) * jnp.where(sine, jnp.sin(angle), jnp.cos(angle))
    np.testing.assert_allclose(pressure_functions(modes, points), expected, rtol=1e-12, atol=1e-15)


@TABLES
@pytest.mark.parametrize("function", [pressure_functions, velocity_potentials])
def test_pressure_functions_and_potentials_are_harmonic(function, modes):
    points = ABOVE[jnp.array([0, 2, 3])]  # the last one on the axis
    hessian = jax.jit(jax.vmap(jax.jacfwd(jax.jacfwd(lambda p: function(modes, p)))))(points)
    total, scale = jnp.trace(hessian, axis1=-2, axis2=-1), jnp.abs(hessian).max(axis=(-2, -1))
    assert np.all(np.abs(total) < 1e-9 * (scale + 1e-3))


@partial(jax.jit, static_argnums=0)
def potential_gradient(modes, points):
    return jax.vmap(jax.jacfwd(lambda p: velocity_potentials(modes, p)))(points)


@TABLES
def test_axial_derivative_of_the_potential_is_the_pressure_function(modes):
    slope = -potential_gradient(modes, ABOVE)[..., 2].T  # z̄ points down
    np.testing.assert_allclose(slope, pressure_functions(modes, ABOVE), rtol=1e-9, atol=1e-12)


def test_axial_derivative_of_pressure_potentials_below_the_disk_too():
    points = ABOVE.at[:, 2].multiply(-1)
    slope = -potential_gradient(ROTOR, points)[..., 2].T
    np.testing.assert_allclose(slope, pressure_functions(ROTOR, points), rtol=1e-9, atol=1e-12)


@TABLES
def test_velocity_above_is_the_gradient_of_the_potential(modes):
    velocity = jax.jit(lambda p: velocity_functions(modes, p))(ABOVE)
    np.testing.assert_allclose(velocity, potential_gradient(modes, ABOVE).T, rtol=1e-9, atol=1e-12)


@partial(jax.jit, static_argnums=0)
def pressure_gradient(modes, points):
    return jax.vmap(jax.jacfwd(lambda p: pressure_functions(modes, p)))(points)


def along_streamline(modes, x, y, z):
    """Velocity (3, M) by integrating ∇Φ down the streamline from far above at unit mass flow."""
    node, weight = np.polynomial.legendre.leggauss(60)
    node, weight = (node + 1) / 2, weight / 2
    heights, weights = [1 / node, node if z < 0 else z + (1 - z) * node], [weight / node**2, weight * min(1, 1 - z)]
    if z < 0:
        heights.append(z * node)
        weights.append(weight * -z)
    heights, weights = np.concatenate(heights), np.concatenate(weights)
    points = jnp.stack([jnp.full_like(heights, x), jnp.full_like(heights, y), jnp.array(heights)], axis=-1)
    return jnp.einsum("n,nmi->im", weights, pressure_gradient(modes, points))


@TABLES
@pytest.mark.parametrize(("x", "y"), [(0.3, 0.4), (-0.2, 0.5), (1.5, 0.7)])
@pytest.mark.parametrize("z", [0.5, -0.3, -1.7])
def test_velocity_anywhere_against_integration_along_streamlines(modes, x, y, z):
    expected = along_streamline(modes, x, y, z)
    mine = FIELD(modes, jnp.array([x, y, z]))
    np.testing.assert_allclose(mine, expected, atol=1e-8)
    np.testing.assert_allclose(-AXIAL(modes, jnp.array([x, y, z])), expected[2], atol=1e-8)


def test_outside_the_wake_the_flow_of_the_rotor_is_upward_below_the_disk():
    point = jnp.array([1.5, 0.0, -0.5])
    mirror = point.at[2].set(0.5)
    np.testing.assert_allclose(disk_functions(ROTOR, point[0], point[1]), 0, atol=1e-15)
    np.testing.assert_allclose(axial_functions(ROTOR, point), -pressure_functions(ROTOR, mirror), atol=1e-15)


def test_table_of_both_parities_is_its_two_parts():
    points = jnp.array([[0.3, 0.2, -0.4], [1.2, 0.1, -0.4], [0.3, 0.2, 0.4]])
    parts = [FIELD(mode_table(first, 1, 2), points) for first in (1, 2)]
    np.testing.assert_allclose(FIELD(BOTH, points), jnp.concatenate(parts, axis=1), rtol=1e-12, atol=1e-15)


def test_far_wake_is_twice_the_disk_flow():
    point = jnp.array([0.5, 0.3, -1e4])
    np.testing.assert_allclose(axial_functions(ROTOR, point), 2 * disk_functions(ROTOR, point[0], point[1]), atol=1e-7)


@pytest.mark.parametrize("jacobian", [jax.jacfwd, jax.jacrev])
def test_derivatives_against_differences(jacobian):
    """On the axis, on the disk's upper face (in its plane), below and above, and in the plane outside."""
    points, step = jnp.array([[0, 0, 0], [0, 0, -0.5], [0.5, 0.1, -0.2], [0, 0, 2.0], [1.5, 0.5, 0], [0.3, 0, 0]]), 1e-5

    def f(p):
        return AXIAL(ROTOR, p)

    axes = jnp.eye(3)[:, None]
    differences = np.moveaxis(
        np.stack([(f(points + step * e) - f(points - step * e)) / (2 * step) for e in axes]), 0, -1
    )
    slopes = np.swapaxes(jax.jit(jax.vmap(jacobian(f)))(points), 0, 1)
    np.testing.assert_allclose(slopes[..., :2], differences[..., :2], rtol=1e-6, atol=1e-7)
    np.testing.assert_allclose(
        slopes[:, 1:4, 2], differences[:, 1:4, 2], rtol=1e-6, atol=1e-7
    )  # kink in the disk's plane


def test_edge_and_far_points_are_finite():
    points = jnp.array([[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [1e3, 0.0, 1e3], [0.0, 0.0, 1e4]])
    for modes in (ROTOR, ModeTable([Mode(0, 0, "cos")], "even")):
        slopes = jax.jit(jax.grad(lambda p, m=modes: pressure_functions(m, p).sum()))(points)
        assert np.all(np.isfinite(slopes))
        assert np.all(np.isfinite(FIELD(modes, points)))


@pytest.mark.parametrize("x", [[1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
def test_in_plane_velocity_on_the_rim_is_that_beside_it(x):
    points = jnp.array(x) * jnp.array([1.0, 1 + 1e-9])[:, None]
    on, beside = np.moveaxis(np.array(velocity_functions(ROTOR, points))[:2], 2, 0)
    np.testing.assert_allclose(on, beside, atol=1e-2 * np.abs(beside).max())
    assert np.abs(on).max() > 0.01
