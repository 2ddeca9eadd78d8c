"""The periodic wake: it is one, it is where rhs rests, and it behaves as rotors do."""

from dataclasses import replace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from rotorjax.ground import plane
from rotorjax.wake import search
from rotorjax.wake.dynamics import inputs_of, rhs
from rotorjax.wake.equilibrium import spread
from rotorjax.wake.model import WakeState, free_wake
from rotorjax.wake.solution import lowest_node, solve, submerged


def test_hover_converges_to_a_rotor_in_hover(hover):
    assert hover.converged, hover.why
    assert hover.residual < 1e-6
    assert hover.load_change < 1e-5
    # momentum theory: no settings bring a hovering wake far from it
    np.testing.assert_allclose(hover.mean_inflow, np.sqrt(hover.CT / 2), rtol=0.12)
    assert hover.CP_profile > 0
    # the tip vortex contracts and goes down
    end = hover.tip_vortex[0, -1]
    assert 0.6 < np.hypot(*end[:2]) < 0.95
    assert end[2] < -0.5


def test_the_periodic_wake_is_where_the_marched_equations_rest(hover):
    inputs = inputs_of(hover.model)
    for slices in (1, 4):
        rate = eqx.filter_jit(rhs)(jnp.asarray(0.3), spread(hover.state, slices), inputs, hover.model)
        assert max(float(jnp.max(jnp.abs(a))) for a in jax.tree.leaves(rate)) < 1e-5


def test_rates_have_derivatives_by_the_inputs(hover):
    """Forward mode by numbers that the points do not depend on: tangents that are batched, points that are not."""
    inputs = inputs_of(hover.model)
    rate = eqx.filter_jit(lambda inputs: rhs(0.0, hover.state, inputs, hover.model).gamma_bound)
    slope = jax.jacfwd(rate)(inputs).collective
    moved = [inputs._replace(collective=inputs.collective + s) for s in (1e-5, -1e-5)]
    np.testing.assert_allclose(slope, (rate(moved[0]) - rate(moved[1])) / 2e-5, rtol=1e-5, atol=1e-7)


@pytest.fixture(scope="module")
def grounded(uh60, coarse, hover):
    return solve(free_wake(*uh60, plane(1.0), coarse), start=hover)


def test_half_the_pitch_is_a_way_to_the_same_wake(hover):
    search_ = search.Search(1e-7, None)
    there, x = search_.by_way_of_less_pitch(search.on_host(hover.model))
    assert search_.ok, search_.why
    assert float(there.operating.collective) == float(hover.model.operating.collective)
    np.testing.assert_allclose(x.gamma_bound, hover.state.gamma_bound, rtol=1e-5)


def test_iterations_that_close_in_go_on_beyond_their_limit(grounded, monkeypatch):
    model = search.on_host(grounded.model)
    guess = jax.tree.map(lambda a: np.asarray(a) * (1 + 1e-3), grounded.unknowns)
    whole = search.Search(1e-9, None).newton(model, guess, 1e-9)
    assert whole.converged
    assert whole.iterations > 1
    monkeypatch.setattr(search, "MOST", 1)
    longer = search.Search(1e-9, None).newton(model, guess, 1e-9)
    assert longer.converged
    assert longer.iterations == len(longer.residuals) - 1 == whole.iterations


def test_ground_raises_thrust_and_lowers_inflow(hover, grounded):
    assert grounded.converged, grounded.why
    assert grounded.CT > hover.CT
    assert grounded.mean_inflow / np.sqrt(grounded.CT) < hover.mean_inflow / np.sqrt(hover.CT)
    assert grounded.ground_normal_velocity_rms < 1e-10


def test_wake_spreads_over_the_ground_and_stays_above_it(grounded):
    path = grounded.tip_vortex[0]
    radius = np.hypot(path[:, 0], path[:, 1])
    assert radius[-1] > radius.min() + 0.1
    nearest = min(float(jnp.min(grounded.model.ground.distance(v))) for v in (grounded.state.far, grounded.state.near))
    assert nearest > 0
    np.testing.assert_allclose(grounded.clearance, nearest, atol=1e-12)
    assert submerged(grounded) is None
    raised = replace(grounded, model=eqx.tree_at(lambda m: m.ground.height, grounded.model, 1.0 - nearest - 0.05))
    assert "lowest node is 0.05 R under the ground" in submerged(raised)


def test_clearance_is_over_the_slope_as_each_blade_has_it(coarse, uh60):
    """Two slices with one node along the blade at ψ = 0 and at π; over 45° the first is nearer."""
    over = free_wake(*uh60, plane(2.0, 45.0), coarse)
    node, high = (np.array([x, 0.0, z]).reshape(1, 1, 3) for x, z in ((1.0, -0.5), (0.0, 9.0)))

    def lowest(*slices):
        nodes = jnp.asarray(np.stack(slices))
        return float(lowest_node(WakeState(nodes, nodes, *(jnp.zeros((2, 1, 1)),) * 2, jnp.zeros((2, 1))), over))

    assert lowest(node, node) == pytest.approx(0.5 / np.sqrt(2))
    assert lowest(high, node) == pytest.approx(2.5 / np.sqrt(2))


@pytest.fixture(scope="module")
def sloped(uh60, coarse_slope, grounded):
    return solve(free_wake(*uh60, plane(1.0, 4.0), coarse_slope), start=grounded)


@pytest.mark.slow
def test_nothing_flows_through_a_slope(sloped):
    """Mountain and valley side differ by 0.3 %, less than this coarse wake knows: test_documents.py looks at them."""
    assert sloped.converged, sloped.why
    assert sloped.ground_normal_velocity_rms < 1e-10


def test_a_longer_wake_is_found_from_a_shorter_one_and_back(grounded):
    """In few iterations, at another height too; the shorter one comes out as it was. From nothing the way leads over a
    shorter one as well, where the prescribed wake is lost.
    """
    settings = replace(grounded.model.settings, free_turns=grounded.model.settings.free_turns + 2.0)
    longer = eqx.tree_at(lambda m: (m.settings, m.ground.height), grounded.model, (settings, jnp.asarray(1.05)))
    found = solve(longer, start=grounded)
    assert found.converged, found.why
    assert found.state.far.shape[2] == settings.far_ages > grounded.state.far.shape[2]
    assert found.iterations <= 8
    stages = []
    alone = solve(longer, progress=lambda stage, residual: stages.append(stage))
    assert stages == ["prescribed wake", "prescribed wake", "free turns", "case"]
    np.testing.assert_allclose(found.CT, alone.CT, rtol=1e-6)
    back = solve(grounded.model, start=found)
    assert back.converged, back.why
    np.testing.assert_allclose(back.CT, grounded.CT, rtol=1e-6)


def test_a_wake_that_a_shorter_one_does_not_lead_to_is_sought_by_the_other_ways(grounded, monkeypatch):
    def lost(self, here, there, x):
        self.hard, self.ok, self.why = True, False, "lost"
        self.prepare(grounded.model, grounded.unknowns)
        return grounded.model, grounded.unknowns

    monkeypatch.setattr(search.Search, "other_turns", lost)
    settings = replace(grounded.model.settings, free_turns=grounded.model.settings.free_turns + 2.0)
    longer, stages = eqx.tree_at(lambda m: m.settings, grounded.model, settings), []
    found = solve(longer, progress=lambda stage, residual: stages.append(stage))
    assert found.converged, found.why
    assert "half the pitch" in stages


@pytest.mark.slow
def test_a_longer_wake_over_a_slope_is_found_from_a_shorter_one(sloped):
    settings = replace(sloped.model.settings, free_turns=3.0)
    longer, stages = eqx.tree_at(lambda m: m.settings, sloped.model, settings), []
    found = solve(longer, sloped, lambda stage, residual: stages.append(stage))
    assert found.converged, found.why
    assert stages == ["free turns", "case"]
    np.testing.assert_allclose(found.CT, solve(longer).CT, rtol=1e-6)


def test_a_solve_that_is_lost_says_so_and_keeps_what_it_had(uh60, coarse, hover, monkeypatch):
    monkeypatch.setattr("rotorjax.wake.search.SMALLEST", 0.5)  # it would only be lost later
    rotor, operating = uh60
    upside_down = eqx.tree_at(lambda o: o.collective, operating, jnp.asarray(-0.6))
    found = solve(free_wake(rotor, upside_down, None, coarse), start=hover)
    assert not found.converged
    assert found.why
    assert np.all(np.isfinite(found.inflow))


def test_a_solve_that_is_lost_from_a_neighbour_tries_from_nothing(grounded, monkeypatch):
    """Then in small steps from the neighbour; where all are lost it keeps what the first gave."""
    move, at_once, losses = search.Search.move, [], 1

    def lost_first(self, here, there, x, stage):
        at_once.append(self.at_once)
        self.ok, self.why = len(at_once) > losses, "lost"
        return move(self, here, there, x, stage) if self.ok else (here, x)

    monkeypatch.setattr(search.Search, "move", lost_first)
    higher = eqx.tree_at(lambda m: m.ground.height, grounded.model, jnp.asarray(1.1))
    found = solve(higher, start=grounded)
    assert at_once == [True, False]
    assert found.converged, found.why
    np.testing.assert_allclose(float(found.model.ground.height), 1.1)
    assert found.CT < grounded.CT

    def nowhere(self, model):
        self.ok, self.why = False, "no way from nothing either"
        return grounded.model, grounded.unknowns

    monkeypatch.setattr(search.Search, "from_nothing", nowhere)
    at_once.clear()
    step_by_step = solve(higher, start=grounded)
    assert at_once == [True, False]
    assert step_by_step.converged, step_by_step.why
    np.testing.assert_allclose(step_by_step.CT, found.CT, rtol=1e-6)

    at_once.clear()
    losses = 2
    lost = solve(higher, start=grounded)
    assert (lost.converged, lost.why) == (False, "lost")
    assert float(lost.model.ground.height) == 1.0

    def stalls_there(self, model):
        self.ok, self.why = False, "stalled"
        return model, grounded.unknowns

    monkeypatch.setattr(search.Search, "from_nothing", stalls_there)
    at_once.clear()
    assert solve(higher, start=grounded).why == "stalled"  # at the case itself, which the neighbour's way did not reach


def test_a_wake_at_another_pitch_is_found_from_its_neighbour_in_a_few_iterations(uh60, coarse, hover):
    """Its residual is small from the start, and Newton's method alone does not get there at once: twelve iterations."""
    rotor, operating = uh60
    gentler = eqx.tree_at(lambda o: o.collective, operating, operating.collective - np.deg2rad(2.0))
    found = solve(free_wake(rotor, gentler, None, coarse), start=hover)
    assert found.converged, found.why
    assert found.iterations <= 4
    np.testing.assert_allclose(found.CT, solve(free_wake(rotor, gentler, None, coarse)).CT, rtol=1e-6)
