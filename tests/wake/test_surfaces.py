"""Solid surfaces under the free wake: one periodic hover beside a wall, its frames, its flow and a derivative."""

from dataclasses import replace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from wakes import COARSE

import rotorjax as rj
from rotorjax.errors import InputError
from rotorjax.frames import rotate_about_shaft
from rotorjax.linearisation.system import residual_of
from rotorjax.panels.surface import Panels, normal_flow, solid
from rotorjax.wake.equilibrium import displacement, full_state, look, spread
from rotorjax.wake.field import node_velocities, old_velocities, velocity
from rotorjax.wake.model import Flight
from rotorjax.wake.start import prescribed

SETTINGS = rj.WakeSettings(**COARSE, azimuths=8, tip_core=0.05)
WALL = {"bottom": -1.0, "top": 1.0, "length": 3.0, "thickness": 0.6, "panel": 0.6}


def model(azimuth_deg=0.0):
    return rj.free_wake(*rj.rotor("uh60", 18.0), None, SETTINGS, rj.wall(1.2, azimuth_deg=azimuth_deg, **WALL))


@pytest.fixture(scope="module")
def beside():
    with pytest.warns(UserWarning, match=r"4\d % of what blows on the surfaces goes through between"):
        return rj.solve(model()).found


@pytest.fixture(scope="module")
def flow(beside):
    """Velocities (I, N, 3) at points at the instants of half a turn."""
    compiled = eqx.filter_jit(velocity)
    return lambda points, model: compiled(beside.state, jnp.asarray(points), model)[: len(beside.psi) // 2]


@pytest.mark.slow
def test_a_rotor_beside_a_wall_is_found(beside):
    assert beside.converged, beside.why
    assert beside.residual < 1e-6
    assert beside.psi.shape == (8,)
    # no node of the wake has gone through
    hub = rotate_about_shaft(beside.state.far, beside.psi[:, None, None])
    assert float(hub[..., 0].max()) < 1.2
    # the wall is felt, and most on its side of the disk
    change = np.abs(beside.dct_dr - beside.dct_dr.mean(axis=0)) @ beside.widths
    assert change.max() / beside.CT > 0.005


@pytest.mark.slow
def test_the_equations_that_are_marched_and_linearised_are_at_rest_there(beside):
    """On the mean over the blades, the panels' answer in it."""
    assert residual_of(beside) < 1e-6
    assert residual_of(replace(beside, model=replace(beside.model, surfaces=None))) > 1e-3


@pytest.mark.slow
def test_no_air_goes_through_the_wall(beside, flow):
    """At every instant: the wake's flow and what the panels make of it, a panel's own share the limit from the air."""
    surfaces = beside.model.surfaces
    panels = surfaces.panels
    open_air = flow(panels.middles, replace(beside.model, surfaces=None))
    through = jnp.sum(open_air * panels.normals, axis=-1)
    assert float(jnp.abs(through).max()) > 1e-3
    left = through + jax.vmap(lambda b: normal_flow(panels, None, surfaces.densities(b)))(through)
    np.testing.assert_allclose(left, 0, atol=1e-12)
    # and the flow that `velocity` gives just outside is along the wall
    outside = panels.middles + 0.01 * panels.normals
    normal = jnp.sum(flow(outside, beside.model) * panels.normals, axis=-1)
    assert float(jnp.abs(normal).max()) < 0.1 * float(jnp.abs(through).max())


@pytest.mark.slow
def test_a_wall_elsewhere_turns_the_wake_with_it(beside):
    """By a quarter of a turn, two slices of eight: what solves one case solves the other."""
    turned = jax.tree.map(lambda a: jnp.roll(a, 2, axis=0), beside.unknowns)
    moved, found = look(jax.tree.map(jnp.asarray, model(90.0)), turned)
    assert displacement(moved) < 2 * beside.residual + 1e-9
    np.testing.assert_allclose(found.loads.circulation, np.roll(beside.circulation, 2, axis=0), atol=1e-9)


@pytest.mark.slow
def test_how_the_flow_changes_as_the_wall_comes_nearer(beside, flow):
    """Of the wake as it is; forward mode through strengths and flow of the panels, against differences."""
    panels = beside.model.surfaces.panels
    points = jnp.asarray(np.random.default_rng(0).uniform(-0.8, 0.8, (5, 3)))

    def of(by):
        closed = solid(panels.moved(by * jnp.array([1.0, 0, 0])))
        return jnp.sum(flow(points, replace(beside.model, surfaces=closed))[..., 2])

    exact = jax.jit(lambda by: jax.jvp(of, (by,), (1.0,)))(0.0)[1]
    differences = (of(1e-4) - of(-1e-4)) / 2e-4
    assert abs(float(exact)) > 1e-4
    np.testing.assert_allclose(exact, differences, rtol=1e-6)


@pytest.mark.parametrize(
    ("surfaces", "words"),
    [
        (rj.wall(0.5, bottom=-1.0, top=1.0, length=2.0), r"keep clear of the disk, but panel \d+ comes to 0.5 R"),
        (rj.box((-3.0, -3.0, -0.3), (3.0, 3.0, 0.2)), "have the rotor outside, but encloses its hub"),
        ("wall", "be made by rj.box"),
    ],
)
def test_surfaces_that_no_rotor_can_turn_among_are_refused(surfaces, words):
    with pytest.raises(InputError, match=words):
        rj.free_wake(*rj.rotor("uh60", 18.0), None, SETTINGS, surfaces)


@pytest.fixture(scope="module")
def in_wind():
    """A made-up wake over a roof's edge in a wind; rigid blades."""
    roof = rj.slab((-2.0, -1.5), (0.3, 1.5), -0.8, thickness=0.4, panel=0.8)
    still = rj.free_wake(*rj.rotor("uh60", 18.0), None, SETTINGS, roof)
    none = jnp.zeros(8)
    flight = Flight(jnp.array([0.08, 0.03, -0.01]), jnp.zeros(()), none, none, none)
    state = full_state(still, spread(prescribed(still.levelled), 8))[0]
    return replace(still, flight=flight), jax.tree.map(jnp.asarray, state)


def test_the_wind_flows_around_a_roof(in_wind):
    """So near before a panel its own half of n·v is 0.96 of that at its face; without the wind's share of the sources
    all of it would go through.
    """
    blown, state = in_wind
    panels = blown.surfaces.panels
    flow = eqx.filter_jit(velocity)(state, panels.middles + 0.005 * panels.normals, blown)[:2]
    normal = jnp.sum((flow + blown.flight.wind) * panels.normals, axis=-1)
    alone = jnp.sum(blown.flight.wind * panels.normals, axis=-1)
    assert float(jnp.abs(alone).max()) > 0.07
    assert float(jnp.abs(normal).max()) < 0.06 * float(jnp.abs(alone).max())


def test_what_a_march_sums_once_a_step_holds_the_wind_once(in_wind):
    blown, state = in_wind
    whole, parts = (
        eqx.filter_jit(node_velocities)(blown, state, 0.0, old)
        for old in (None, eqx.filter_jit(old_velocities)(blown, state))
    )
    jax.tree.map(lambda a, b: np.testing.assert_allclose(a, b, atol=1e-12), whole, parts)


def test_surfaces_move_past_a_hub_that_flies(in_wind):
    """In still air, whichever moves; and with them the wind over them, where there is one. The inverse stays."""
    blown, state = in_wind
    place, turn = jnp.array([0.2, -0.1, 0.05]), jnp.asarray([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    there = replace(blown.surfaces, wind=jnp.array([0.05, 0.0, 0.0])).seen_from(place, turn)
    anew = solid(Panels((blown.surfaces.panels.corners - place) @ turn.T))
    np.testing.assert_allclose(there.panels.corners, anew.panels.corners, atol=1e-15)
    np.testing.assert_allclose(there.inverse, anew.inverse, atol=1e-10)
    np.testing.assert_allclose(there.wind, [0.0, 0.05, 0.0], atol=1e-15)
    points = jnp.array([[0.3, 0.4, -0.3], [0.9, -0.2, -0.5]])
    flow = eqx.filter_jit(velocity)
    still = replace(blown, surfaces=replace(anew, wind=jnp.zeros(3)))
    windy = replace(blown, surfaces=there)
    answer = there.answer(points, there.panels.normals @ there.wind)
    assert np.abs(answer).max() > 1e-3
    change = flow(state, points, windy) - flow(state, points, still)
    np.testing.assert_allclose(change, jnp.broadcast_to(answer, change.shape), atol=1e-12)
