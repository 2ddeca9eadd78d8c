"""The turns that follow the free ones: as many as there are, over ground as in the free air far above it."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from rotorjax.ground import Plane, plane
from rotorjax.rotor.catalogue import load
from rotorjax.wake import far_wake, segments
from rotorjax.wake.biot_savart import segment_velocity
from rotorjax.wake.far_wake import REACH, repeats, segment_ages, turns_each
from rotorjax.wake.model import WakeState, free_wake
from rotorjax.wake.roll_up import Release
from rotorjax.wake.settings import wake_settings
from rotorjax.wake.start import prescribed, shorter, with_turns

PITCH, RADIUS = 0.04, 0.75
ZERO = jnp.zeros(())
closure, faded, far_filaments = map(eqx.filter_jit, (far_wake.closure, far_wake.faded, segments.far_filaments))


def model_of(height=None, **settings):
    ground = None if height is None else Plane(jnp.asarray(height, float), jnp.zeros(()))
    usual = {"panels": 5, "near_wake_deg": 60.0, "inboard_decay": 0.0, "turbulence": 0.0}
    settings = wake_settings(**(usual | settings))
    return free_wake(*load("uh60"), ground, settings)


def helices(model):
    """Nodes of all filaments, the release point first, wound evenly down at PITCH a radian."""
    settings = model.settings
    age = settings.filament_ages
    one = np.stack([RADIUS * np.cos(age), -RADIUS * np.sin(age), -PITCH * age], axis=-1)
    return jnp.asarray(np.stack([one] * settings.filaments))


def inflow(model, points):
    """Downward velocity of all blades' tip vortices with Γ = 1."""
    nodes, settings = helices(model), model.settings
    alone = jnp.zeros(settings.filaments).at[0].set(1.0)
    nothing = jnp.zeros((settings.panels, settings.near_ages))
    near = jnp.zeros((settings.panels + 1, settings.near_ages, 3))
    strength = jnp.broadcast_to(alone[:, None], (settings.filaments, settings.far_ages))
    state = WakeState(near, nodes[:, 1:], nothing, strength, nothing[:, 0])
    far = far_filaments(model, state, Release(nodes[:, 0], alone), ZERO)
    return -segment_velocity(points, *far, plane=model.ground, blades=model.rotor.blades)[:, 2]


@pytest.mark.parametrize(("stretch", "more"), [(1, 30), (2, 12), (2, 17)])
def test_a_wake_gets_more_turns_by_going_on_as_it_did(stretch, more):
    """A helix stays one; what is cut off again is what there was."""
    model = model_of(free_turns=3.0, stretch=stretch)
    x = prescribed(model)._replace(far=helices(model)[None, :, 1:])
    longer = with_turns(x, model, model.settings.far_ages + more)
    goes_on = model.settings.filament_ages[-1] + stretch * model.settings.age_step * np.arange(1, more + 1)
    helix = [RADIUS * np.cos(goes_on), -RADIUS * np.sin(goes_on), -PITCH * goes_on]
    for filament in longer.far[0]:
        np.testing.assert_allclose(filament[-more:], np.stack(helix, axis=-1), atol=1e-12)
    there = model_of(free_turns=4.0, stretch=stretch)
    cut = with_turns(longer, there, model.settings.far_ages)
    np.testing.assert_array_equal(cut.far, x.far)


@pytest.mark.parametrize(("stretch", "turns", "half"), [(1, 4.0, 2.0), (1, 5.0, 3.0), (2, 8.0, 4.0), (2, 6.0, 4.0)])
def test_a_wake_is_found_from_half_its_turns_where_its_nodes_begin_so(stretch, turns, half):
    short = shorter(model_of(free_turns=turns, stretch=stretch))
    assert short.settings.free_turns == half


@pytest.mark.parametrize(("stretch", "turns"), [(1, 2.0), (2, 4.0), (2, 3.0)])
def test_a_wake_that_is_as_short_as_can_be_is_found_from_none(stretch, turns):
    """The usual one too: with fewer turns its old steps would begin sooner."""
    assert shorter(model_of(free_turns=turns, stretch=stretch)) is None


DISK = jnp.array([[0.1, 0.0, 0.0], [0.3, 0.2, 0.0], [0.0, 0.6, 0.0], [0.9, 0.0, 0.0]])


@pytest.mark.parametrize("turns", [2, 4])
def test_bundles_stand_for_all_turns_to_come(turns):
    """Against 50 turns one by one, their end closed as a vortex cylinder seen from far away."""
    whole = inflow(model_of(closure_turns=50, closure_bundles=0), DISK)
    sheet = 4 / (2 * np.pi * PITCH)
    depth = 2 * np.pi * PITCH * (52 + 1 / 6)
    whole = whole + 0.25 * sheet * RADIUS**2 / depth**2
    found = inflow(model_of(closure_turns=turns, closure_bundles=6), DISK)
    np.testing.assert_allclose(found, whole, atol=5e-3 * float(whole[0]))
    cut = inflow(model_of(closure_turns=turns, closure_bundles=0), DISK)
    # what a cut wake lacks, about R²/4L² of the sheet's strength
    assert float(jnp.max(whole - cut)) > 0.02 * float(whole[0])


def test_long_steps_of_old_turns_induce_what_short_ones_do():
    """Half as many nodes to a turn, halved between them by cubics, and a closure of their chords."""
    short, long = (model_of(free_turns=4.0, stretch=stretch) for stretch in (1, 2))
    assert long.settings.far_ages == 63 < short.settings.far_ages == 96
    exact = inflow(short, DISK)
    np.testing.assert_allclose(inflow(long, DISK), exact, atol=1e-3 * float(exact[0]))
    # with the chords' own area the closure's jet would be 3 % too weak
    ends = segments.points_between(long, helices(long))[0]
    age = long.settings.segment_ages
    np.testing.assert_allclose(
        ends, np.stack([RADIUS * np.cos(age), -RADIUS * np.sin(age), -PITCH * age], -1), atol=1e-12
    )


def test_every_turn_is_counted_once():
    model = model_of(closure_turns=3, closure_bundles=4)
    after, weight = repeats(model)
    assert weight == (1, 1, 1, 2, 4, 8, 16)
    ends = np.cumsum(weight)
    assert after[:3] == (1.0, 2.0, 3.0)
    # within the turns that it stands for, nearer to their start
    assert np.all(after > ends - np.array(weight))
    assert np.all(after <= ends - (np.array(weight) - 1) / 2)
    per_turn = model.settings.steps_per_turn
    assert np.sum(turns_each(model)) == pytest.approx(per_turn * (model.settings.free_turns + ends[-1]))


def left_of(model):
    """Made-up strengths of the filaments at their release, (F,), and what is left at the free nodes, (F, A_F)."""
    settings = model.settings
    released = jnp.asarray([0.9, *(-0.5, -0.4)[: settings.filaments - 1]])
    strength = jnp.broadcast_to(released[:, None], (settings.filaments, settings.far_ages))
    return released, faded(model, strength, settings.filament_ages[1:])


def test_inboard_filaments_fade_and_the_tip_vortex_does_not():
    model = model_of(inboard_decay=0.5, impulse_kept=0.0)
    released, left = left_of(model)
    turns = np.arange(1, model.settings.far_ages + 1) / model.settings.steps_per_turn
    np.testing.assert_array_equal(left[0], released[0])
    np.testing.assert_allclose(left[1:], np.outer(released[1:], np.exp(-0.5 * turns)), rtol=1e-12)
    assert segment_ages(model)[0] == pytest.approx(np.mean(model.settings.filament_ages[:2]))


def test_turns_that_lie_side_by_side_mix():
    """From an age of a turn on cores thicken evenly and inboard strength falls as a Gaussian, not before."""
    plain, mixed = (model_of(inboard_decay=0.5, mixing=m, spreading=s) for m, s in ((0.0, 0.0), (0.7, 0.03)))
    turns = np.maximum(plain.settings.filament_ages[1:] / (2 * np.pi) - 1, 0)
    ratio = left_of(mixed)[1][1] / left_of(plain)[1][1]
    np.testing.assert_allclose(ratio, np.exp(-((0.7 * turns) ** 2)), rtol=1e-12)
    ages = plain.settings.filament_ages
    before, after = (far_wake.cores(m, jnp.asarray(0.01), ages)[0] for m in (plain, mixed))
    np.testing.assert_allclose(after[1:] ** 2 - before[1:] ** 2, (0.03 * turns) ** 2, atol=1e-15)


@pytest.mark.parametrize("share", [0.0, 0.4, 1.0])
def test_the_impulse_of_a_turn_changes_by_what_is_not_kept(share):
    model = model_of(inboard_decay=0.5, impulse_kept=share)
    released, left = left_of(model)
    r2 = jnp.asarray([float(model.settings.release), *model.settings.inboard]) ** 2
    lost = (left[1:] - released[1:, None]).T @ r2[1:]
    assert float(lost[-1]) > 0.1
    np.testing.assert_allclose(left.T @ r2 - released @ r2, (1 - share) * lost, atol=1e-14)


def test_what_is_left_has_its_derivatives():
    model = model_of(inboard_decay=0.5, impulse_kept=0.3)

    def of(values):
        names = ("inboard_decay", "impulse_kept", "release")
        return left_of(eqx.tree_at(lambda m: [getattr(m.settings, n) for n in names], model, list(values)))[1]

    values = jnp.asarray([0.5, 0.3, 0.97])
    step = 1e-5 * jnp.eye(3)
    differences = jnp.stack([(of(values + s) - of(values - s)) / 2e-5 for s in step], axis=-1)
    forward = jax.jit(jax.jacfwd(of))(values)
    np.testing.assert_allclose(forward, differences, rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(jax.jit(jax.jacrev(of))(values), forward, rtol=1e-12, atol=1e-15)


def test_without_inboard_filaments_nothing_fades():
    released, left = left_of(model_of(inboard=(), roll_up="paper", inboard_decay=0.5, impulse_kept=1.0))
    np.testing.assert_array_equal(left, jnp.full(left.shape, released[0]))


def test_far_above_a_plane_the_closure_is_that_of_free_air():
    free = closure(model_of(), helices(model_of()), ZERO)
    for height, allowed in ((1e2, 1e-12), (1e5, 1e-9)):
        over = closure(model_of(height), helices(model_of()), ZERO)
        np.testing.assert_allclose(over, free, atol=allowed)


@pytest.mark.parametrize("height", [0.8, 1.5, 3.0])
def test_over_a_plane_it_stays_above_and_spreads_as_the_flow_through_it_is_kept(height):
    """r²/(2 REACH + r) tanh(z/REACH) is the stream function of a jet that runs along the plane at a steady speed."""
    model = model_of(height)
    nodes = closure(model, helices(model), ZERO)
    z, r = nodes[..., 2] + height, jnp.hypot(nodes[..., 0], nodes[..., 1])
    assert float(jnp.min(z)) > 0
    per_turn = model.settings.steps_per_turn
    last = helices(model)[:, -per_turn:]
    start = RADIUS**2 / (2 * REACH + RADIUS) * jnp.tanh((last[..., 2] + height) / REACH)
    for turn in range(model.settings.closure_turns):
        here = slice(turn * per_turn, (turn + 1) * per_turn)
        np.testing.assert_allclose((r**2 / (2 * REACH + r) * jnp.tanh(z / REACH))[:, here], start, rtol=1e-10)
        assert jnp.all(z[:, here] < last[..., 2] + height)


def test_far_out_on_a_plane_turns_grow_by_one_step():
    """By what a turn that widens as in a stagnation flow does at 2 REACH from the shaft, REACH times the fall."""
    height, turns = 0.8, 30
    model = model_of(height, closure_turns=turns, closure_bundles=0)
    nodes, turn = helices(model), model.settings.steps_per_turn
    last, before = (float(jnp.mean(nodes[0, a:b, 2])) for a, b in ((-turn - 1, None), (-2 * turn - 1, -turn)))
    fall = np.log(np.sinh((before + height) / REACH) / np.sinh((last + height) / REACH))
    found = closure(model, nodes, ZERO)[0].reshape(turns, turn, 3)
    radius = np.hypot(found[..., 0], found[..., 1]).mean(axis=1)
    own = 0.5 * (1 + RADIUS / (2 * REACH))  # what a stagnation flow has of the steady speed at the turn's own radius
    np.testing.assert_allclose(np.diff(radius)[-5:], 2 * REACH * own * fall, rtol=0.01)


@pytest.mark.parametrize("dtype", [jnp.float32, jnp.float64])
def test_turns_that_a_search_drops_onto_the_plane_at_once_stay_finite(dtype):
    """From 3 R above the plane down to it within a turn, 13 of ln sinh, and that 64 times."""
    model = model_of(3.0, free_turns=2.0, closure_turns=2, closure_bundles=6)
    turn = model.settings.steps_per_turn
    nodes = helices(model).at[:, -turn - 1 :, 2].set(-2.9999).at[:, : -turn - 1, 2].set(0.0)
    narrow = jax.tree.map(lambda a: a.astype(dtype) if eqx.is_inexact_array(a) else a, model)
    assert np.all(np.isfinite(closure(narrow, nodes.astype(dtype), ZERO.astype(dtype))))


def test_next_to_a_plane_a_narrow_turn_comes_down_by_the_same_ratio():
    """A stagnation flow: heights fall by one ratio, radii grow by the root of its inverse."""
    model = model_of(0.56, free_turns=2.0, closure_turns=3, closure_bundles=0)
    nodes = helices(model) * np.array([1e-6, 1e-6, 0.02])  # a wake far smaller than REACH …
    low = nodes.at[..., 2].add(-0.55)  # … right above the plane
    turn = model.settings.steps_per_turn
    found = closure(model, low, ZERO).reshape(model.settings.filaments, 3, turn, 3)
    z = found[..., 2] + 0.56
    ratio = z[:, 1:] / z[:, :-1]
    np.testing.assert_allclose(ratio, jnp.broadcast_to(ratio[:1, :1, :1], ratio.shape), rtol=1e-4)
    radius = jnp.hypot(found[..., 0], found[..., 1])
    np.testing.assert_allclose((radius[:, 1:] / radius[:, :-1]) ** -2, ratio, rtol=1e-4)


def over_slope(height, slope_deg, **settings):
    return eqx.tree_at(
        lambda m: m.ground, model_of(**settings), plane(height, slope_deg), is_leaf=lambda value: value is None
    )


def test_over_a_slope_turns_come_down_along_the_shaft_and_run_off_downhill():
    """In the flow next to the plane, integrated: normal to it −tanh n; along it x/2 cosh² n less the tan δ that it came
    with. By how much of its size it has run off by the height that it has come to is that of a turn.
    """
    height, slope = 1.5, 20.0
    model = over_slope(height, slope, closure_turns=3, closure_bundles=0)
    nodes, turn = helices(model), model.settings.steps_per_turn
    uphill, normal = (
        np.array([np.cos(np.deg2rad(slope)), 0, np.sin(np.deg2rad(slope))]),
        np.asarray(model.ground.normal),
    )
    foot = np.array([0, 0, -height])

    def on_plane(points):
        arm = np.asarray(points) - foot
        return np.stack([arm @ uphill, arm[..., 1], arm @ normal]) / REACH

    def flow(_, y):
        spread = 0.5 / np.cosh(y[2]) ** 2
        return [spread * y[0] - np.tan(np.deg2rad(slope)), spread * y[1], -np.tanh(y[2])]

    found = closure(model, nodes, ZERO)[0].reshape(3, turn, 3)
    free = 2 / np.sqrt(np.mean(np.sum(on_plane(nodes[0, -turn - 1 :])[:2] ** 2, axis=0)))
    for k in (1, 3):
        starts, ends = on_plane(nodes[0, -turn:]), on_plane(found[k - 1])
        times, wider = np.log(np.sinh(starts[2]) / np.sinh(ends[2])), ends[1] / starts[1]
        np.testing.assert_allclose(times, times[0], rtol=1e-10)
        off_axis = np.abs(starts[1]) > 0.1
        thinner = wider**2 * (1 + free) / (free + wider) * np.tanh(ends[2])
        np.testing.assert_allclose(thinner[off_axis], np.tanh(starts[2])[off_axis], rtol=1e-10)
        for i in (0, 6, 19):
            there = solve_ivp(flow, (0, times[i]), starts[:, i], rtol=1e-10, atol=1e-12).y[:, -1]
            np.testing.assert_allclose(ends[0, i] / wider[i], there[0] * starts[1, i] / there[1], atol=1e-3)


def test_far_above_a_slope_the_closure_is_that_of_free_air():
    free = closure(model_of(), helices(model_of()), ZERO)
    model = over_slope(1e3, 30.0)
    np.testing.assert_allclose(closure(model, helices(model), ZERO), free, atol=1e-9)


@pytest.mark.parametrize("below", [0.0, 0.05])
def test_nodes_that_a_search_puts_on_or_under_the_plane_do_no_harm(below):
    model = model_of(0.8)
    nodes = helices(model)
    nodes = nodes.at[:, -3, 2].set(-0.8 - below)

    def total(height, nodes):
        # linear: a sine of coordinates in the millions would turn their rounding into digits of its derivative
        found = closure(eqx.tree_at(lambda m: m.ground.height, model, height), nodes, ZERO)
        return jnp.sum(jnp.cos(jnp.arange(found.size)) * found.ravel())

    height = jnp.asarray(0.8)
    value, (by_height, by_nodes) = jax.jit(jax.value_and_grad(total, argnums=(0, 1)))(height, nodes)
    assert np.isfinite(value)
    assert np.isfinite(by_height)
    assert np.all(np.isfinite(by_nodes))
    forward = jax.jvp(total, (height, nodes), (jnp.ones(()), jnp.zeros_like(nodes)))[1]
    np.testing.assert_allclose(forward, by_height, rtol=1e-10)
