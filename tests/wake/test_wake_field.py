"""Velocities of the wake: images, symmetries, self-induction."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from rotorjax.frames import rotate_about_shaft
from rotorjax.ground import plane
from rotorjax.wake import equilibrium, field
from rotorjax.wake.biot_savart import segment_velocity
from rotorjax.wake.equilibrium import spread
from rotorjax.wake.field import self_induction
from rotorjax.wake.model import WakeState, free_wake
from rotorjax.wake.settings import wake_settings
from rotorjax.wake.start import prescribed

full_state, node_velocities = eqx.filter_jit(equilibrium.full_state), eqx.filter_jit(field.node_velocities)
velocity, velocity_now = eqx.filter_jit(field.velocity), eqx.filter_jit(field.velocity_now)
wake_segments = eqx.filter_jit(field.wake_segments)
POINTS = jnp.array([[0.3, 0.2, -0.1], [0.7, -0.4, 0.2], [0.0, 0.0, -0.3], [1.1, 0.5, -0.05]])


@pytest.fixture(scope="module", params=[None, 0.0, 20.0], ids=["oge", "level", "slope"])
def case(request, uh60, coarse):
    return wake_over(None if request.param is None else plane(1.2, request.param), uh60, coarse)


@pytest.fixture(scope="module", params=[None, 0.0], ids=["oge", "level"])
def axisymmetric(request, uh60, coarse):
    return wake_over(None if request.param is None else plane(1.2, request.param), uh60, coarse)


@pytest.fixture(scope="module", params=[0.0, 20.0], ids=["level", "slope"])
def grounded_case(request, uh60, coarse):
    return wake_over(plane(1.2, request.param), uh60, coarse)


def wake_over(ground, uh60, coarse):
    model = free_wake(*uh60, ground, coarse)
    return model, full_state(model, prescribed(model))[0]


def test_an_axisymmetric_wake_is_the_same_in_one_slice_or_four(case):
    model, state = case
    if model.ground is not None and float(model.ground.slope) != 0:
        model = eqx.tree_at(lambda m: m.ground.slope, model, jnp.zeros(()))
    one = node_velocities(model, state)
    four = node_velocities(model, spread(state, 4))
    for a, b in zip(one, four, strict=True):
        np.testing.assert_allclose(b, jnp.broadcast_to(a, b.shape), atol=1e-13)


def test_one_slice_stands_for_all_blades_at_any_instant(axisymmetric):
    model, state = axisymmetric
    psi = jnp.asarray(0.3)
    one = velocity_now(state, psi, POINTS, model)
    np.testing.assert_allclose(one, velocity_now(spread(state, 4), psi, POINTS, model), atol=1e-13)
    assert float(jnp.abs(one - velocity_now(state, 0 * psi, POINTS, model)).max()) > 1e-4


def test_velocity_turns_with_the_blades(axisymmetric):
    model, state = axisymmetric
    quarter = jnp.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    here = velocity(state, POINTS, model)[0]
    there = velocity(state, POINTS @ quarter.T, model)[0]
    np.testing.assert_allclose(there, here @ quarter.T, atol=1e-13)


def test_image_option_equals_an_explicit_mirror(grounded_case):
    model, state = grounded_case
    state = spread(state, 4)
    segments = wake_segments(model, state)
    at = (2 * jnp.pi / 4 * jnp.arange(4))[:, None]
    start = rotate_about_shaft(segments.start, at).reshape(-1, 3)
    end = rotate_about_shaft(segments.end, at).reshape(-1, 3)
    strength, core = segments.strength.ravel(), segments.core.ravel()
    ground = model.ground
    explicit = segment_velocity(POINTS, start, end, strength, core)
    # a mirrored vortex turns the other way: its ends change places
    explicit += segment_velocity(POINTS, ground.reflect_points(end), ground.reflect_points(start), strength, core)
    np.testing.assert_allclose(velocity(state, POINTS, model)[0], explicit, atol=1e-12)


def test_no_flow_through_the_ground(grounded_case):
    model, state = grounded_case
    on = POINTS - model.ground.distance(POINTS)[:, None] * model.ground.normal
    through = velocity(spread(state, 4), on, model) @ model.ground.normal
    assert float(jnp.max(jnp.abs(through))) < 1e-14


def test_a_wake_and_its_mirror_image_in_a_vertical_plane(case):
    """Mirrored in y and turning the other way, the flow is the mirrored flow; the slope, along x, stays as it is."""
    model, state = case
    state = spread(state, 4)
    segments = wake_segments(model, state)
    mirror = jnp.array([1.0, -1.0, 1.0])
    one = jax.tree.map(lambda a: a[0], segments)
    here = segment_velocity(POINTS, *one, plane=model.ground)
    flipped = one._replace(start=one.end * mirror, end=one.start * mirror)
    there = segment_velocity(POINTS * mirror, *flipped, plane=model.ground)
    np.testing.assert_allclose(there, here * mirror, atol=1e-12)


def test_self_induction_restores_a_rings_speed(uh60):
    """Local part plus the cut-out ring's own speed is that of the whole ring with a Lamb-Oseen core."""
    settings = wake_settings(
        age_step_deg=5.0,
        near_wake_deg=20.0,
        free_turns=2.0,
        inboard=(0.45,),
        impulse_kept=0.0,
        self_induction_core=0.01,
    )
    model = free_wake(*uh60, None, settings)
    age = settings.age_step * np.arange(1, settings.far_ages + 1)
    gamma, radius = 0.02, 0.8
    far = jnp.asarray(np.stack([radius * np.cos(age), -radius * np.sin(age), 0 * age], axis=-1))
    blank = full_state(model, prescribed(model))[0]
    state = jax.tree.map(lambda a: a[0], blank)
    state = WakeState(
        state.near, jnp.stack([far, far]), state.gamma_near, jnp.full((2, len(age)), gamma), state.gamma_bound
    )
    local = float(self_induction(model, state)[0, 60, 2])
    step = 2 * radius * np.sin(settings.age_step / 2)
    whole = gamma / (4 * np.pi * radius) * (np.log(8 * radius / 0.01) - 0.444)
    cut = gamma / (4 * np.pi * radius) * np.log(4 * radius / step)
    # the wake trails behind the blade: with Γ > 0 it moves down
    np.testing.assert_allclose(-local, whole - cut, rtol=5e-3)
    assert float(jnp.max(jnp.abs(self_induction(model, state)[1]))) == 0
