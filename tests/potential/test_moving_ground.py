import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from derivatives import both_ways

from rotorjax.errors import InputError
from rotorjax.ground import Plane, plane
from rotorjax.potential.dynamics import InflowInputs, hover_inputs
from rotorjax.potential.ground_source import self_flow
from rotorjax.potential.model import finite_state_model, steady_state
from rotorjax.potential.moving_ground import (
    GroundMotion,
    ground_states,
    plane_velocity,
    prescribed,
    residual,
    still,
)
from rotorjax.potential.wake_transport import wake_transport

TRANSPORT = wake_transport(2.0)


def motion(height=1.0, slope=0.15, height_rate=0.0, slope_rate=0.0):
    return GroundMotion(*(jnp.array(v) for v in (height, slope, height_rate, slope_rate)))


def hover(model):
    return hover_inputs(jnp.zeros(len(model.modes)))


CYLINDER = {"printed": True, "strengths": "closed"}


@pytest.mark.parametrize("variant", ["static", "quasi-steady", "dynamic"])
def test_ground_at_rest_is_the_steady_model(variant):
    model = finite_state_model(plane(1.0, 15.0), harmonics=1, ground_harmonics=1)
    tau = jnp.full(9, 1e-4).at[0].set(2.6e-3)
    state = steady_state(model, tau)
    c = ground_states(state.a, still(model.ground), hover(model), model, variant, TRANSPORT)
    np.testing.assert_allclose(c, state.c, atol=1e-10 * float(jnp.abs(state.c).max()))


def test_normal_velocity_of_the_plane_is_that_of_its_points():
    """The plane z = −h + x tan δ a little later, seen along its normal from a point of it."""
    now, dt = motion(1.0, 0.3, 0.02, -0.05), 1e-6
    later = Plane(now.height + dt * now.height_rate, now.slope + dt * now.slope_rate)
    x = np.array([-0.7, 0.0, 0.9])
    points = jnp.stack([x, 0 * x, -now.height + x * jnp.tan(now.slope)], axis=-1)
    moved = -later.distance(points) / dt
    np.testing.assert_allclose(plane_velocity(now, jnp.array(0.0), jnp.array(0.0), jnp.array(x)), moved, rtol=1e-5)


def test_rotor_that_moves_over_ground_at_rest_sees_no_plane_velocity():
    """Climbing, and flying forward over a slope: the ground only seems to move."""
    mu, climb, slope = 0.1, -0.02, 0.2
    now = motion(1.0, slope, climb + mu * np.tan(slope) * -1)
    assert abs(plane_velocity(now, jnp.array(-mu), jnp.array(climb), jnp.array(0.4))) < 1e-17


def test_plane_velocity_is_met_exactly():
    """Without a rotor the sources' own flow is the plane's velocity: both are in the span of the r = j functions."""
    model = finite_state_model(harmonics=1, ground_harmonics=1, **CYLINDER)
    now = motion(1.2, 0.2, -0.03, 0.04)
    c = ground_states(jnp.zeros(9), now, hover(model), model)
    assert residual(c, jnp.zeros(9), now, hover(model), model) < 1e-13
    upward = ground_states(jnp.zeros(9), motion(1.2, 0.0, -0.03), hover(model), model)
    np.testing.assert_allclose(upward[0], 0.03, rtol=1e-12)
    np.testing.assert_allclose(upward[1:], 0, atol=1e-15)


def test_odd_sources_meet_the_plane_velocity_but_for_a_rim():
    """A piston's edge is a step; what seven terms leave of it lies at the rim."""
    model = finite_state_model(harmonics=1, ground_harmonics=1)
    c = ground_states(jnp.zeros(9), motion(1.2, 0.0, -0.03), hover(model), model)
    flow = c @ self_flow(model.sources, jnp.linspace(0, 0.9, 10), jnp.zeros(10))
    np.testing.assert_allclose(flow, 0.03, rtol=0.25)
    left = float(residual(c, jnp.zeros(9), motion(1.2, 0.0, -0.03), hover(model), model))
    assert 0.05 < left < 0.1  # seven terms see the step over a fourteenth of ν


def test_moving_plane_is_not_penetrated():
    """≤ 3 % rms on a heaving and pitching plane at all times, as each variant sees the flow."""
    model = finite_state_model(harmonics=1, ground_harmonics=1, ground_radial_terms=7, **CYLINDER)
    psi = jnp.linspace(0, 60, 81)
    moving = prescribed(psi, 1 + 0.2 * jnp.sin(0.3 * psi), 0.15 * jnp.sin(0.2 * psi))
    base = steady_state(model, jnp.full(9, 1e-4).at[0].set(2.6e-3)).a
    swing = 1 + 0.2 * jnp.sin(0.25 * psi[:, None] - 5 * TRANSPORT.depths)

    def one(now, scale, variant):
        b = scale[:, None] * base
        settings = (now, hover(model), model, variant, TRANSPORT, b[1:])
        return residual(ground_states(b[0], *settings), b[0], *settings)

    for variant in ("static", "quasi-steady", "dynamic"):
        left = eqx.filter_jit(lambda v=variant: jax.lax.map(lambda row: one(*row, v), (moving, swing)))()
        assert 1e-3 < float(left.max()) < 0.03


def test_rates_of_prescribed_motion_are_second_order():
    errors = []
    for count in (41, 81, 161):
        psi = jnp.linspace(0, 10, count)
        found = prescribed(psi, 2 + 0.3 * jnp.sin(psi), 0.1 * jnp.cos(psi))
        errors.append(float(jnp.abs(found.height_rate - 0.3 * jnp.cos(psi))[1:-1].max()))
    np.testing.assert_allclose(np.log2(np.array(errors[:-1]) / errors[1:]), 2, atol=0.1)


@pytest.mark.slow
def test_derivative_ladder():
    model = finite_state_model(harmonics=1, radial_terms=2, ground_harmonics=1)

    @jax.jit
    def f(v):
        now, inputs = GroundMotion(v[0], v[1], v[2], v[3]), InflowInputs(jnp.zeros(6), v[4], v[5])
        wake = v[6] * jnp.cos(jnp.arange(12.0))[:, None] * jnp.ones(6)
        return ground_states(v[6] * jnp.ones(6), now, inputs, model, "dynamic", TRANSPORT, wake)

    v = jnp.array([1.1, 0.1, 0.02, 0.01, 0.05, 0.01, 0.06])
    (forward, reverse), step = both_ways(f)(v), 1e-6
    differences = np.stack([(f(v + step * e) - f(v - step * e)) / (2 * step) for e in np.eye(7)], axis=-1)
    np.testing.assert_allclose(forward, differences, rtol=1e-6, atol=1e-8)
    np.testing.assert_allclose(forward, reverse, rtol=1e-11, atol=1e-13)


def test_bad_input():
    psi = jnp.linspace(0, 1, 5)
    ones = jnp.ones(5)
    with pytest.raises(InputError, match=r"must increase, but has 0\.5 followed by 0\.25"):
        prescribed(psi.at[3].set(0.25), ones, 0 * ones)
    with pytest.raises(InputError, match=r"must exceed .* it is 0.05"):
        prescribed(psi, ones.at[2].set(0.05), 0.1 * ones)
    with pytest.raises(InputError, match="of one length"):
        prescribed(psi, jnp.ones(4), 0 * ones)
    with pytest.raises(InputError, match="within 60 deg, but reaches 68"):
        prescribed(psi, 9 * ones, 1.2 * ones)
    model = finite_state_model()
    with pytest.raises(InputError, match="but is 'slow'"):
        ground_states(jnp.zeros(3), motion(), hover(model), model, "slow")
    with pytest.raises(InputError, match="`transport` must be given"):
        ground_states(jnp.zeros(3), motion(), hover(model), model, "dynamic")
