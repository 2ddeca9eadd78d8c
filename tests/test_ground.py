"""The ground plane: mirror images, signs of the slope, derivatives and what the constructor refuses."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from rotorjax import ground
from rotorjax.errors import InputError

POINTS = jnp.array([[0.3, -0.2, 0.1], [1.0, 0.4, -0.2], [-2.0, 1.5, 0.6]])


@pytest.fixture(params=[0.0, 15.0, 30.0])
def plane(request):
    return ground.plane(1.0, request.param)


def test_points_of_equation_9_lie_on_the_plane(plane):
    x, y = jnp.array([-1.0, 0.0, 0.8]), jnp.array([0.3, -2.0, 0.0])
    on = jnp.stack([x, y, -1.0 + x * jnp.tan(plane.slope)], -1)
    np.testing.assert_allclose(plane.distance(on), 0, atol=1e-15)
    np.testing.assert_allclose(plane.reflect_points(on), on, atol=1e-15)


def test_mountain_side_is_aft():
    sloping = ground.plane(1.0, 20.0)
    aft, forward = sloping.distance(jnp.array([[0.9, 0.0, 0.0], [-0.9, 0.0, 0.0]]))
    assert aft < forward


def test_reflecting_twice_gives_back_points_and_vectors(plane):
    np.testing.assert_allclose(plane.reflect_points(plane.reflect_points(POINTS)), POINTS, atol=1e-14)
    np.testing.assert_allclose(plane.reflect_vectors(plane.reflect_vectors(POINTS)), POINTS, atol=1e-14)


def test_image_lies_as_deep_as_the_point_is_high(plane):
    np.testing.assert_allclose(plane.distance(plane.reflect_points(POINTS)), -plane.distance(POINTS), atol=1e-14)


def test_vectors_reflect_as_differences_of_points(plane):
    difference = plane.reflect_points(POINTS + 0.3) - plane.reflect_points(POINTS)
    np.testing.assert_allclose(plane.reflect_vectors(jnp.full((3, 3), 0.3)), difference, atol=1e-14)


def test_level_ground_reflects_in_z():
    image = ground.plane(0.7).reflect_points(POINTS)
    np.testing.assert_allclose(image, POINTS * jnp.array([1, 1, -1]) - jnp.array([0, 0, 1.4]), atol=1e-15)


def test_normal_has_unit_length(plane):
    np.testing.assert_allclose(jnp.linalg.norm(plane.normal), 1, rtol=1e-15)


def test_derivatives_in_height_and_slope_match_finite_differences(plane):
    def image(parameters):
        return ground.Plane(parameters[0], parameters[1]).reflect_points(POINTS)

    at, step = jnp.stack([plane.height, plane.slope]), 1e-6
    numeric = jnp.stack([(image(at + step * e) - image(at - step * e)) / (2 * step) for e in jnp.eye(2)], -1)
    forward, reverse = jax.jacfwd(image)(at), jax.jacrev(image)(at)
    np.testing.assert_allclose(forward, numeric, atol=1e-8)
    np.testing.assert_allclose(forward, reverse, atol=1e-14)


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        ((0.0,), "Argument `height` must be positive .* but is 0.0"),
        ((-1.0,), "Argument `height` must"),
        ((float("nan"),), "Argument `height` must .* but is nan"),
        ((float("inf"),), "Argument `height` must .* but is inf"),
        ((1.0, 60.0), r"Argument `slope_deg` must lie in \[0, 60\) degrees, but is 60.0"),
        ((1.0, -1.0), "Argument `slope_deg` must"),
        ((1.0, float("nan")), "Argument `slope_deg` must"),
        ((0.5, 30.0), r"Argument `height` must exceed tan\(30.0 deg\) = 0.577, .* but is 0.5"),
    ],
)
def test_refuses(arguments, text):
    with pytest.raises(InputError, match=text):
        ground.plane(*arguments)
