"""Finished cases are kept, a second run continues, a stranger's folder is refused, a diverged case ends nothing."""

import numpy as np
import pytest
from wakes import fails_at, made_up

from rotorjax.bench import wake_file
from rotorjax.bench.cases import Case, study_cases
from rotorjax.bench.settings import study_settings
from rotorjax.errors import InputError
from rotorjax.io import netcdf
from rotorjax.study.run import solve_case, solve_cases

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
