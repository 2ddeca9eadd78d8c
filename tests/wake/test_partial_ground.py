"""Ground on a part of the plane: exact limits, symmetry, superposition, no flow through the region."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from rotorjax.errors import InputError
from rotorjax.frames import rotate_about_shaft
from rotorjax.ground import plane
from rotorjax.region import half_plane
from rotorjax.wake.biot_savart import segment_velocity
from rotorjax.wake.field import velocity as wake_velocity
from rotorjax.wake.model import WakeState, free_wake
from rotorjax.wake.partial_ground import all_segments, ground_velocity, partial_ground
from rotorjax.wake.segments import Segments

POINTS = jnp.array([[0.5, 0.2, 0.0], [-0.6, 0.1, 0.0], [0.0, -0.9, 0.0], [0.95, 0.0, -0.2]])


def rings(count=24):
    """A wake of closed rings without a core to speak of: a potential flow."""
    angle = -2 * np.pi * np.arange(count + 1) / count
    turns = [np.stack([np.cos(angle), np.sin(angle), z + 0 * angle], -1) for z in (-0.1, -0.3, -0.5, -0.7)]
    start, end = (np.concatenate([turn[part] for turn in turns]) for part in (slice(None, -1), slice(1, None)))
    size = len(start)
    return Segments(jnp.asarray(start), jnp.asarray(end), jnp.full(size, 0.02), jnp.full(size, 1e-5))


WAKE = rings()
velocity = eqx.filter_jit(ground_velocity)


def over(edge, slope_deg=0.0, azimuth_deg=0.0, reach=10.0, nodes=40):
    return partial_ground(plane(1.0, slope_deg), half_plane(edge, azimuth_deg), nodes, reach)


@pytest.mark.parametrize("slope_deg", [0.0, 12.0])
def test_limits_are_the_image_and_nothing(slope_deg):
    whole, none = (over(edge, slope_deg) for edge in (60.0, -60.0))
    at = whole.plane
    image = at.reflect_vectors(segment_velocity(at.reflect_points(POINTS), *WAKE))
    np.testing.assert_allclose(velocity(POINTS, WAKE, whole), image, rtol=1e-13, atol=1e-16)
    assert np.abs(velocity(POINTS, WAKE, none)).max() == 0


def test_sources_on_the_region_are_the_image_less_sources_off_it():
    """In all components, so that the share of the image is a matter of accuracy only."""
    ground = over(0.3, 6.0, reach=20.0, nodes=100)
    sheet, image = (velocity(POINTS, WAKE, ground, jnp.asarray(share)) for share in (0.0, 1.0))
    assert 0 < float(ground.share) < 1
    np.testing.assert_allclose(sheet, image, atol=2e-5 * np.abs(image).max())


def test_no_flow_through_the_region_and_the_wakes_own_beside_it():
    """Read above the plane at three heights and carried on to it, on a fine grid."""
    ground = over(0.5, reach=6.0, nodes=100)
    foot = jnp.array([[-0.6, 0.1, -1.0], [-0.1, 0.4, -1.0], [1.2, 0.1, -1.0]])
    rise = 0.07 * jnp.array([[[1.0]], [[2.0]], [[3.0]]]) * jnp.array([0.0, 0.0, 1.0])
    points = (foot + rise).reshape(-1, 3)
    f = (segment_velocity(points, *WAKE) + velocity(points, WAKE, ground))[:, 2].reshape(3, 3)
    own = segment_velocity(foot, *WAKE)[:, 2]
    limit = 3 * f[0] - 3 * f[1] + f[2]
    np.testing.assert_allclose(limit, jnp.array([0, 0, 1]) * own, atol=0.02 * np.abs(own).max())


def test_mirrored_and_turned_edges():
    ahead = velocity(POINTS, WAKE, over(0.5))
    for azimuth in (180.0, 90.0):
        angle = jnp.deg2rad(azimuth)
        there = velocity(rotate_about_shaft(POINTS, angle), WAKE, over(0.5, azimuth_deg=azimuth))
        np.testing.assert_allclose(there, rotate_about_shaft(ahead, angle), atol=1e-12)
    mirror = jnp.array([1.0, -1.0, 1.0])
    np.testing.assert_allclose(velocity(POINTS * mirror, WAKE, over(0.5)), ahead * mirror, atol=1e-12)


def test_segments_of_all_blades_are_the_wake(uh60, coarse):
    """Any wake over ground everywhere, turned, against the free wake's own velocity with its image."""
    ground, rng = plane(1.2), np.random.default_rng(3)
    model = free_wake(*uh60, ground=ground, settings=coarse)
    ages = coarse.near_ages, coarse.far_ages
    shapes = (9, ages[0], 3), (coarse.filaments, ages[1], 3), (8, ages[0]), (coarse.filaments, ages[1]), (8,)
    state = WakeState(*(jnp.asarray(rng.uniform(-1, 1, (1, *shape))) for shape in shapes))
    whole = partial_ground(ground, half_plane(60.0), nodes=4)

    @jax.jit
    def both(angle):
        segments = all_segments(model, state, angle)
        back = rotate_about_shaft(POINTS, -angle)
        own = segment_velocity(POINTS, *segments) + ground_velocity(POINTS, segments, whole)
        return own, rotate_about_shaft(wake_velocity(state, back, model)[0], angle)

    ours, theirs = both(0.4)
    np.testing.assert_allclose(ours, theirs, atol=1e-12)
    for blades in (2, 3):
        with pytest.raises(InputError, match=f"holds {blades}"):
            all_segments(model, jax.tree.map(lambda a, n=blades: jnp.repeat(a, n, axis=0), state))


def test_bad_input():
    for nodes, reach, words in ((2, 8.0, "`nodes`"), (40, 1.0, "`reach`")):
        with pytest.raises(InputError, match=words):
            partial_ground(plane(1.0), half_plane(0.0), nodes, reach)
