"""Finished cases are kept, a second run continues, a stranger's folder is refused, a diverged case ends nothing."""

import equinox as eqx
import numpy as np
import pytest
from wakes import fails_at, made_up

from rotorjax.bench import wake_file
from rotorjax.bench.cases import Case, study_cases
from rotorjax.bench.dataset import combine
from rotorjax.bench.record import add_finite_state, summary_entry
from rotorjax.bench.settings import study_settings
from rotorjax.bench.single_output import table, title_of
from rotorjax.errors import InputError
from rotorjax.io import netcdf
from rotorjax.study.figures import draw_all
from rotorjax.study.report import report
from rotorjax.study.run import solve_case, solve_cases
from rotorjax.wake.search import with_washout

CASES = study_cases([1.0, 2.0], [15.0])


class Counting:
    def __init__(self, stop_after=99):
        self.calls, self.stop_after = [], stop_after

    def __call__(self, model, start, progress):
        if len(self.calls) == self.stop_after:
            raise KeyboardInterrupt
        self.calls.append((model, start))
        return made_up(model, start, progress)


def test_an_interrupted_study_continues(tmp_path, settings):
    with pytest.raises(KeyboardInterrupt):
        solve_cases(CASES, settings, tmp_path, show=False, solver=Counting(stop_after=2), workers=1)
    kept = sorted(p.name for p in (tmp_path / "cases").iterdir())
    assert kept == ["h2.nc", "oge.nc"]
    again = Counting()
    result = solve_cases(CASES, settings, tmp_path, show=False, solver=again, workers=1)
    assert len(again.calls) == 2
    assert [d.attrs["case"] for d in result.cases] == ["oge", "h2", "h1", "h1-slope15"]
    whole = solve_cases(CASES, settings, tmp_path / "whole", show=False, solver=made_up)
    for ours, theirs in zip(result.cases, whole.cases, strict=True):
        np.testing.assert_array_equal(ours["vpbfsm_inflow"], theirs["vpbfsm_inflow"])


def test_each_case_gets_its_neighbours_solution(tmp_path, settings):
    solver = Counting()
    solve_cases(CASES, settings, tmp_path, show=False, solver=solver, workers=1)
    starts = [None if start is None else start.model.ground for _, start in solver.calls]
    assert starts[:2] == [None, None]
    assert [float(ground.height) for ground in starts[2:]] == [2.0, 1.0]


def test_a_solution_survives_its_file(tmp_path, settings):
    climbing = study_settings(climb_ratio=0.02)
    before = made_up(wake_file.model_of(Case(), climbing))
    netcdf.write(tmp_path / "a.nc", wake_file.to_dataset(Case(), before, climbing))
    kept = netcdf.read(tmp_path / "a.nc")
    np.testing.assert_allclose(kept["free_wake_inflow"], before.inflow - 0.02, atol=1e-15)  # what is kept is induced
    after = wake_file.to_solution(kept, climbing)
    for name in ("dct_dr", "inflow", "tip_vortex", "CT", "mean_inflow", "converged", "iterations"):
        np.testing.assert_allclose(getattr(after, name), getattr(before, name), atol=1e-15)
    for name in ("near", "far", "gamma_near", "gamma_far", "gamma_bound"):
        np.testing.assert_array_equal(getattr(after.state, name), getattr(before.state, name))


def test_another_studys_folder_is_refused(tmp_path, settings):
    solve_cases([Case()], settings, tmp_path, show=False, solver=made_up)
    other = study_settings(collective_deg=17.0)
    with pytest.raises(InputError, match=r"collective_deg 18.0 instead of 17.0") as caught:
        solve_cases([Case()], other, tmp_path, show=False, solver=made_up)
    assert "\n" not in str(caught.value)


def test_a_diverged_case_is_kept_and_reported_and_nothing_starts_from_it(tmp_path, settings):
    solver = Counting()

    def failing(model, start, progress):
        solver(model, start, progress)
        return fails_at((1.0, 0.0))(model, start, progress)

    result = solve_cases(CASES, settings, tmp_path, show=False, solver=failing, workers=1)
    assert result.diverged == ("h = 1",)
    kept = netcdf.read(tmp_path / "cases" / "h1.nc")
    assert not bool(kept["converged"])
    assert kept.attrs["why"] == "made up to fail"
    assert "wake_state_near" in kept
    sloped_start = solver.calls[-1][1]
    assert float(sloped_start.model.ground.height) == 2.0


def test_a_wake_that_is_not_finite_leaves_the_other_model_out(settings):
    def broken(model, start, progress):
        solution = made_up(model, start, progress, converged=False)
        solution.dct_dr[:] = np.nan
        return solution

    data = solve_case(Case(1.0), settings, {}, solver=broken)
    assert "vpbfsm_inflow" not in data
    assert not wake_file.is_sound(data)


def flipped(content, seed):
    at = np.random.default_rng(seed).integers(len(content))
    return content[:at] + bytes([content[at] ^ 8]) + content[at + 1 :]


DAMAGE = {
    "flipped": lambda kept: kept.write_bytes(flipped(kept.read_bytes(), 3)),
    "truncated": lambda kept: kept.write_bytes(kept.read_bytes()[:5000]),
    "empty": lambda kept: kept.write_bytes(b""),
    "garbled": lambda kept: kept.write_bytes(b"garbled"),
    "another case's": lambda kept: kept.write_bytes((kept.parent / "oge.nc").read_bytes()),
}


@pytest.mark.parametrize("what", DAMAGE)
def test_a_damaged_case_is_set_aside_and_solved_again(tmp_path, settings, capsys, what):
    cases = [Case(), Case(2.0)]
    before = solve_cases(cases, settings, tmp_path, show=False, solver=made_up).cases[1]
    kept = tmp_path / "cases" / "h2.nc"
    DAMAGE[what](kept)
    damaged, solver = kept.read_bytes(), Counting()
    after = solve_cases(cases, settings, tmp_path, show=False, solver=solver).cases[1]
    assert len(solver.calls) == 1
    np.testing.assert_array_equal(after["vpbfsm_inflow"], before["vpbfsm_inflow"])
    assert (tmp_path / "cases" / "h2.nc.damaged").read_bytes() == damaged
    told = capsys.readouterr().err
    assert "h2.nc is " in told
    assert "renamed to h2.nc.damaged, the case is solved again" in told
    solve_cases(cases, settings, tmp_path, show=False, solver=made_up)
    assert "renamed" not in capsys.readouterr().err


def test_heights_that_differ_in_the_seventh_digit_are_two_cases(tmp_path, settings):
    cases = study_cases([1.0, 1.0000001], [])
    result = solve_cases(cases, settings, tmp_path, show=False, solver=made_up)
    assert sorted(p.name for p in (tmp_path / "cases").iterdir()) == ["h1.0000001.nc", "h1.nc", "oge.nc"]
    assert len({c.label for c in cases}) == len({float(d["height"]) for d in result.cases}) == 3


def lost_on_the_way(model, start=None, progress=None):
    """A wake of half the slope under the name of the whole."""
    if model.ground is None or float(model.ground.slope) == 0:
        return made_up(model, start, progress)
    half = eqx.tree_at(lambda m: m.ground.slope, model, 0.5 * model.ground.slope)
    return made_up(half, start, progress, converged=False)


def test_a_wake_that_was_lost_on_the_way_is_not_shown_as_the_case(tmp_path, settings):
    result = solve_cases(study_cases([1.0], [15.0]), settings, tmp_path, show=False, solver=lost_on_the_way)
    lost = result.cases[-1]
    assert result.diverged == ("h = 1, δ = 15°",)
    assert wake_file.lost_at(lost) == "h = 1, δ = 7.5°"
    assert wake_file.lost_at(result.cases[1]) is None
    assert "vpbfsm_inflow" not in lost  # the loads belong to another ground
    entry = summary_entry(lost, 0.05)
    assert entry["free_wake"]["lost_at"] == "h = 1, δ = 7.5°"
    merged = combine(result.cases, settings)
    drawn, missing = draw_all(merged, tmp_path, ("png",))
    assert {"fig11", "fig12"} <= set(missing)
    assert "(**lost at h = 1, δ = 7.5°**, whose numbers these are)" in report(merged, drawn, missing, {}, 1.0)
    title = title_of(lost)
    assert title.startswith("h = 1, δ = 7.5° (NOT the case")
    assert title in table(lost, settings, None)


def test_a_wake_left_in_the_auxiliary_flow_says_so(settings):
    washed = with_washout(wake_file.model_of(Case(), settings), 0.04)
    data = wake_file.to_dataset(Case(), made_up(washed, converged=False), settings)
    assert wake_file.lost_at(data) == "in an auxiliary flow of 0.04 ΩR"
    assert "vpbfsm_inflow" not in add_finite_state(data, settings)
