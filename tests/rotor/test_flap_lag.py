"""Rigid flap and lag against closed forms, without air: frequencies, energy, hub moment, gyroscopic moments."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.interpolate import PchipInterpolator

from rotorjax.errors import InputError
from rotorjax.ode.trajectory import integrate
from rotorjax.rotor import catalogue, geometry
from rotorjax.rotor.flap_lag import (
    accelerations,
    blade_of,
    damper_moment,
    energy,
    flap_frequency,
    hub_loads,
    lag_frequency,
)
from rotorjax.rotor.hub import rotor_inputs, turning_frame

CALM = jnp.zeros(3)


@pytest.fixture(scope="module")
def uh60():
    return catalogue.load("uh60")


@pytest.fixture(scope="module")
def blade(uh60):
    return blade_of(*uh60)


@pytest.fixture(scope="module")
def free(blade):
    """Without damper, with springs and precone, so that every term of the energy counts."""
    return eqx.tree_at(
        lambda b: (b.damper_arm, b.flap_spring, b.lag_spring, b.precone),
        blade,
        (jnp.zeros(()), jnp.asarray(0.1), jnp.asarray(0.05), jnp.asarray(0.03)),
    )


def rhs(psi, state, inputs, blade, air_moment=CALM):
    q, q_dot = state
    frame = turning_frame(inputs, psi, blade.gravity)
    return q_dot, accelerations(blade, frame, q, q_dot, air_moment)


def test_frequencies_of_the_uh60(blade):
    """Published: 1.035 and 0.268 per rev; the equations' own Jacobian agrees with the closed forms."""
    assert float(flap_frequency(blade)) == pytest.approx(1.035, abs=5e-4)
    assert float(lag_frequency(blade)) == pytest.approx(0.268, abs=5e-4)
    weightless = eqx.tree_at(lambda b: b.gravity, blade, jnp.zeros(()))

    def stiffness(q):
        frame = turning_frame(rotor_inputs(), jnp.asarray(0.3), weightless.gravity)
        return accelerations(weightless, frame, q, jnp.zeros(2), CALM)

    found = -jax.jit(jax.jacfwd(stiffness))(jnp.zeros(2))
    expected = jnp.diag(jnp.stack([flap_frequency(blade) ** 2, lag_frequency(blade) ** 2]))
    np.testing.assert_allclose(found, expected, atol=1e-12)


def test_energy_is_kept_over_twenty_revolutions(free):
    start = (jnp.array([0.15, -0.1]), jnp.array([0.05, 0.08]))
    steps = 20 * 180
    run = jax.jit(lambda x: integrate(rhs, x, 0.0, 2 * np.pi / 180, steps, rotor_inputs(), free, save_every=90))
    found = run(start)
    kept = jax.vmap(lambda q, v: energy(free, q, v))(*found.x)
    assert float(jnp.ptp(found.x[0][:, 1])) > 0.1  # it does move
    np.testing.assert_allclose(kept, kept[0], rtol=1e-8)


def test_torque_is_the_rate_of_angular_momentum(free):
    """The torque that turns the hub is the rate of the blade's angular momentum about the shaft."""

    def momentum(q, q_dot):
        """Angular momentum about the shaft over ρR⁵Ω: what the hub has to turn, by direct integration over the mass."""
        n, n_dot = jax.jvp(lambda q: _direction(q), (q,), (q_dot,))
        e, s = free.offset, free.first_moment
        mass = free.mass * e**2 + 2 * s * e * n[0] + n[0] ** 2 + n[1] ** 2
        own = s * e * n_dot[1] + n[0] * n_dot[1] - n[1] * n_dot[0]
        return (mass + own) / free.air

    q, q_dot = jnp.array([0.15, -0.1]), jnp.array([0.05, 0.08])
    frame = turning_frame(rotor_inputs(), jnp.asarray(0.0), free.gravity)
    q_dot_dot = accelerations(free, frame, q, q_dot, CALM)
    _, rate = jax.jvp(momentum, (q, q_dot), (q_dot, q_dot_dot))
    loads = hub_loads(free, frame, q, q_dot, q_dot_dot, CALM, CALM)
    np.testing.assert_allclose(-loads.moment[2], rate, rtol=1e-12)


def _direction(q):
    return jnp.stack([jnp.cos(q[0]) * jnp.cos(q[1]), -jnp.cos(q[0]) * jnp.sin(q[1]), jnp.sin(q[0])])


def test_hub_moment_of_tilted_flapping(blade):
    """A disk tilted by β_1c gives the hub B/2 · eSΩ² β_1c, the centrifugal force at the offset hinge."""
    tilt = 1e-4
    weightless = eqx.tree_at(lambda b: b.gravity, blade, jnp.zeros(()))

    def moment(psi):
        q = jnp.stack([tilt * jnp.cos(psi), jnp.zeros(())])
        q_dot = jnp.stack([-tilt * jnp.sin(psi), jnp.zeros(())])
        frame = turning_frame(rotor_inputs(), psi, weightless.gravity)
        # the air gives what steady flapping at once per rev needs: (ν² − 1)β
        air = jnp.array([0.0, 0.0, 1.0]) * (flap_frequency(blade) ** 2 - 1) * q[0] / blade.air
        q_dot_dot = accelerations(weightless, frame, q, q_dot, air)
        np.testing.assert_allclose(q_dot_dot[0], -q[0], atol=1e-10)
        loads = hub_loads(weightless, frame, q, q_dot, q_dot_dot, CALM, air)
        return loads.moment[1] * -jnp.cos(psi)  # about the hub's −y: nose down for a disk tilted up aft

    mean = 4 * np.mean([moment(jnp.asarray(p)) for p in np.pi / 2 * np.arange(4)])
    expected = 2 * blade.offset * blade.first_moment * tilt / blade.air
    np.testing.assert_allclose(mean, expected, rtol=1e-6)


def test_a_pitching_hub_bends_the_blade_gyroscopically(blade):
    """β̈ of a straight blade from a steady pitch rate is that of its gyroscopic moment, 2q(1 + eS/I) sin ψ."""
    rate = 0.01
    for psi in (0.0, 0.4, np.pi / 2, 4.0):
        frame = turning_frame(rotor_inputs(q=rate), jnp.asarray(psi), 0.0 * blade.gravity)
        found = accelerations(blade, frame, jnp.zeros(2), jnp.zeros(2), CALM)[0]
        expected = 2 * rate * (1 + blade.offset * blade.first_moment) * np.sin(psi)
        np.testing.assert_allclose(abs(found), abs(expected), rtol=1e-10, atol=1e-14)


def test_accelerating_hub_is_felt_as_gravity(blade):
    """A hub that accelerates downward as fast as it falls leaves the blade weightless."""
    frame = turning_frame(rotor_inputs(w_rate=float(blade.gravity)), jnp.asarray(1.0), blade.gravity)
    np.testing.assert_allclose(frame.acceleration, 0.0, atol=1e-17)


def damper_force(blade, axial):
    """Force (N) of the UH-60's damper at axial rates (m/s)."""
    rotor, point = catalogue.load("uh60")
    omega = point.omega
    moment = jax.vmap(lambda rate: damper_moment(blade, rate))(jnp.asarray(axial) / blade.damper_arm / omega)
    return moment * rotor.hinge.flap_inertia * omega**2 / blade.damper_arm


def test_damper_is_its_table(blade, uh60):
    """At every point of it on both sides, as its last piece goes on beyond it, and odd to the last bit."""
    hinge = uh60[0].hinge
    rate, force = np.asarray(hinge.damper_rate), np.asarray(hinge.damper_force)
    np.testing.assert_allclose(damper_force(blade, rate), force, rtol=1e-12)
    np.testing.assert_array_equal(damper_force(blade, -rate), -damper_force(blade, rate))
    assert damper_force(blade, [0.00508])[0] == pytest.approx(1023.09, rel=1e-12)
    slope = (force[-1] - force[-2]) / (rate[-1] - rate[-2])
    for beyond in (0.2, 1.0):
        np.testing.assert_allclose(damper_force(blade, [beyond]), force[-1] + slope * (beyond - rate[-1]), rtol=1e-12)


def test_damper_has_no_kinks_and_does_not_overshoot(blade, uh60):
    """Between its points it is scipy's PCHIP; its slope is one from both sides of every point, and never negative."""
    hinge = uh60[0].hinge
    rate, force = np.asarray(hinge.damper_rate), np.asarray(hinge.damper_force)
    inside = np.linspace(0, rate[-2], 400)  # the last piece begins where the table's end is told
    odd = [np.concatenate([-values[:0:-1], values]) for values in (rate, force)]
    np.testing.assert_allclose(
        damper_force(blade, inside), PchipInterpolator(odd[0], odd[1])(inside), rtol=1e-10, atol=1e-9
    )
    slope = jax.vmap(jax.grad(lambda v: damper_force(blade, v[None])[0]))
    left, right = (np.asarray(slope(jnp.asarray(rate) * (1 + way))) for way in (-1e-9, 1e-9))
    np.testing.assert_allclose(left, right, rtol=1e-5)
    assert np.asarray(slope(jnp.linspace(-0.2, 0.2, 801))).min() > 0


def test_damper_by_its_table_and_rotor_speed_agrees_with_differences(uh60):
    rotor, point = uh60

    def moment(force, omega):
        hinge = eqx.tree_at(lambda h: h.damper_force, rotor.hinge, force)
        found = blade_of(eqx.tree_at(lambda r: r.hinge, rotor, hinge), eqx.tree_at(lambda p: p.omega, point, omega))
        return damper_moment(found, jnp.asarray(0.006))

    force, omega, way = rotor.hinge.damper_force, point.omega, jnp.linspace(0, 1, 26) ** 2
    along = jax.jvp(moment, (force, omega), (way, jnp.ones(())))[1]
    ends = [moment(force + h * way, omega + h) for h in (1e-4, -1e-4)]
    np.testing.assert_allclose(along, (ends[0] - ends[1]) / 2e-4, rtol=1e-6)


def test_derivatives_agree_with_differences(free):
    inputs = rotor_inputs(u=0.1, p=0.01, q_rate=0.02, omega_rate=0.05)

    def f(x):
        frame = turning_frame(inputs, x[4], free.gravity)
        return accelerations(free, frame, x[:2], x[2:4], jnp.array([1.0, -0.3, 2.0]) * x[5])

    x = jnp.array([0.1, -0.2, 0.05, 0.03, 0.7, 0.001])
    ends = jax.jit(jax.vmap(f))(x + 1e-6 * jnp.concatenate([jnp.eye(6), -jnp.eye(6)]))
    differences = ((ends[:6] - ends[6:]) / 2e-6).T
    forward = jax.jit(jax.vmap(lambda d: jax.jvp(f, (x,), (d,))[1]))(jnp.eye(6)).T
    np.testing.assert_allclose(forward, differences, rtol=1e-6, atol=1e-8)
    np.testing.assert_allclose(jax.jit(jax.jacrev(f))(x), forward, rtol=1e-11, atol=1e-13)


@pytest.mark.parametrize(
    ("change", "name"), [({"flap_inertia": 1000.0}, "flap_inertia"), ({"flap_spring": -1.0}, "flap_spring")]
)
def test_impossible_hinges_are_refused(change, name):
    sound = {"offset": 0.381, "blade_mass": 116.53, "first_moment": 385.66, "flap_inertia": 2050.81}
    with pytest.raises(InputError, match=name):
        geometry.hinge(**(sound | change))


def test_a_hinge_beyond_half_the_blade_is_refused():
    hinge = geometry.hinge(5.0, 100.0, 100.0, 2000.0)
    rotor, _ = catalogue.load("uh60")
    with pytest.raises(InputError, match=r"hinge\.offset.*5"):
        geometry.rotor("x", 4, 8.0, 0.1, 0.5, rotor.airfoil, hinge=hinge)


def test_a_rotor_without_hinge_cannot_flap():
    with pytest.raises(InputError, match="hinge"):
        blade_of(*catalogue.load("caradonna_tung"))
