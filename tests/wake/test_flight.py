"""The wake of a rotor that flies and flaps: limits in which it is the wake of one that does not, turned winds, flap."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from rotorjax.frames import rotate_about_shaft
from rotorjax.wake.dynamics import carried_on, inputs_of
from rotorjax.wake.equilibrium import evaluated, full_state, spread
from rotorjax.wake.field import Velocities, carried, undisturbed
from rotorjax.wake.loads import blade_loads
from rotorjax.wake.model import Flight, free_wake, on_blade
from rotorjax.wake.settings import flight_settings
from rotorjax.wake.start import prescribed

SLICES = 8
TINY = {"panels": 5, "age_step_deg": 30.0, "near_wake_deg": 120.0, "azimuths": SLICES}
TINY |= {"closure_turns": 1, "closure_bundles": 0}


@pytest.fixture(scope="module")
def still(uh60):
    return free_wake(*uh60, settings=flight_settings(4, **TINY))


@pytest.fixture(scope="module")
def wake(still):
    """Not axisymmetric, so that nothing is right by symmetry alone."""
    x = spread(prescribed(still), SLICES)
    key = jax.random.key(0)
    return jax.tree.map(lambda a: a * (1 + 0.02 * jax.random.normal(key, a.shape)), x)


def flying(model, wind=(0.0, 0.0, 0.0), **blades):
    parts = {name: jnp.zeros(SLICES) for name in ("flap", "flap_rate", "cyclic")} | blades
    flight = Flight(wind=jnp.asarray(wind, float), hinge=jnp.asarray(0.0466), **parts)
    return eqx.tree_at(lambda m: m.flight, model, flight, is_leaf=lambda v: v is None)


def close(a, b, atol=1e-12):
    jax.tree.map(lambda x, y: np.testing.assert_allclose(x, y, atol=atol, rtol=0), a, b)


def test_no_wind_and_rigid_blades_change_nothing(still, wake):
    close(evaluated(flying(still), wake), evaluated(still, wake))


def test_a_wind_from_above_is_a_climb(still, wake):
    climbing = eqx.tree_at(lambda m: m.operating.climb, still, 0.03 * still.operating.tip_speed(still.rotor.radius))
    blown, climbed = evaluated(flying(still, (0.0, 0.0, -0.03)), wake), evaluated(climbing, wake)
    close(blown.velocities, climbed.velocities)


def test_a_turned_wind_turns_the_wake(still, wake):
    """Wind and slices turned by one azimuth: the same loads, one slice later."""
    wind = jnp.array([0.2, 0.05, -0.01])
    cyclic = 0.02 * jnp.cos(2 * jnp.pi / SLICES * jnp.arange(SLICES))
    here = evaluated(flying(still, wind, cyclic=cyclic, flap=cyclic), wake)
    turned = rotate_about_shaft(wind, jnp.asarray(2 * np.pi / SLICES))
    rolled = jax.tree.map(lambda a: jnp.roll(a, 1, axis=0), (wake, cyclic))
    there = evaluated(flying(still, turned, cyclic=rolled[1], flap=rolled[1]), rolled[0])
    close(there, jax.tree.map(lambda a: jnp.roll(a, 1, axis=0), here))
    assert float(jnp.ptp(here.loads.dlift[:, -1])) > 1e-3


def test_a_blade_that_flaps_up_meets_air_from_above(still):
    """A rate q is worth a downwash q (r − e); loads are those of the flow across the blade, whatever its flap."""
    flap, rate = jnp.full(SLICES, 0.1), jnp.full(SLICES, 0.02)
    model = flying(still, flap=flap, flap_rate=rate)
    gamma = jnp.full((SLICES, 5), 0.01)
    arm = model.stations - 0.0466
    up = jnp.array([-jnp.sin(0.1), 0.0, jnp.cos(0.1)])
    air = jnp.broadcast_to(jnp.array([0.01, 0.0, -0.05]), (SLICES, 5, 3))
    moving = blade_loads(model, air, gamma, inputs_of(model))
    held = eqx.tree_at(lambda m: m.flight.flap_rate, model, jnp.zeros(SLICES))
    close(moving, blade_loads(held, air - (arm * 0.02)[:, None] * up, gamma, inputs_of(held)))


def test_points_lie_on_the_flapped_blade(still):
    model = flying(still, flap=jnp.full(SLICES, 0.2)).of_slice(3)
    points = on_blade(model, model.edges)
    arm = model.edges - 0.0466
    np.testing.assert_allclose(jnp.hypot(points[:, 0] - 0.0466, points[:, 2]), arm, rtol=1e-12)
    np.testing.assert_allclose(points[:, 2], arm * np.sin(0.2), rtol=1e-12)


def test_the_wind_is_seen_from_the_turning_blade(still):
    """A wind from ahead of the hub blows along a blade that points aft, and against one that advances."""
    model = flying(still, (0.2, 0.0, 0.0))
    np.testing.assert_allclose(carried(model, jnp.asarray(0.0)), [0.2, 0.0, 0.0], atol=1e-15)
    np.testing.assert_allclose(carried(model, jnp.asarray(np.pi / 2)), [0.0, -0.2, 0.0], atol=1e-15)


def test_a_hub_that_turns_about_its_shaft_turns_its_blades(still):
    """A hub that turns by 0.05 and a rotor that turns on it by 0.95: as fast through the air as one that turns by 1."""
    flap = jnp.full(SLICES, 0.1)
    here = flying(still, (0.2, 0.0, 0.0), flap=flap)
    turn = jnp.array([0.0, 0.0, 0.05])
    there = eqx.tree_at(
        lambda m: (m.flight.turn, m.flight.speed), here, (turn, jnp.asarray(0.95)), is_leaf=lambda v: v is None
    )
    gamma, angle = jnp.full((SLICES, 5), 0.01), jnp.asarray(0.3)

    def loads(model):
        air = undisturbed(model, model.of_slice(0).control, angle)
        return blade_loads(model, jnp.broadcast_to(air, (SLICES, 5, 3)), gamma, inputs_of(model))

    close(loads(here), loads(there))


def test_air_at_rest_goes_round_a_hub_that_rolls(still):
    """The point ahead of a hub that turns about x by q is passed by air at −q × r, seen from the blade at 90° too."""
    rolling = eqx.tree_at(
        lambda m: m.flight.turn, flying(still), jnp.array([0.1, 0.0, 0.0]), is_leaf=lambda v: v is None
    )
    starboard = jnp.array([[1.0, 0.0, 0.0]])  # of the blade's frame
    np.testing.assert_allclose(undisturbed(rolling, starboard, jnp.asarray(np.pi / 2)), [[0, 0, -0.1]], atol=1e-15)
    np.testing.assert_allclose(undisturbed(rolling, starboard, jnp.asarray(0.0)), 0, atol=1e-15)


def test_wake_age_goes_with_the_rotors_speed(still, wake):
    """Rates less the air's velocity, and those of strengths, are in proportion to Ω."""
    slow = eqx.tree_at(lambda m: m.flight.speed, flying(still), jnp.asarray(0.9), is_leaf=lambda v: v is None)
    state = full_state(still, wake)[0]
    rest = Velocities(jnp.zeros((SLICES, 5, 3)), 0 * state.near, 0 * state.far)
    wanted = 2 * state.gamma_bound
    here, there = carried_on(state, rest, wanted, flying(still)), carried_on(state, rest, wanted, slow)
    close(there, jax.tree.map(lambda v: 0.9 * v, here))
    blown = carried_on(state, rest._replace(far=rest.far + 0.01), wanted, slow)
    close(blown.far - there.far, jnp.full_like(state.far, 0.01))


def test_lift_fades_where_hardly_any_air_passes_a_section(still):
    """In full at 0.1 ΩR, gone at 0.004, and the loads of a rigid rotor in hover are left as they are."""
    model = flying(still)
    speeds = jnp.array([0.004, 0.02, 0.04, 0.1, 0.5])  # left by a wind that goes with the blade
    air = jnp.zeros((SLICES, 5, 3)).at[..., 1].set(model.stations - speeds)
    gamma = jnp.zeros((SLICES, 5))
    faded = blade_loads(model, air, gamma, inputs_of(model)).circulation[0]
    whole = blade_loads(still, air, gamma, inputs_of(still)).circulation[0]
    share = 1 - np.exp(-((speeds / 0.04) ** 4))
    np.testing.assert_allclose(faded, share * whole, rtol=1e-9, atol=1e-15)
    assert float(faded[0] / whole[0]) < 1e-3
    assert float(faded[3] / whole[3]) > 1 - 1e-9
