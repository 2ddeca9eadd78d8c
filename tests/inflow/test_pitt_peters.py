"""Pitt-Peters and uniform inflow: published gains, time constants, momentum theory, a step of collective."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from rotorjax.errors import InputError
from rotorjax.ground import plane
from rotorjax.inflow.choice import inflow_model
from rotorjax.inflow.interface import DiskLoads
from rotorjax.inflow.momentum import ground_share, hover_inflow, uniform
from rotorjax.inflow.pitt_peters import GRADIENT_MASS, disk_moments, pitt_peters, static_gain
from rotorjax.ode.trajectory import integrate
from rotorjax.potential.matrices import influence
from rotorjax.potential.modes import rotor_modes
from rotorjax.reference.published import cheeseman_bennett
from rotorjax.rotor.hub import rotor_inputs


def loads_of(thrust, aft=0.0, starboard=0.0):
    """Four point loads on the axes at r = 0.5 with a given thrust and moments."""
    psi = jnp.pi / 2 * jnp.arange(4)
    points = jnp.stack([0.5 * jnp.cos(psi), 0.5 * jnp.sin(psi), 0 * psi], axis=-1)[:, None, :]
    share = jnp.asarray(thrust) / 4 + aft * jnp.cos(psi) + starboard * jnp.sin(psi)
    return DiskLoads(jnp.pi * share[:, None], points, jnp.ones(1), psi, jnp.array([0.5]), jnp.asarray(thrust))


@pytest.mark.parametrize("alpha_deg", [90.0, 40.0, 10.0, 0.0])
def test_gains_are_the_published_matrix(alpha_deg):
    """Pitt & Peters 1981, wind axes, in (C_T, C_L, C_M) → (λ_0, λ_s, λ_c); C_c = −C_M, C_s = −C_L."""
    alpha = np.deg2rad(alpha_deg)
    sine, x = np.sin(alpha), np.sqrt((1 - np.sin(alpha)) / (1 + np.sin(alpha)))
    published = np.array(
        [
            [0.5, 0, 15 * np.pi / 64 * x],
            [0, -4 / (1 + sine), 0],
            [15 * np.pi / 64 * x, 0, -4 * sine / (1 + sine)],
        ]
    )
    ours = np.asarray(static_gain(jnp.array([x, 0.0])))
    from_thrust, swap = np.diag([1.0, -1.0, -1.0]), [0, 2, 1]
    np.testing.assert_allclose(ours[np.ix_(swap, swap)] @ from_thrust, published, atol=1e-13)


def test_gradients_follow_the_potential_theory():
    """Aft and starboard gradients grow with the skew as the finite-state model's own matrices."""
    x, modes = 0.4, rotor_modes(1, 1)
    skewed, straight = (np.diag(influence(modes, modes, jnp.asarray(v))) for v in (x, 0.0))
    ours = np.diag(static_gain(jnp.array([x, 0.0]))) / np.diag(static_gain(jnp.zeros(2)))
    np.testing.assert_allclose(skewed / straight, ours, rtol=1e-12)


def test_gains_turn_with_the_wind():
    x, angle = 0.5, 0.8
    c, s = np.cos(angle), np.sin(angle)
    turn = np.array([[1, 0, 0], [0, c, -s], [0, s, c]])
    there = static_gain(jnp.array([x * c, x * s]))
    np.testing.assert_allclose(there, turn @ static_gain(jnp.array([x, 0.0])) @ turn.T, atol=1e-14)


def test_time_constants_in_hover():
    """Linearised about λ: 8/3π / 4λ for the mean, whose mass flow grows with it, 16/45π / λ for the gradients."""
    thrust = 0.006
    state = pitt_peters().start(jnp.asarray(thrust), rotor_inputs())
    rate = jax.jit(lambda x: pitt_peters().rate(x, loads_of(thrust), rotor_inputs()))
    decay = -jax.jit(jax.jacfwd(rate))(state)
    mean = np.sqrt(thrust / 2)
    np.testing.assert_allclose(
        1 / np.diag(decay), [8 / (3 * np.pi) / (4 * mean), *2 * [GRADIENT_MASS * 2 / (2 * mean)]]
    )
    np.testing.assert_allclose(rate(state), 0.0, atol=1e-15)


@pytest.mark.parametrize("speed", [(0.0, 0.0, 0.0), (0.15, 0.0, -0.01), (0.2, 0.1, 0.03), (0.0, 0.0, -0.05)])
def test_steady_inflow_is_momentum_theorys(speed):
    inputs = rotor_inputs(u=speed[0], v=speed[1], w=speed[2])
    thrust = jnp.asarray(0.006)
    mean = hover_inflow(thrust, inputs)
    total = np.sqrt(speed[0] ** 2 + speed[1] ** 2 + (mean - speed[2]) ** 2)
    np.testing.assert_allclose(2 * mean * total, thrust, rtol=1e-12)
    np.testing.assert_allclose(uniform().rate(mean, loads_of(0.006), inputs), 0.0, atol=1e-13)
    state = pitt_peters().start(thrust, inputs)
    np.testing.assert_allclose(pitt_peters().rate(state, loads_of(0.006), inputs), 0.0, atol=1e-12)


def test_skewed_wake_has_more_inflow_aft():
    """λ_1c = (15π/32) tan(χ/2) λ_0 at high speed, where both mass flows are μ."""
    inputs, thrust = rotor_inputs(u=0.3), 0.006
    model = pitt_peters()
    state = model.start(jnp.asarray(thrust), inputs)
    run = jax.jit(lambda x: integrate(lambda t, x: model.rate(x, loads_of(thrust), inputs), x, 0.0, 0.1, 600).last)
    steady = run(state)
    skew = 0.3 / (np.hypot(0.3, steady[0]) + steady[0])
    np.testing.assert_allclose(steady[1], 15 * np.pi / 32 * skew * steady[0], rtol=0.01)
    np.testing.assert_allclose(steady[2], 0.0, atol=1e-15)


# theory.md, section 8: step of the pitch of a non-flapping rotor, a = 5.73; Carpenter and Fridovich's solidity, 0.042
STEPS = [(6, 1.91, 0.90), (8, 1.75, 0.80), (10, 1.65, 0.73), (12, 1.58, 0.68)]


@pytest.mark.parametrize(("pitch_deg", "overshoot", "revolutions"), STEPS)
@pytest.mark.parametrize("model", [uniform(), pitt_peters()], ids=["uniform", "pitt-peters"])
def test_step_of_collective(model, pitch_deg, overshoot, revolutions):
    lift, theta = 0.042 * 5.73 / 2, np.deg2rad(pitch_deg)
    inputs = rotor_inputs()

    def thrust_of(x):
        return lift * (theta / 3 - jnp.ravel(x)[0] / 2)

    rest = model.start(jnp.asarray(0.0), inputs)
    step = 2 * np.pi / 400
    run = jax.jit(lambda x: integrate(lambda t, x: model.rate(x, loads_of(thrust_of(x)), inputs), x, 0.0, step, 8000).x)
    x = run(rest)
    mean = np.asarray(x if x.ndim == 1 else x[:, 0])
    settled = lift * (theta / 3 - mean[-1] / 2)
    assert lift * theta / 3 / settled == pytest.approx(overshoot, rel=0.02)
    assert np.interp(0.632 * mean[-1], mean, np.arange(mean.size) / 400) == pytest.approx(revolutions, rel=0.02)


def test_moments_of_blades_are_those_of_their_loads():
    found = disk_moments(loads_of(0.006, aft=0.001, starboard=-0.002))
    np.testing.assert_allclose(found, [0.006, 0.5 * 2 * 0.001, -0.5 * 2 * 0.002], rtol=1e-12)


@pytest.mark.parametrize(("u", "rtol"), [(0.0, 1e-12), (0.1, 1e-4), (0.2, 1e-5)])
def test_ground_gives_cheeseman_and_bennetts_thrust_at_the_same_power(u, rtol):
    """T∞/T = 1 − (1/16h²)/(1 + (μ/λ)²): exact in hover, where power goes as T^1.5, and next to it in flight."""
    there, free = rotor_inputs(height=1.0, u=u), rotor_inputs(u=u)
    mean = hover_inflow(jnp.asarray(0.006), free)
    thrust = 0.006 / (1 - 1 / 16 / (1 + (u / mean) ** 2))
    over = hover_inflow(thrust, free)
    np.testing.assert_allclose(thrust * ground_share(over, there) * over, 0.006 * mean, rtol=rtol)
    assert ground_share(mean, free) == 1


def test_momentum_theory_over_ground_is_the_published_formula():
    for height in (0.5, 0.75, 1.0, 2.0):
        share = ground_share(jnp.asarray(0.05), rotor_inputs(height=height))
        np.testing.assert_allclose(share, cheeseman_bennett(height), rtol=1e-12)


def test_derivatives_of_the_rate():
    """Forward and reverse against differences, and finite in air at rest, where the skew has no direction."""
    model, x = pitt_peters(), jnp.array([0.05, 0.01, -0.02])

    def f(x, u, thrust):
        rate = model.rate(x, loads_of(thrust, 0.001), u)
        return rate + model.velocity(x, jnp.ones((3, 3)) * 0.3, u)[:, 2]

    forward, reverse = jax.jit(jax.jacfwd(f)), jax.jit(jax.jacrev(f, (0, 1)))
    values = jax.jit(jax.vmap(f, (0, None, None)))
    for inputs in ({}, {"u": 0.2, "v": 0.05, "w": -0.02}):
        u = rotor_inputs(height=1.0, **inputs)
        ends = values(x + 1e-6 * jnp.concatenate([jnp.eye(3), -jnp.eye(3)]), u, 0.006)
        np.testing.assert_allclose(forward(x, u, 0.006), ((ends[:3] - ends[3:]) / 2e-6).T, rtol=1e-6, atol=1e-9)
        np.testing.assert_allclose(reverse(x, u, 0.006)[0], forward(x, u, 0.006), rtol=1e-11, atol=1e-13)
    rest = reverse(jnp.zeros(3), rotor_inputs(height=1.0), 0.0)
    assert all(bool(jnp.all(jnp.isfinite(leaf))) for leaf in jax.tree.leaves(rest))


@pytest.mark.parametrize(
    ("name", "ground", "words"),
    [("pitt", None, "pitt-peters"), ("uniform", (1.0, 10.0), "slope"), ("uniform", (0.3, 0.0), "height")],
)
def test_unfit_models_are_refused(name, ground, words):
    with pytest.raises(InputError, match=words):
        inflow_model(name, None if ground is None else plane(*ground))
