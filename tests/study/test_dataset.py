"""The merged data set: labelled, complete, and the differences are the ones defined."""

import numpy as np
import pytest

from rotorjax.bench.cases import Case
from rotorjax.bench.dataset import TERMS, _turned, combine, select
from rotorjax.bench.record import rms_difference, summary_entry


def test_every_array_is_labelled(merged):
    for name, variable in merged.data_vars.items():
        assert "long_name" in variable.attrs, name
        if variable.dtype.kind == "f":
            assert "units" in variable.attrs, name
    assert set(merged.sizes) >= {"case", "azimuth", "radius", "grid_azimuth", "grid_radius", "mode", "age", "terms"}


def test_reference_is_the_free_wakes_mean_out_of_ground_effect(merged):
    assert float(merged["reference_inflow"]) == float(merged["free_wake_mean_inflow"].sel(case="oge"))


def test_difference_by_an_independent_sum(merged):
    data = select(merged, Case(1.0, 30.0))
    assert data is not None
    total = weight = 0.0
    outer = 1.0
    for i in range(data.sizes["radius"] - 1, -1, -1):  # from the tip, where the outermost panel ends
        inner = outer - float(data["panel_width"][i])
        area = max(min(outer, 0.95) ** 2 - max(inner, 0.25) ** 2, 0.0)
        for k in range(data.sizes["azimuth"]):
            gap = float(data["vpbfsm_inflow"][k, i] - data["free_wake_inflow"][k, i]) / float(
                merged["reference_inflow"]
            )
            total, weight = total + area * gap**2, weight + area
        outer = inner
    assert float(data["vpbfsm_inflow_rms_difference"]) == pytest.approx(np.sqrt(total / weight), rel=1e-12)


def test_rms_difference_of_a_constant_gap_is_the_gap():
    field = np.random.default_rng(1).normal(size=(5, 30))
    assert rms_difference(field + 0.3, field, np.full(30, 0.03)) == pytest.approx(0.3)
    assert np.isnan(rms_difference(field, field, np.full(30, 0.03), (2.0, 3.0)))


def test_axisymmetric_cases_are_repeated_and_their_vortices_turned(merged):
    level = merged.sel(case="h1")
    count = merged.sizes["azimuth"]
    assert count > 1
    np.testing.assert_array_equal(level["free_wake_inflow"], np.tile(level["free_wake_inflow"][0], (count, 1)))
    np.testing.assert_allclose(level["tip_vortex"][count // 4, 0, :2], [0.0, 1.0], atol=1e-12)
    turned = _turned(np.array([[1.0, 0.0, -0.2]]), np.array([0.0, np.pi / 2]))
    np.testing.assert_allclose(turned[1], [[0.0, 1.0, -0.2]], atol=1e-15)


def test_three_terms_of_the_terms_study_are_the_case_itself(merged):
    by_terms = merged["vpbfsm_inflow_by_terms"].sel(terms=3)
    np.testing.assert_allclose(by_terms, merged["vpbfsm_inflow_grid"].sel(case="oge")[0], atol=1e-12)
    assert tuple(merged["terms"].to_numpy()) == TERMS


def test_summary_entries_have_the_agreed_keys(studied):
    for data in studied[0].cases:
        entry = summary_entry(data, 0.05)
        assert list(entry) == [
            "height",
            "slope_deg",
            "free_wake",
            "vpbfsm",
            "finite_state",
            "inflow_rms_difference",
            "wall_time_s",
            "compile_time_s",
        ]
        wake = ["CT", "CP_induced", "mean_inflow", "residual", "converged", "ground_normal_velocity_rms"]
        assert list(entry["free_wake"]) == [*wake, "CP", "CP_profile", "lost_at"]
        assert entry["free_wake"]["CP"] == pytest.approx(
            entry["free_wake"]["CP_induced"] + entry["free_wake"]["CP_profile"]
        )
        assert list(entry["vpbfsm"]) == ["mean_inflow", "ground_normal_velocity_rms"]


def test_cases_have_height_and_slope_along_them(merged):
    grounded = merged.where(merged["height"] == 1.0, drop=True)
    assert set(grounded["slope_deg"].to_numpy()) == {0.0, 5.0, 8.0, 10.0, 15.0, 30.0, 40.0}
    assert {"height", "slope_deg"} <= set(merged.coords)
    assert str(merged["mode"].to_numpy()[0]) == "m = 0, n = 1, cos"
    assert merged.attrs["rotor"] == "UH-60A"


def test_without_the_case_out_of_ground_effect_there_is_no_difference(studied, settings):
    alone = combine(studied[0].cases[1:3], settings)
    assert np.isnan(float(alone["reference_inflow"]))
    assert np.all(np.isnan(alone["vpbfsm_inflow_rms_difference"]))
