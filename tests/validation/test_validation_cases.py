"""What the cases read off a wake, and the order in which wakes are solved."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib.figure import Figure

from rotorjax.errors import InputError
from rotorjax.reference.published import Hover, Path, induced_power_factor, knight_hefner
from rotorjax.reference.published import caradonna_tung as caradonna_tung_data
from rotorjax.rotor.catalogue import load
from rotorjax.validation import caradonna_tung, grid, ground, momentum, polars, step
from rotorjax.validation.case import Comparison, Subject, ValidationCase
from rotorjax.validation.cases import CASES, chosen_cases
from rotorjax.validation.measure import disk_inflow, far_pitch, first_harmonic, section_lift, tip_path
from rotorjax.validation.measured_power import measured_power_factor
from rotorjax.validation.point import Point, needed, point, twist_of
from rotorjax.validation.row import Row, between
from rotorjax.validation.run import _compare
from rotorjax.wake.settings import MARCHED


def test_the_tip_vortex_starts_on_the_blade_and_is_the_solutions_own(coarse_hover):
    path = tip_path(coarse_hover)
    assert path.r[0] == pytest.approx(float(coarse_hover.model.settings.release))
    assert path.z[0] == 0
    own = coarse_hover.tip_vortex[0]
    far = np.searchsorted(path.age, coarse_hover.tip_vortex_age[0] - 1e-9)
    np.testing.assert_allclose(path.age[far:], coarse_hover.tip_vortex_age, rtol=1e-12)
    np.testing.assert_allclose(path.r[far:], np.hypot(own[:, 0], own[:, 1]), atol=1e-12)
    np.testing.assert_allclose(path.z[far:], own[:, 2], atol=1e-12)


def test_section_lift_is_the_solutions_loading(coarse_hover):
    r = coarse_hover.r
    chord = 0.1905 / 1.143
    sigma = 2 * chord / np.pi
    lift = section_lift(coarse_hover, r)
    np.testing.assert_allclose(0.5 * sigma * lift * r**2, coarse_hover.dct_dr[0], rtol=0.05, atol=1e-4)


def test_a_wakes_own_lift_asks_for_the_wakes_own_power(coarse_hover):
    solution = coarse_hover
    own = Hover(solution.CT, solution.r, section_lift(solution, solution.r))
    panels = solution.model.settings.panels
    asked = measured_power_factor(solution.model.rotor, solution.model.operating, own, panels)
    assert asked == pytest.approx(induced_power_factor(solution.CT, solution.CP_induced), rel=0.02)


def test_more_lift_at_the_same_pitch_asks_for_less_power():
    measured = caradonna_tung_data()
    factors = [
        measured_power_factor(*load("caradonna_tung"), measured._replace(lift=f * measured.lift)) for f in (1, 1.03)
    ]
    assert factors[0] - factors[1] == pytest.approx(0.046, abs=0.004)


def test_the_measured_rotors_rows(coarse_hover):
    assert coarse_hover.converged
    wakes: dict = dict.fromkeys(caradonna_tung.points(Subject()), coarse_hover)
    found = caradonna_tung.compare(Subject(), wakes)
    assert len(found.rows) == 22
    for row in [
        r for r in found.rows if r.quantity not in ("C_T at 5°", "C_T at 12°")
    ]:  # coarse, so near and not within what is allowed
        assert row.ours == pytest.approx(row.limits.reference, rel=0.4, abs=0.1)
    exact = [replace(row, ours=row.limits.reference) for row in found.rows]
    assert all(row.met for row in exact)
    assert found.rows[0].limits.high == pytest.approx(1.03 * 0.00459)
    assert len(found.draw().axes) == 3


def test_the_first_harmonic_is_the_area_mean_of_the_fields_own(coarse_hover):
    psi, r = np.linspace(0, 2 * np.pi, 8, endpoint=False), coarse_hover.r
    there = replace(coarse_hover, psi=psi)
    field = 3 + 0.2 * np.cos(psi)[:, None] * np.ones_like(r) - 0.5 * np.sin(psi)[:, None] + np.cos(2 * psi)[:, None]
    assert first_harmonic(there, field) == pytest.approx(0.2 - 0.5j)
    edges = np.asarray(coarse_hover.model.edges)
    cuts = np.array([0.3, *edges[(edges > 0.3) & (edges < 0.9)], 0.9])  # each stretch lies in one panel
    middles, lengths = (cuts[1:] + cuts[:-1]) / 2, np.diff(cuts)
    mean = np.average(r[np.searchsorted(edges, middles) - 1], weights=middles * lengths)
    assert first_harmonic(there, np.cos(psi)[:, None] * r) == pytest.approx(mean)


def test_the_grids_wakes_differ_in_one_number_and_each_near_the_ground_has_one_to_start_from():
    pairs, tasks = grid.pairs(Subject()), grid.points(Subject())
    assert {finer.changes[0][0] for _, finer in pairs} == {"panels", "age_step_deg", "free_turns"}
    for base, finer in pairs:
        assert not base.changes
        assert replace(finer, changes=()) == base
    assert {base.slope_deg for base, _ in pairs} == {0.0, 10.0, 20.0, 30.0}
    for task in tasks:
        near = needed(task, tasks)
        if task.changes and task.changes[0][0] == "free_turns" and not task.slope_deg:
            assert near == replace(task, changes=())
        else:
            assert (near is None) == (task.height is None)


def test_a_wake_that_fails_takes_out_the_rows_that_are_read_from_it(coarse_hover):
    """And of a case that does not say which, all."""
    lost, free = point("uh60", 18.0, 0.5, free_turns=4.0), point("uh60")
    wakes = {at: replace(coarse_hover, converged=at != lost) for at in (free, lost)}
    rows = [Row("some", name, 1.0, between(0, 2), grid.COARSE, wakes=of) for name, of in READ_FROM.items()]
    some = ValidationCase("some", "Some", lambda s: (free, lost), lambda s, w: Comparison(rows, Figure))
    met = {row.quantity: row.met for row in _compare(some, Subject(), wakes).rows}
    assert met == {"free alone": True, "both": False, "of the case": False}


def test_a_wake_that_fails_has_no_bar(coarse_hover):
    subject = Subject()
    lost = point("uh60", None, 0.5, free_turns=grid.refined(False)["free_turns"])
    tasks = grid.points(subject)
    assert lost in tasks
    figure = grid.draw(subject, {at: replace(coarse_hover, converged=at != lost) for at in tasks})
    axes = figure.axes[0]
    names = [label.get_text() for label in axes.get_xticklabels()]
    at = next(k for k, (_, finer) in enumerate(grid.pairs(subject)) if finer == lost)
    assert [k for k, name in enumerate(names) if name.endswith("not converged")] == [at]
    for bars in axes.containers:
        missing = [k for k, bar in enumerate(bars) if np.isnan(bar.get_height())]
        assert missing == [at]


READ_FROM = {
    "free alone": ("uh60 18°, OGE",),
    "both": ("uh60 18°, OGE", "uh60 18°, h = 0.5, free_turns 4"),
    "of the case": (),
}


def test_a_harmonics_change_counts_phase_and_size(coarse_hover):
    psi = np.linspace(0, 2 * np.pi, 8, endpoint=False)
    there = [
        replace(coarse_hover, psi=psi, inflow=np.outer(f(psi), np.ones_like(coarse_hover.r))) for f in (np.cos, np.sin)
    ]
    larger = replace(there[0], inflow=1.1 * there[0].inflow)
    assert grid.harmonic_change(there[0], larger, grid.FIRST["inflow"]) == pytest.approx(0.1)
    assert grid.harmonic_change(there[0], there[1], grid.FIRST["inflow"]) == pytest.approx(np.sqrt(2))


def test_the_isolated_rotors_curve_judges_a_model_rotor_and_hayden_joins_in_for_a_helicopters():
    model, flown = point("knight_hefner_2", 8.0, 0.5), point("uh60", 18.0, 0.5)
    for at, low, high in ((model, 0.68, 0.76), (flown, 0.5853, 0.76)):
        limits = ground._limits(at)
        assert limits is not None
        assert (limits.low, limits.high) == pytest.approx((low, high), abs=1e-3)
    assert ground._limits(point("uh60", 18.0, 3.0)) is None


def test_the_polars_rows_are_met_by_the_measurement_itself():
    polar = knight_hefner(2)
    wakes = {}
    for at in polars.points(Subject()):
        own = knight_hefner(2 if at.rotor.endswith("2") else 4)
        thrust, torque = (float(np.interp(at.collective_deg, own.pitch_deg, v)) for v in own[1:])
        profile = 0.4 * torque
        wakes[at] = SimpleNamespace(CT=thrust, CP=torque, CP_profile=profile, CP_induced=torque - profile)
    found = polars.compare(Subject(), wakes).rows
    assert len(found) == 32
    assert [row.quantity for row in found if not row.met] == []
    wakes[point("knight_hefner_2", 8.0)].CT = 1.06 * polar.thrust[list(polar.pitch_deg).index(8)]
    assert not polars.compare(Subject(), wakes).rows[8].met


def test_a_straight_path_has_its_pitch():
    age = np.linspace(0, 12, 200)
    assert far_pitch(Path(age, np.ones(200), np.where(age < np.pi, 0, -0.07 * (age - np.pi))), 2) == pytest.approx(
        -0.07
    )


def test_no_ground_is_infinitely_far(coarse_hover):
    assert coarse_hover.clearance == np.inf
    alone = coarse_hover, replace(coarse_hover, CT=1.3 * coarse_hover.CT)
    assert ground.inflow_ratio(coarse_hover, alone) == 1
    assert ground.power_ratio(coarse_hover, alone) == 1


def test_the_power_ratio_is_that_at_constant_thrust(coarse_hover):
    """What it takes out of ground effect at the thrust near the ground is read off two collectives."""

    def wake(thrust, power):  # over those of the coarse hover
        return replace(
            coarse_hover, CT=thrust * coarse_hover.CT, CP_induced=power * thrust**1.5 * coarse_hover.CP_induced
        )

    alone = wake(1, 1), wake(1.5, 1.04)
    assert ground.power_ratio(wake(1.25, 0.8), alone) == pytest.approx(0.8 / 1.02)
    assert ground.power_ratio(wake(1.75, 0.8), alone) == pytest.approx(0.8 / 1.06)


def test_inflow_over_the_disk_is_less_than_at_the_blades_and_has_converged_in_azimuth(coarse_hover):
    disk = disk_inflow(coarse_hover)
    assert disk == pytest.approx(disk_inflow(coarse_hover, 24), rel=0.01)
    assert 0.7 * coarse_hover.mean_inflow < disk < coarse_hover.mean_inflow


def test_twist_is_a_line_through_the_table():
    assert twist_of("caradonna_tung") == pytest.approx(0, abs=1e-9)
    assert -20 < twist_of("uh60") < -12


def test_time_to_63_percent_is_found_between_samples():
    psi = np.linspace(0, 6, 61)
    assert step.first_time(psi, 1 - np.exp(-psi / 1.5)) == pytest.approx(1.5 / (2 * np.pi), rel=1e-3)
    assert np.isnan(step.first_time(psi, np.zeros(61)))
    assert np.isnan(step.first_time(psi, np.full(61, np.nan)))


def test_more_turns_and_slopes_take_longer():
    level, slope = point("uh60", 18.0, 1.0), Point("uh60", 18.0, 1.0, slope_deg=20.0)
    assert level.length == 1 < slope.length
    assert point("uh60", 18.0, 1.0, free_turns=8.0).length == 4
    assert point("uh60", 18.0, 1.0, **MARCHED).length < 1


def test_wakes_start_from_their_neighbours():
    free, high, low = (point("uh60", 18.0, h) for h in (None, 2.0, 1.0))
    other, finer = point("uh60", 16.0), point("uh60", 18.0, panels=28)
    tasks = [free, other, finer, high, low]
    assert [needed(task, tasks) for task in tasks] == [None, free, None, free, high]
    gentle, steep = (replace(low, slope_deg=s) for s in (10.0, 20.0))
    tasks = [free, high, low, gentle, steep, replace(low, height=0.75)]
    assert [needed(task, tasks) for task in tasks] == [None, free, high, low, gentle, low]
    assert point("uh60") == free
    longer = replace(low, changes=(("free_turns", 8.0),))
    tasks = [high, replace(longer, height=2.0), low, longer, replace(longer, height=0.75)]
    assert [needed(task, tasks) for task in tasks] == [None, high, high, low, longer]
    gentle = replace(low, slope_deg=10.0)
    tasks = [low, longer, gentle, replace(longer, slope_deg=10.0)]
    assert [needed(task, tasks) for task in tasks] == [None, low, low, longer]


def test_cases_that_suit_the_subject():
    assert [*(c.name for c in chosen_cases(None, Subject())), "coaxial"] == list(CASES)
    assert "caradonna-tung" not in [c.name for c in chosen_cases(None, Subject("uh60", 15.0))]
    assert [c.name for c in chosen_cases(None, Subject(quick=True))] == ["caradonna-tung", "momentum", "ground"]
    assert [c.name for c in chosen_cases(["ground", "momentum"], Subject())] == ["momentum", "ground"]
    assert momentum.points(Subject("elliott_althoff", 9.0)) == (point("elliott_althoff", 9.0),)
    for names, subject, match in (
        (["grond"], Subject(), "did you mean 'ground'"),
        (None, Subject(None, 8.0), "must come with a rotor"),
        (["caradonna-tung"], Subject("uh60"), "rotor of one's own"),
    ):
        with pytest.raises(InputError, match=match):
            chosen_cases(names, subject)
