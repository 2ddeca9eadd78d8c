"""Several rotors marched, each at its own speed: one rotor's equations, a fast rotor's exact scaling, mirror images."""

from dataclasses import replace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from wakes import COARSE

import rotorjax as rj
from rotorjax.errors import InputError
from rotorjax.simulation.several_march import several_march
from rotorjax.wake import dynamics
from rotorjax.wake.several_dynamics import SeveralInputs, SeveralState, nominal, rhs

SETTINGS = rj.WakeSettings(**COARSE)
several_rhs = eqx.filter_jit(rhs)


@pytest.fixture(scope="module")
def rotor():
    """In air that is neither compressible nor viscous, so that speed is no more than a unit."""
    kind, operating = rj.rotor("knight_hefner_2", 8.0)
    return kind, eqx.tree_at(lambda o: (o.sound_speed, o.viscosity), operating, (jnp.asarray(1e9), jnp.asarray(1e-15)))


@pytest.fixture(scope="module")
def alone(rotor):
    return rj.solve(rj.free_wake(*rotor, None, SETTINGS)).found


def state_of(alone, several):
    """Every rotor in the wake of one alone, its blades where its phase says."""
    many = (len(several), several.wakes.rotor.blades)
    wakes = jax.tree.map(lambda a: jnp.broadcast_to(a[0], (*many, *a.shape[1:])), alone.state)
    return SeveralState(several.phases, wakes)


def disturbed(state, several):
    """The same with nodes moved, mirror images for all rotors."""
    shift = 0.01 * np.random.default_rng(0).normal(size=state.wakes.far.shape[1:])
    return eqx.tree_at(lambda s: s.wakes.far, state, state.wakes.far + shift)


def test_one_rotor_is_carried_as_the_free_wake(rotor, alone):
    one = rj.several_wakes(*rotor, [(0, 0, 0)], settings=SETTINGS, phases_deg=30.0)
    state = disturbed(state_of(alone, one), one)
    rate, _ = several_rhs(0.0, state, nominal(one), one)
    model = alone.model
    wanted = jax.jit(dynamics.rhs)(
        one.phases[0], jax.tree.map(lambda a: a[0], state.wakes), dynamics.inputs_of(model), model
    )
    for found, expected in zip(jax.tree.leaves(rate.wakes), jax.tree.leaves(wanted), strict=True):
        np.testing.assert_allclose(found[0], expected, atol=1e-12)
    assert rate.azimuth[0] == 1


def test_a_fast_rotor_far_away_is_the_slow_one_with_more_circulation(rotor, alone):
    """ω times the speed is ω times the circulation in the same wake: at rest
    there, with ω² the thrust and ω³ the power. The rotors, 1000 R apart, leave each other alone.
    """
    fast, pair = 1.2, rj.several_wakes(*rotor, [(0, 0, 0), (0, 1000.0, 0)], settings=SETTINGS)
    rest = state_of(alone, pair)
    gammas = ("gamma_near", "gamma_far", "gamma_bound")
    factor = jnp.array([1.0, fast])
    scaled = {n: jax.vmap(jnp.multiply)(getattr(rest.wakes, n), factor) for n in gammas}
    wakes = eqx.tree_at(lambda w: [getattr(w, n) for n in gammas], rest.wakes, [scaled[n] for n in gammas])
    rate, loads = several_rhs(0.0, replace(rest, wakes=wakes), SeveralInputs(nominal(pair).theta_0, factor), pair)
    assert max(float(jnp.abs(leaf).max()) for leaf in jax.tree.leaves(rate.wakes)) < 1e-5
    np.testing.assert_allclose(rate.azimuth, factor)
    np.testing.assert_allclose(loads.thrust, alone.CT * factor**2, rtol=1e-5)
    np.testing.assert_allclose(loads.power, alone.CP * factor**3, rtol=1e-5)
    np.testing.assert_allclose(loads.mean_inflow, alone.mean_inflow * factor, rtol=1e-5)


def test_a_pair_stays_its_own_mirror_image(rotor, alone):
    pair = rj.several_wakes(*rotor, [(0, -1.2, 0), (0, 1.2, 0)], settings=SETTINGS, ground=rj.plane(1.5))
    state = disturbed(state_of(alone, pair), pair)
    rate, loads = several_rhs(0.0, state, nominal(pair), pair)
    for leaf in jax.tree.leaves((rate, loads)):
        np.testing.assert_allclose(leaf[0], leaf[1], atol=1e-12)
    apart = rj.several_wakes(*rotor, [(0, -1.2, 0), (0, 500.0, 0)], settings=SETTINGS, ground=rj.plane(1.5))
    assert float(jnp.abs(several_rhs(0.0, state, nominal(apart), apart)[0].wakes.near - rate.wakes.near).max()) > 1e-3


@pytest.fixture(scope="module")
def marched(rotor):
    one = rj.several_wakes(*rotor, [(0, 0, 0)], settings=SETTINGS, phases_deg=30.0)
    return several_march(rj.solve(one).found, precision="double")


def test_a_wake_that_is_periodic_stays_and_a_faster_rotor_lifts_more(marched):
    state = marched.start
    for _ in range(3):
        state = marched.step(state)
    rest = float(state.y.thrust[0])
    np.testing.assert_allclose(state.x.wakes.far, marched.start.x.wakes.far, atol=1e-6)
    np.testing.assert_allclose(state.x.azimuth, np.deg2rad(30) + 3 * 2 * np.pi / marched.steps_per_turn)
    state = marched.step(state, replace(marched.inputs, omega=[1.05]))
    state = marched.step(state, replace(marched.inputs, omega=[1.05]))
    assert 1.04 < float(state.y.thrust[0]) / rest < 1.15
    assert state.steps == 5


def test_wrong_steps_and_inputs_are_named(marched, rotor):
    with pytest.raises(InputError, match=r"omega <= .* march with steps_per_turn"):
        marched.step(marched.start, replace(marched.inputs, omega=[9.0]))
    with pytest.raises(InputError, match="must be made of `inputs`"):
        marched.step(marched.start, replace(marched.inputs, omega=[1.0, 1.0]))
    lost = replace(rj.solve(rj.several_wakes(*rotor, [(0, 0, 0)], settings=SETTINGS)).found, converged=False)
    with pytest.raises(InputError, match="must be converged to be marched from"):
        several_march(lost)
    with pytest.raises(InputError, match="at least"):
        several_march(replace(lost, converged=True), 2)
