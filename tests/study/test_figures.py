"""Every figure of the paper with a result is drawn from a full study, and none from a study that lacks its cases."""

import numpy as np
import pytest

from rotorjax.bench.azimuth import refine_azimuth
from rotorjax.bench.cases import Case
from rotorjax.bench.dataset import select
from rotorjax.bench.plotting import across, shared_levels
from rotorjax.study.figures import FIGURES, across_disk

PAPER = ["06", "07", "08a", "08b", "09", "10a", "10b", "11", "12", "13", "14a", "14b", "15", "16a", "16b"]


def test_all_figures_are_written(written):
    for number in PAPER:
        assert (written / f"fig{number}.png").read_bytes().startswith(b"\x89PNG")
        assert (written / f"fig{number}.pdf").read_bytes().startswith(b"%PDF")
    assert not [p.name for p in written.iterdir() if p.name.startswith(".")]


def test_figures_without_their_cases_are_left_out(merged):
    few = merged.sel(case=["oge", "h2"])
    drawn = {name for name, draw in FIGURES.items() if draw(few) is not None}
    assert drawn == {"fig06", "fig07", "fig08a", "fig08b", "fig10a", "fig10b"}


@pytest.mark.parametrize("name", ["fig06", "fig10a", "fig14b", "fig13"])
def test_axes_are_labelled(merged, name):
    figure = FIGURES[name](merged)
    assert figure is not None
    labels = [text for axes in figure.axes for text in (axes.get_xlabel(), axes.get_ylabel()) if text]
    assert labels


def test_contours_are_seen_from_above_with_the_mountain_at_the_right(merged):
    figure = FIGURES["fig11"](merged)
    assert figure is not None
    polar = next(axes for axes in figure.axes if axes.name == "polar")
    assert polar.get_theta_offset() == 0.0
    assert polar.get_theta_direction() == 1  # counter-clockwise, as the rotor turns
    assert polar.get_xlabel() == "seen from above"


def test_curves_run_from_valley_to_mountain(merged):
    data = select(merged, Case(1.0, 30.0))
    assert data is not None
    for model in ("free_wake", "printed", "exact_image"):  # of the default's tilt the made-up loads leave nothing
        x, values = across_disk(data, model, 1.0)
        assert np.all(np.diff(x[np.isfinite(x)]) >= 0)
        assert np.nanmean(values[x < -0.3]) > np.nanmean(values[x > 0.3])  # less inflow where the ground is nearer


def test_curves_break_at_the_root_cut_out():
    x, values = across(np.array([0.2, 1.0]), np.array([1.0, 2.0]), np.array([3.0, 4.0]))
    np.testing.assert_array_equal(x, [-1.0, -0.2, np.nan, 0.2, 1.0])
    np.testing.assert_array_equal(values, [4.0, 3.0, np.nan, 1.0, 2.0])


@pytest.mark.parametrize("count", [8, 12, 9])
def test_few_azimuths_are_refined_exactly(count):
    psi = 2 * np.pi / count * np.arange(count)
    fine, values = refine_azimuth(psi, (1 + np.cos(psi) - 0.3 * np.sin(3 * psi))[:, None])
    np.testing.assert_allclose(values[:, 0], 1 + np.cos(fine) - 0.3 * np.sin(3 * fine), atol=1e-12)


def test_levels_span_all_fields():
    levels = shared_levels([np.array([0.0, 1.0]), np.array([3.0])])
    assert levels[0] <= 0
    assert levels[-1] >= 3
    assert len(shared_levels([np.zeros(3)])) > 1


def test_cases_that_did_not_converge_are_marked(merged):
    lost = merged.assign(converged=merged["converged"] * (merged["case"] != "h2"))
    figure = FIGURES["fig10a"](lost)
    assert figure is not None
    labels = [text.get_text() for text in figure.axes[0].get_legend().get_texts()]
    assert [label for label in labels if "not converged" in label] == ["h = 2 (not converged)"]
