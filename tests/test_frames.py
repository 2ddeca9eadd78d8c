"""The frames' own rules: who is aft, who is up, and that the bridge between the frames is its own inverse."""

import jax.numpy as jnp
import numpy as np

from rotorjax import frames


def test_azimuth_is_zero_aft_and_turns_to_starboard():
    points = frames.disk_points(jnp.array([1.0, 1.0, 0.5, 0.5]), jnp.deg2rad(jnp.array([0.0, 90.0, 180.0, 270.0])))
    np.testing.assert_allclose(points, [[1, 0, 0], [0, 1, 0], [-0.5, 0, 0], [0, -0.5, 0]], atol=1e-15)


def test_ellipsoidal_frame_is_forward_starboard_down():
    np.testing.assert_array_equal(frames.to_ellipsoidal(jnp.eye(3)), np.diag([-1.0, 1.0, -1.0]))


def test_ellipsoidal_bridge_is_a_proper_rotation_and_its_own_inverse():
    bridge = np.asarray(frames.to_ellipsoidal(jnp.eye(3)))
    np.testing.assert_array_equal(bridge @ bridge, np.eye(3))
    assert np.linalg.det(bridge) == 1


def test_rotation_moves_a_blade_by_its_angle():
    r, psi, step = jnp.array([0.3, 0.9]), jnp.array([0.4, 2.0]), jnp.array([0.7, -1.1])
    turned = frames.rotate_about_shaft(frames.disk_points(r, psi), step)
    np.testing.assert_allclose(turned, frames.disk_points(r, psi + step), atol=1e-15)


def test_rotation_keeps_height_and_length():
    xyz = jnp.array([[0.2, -0.5, 0.7], [1.0, 2.0, -3.0]])
    turned = frames.rotate_about_shaft(xyz, jnp.array(0.9))
    np.testing.assert_array_equal(turned[:, 2], xyz[:, 2])
    np.testing.assert_allclose(jnp.linalg.norm(turned, axis=1), jnp.linalg.norm(xyz, axis=1), rtol=1e-15)
