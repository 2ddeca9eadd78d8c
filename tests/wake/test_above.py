"""Nodes under the ground stand for their mirror images above it."""

from dataclasses import replace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax.flatten_util import ravel_pytree

from rotorjax.frames import rotate_about_shaft
from rotorjax.ground import plane
from rotorjax.wake import field
from rotorjax.wake.above import FILM, above_ground, height
from rotorjax.wake.equilibrium import full_state, spread
from rotorjax.wake.influence import instant_response, velocity_response
from rotorjax.wake.model import azimuths, free_wake
from rotorjax.wake.start import prescribed

node_velocities = eqx.filter_jit(field.node_velocities)


@pytest.fixture(scope="module", params=[0.0, 20.0])
def sunk(request, uh60, coarse):
    """A wake of all blades with far nodes under the plane, its mirror images above, and the model."""
    model = free_wake(*uh60, plane(0.6, request.param), coarse)
    state = eqx.filter_jit(full_state)(model, spread(prescribed(model.levelled), model.rotor.blades))[0]
    angles = azimuths(state)[:, None, None]
    hub = rotate_about_shaft(state.far, angles)
    depth = 0.021 + 0.1 * np.random.default_rng(3).random(hub.shape[:3])
    # the older half lies as high above the plane as drawn, the last of it as deep under it
    old, below = (np.arange(hub.shape[2]) >= share * hub.shape[2] for share in (0.5, 0.75))
    young = jnp.maximum(model.ground.distance(hub), 0.1)
    shift = jnp.where(below, -depth, jnp.where(old, depth, young)) - model.ground.distance(hub)
    there = shift[..., None] * model.ground.normal
    low = replace(state, far=rotate_about_shaft(hub + there, -angles))
    mirrored = jnp.where(below[:, None], model.ground.reflect_points(hub + there), hub + there)
    return model, low, replace(low, far=rotate_about_shaft(mirrored, -angles)), below


def test_the_wake_is_that_of_the_mirror_images(sunk):
    model, low, high, _ = sunk
    lift = eqx.filter_jit(above_ground)
    np.testing.assert_allclose(lift(model, low).far, high.far, atol=1e-14)
    turned = lift(model, replace(low, far=rotate_about_shaft(low.far, jnp.asarray(-0.7))), 0.7).far
    np.testing.assert_allclose(rotate_about_shaft(turned, jnp.asarray(0.7)), high.far, atol=1e-14)
    points = jnp.asarray([[0.3, 0.2, -0.2], [-0.9, 0.1, 0.1]])
    at = eqx.filter_jit(field.velocity)
    np.testing.assert_allclose(at(low, points, model), at(high, points, model), atol=1e-13)


def test_a_node_below_moves_as_the_mirror_image_of_the_one_above(sunk):
    model, low, high, below = sunk
    under, over = node_velocities(model, low), node_velocities(model, high)
    np.testing.assert_allclose(under.control, over.control, atol=1e-13)
    np.testing.assert_allclose(under.near, over.near, atol=1e-13)
    angles = azimuths(low)[:, None, None]
    turned = model.ground.reflect_vectors(rotate_about_shaft(over.far, angles))
    wanted = jnp.where(below[:, None], rotate_about_shaft(turned, -angles), over.far)
    crossing = np.abs(np.arange(below.size) - np.argmax(below) + 0.5) < 1  # there a path is bent once it is mirrored
    np.testing.assert_allclose(under.far[:, :, ~crossing], wanted[:, :, ~crossing], atol=1e-13)
    np.testing.assert_allclose(under.far[:, 1:], wanted[:, 1:], atol=1e-13)


def test_wakes_above_the_ground_are_left_as_they_are(sunk):
    model, _, high, _ = sunk
    assert above_ground(replace(model, ground=None), high) is high
    found = eqx.filter_jit(above_ground)(model, high)
    np.testing.assert_array_equal(found.far, high.far)
    np.testing.assert_array_equal(found.near, high.near)


def test_the_two_sides_pass_into_each_other_smoothly():
    """|d| with two continuous derivatives, never on the plane; the sense is the first."""
    d = jnp.linspace(-1.5 * FILM, 1.5 * FILM, 301)
    value, sense = jax.vmap(height)(d)
    slope, bend = (jax.vmap(of)(d) for of in (jax.grad(lambda d: height(d).value), jax.grad(lambda d: height(d).sense)))
    np.testing.assert_allclose(slope, sense, atol=1e-14)
    np.testing.assert_allclose(jnp.diff(sense), 0.5 * (bend[1:] + bend[:-1]) * jnp.diff(d), atol=1e-4)
    assert float(jnp.max(jnp.abs(jnp.diff(bend)))) < 0.05 / FILM
    np.testing.assert_array_equal(value[abs(d) >= FILM], abs(d[abs(d) >= FILM]))
    assert float(jnp.min(value)) == pytest.approx(0.375 * FILM)


@pytest.mark.parametrize("sunk", [20.0], indirect=True)
def test_dense_derivatives_are_those_of_the_velocities(sunk):
    """Through nodes on both sides of the plane and in the film, all blades at an instant."""
    model, low, _, _ = sunk
    deep = replace(low, far=low.far + jnp.asarray([0.0, 0.0, -0.03]))
    along = jax.tree.map(lambda a: jnp.asarray(np.random.default_rng(5).standard_normal(a.shape)), deep)

    @eqx.filter_jit
    def slope(state, along):
        pushed = jax.jvp(lambda s: field.node_velocities(model, s, 0.3), (state,), (along,))[1]
        return jnp.concatenate([v.reshape(len(v), -1, 3) for v in pushed], axis=1)

    flat = jax.vmap(lambda s: ravel_pytree(s)[0])(along)
    found = jnp.einsum("inkbm,bm->ink", instant_response(model, deep, jnp.asarray(0.3)), flat)
    np.testing.assert_allclose(found, slope(deep, along), atol=1e-10 * float(jnp.max(jnp.abs(found))))


@pytest.mark.parametrize("sunk", [0.0], indirect=True)
def test_the_harmonics_matrix_is_the_velocities_derivative(sunk):
    """As before, of an axisymmetric wake over level ground."""
    model, low, _, _ = sunk
    alone = jax.tree.map(lambda a: a[:1], low)
    along = jax.tree.map(lambda a: jnp.asarray(np.random.default_rng(5).standard_normal(a.shape)), alone)
    pushed = eqx.filter_jit(lambda s, t: jax.jvp(lambda s: field.node_velocities(model, s), (s,), (t,))[1])(
        alone, along
    )
    found = jnp.real(velocity_response(model, alone, jnp.zeros(()))) @ ravel_pytree(along)[0]
    wanted = jnp.concatenate([v.reshape(-1, 3) for v in pushed])
    np.testing.assert_allclose(found, wanted, atol=1e-10 * float(jnp.max(jnp.abs(found))))
