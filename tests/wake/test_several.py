"""Several rotors in one free wake: symmetries, limits, one solved coaxial pair and its derivative."""

from dataclasses import replace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from wakes import COARSE

import rotorjax as rj
from rotorjax.errors import InputError
from rotorjax.wake import field, several_solution
from rotorjax.wake.equilibrium import full_state, spread
from rotorjax.wake.several import answer, evaluate, interference, leaked, several_wakes, velocity
from rotorjax.wake.solution import told_of

SETTINGS = rj.WakeSettings(**COARSE)
THRUST = 0.006


@pytest.fixture(scope="module")
def uh60():
    return rj.rotor("uh60", 18.0)


@pytest.fixture(scope="module")
def alone(uh60):
    return rj.solve(rj.free_wake(*uh60, None, SETTINGS)).found


@pytest.fixture(scope="module")
def stages():
    """Residual after each stage of the pair's search."""
    return {}


@pytest.fixture(scope="module")
def coaxial(uh60, stages):
    pair = several_wakes(*uh60, [(0, 0, 0), (0, 0, -0.2)], settings=SETTINGS, thrusts=THRUST)
    return rj.solve(pair, progress=stages.__setitem__)


def of_each(alone, several):
    """Every rotor in the wake of one alone."""
    x = spread(alone.unknowns, several.slices)
    one = eqx.filter_jit(full_state)(several.one(0), x)[0]
    return jax.tree.map(lambda a: jnp.repeat(a[None], len(several), axis=0), one)


def test_rotors_side_by_side_are_mirror_images(uh60, alone):
    pair = several_wakes(*uh60, [(0, -1.2, 0), (0, 1.2, 0)], settings=SETTINGS, ground=rj.plane(2.0))
    assert pair.slices == 8
    left, right = np.asarray(eqx.filter_jit(interference)(pair, of_each(alone, pair)))
    assert np.abs(left).max() > 1e-3
    np.testing.assert_allclose(left, right, atol=1e-13)
    points = np.random.default_rng(0).uniform(-1.5, 1.5, (6, 3)) - [0, 0, 0.4]
    flow = eqx.filter_jit(velocity)
    here, there = (np.asarray(flow(of_each(alone, pair), jnp.asarray(p), pair)) for p in (points, points * [1, -1, 1]))
    np.testing.assert_allclose(here, there * [1, -1, 1], atol=1e-13)
    ground = np.column_stack([points[:, :2], np.full(6, -2.0)])
    np.testing.assert_allclose(flow(of_each(alone, pair), jnp.asarray(ground), pair)[:, 2], 0, atol=1e-14)


def test_rotors_far_apart_leave_each_other_alone(uh60, alone):
    """A wake from afar is a sink above and a source below: about A v/(4π d²) of its jet, here 2e-4 of the inflow."""
    pair = several_wakes(*uh60, [(0, 0, 0), (20, 0, 0)], settings=SETTINGS)
    added = np.asarray(eqx.filter_jit(interference)(pair, of_each(alone, pair)))
    assert np.abs(added[..., 2]).max() < 1e-3 * float(alone.mean_inflow)


def test_on_one_shaft_each_sees_the_mean_flow_of_the_other(uh60, alone):
    """At the lower rotor's control points: the upper wake's velocity averaged over its own azimuth."""
    pair = several_wakes(*uh60, [(0, 0, 0), (0, 0, -0.3)], settings=SETTINGS)
    added = np.asarray(interference(pair, of_each(alone, pair)))[1, 0]
    control = np.asarray(pair.one(1).control)
    upper = rj.velocity(rj.solve(rj.free_wake(*uh60, None, SETTINGS)), jnp.asarray(control - [0, 0, 0.3]), instants=60)
    np.testing.assert_allclose(added[: len(control), 2], np.asarray(upper)[:, 2], atol=2e-4)
    # the frames are mirror images: what turns with the upper rotor turns against the lower one
    np.testing.assert_allclose(added[: len(control), 1], -np.asarray(upper)[:, 1], atol=2e-4)


WALL = {"bottom": -1.0, "top": 0.6, "length": 2.0, "thickness": 0.6, "panel": 0.7}
AMONG = rj.WakeSettings(**COARSE, azimuths=8, tip_core=0.05)


def test_a_wall_far_away_leaves_a_pair_alone(uh60, alone):
    """Each wake's jet, a source of A v seen from 30 R, makes of the wall a dipole: far below 1e-6 at the rotors."""
    places = [(0, -1.2, 0), (0, 1.2, 0)]
    beside = several_wakes(*uh60, places, settings=AMONG, surfaces=rj.wall(30.0, **WALL))
    states = of_each(alone, beside)
    assert np.abs(eqx.filter_jit(answer)(beside, states)).max() < 1e-6


def test_a_pair_beside_a_wall_is_mirrored_and_blows_none_through_it(uh60, alone):
    """The wall stands aft, half of it on either side. So near before a panel its own half of n·v is 0.96 of that at its
    face, by the softening and the solid angle.
    """
    wall = rj.wall(1.3, **WALL)
    pair = several_wakes(*uh60, [(0, -1.2, 0), (0, 1.2, 0)], settings=AMONG, surfaces=wall)
    states = of_each(alone, pair)
    left, right = np.asarray(eqx.filter_jit(answer)(pair, states))
    assert np.abs(left).max() > 1e-3
    bare = eqx.tree_at(lambda m: m.surfaces, pair, None)
    np.testing.assert_allclose(left, right, atol=1e-12)
    near = wall.middles + 0.005 * wall.normals
    flow = eqx.filter_jit(velocity)
    blown, kept = (jnp.sum(flow(states, near, m) * wall.normals, axis=1) for m in (bare, pair))
    assert float(jnp.abs(blown).max()) > 1e-3
    assert float(jnp.abs(kept).max()) < 0.05 * float(jnp.abs(blown).max())


def test_one_rotor_is_the_free_wake(uh60, alone):
    """What its wake blows on a wall and what of it goes through, by the functions of one rotor and of several."""
    wall = rj.wall(1.3, **WALL)
    one, lone = several_wakes(*uh60, [(0, 0, 0)], settings=AMONG, surfaces=wall), rj.free_wake(*uh60, None, AMONG, wall)
    states = of_each(alone, one)
    state = jax.tree.map(lambda a: a[0], states)
    share = float(eqx.filter_jit(leaked)(one, states))
    np.testing.assert_allclose(share, eqx.filter_jit(field.leaked)(lone, state), rtol=1e-9)
    assert 0.02 < share < 0.5
    bare = eqx.tree_at(lambda m: m.surfaces, one, None)
    assert np.abs(eqx.filter_jit(interference)(bare, states)).max() == 0


@pytest.mark.slow
def test_a_coaxial_pair_is_trimmed_and_takes_more_power_than_two_rotors(coaxial, alone):
    """Less than one actuator disk would (√2), the lower rotor more than the upper one."""
    assert coaxial.converged, coaxial.why
    np.testing.assert_allclose(coaxial.CT, THRUST, rtol=1e-6)
    ratio = coaxial.CP_induced / (alone.CP_induced * (THRUST / alone.CT) ** 1.5)
    assert ratio[0] < ratio[1]
    assert 1.2 < ratio.mean() < np.sqrt(2)
    assert coaxial.collective_deg[0] < coaxial.collective_deg[1]


def test_rotors_are_brought_to_their_thrusts_before_they_see_each_other(coaxial, stages):
    """Over ground Newton is lost where it has to change collectives on the way (a pair over h = 1 was)."""
    assert stages["together 0.00"] < 1e-6
    assert coaxial.found.iterations < 40


def test_a_thrust_beyond_stall_is_told(uh60):
    lost = rj.solve(several_wakes(*uh60, [(0, 0, 0)], settings=SETTINGS, collectives_deg=28.0, thrusts=0.03))
    assert not lost.converged
    assert "C_T = 0.03 is out of a rotor's reach" in lost.why
    assert 0.01 < lost.CT[0] < 0.016


@pytest.mark.parametrize("interrupted", [False, True])
def test_a_lost_way_to_the_thrust_is_given_up_and_an_interrupt_ends_the_search(uh60, alone, monkeypatch, interrupted):
    """From the last wake that was found all rotors are tried together; not where the user has ended it."""
    answers = iter([alone, replace(alone, converged=False, interrupted=interrupted, why="ended")])
    monkeypatch.setattr(several_solution, "solve", lambda *_: next(answers))
    found, spent = several_solution._one_alone(alone.model, THRUST, None, None, 1e-7)
    assert (found.converged, spent) == (not interrupted, 2 * alone.iterations)


@pytest.mark.slow
def test_nodes_under_the_ground_are_told_of_all_rotors(uh60, coaxial):
    """Whosever they are; in free air there are none."""
    assert coaxial.clearance == np.inf
    places, state = np.array([(0, 0, 0), (0, 0, -0.2)]), coaxial.found.state
    lowest = min(float(jnp.min(v[i, ..., 2])) + places[i, 2] for v in (state.near, state.far) for i in range(2))
    for height, under in ((-0.05 - lowest, True), (0.05 - lowest, False)):
        model = several_wakes(*uh60, places, ground=rj.plane(height), settings=SETTINGS)
        rotors = tuple(replace(one, model=model.one(i)) for i, one in enumerate(coaxial.rotors))
        found = replace(coaxial.found, model=model, rotors=rotors)
        np.testing.assert_allclose(found.clearance, -0.05 if under else 0.05, atol=1e-12)
        words = "found, but its lowest node is 0.05 R under the ground"
        assert told_of(found, "found")[: len(words)] == (words if under else "found")


def test_what_is_found_is_drawn_and_written(coaxial, tmp_path):
    coaxial.plot(tmp_path / "pair.png")
    coaxial.to_vtk(tmp_path / "pair.vtk")
    data = coaxial.to_xarray()
    assert dict(data.sizes)["rotor"] == 2
    np.testing.assert_allclose(data["CT"], THRUST, rtol=1e-6)
    paths = coaxial.tip_vortices()
    assert paths.shape[:2] == (2, 4)
    assert np.all(paths[1, ..., 2].max(axis=1) < paths[0, ..., 2].max(axis=1))
    assert (tmp_path / "pair.vtk").stat().st_size > 1000


BAD = {
    r"`places` must be finite and of shape \(N, 3\)": {"places": [(0, 0)]},
    "rotors 0 and 1 .* overlap": {"places": [(0, 0, 0), (1.5, 0, 0)]},
    "`senses` must hold 2 numbers": {"senses": [1, 2]},
    "`ground` must be level": {"ground": rj.plane(2.0, 10.0)},
    "`places` must keep every disk above the ground": {"ground": rj.plane(0.1)},
    "`collectives_deg` must be a number or 2 of them": {"collectives_deg": [1.0, 2.0, 3.0]},
    "`tilts_deg` must be of shape": {"tilts_deg": [(3.0, 0.0)]},
    r"`thrusts` must be a number in \(0, 0.1\]": {"thrusts": -0.01},
    "`thrusts` must be a number or 2 of them, all finite, but is .much": {"thrusts": "much"},
    "keep clear of the disk": {"surfaces": rj.wall(0.5, bottom=-1.0, top=1.0)},
    "`surfaces` must be made by": {"surfaces": "wall"},
}


@pytest.mark.parametrize("message", BAD)
def test_wrong_input_is_named(message, uh60):
    with pytest.raises(InputError, match=message):
        several_wakes(*uh60, **{"places": [(0, 0, 0), (0, 0, -0.2)], "settings": SETTINGS} | BAD[message])


def test_rotors_that_cannot_stand_side_by_side_are_refused(uh60):
    places = [(0, 0, 0), (3, 0, 0)]
    with pytest.raises(InputError, match="one rotor, the kind that all are of, or 2 of them"):
        several_wakes([uh60[0]] * 3, uh60[1], places)
    with pytest.raises(InputError, match="have one number of blades for all, but is 4 and 2"):
        several_wakes([uh60[0], rj.rotor("tn2318_2")[0]], uh60[1], places)
    with pytest.raises(InputError, match="overlap"):
        several_wakes(*uh60, [(0, 0, 0), (1.9, 0, 0)], tilts_deg=[(-10, 0), (10, 0)])
    several_wakes(*uh60, [(0, 0, 0), (1.9, 0, 0.1)], tilts_deg=[(-10, 0), (10, 0)])  # one rim above the other
    with pytest.raises(InputError, match="every disk above the ground"):
        several_wakes(*uh60, places, tilts_deg=[(0, 0), (30, 0)], ground=rj.plane(0.49))


def test_a_rotor_that_leans_stands_over_a_slope(uh60, alone):
    """A shaft that leans aft by δ sees level ground as the paper's slope, rising aft by δ: the same flow in the rotor's
    own frame, h along the shaft; and seen from the common frame none of it goes through the ground.
    """
    lean, height = 12.0, 1.1
    leaning = several_wakes(*uh60, [(0, 0, 0)], ground=rj.plane(height), settings=SETTINGS, tilts_deg=[(-lean, 0.0)])
    states, own = of_each(alone, leaning), np.asarray(leaning.axes[0])
    model = rj.free_wake(*uh60, rj.plane(height / np.cos(np.deg2rad(lean)), lean), SETTINGS)
    points = np.random.default_rng(1).uniform(-0.8, 0.8, (6, 3)) - [0, 0, 0.3]
    wanted = field.velocity(jax.tree.map(lambda a: a[0], states), jnp.asarray(points), model).mean(axis=0)
    flow = eqx.filter_jit(velocity)
    np.testing.assert_allclose(flow(states, jnp.asarray(points @ own.T), leaning) @ own, wanted, atol=1e-12)
    ground = jnp.asarray(np.column_stack([points[:, :2], np.full(6, -height)]))
    np.testing.assert_allclose(flow(states, ground, leaning)[:, 2], 0, atol=1e-14)


def test_a_pair_that_leans_apart_is_its_own_mirror_image(uh60, alone):
    """Side by side, each leaning outboard; and the whole of it turned by 90°, so that they lean fore and aft."""
    leans = {"settings": SETTINGS, "senses": [1, -1]}
    abreast = several_wakes(*uh60, [(0, -1.2, 0), (0, 1.2, 0)], tilts_deg=[(0, -8), (0, 8)], **leans)
    left, right = np.asarray(eqx.filter_jit(interference)(abreast, of_each(alone, abreast)))
    assert np.abs(left).max() > 1e-3
    np.testing.assert_allclose(left, right, atol=1e-13)
    places, phases = [(1.2, 0, 0), (-1.2, 0, 0)], [90.0, -90.0]  # each blade 0 where the turn took it, in its own sense
    tandem = several_wakes(*uh60, places, tilts_deg=[(-8, 0), (8, 0)], phases_deg=phases, **leans)
    turned = np.asarray(eqx.filter_jit(interference)(tandem, of_each(alone, tandem)))
    np.testing.assert_allclose(turned, [left, right], atol=1e-12)


def test_kinds_may_differ_in_chord_and_twist(uh60, alone):
    """Left and right are mirror images, whichever has more chord; more stations of a table change nothing."""
    kind, operating = uh60
    wide = eqx.tree_at(lambda rotor: rotor.chord.values, kind, kind.chord.values * 4 / 3)
    between = (kind.twist.stations[1:] + kind.twist.stations[:-1]) / 2
    stations = jnp.sort(jnp.concatenate([kind.twist.stations, between]))
    finer = eqx.tree_at(
        lambda rotor: (rotor.twist.stations, rotor.twist.values), kind, (stations, kind.twist(stations))
    )

    @eqx.filter_jit
    def circulation(model):
        x = jax.tree.map(lambda a: jnp.repeat(a[None], 2, axis=0), spread(alone.unknowns, model.slices))
        return evaluate(model, x).loads.circulation

    def of(*kinds):
        return np.asarray(circulation(several_wakes(kinds, operating, [(0, -1.2, 0), (0, 1.2, 0)], settings=SETTINGS)))

    found, twins = of(kind, wide), of(kind, finer)
    np.testing.assert_allclose(found, of(wide, kind)[::-1], rtol=1e-10)
    np.testing.assert_allclose(twins, of(kind, kind), rtol=1e-10)
    assert 1.1 < found[1].sum() / found[0].sum() < 4 / 3

    @jax.jit
    def widths(factor):
        wider = eqx.tree_at(lambda rotor: rotor.chord.values, kind, kind.chord.values * factor)
        return several_wakes([kind, wider], operating, [(0, 0, 0), (3, 0, 0)]).wakes.rotor.chord.values

    np.testing.assert_allclose(widths(4 / 3)[1], wide.chord.values)


def test_a_traced_pair_is_sent_to_its_derivative(uh60):
    def thrust(height):
        return rj.solve(several_wakes(*uh60, [(0, 0, 0), (0, 0, -0.2)], ground=rj.plane(height))).CT.sum()

    with pytest.raises(InputError, match="solve first, and differentiate"):
        jax.grad(thrust)(2.0)
