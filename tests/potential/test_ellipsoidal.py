import jax
import jax.numpy as jnp
import numpy as np
import pytest

from rotorjax.frames import to_ellipsoidal
from rotorjax.potential.ellipsoidal import azimuth, ellipsoidal, from_ellipsoidal, nu_eta


def hub_points(nu, eta, psi):
    return to_ellipsoidal(jnp.stack(from_ellipsoidal(nu, eta, psi), axis=-1))


@pytest.mark.parametrize("nu", [-1.0, -0.6, -1e-3, 1e-3, 0.3, 1.0])
@pytest.mark.parametrize("eta", [1e-6, 0.02, 1.0, 7.0, 400.0])
def test_inverse_of_the_definition(nu, eta):
    psi = jnp.array([0.3, 2.0, 4.5])
    at = ellipsoidal(hub_points(jnp.full(3, nu), jnp.full(3, eta), psi))
    np.testing.assert_allclose(
        at.nu, nu, rtol=1e-9, atol=1e-12
    )  # 1 − S̄ cancels: digits of the input, not of the formula
    np.testing.assert_allclose(at.eta, eta, rtol=1e-9)
    np.testing.assert_allclose(at.cosine, np.sqrt(1 - nu**2) * np.cos(psi), atol=1e-12)
    np.testing.assert_allclose(at.sine, np.sqrt(1 - nu**2) * np.sin(psi), atol=1e-12)


def test_disk_plane_and_edge():
    r = jnp.array([0.0, 0.5, 0.999, 1.0, 1.2, 50.0])
    nu, eta = nu_eta(r * r, jnp.zeros_like(r))
    np.testing.assert_allclose(nu, np.sqrt(np.maximum(1 - r**2, 0)), rtol=1e-15)
    np.testing.assert_allclose(eta, np.sqrt(np.maximum(r**2 - 1, 0)), rtol=1e-15)


def test_upper_face_has_positive_nu_and_lower_side_negative():
    r2 = jnp.array([0.0, 0.5, 2.0])
    assert np.all(nu_eta(r2, jnp.full(3, -0.1))[0] > 0)
    assert np.all(nu_eta(r2, jnp.full(3, 0.1))[0] < 0)


def test_azimuth_is_zero_aft_and_counter_clockwise():
    psi = jnp.array([0.0, 1.0, 3.0, -2.0])
    x, y, _ = from_ellipsoidal(jnp.full(4, 0.5), jnp.full(4, 0.2), psi)
    np.testing.assert_allclose(azimuth(x, y), psi, atol=1e-15)
    assert jax.grad(azimuth)(0.0, 0.0) == 0


@pytest.mark.parametrize("jacobian", [jax.jacfwd, jax.jacrev])
@pytest.mark.parametrize(
    "point",
    [(0.0, 0.0, 0.4), (0.0, 0.0, -2.0), (0.4, 0.2, 0.3), (1.5, -0.5, 0.0), (1.0, 0.0, 0.05), (30.0, 40.0, -20.0)],
)
def test_derivatives_against_differences(point, jacobian):
    def f(p):
        return jnp.stack(ellipsoidal(p))

    p, step = jnp.array(point), 1e-6
    differences = np.stack([(f(p + step * e) - f(p - step * e)) / (2 * step) for e in np.eye(3)], axis=-1)
    np.testing.assert_allclose(jacobian(f)(p), differences, rtol=1e-6, atol=1e-8)


def test_derivatives_on_the_upper_face_are_one_sided():
    r2 = jnp.array(0.36)
    slope = jax.grad(lambda z: nu_eta(r2, z)[1])(0.0)
    np.testing.assert_allclose(slope, -1 / 0.8, rtol=1e-14)  # η = −z̄/ν above the disk


@pytest.mark.parametrize("jacobian", [jax.jacfwd, jax.jacrev])
def test_finite_at_the_edge(jacobian):
    assert np.all(np.isfinite(jacobian(lambda p: jnp.stack(ellipsoidal(p)))(jnp.array([1.0, 0.0, 0.0]))))


@pytest.mark.parametrize("z", [1e-300, 1e-170, 0.0])
def test_finite_where_the_square_of_the_height_is_zero(z):
    for jacobian in (jax.jacfwd, jax.jacrev):
        assert np.all(np.isfinite(jacobian(lambda v: jnp.stack(nu_eta(v[0], v[1])))(jnp.array([1.0, z]))))
