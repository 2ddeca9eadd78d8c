"""The coupled rotor against closed forms: damping, coning, gyroscopic response, power balance, blades against modes."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax.flatten_util import ravel_pytree

from rotorjax.coupled import CoupledState, coupled_rotor, output, rhs, still_state
from rotorjax.inflow.momentum import Uniform, uniform
from rotorjax.inflow.pitt_peters import pitt_peters
from rotorjax.operating import operating_point
from rotorjax.rotor import geometry
from rotorjax.rotor.airfoil import linear_airfoil
from rotorjax.rotor.hub import rotor_inputs

SLOPE, CHORD = 5.73, 0.5
B, R, OMEGA = 4, 8.0, 27.0


class NoInflow(Uniform):
    """Air that the rotor leaves alone."""

    def rate(self, state, loads, inputs):
        return 0.0 * state


def plain_rotor(offset=0.0, tip=1.0, flap_inertia=2000.0, **hinge):
    """Linear sections without drag and twist from the axis to the tip."""
    blade = geometry.hinge(offset * R, 100.0, 380.0, flap_inertia, **hinge)
    rotor = geometry.rotor("plain", B, R, 0.0, CHORD, linear_airfoil(SLOPE), hinge=blade, tip_loss=tip)
    return rotor, operating_point(OMEGA)


def at_rest(p, u):
    x = still_state(p, u, 0.0)
    return eqx.tree_at(lambda x: x.inflow, x, jnp.zeros_like(x.inflow))


@pytest.fixture(scope="module")
def rate():
    return eqx.filter_jit(lambda x, u, p: rhs(jnp.zeros(()), x, u, p))


@pytest.fixture(scope="module")
def slopes():
    """Jacobian of the flap accelerations with respect to flap, flap rates and the pitch rate q."""

    def of_motion(flap, flap_rate, q, x, u, p):
        x = eqx.tree_at(lambda x: (x.rotor.flap, x.rotor.flap_rate), x, (flap, flap_rate))
        return rhs(jnp.zeros(()), x, eqx.tree_at(lambda u: u.q, u, q), p).rotor.flap_rate

    program = eqx.filter_jit(jax.jacfwd(of_motion, (0, 1, 2)))
    return lambda x, u, p: program(x.rotor.flap, x.rotor.flap_rate, u.q, x, u, p)


def lock_number(p):
    return 1.225 * SLOPE * CHORD * R**4 / float(p.rotor.hinge.flap_inertia)


@pytest.mark.parametrize("offset", [0.0, 0.05])
def test_flap_damping(slopes, offset):
    """Hover, collective motion: decay γ/16 per radian; with an offset its moment is ∫ (r − e)² r dr, over 1/4."""
    p = coupled_rotor(*plain_rotor(offset), NoInflow(jnp.ones(())), 96)
    u = rotor_inputs()
    x = at_rest(p, u)
    damping = -0.5 * slopes(x, u, p)[1][0, 0]
    e = offset
    # sections inboard of the hinge do not flap, but on this blade they do: the aerofoil starts at the axis
    share = 4 * ((1 - e**4) / 4 - 2 * e * (1 - e**3) / 3 + e**2 * (1 - e**2) / 2)
    inboard = 4 * (e**4 / 4 - 2 * e * e**3 / 3 + e**2 * e**2 / 2)
    np.testing.assert_allclose(damping, lock_number(p) / 16 * (share + inboard), rtol=2e-4)


def test_response_to_a_steady_pitch_rate(slopes):
    """A nose-up rate tips the disk nose down behind the shaft: β_1c = −16/γ q (Bramwell), and sideways −q."""
    p = coupled_rotor(*plain_rotor(), NoInflow(jnp.ones(())), 96)
    weightless = eqx.tree_at(lambda p: p.blade.gravity, p, jnp.zeros(()))
    u = rotor_inputs()
    stiffness, _, by_rate = slopes(at_rest(weightless, u), u, weightless)
    flap = -jnp.linalg.solve(stiffness, by_rate)
    # β_1c > 0: disk up aft, that is tipped nose down
    np.testing.assert_allclose(flap[1], 16 / lock_number(p), rtol=5e-4)
    np.testing.assert_allclose(abs(flap[2]), 1.0, rtol=5e-4)


def test_pitch_flap_coupling_stiffens_the_blade(slopes):
    """δ₃ takes tan δ₃ of pitch away per flap: γ/8 tan δ₃ more stiffness in hover."""
    stiffness = []
    for delta3 in (0.0, 0.5):
        p = coupled_rotor(*plain_rotor(delta3=delta3), NoInflow(jnp.ones(())), 96)
        u = rotor_inputs()
        stiffness.append(-float(slopes(at_rest(p, u), u, p)[0][0, 0]))
    np.testing.assert_allclose(stiffness[1] - stiffness[0], lock_number(p) / 8 * np.tan(0.5), rtol=1e-3)


def test_coning(rate):
    """β_0 = γ(θ/8 − λ/6) less the blade's weight, to 1 %: small angles, no offset."""
    p = coupled_rotor(*plain_rotor(), NoInflow(jnp.ones(())), 96)
    theta, inflow = 0.06, 0.03
    u = rotor_inputs(theta_0=theta)
    x = eqx.tree_at(lambda x: x.inflow, at_rest(p, u), jnp.asarray(inflow))
    weight = float(p.blade.first_moment * p.blade.gravity)
    expected = lock_number(p) * (theta / 8 - inflow / 6) - weight

    coned = eqx.tree_at(lambda x: x.rotor.flap, x, jnp.array([expected, 0, 0, 0]))
    slope = -1.0
    found = expected - float(rate(coned, u, p).rotor.flap_rate[0]) / slope
    assert found == pytest.approx(expected, rel=0.01)
    assert weight > 0


def test_thrust_is_blade_element_theorys(rate):
    """C_T = σa/2 (θ/3 − λ/2) of untwisted blades at rest in their hinges; with tip loss B the powers of B."""
    theta, inflow, u = 0.06, 0.02, rotor_inputs(theta_0=0.06)
    sigma = B * CHORD / (np.pi * R)
    for tip in (1.0, 0.97):
        p = coupled_rotor(*plain_rotor(tip=tip), NoInflow(jnp.ones(())), 96)
        x = eqx.tree_at(lambda x: x.inflow, at_rest(p, u), jnp.asarray(inflow))
        found = eqx.filter_jit(output)(jnp.zeros(()), x, u, p)
        expected = sigma * SLOPE / 2 * (theta * tip**3 / 3 - inflow * tip**2 / 2)
        # small angles: φ ≈ λ/r makes 1 % at the root
        assert float(found.CT) == pytest.approx(expected, rel=0.01)


def test_two_blades_give_half_the_thrust_of_four():
    """A rotor without cyclic multi-blade coordinates."""
    found = {}
    for blades in (2, 4):
        rotor, point = plain_rotor()
        p = coupled_rotor(_with_blades(rotor, blades), point, uniform(), 8)
        u = rotor_inputs(theta_0=0.1)
        found[blades] = float(eqx.filter_jit(lambda x, u, p: _thrust(x, u, p))(at_rest(p, u), u, p))
    np.testing.assert_allclose(2 * found[2], found[4], rtol=1e-12)


def _thrust(x, u, p):
    return output(jnp.zeros(()), x, u, p).CT


def _with_blades(rotor, blades):
    return geometry.Rotor(**{**{k: getattr(rotor, k) for k in rotor.__dataclass_fields__}, "blades": blades})


def test_rotor_speed_scales_time(rate):
    """At Ω = 0.9 Ω_ref in vacuum the azimuth and the centrifugal stiffness follow Ω and Ω²."""
    p = coupled_rotor(*plain_rotor(), NoInflow(jnp.ones(())))
    vacuum = eqx.tree_at(lambda p: (p.blade.air, p.blade.gravity), p, (jnp.asarray(1e-12), jnp.zeros(())))
    u = rotor_inputs(omega=0.9)
    x = eqx.tree_at(lambda x: x.rotor.flap, at_rest(vacuum, u), jnp.array([1e-4, 0, 0, 0]))
    found = rate(x, u, vacuum)
    assert float(found.psi) == 0.9
    np.testing.assert_allclose(found.rotor.flap_rate[0], -0.81e-4, rtol=1e-6)


def test_derivatives(rate):
    """jit, vmap, forward and reverse against differences, with everything moving."""
    rotor, point = plain_rotor(0.05, 0.97)
    p = coupled_rotor(rotor, point, pitt_peters(), 8)
    u = rotor_inputs(theta_0=0.15, theta_1s=-0.04, u=0.2, w=-0.02, p=0.01, height=1.0, omega_rate=0.01)
    x = still_state(p, u, 0.006)
    flat, back = ravel_pytree((x, u))
    flat = flat + 1e-3 * jnp.arange(flat.size) / flat.size

    def f(v):
        x, u = back(v)
        return ravel_pytree(rhs(jnp.zeros(()), x, u, p))[0]

    rng = np.random.default_rng(1)
    ways = jnp.asarray(rng.normal(size=(6, flat.size)))
    cover = jnp.asarray(rng.normal(size=20))
    forward = jax.jit(jax.vmap(lambda d: jax.jvp(f, (flat,), (d,))[1]))(ways)
    reverse = jax.jit(lambda c: jax.vjp(f, flat)[1](c)[0])(cover)
    step = 1e-5
    ends = jax.jit(jax.vmap(f))(jnp.concatenate([flat + step * ways, flat - step * ways]))
    differences = (ends[:6] - ends[6:]) / (2 * step)
    scale = float(jnp.max(jnp.abs(forward)))
    np.testing.assert_allclose(forward, differences, rtol=1e-6, atol=1e-7 * scale)
    np.testing.assert_allclose(ways @ reverse, forward @ cover, rtol=1e-11)


def test_state_is_named_as_in_eq_10():
    p = coupled_rotor(*plain_rotor(), pitt_peters())
    x = still_state(p, rotor_inputs(), 0.006)
    assert isinstance(x, CoupledState)
    assert sum(leaf.size for leaf in jax.tree.leaves(x)) == 20
