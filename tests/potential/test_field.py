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
from rotorjax.potential.modes import Mode, ModeTable, ground_modes, rotor_modes

ROTOR = rotor_modes(3, 3)
GROUND = ground_modes(5, 3)
ABOVE = jnp.array([[0.3, 0.2, 0.4], [-0.7, 0.1, 0.05], [1.3, -0.8, 0.6], [0, 0, 1.0], [2.0, 1.0, 0], [0.4, -0.3, 7.0]])
TABLES = pytest.mark.parametrize("modes", [ROTOR, GROUND], ids=["rotor", "ground"])


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


def laplacian(function, point):
    hessian = jax.jit(jax.jacfwd(jax.jacrev(function)))(point)
    return jnp.trace(hessian, axis1=-2, axis2=-1), jnp.abs(hessian).max(axis=(-2, -1))


@TABLES
def test_pressure_functions_and_potentials_are_harmonic(modes):
    for function in (pressure_functions, velocity_potentials):
        for point in (ABOVE[0], ABOVE[2], ABOVE[3]):  # the last one on the axis
            total, scale = laplacian(lambda p, f=function: f(modes, p), point)
            assert np.all(np.abs(total) < 1e-9 * (scale + 1e-3))


@TABLES
def test_axial_derivative_of_the_potential_is_the_pressure_function(modes):
    for point in ABOVE:
        slope = -jax.jacfwd(lambda p: velocity_potentials(modes, p))(point)[:, 2]  # z̄ points down
        np.testing.assert_allclose(slope, pressure_functions(modes, point), rtol=1e-9, atol=1e-12)


def test_axial_derivative_of_pressure_potentials_below_the_disk_too():
    point = jnp.array([0.3, 0.2, -0.4])
    slope = -jax.jacfwd(lambda p: velocity_potentials(ROTOR, p))(point)[:, 2]
    np.testing.assert_allclose(slope, pressure_functions(ROTOR, point), rtol=1e-9, atol=1e-12)


@TABLES
def test_velocity_above_is_the_gradient_of_the_potential(modes):
    for point in ABOVE[jnp.array([0, 2, 5])]:
        gradient = jax.jacfwd(lambda p: velocity_potentials(modes, p))(point).T
        np.testing.assert_allclose(velocity_functions(modes, point), gradient, rtol=1e-9, atol=1e-12)


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
    mine = field_functions(modes, jnp.array([x, y, z]))
    np.testing.assert_allclose(mine, expected, atol=1e-8)
    np.testing.assert_allclose(-axial_functions(modes, jnp.array([x, y, z])), expected[2], atol=1e-8)


def test_outside_the_wake_the_flow_of_the_rotor_is_upward_below_the_disk():
    point = jnp.array([1.5, 0.0, -0.5])
    mirror = point.at[2].set(0.5)
    np.testing.assert_allclose(disk_functions(ROTOR, point[0], point[1]), 0, atol=1e-15)
    np.testing.assert_allclose(axial_functions(ROTOR, point), -pressure_functions(ROTOR, mirror), atol=1e-15)


def test_far_wake_is_twice_the_disk_flow():
    point = jnp.array([0.5, 0.3, -1e4])
    np.testing.assert_allclose(axial_functions(ROTOR, point), 2 * disk_functions(ROTOR, point[0], point[1]), atol=1e-7)


@pytest.mark.parametrize("jacobian", [jax.jacfwd, jax.jacrev])
@pytest.mark.parametrize(
    "point", [(0.0, 0.0, 0.0), (0.0, 0.0, -0.5), (0.5, 0.1, -0.2), (1.5, 0.5, 0.0), (0.0, 0.0, 2.0)]
)
def test_derivatives_against_differences(point, jacobian):
    p, step = jnp.array(point), 1e-5
    axes = np.eye(3)[: 2 if point[2] == 0 else 3]  # one-sided across the disk plane

    def f(p):
        return axial_functions(ROTOR, p)

    differences = np.stack([(f(p + step * e) - f(p - step * e)) / (2 * step) for e in axes], axis=-1)
    np.testing.assert_allclose(jacobian(f)(p)[:, : len(axes)], differences, rtol=1e-6, atol=1e-7)


def test_edge_and_far_points_are_finite():
    points = jnp.array([[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [1e3, 0.0, 1e3], [0.0, 0.0, 1e4]])
    for modes in (ROTOR, ModeTable([Mode(0, 0, "cos")], "even")):
        values, pull = jax.vjp(lambda p, m=modes: pressure_functions(m, p), points)
        assert np.all(np.isfinite(values))
        assert np.all(np.isfinite(pull(jnp.ones_like(values))[0]))
        assert np.all(np.isfinite(field_functions(modes, points)))
