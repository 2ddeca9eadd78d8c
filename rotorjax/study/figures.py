"""The paper's figures with a result (6 to 16), each a function of the merged data set."""

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from rotorjax.bench.azimuth import valley_side
from rotorjax.bench.cases import SLOPE_HEIGHT, STEEP_DEG, Case
from rotorjax.bench.dataset import present, select
from rotorjax.bench.plotting import (
    FREE_WAKE,
    INK,
    MODEL_STYLE,
    VPBFSM,
    across,
    diameter_axes,
    legend_below,
    new_figure,
    polar_contour,
    save,
    series_colours,
    shared_levels,
    style,
)

LOADING = r"$\mathrm{d}C_T/\mathrm{d}\bar{r}$"
INFLOW = "inflow / mean OGE inflow of the free wake"
Draw = Callable[[xr.Dataset], Figure | None]


def draw_all(
    merged: xr.Dataset, folder: str | Path, formats: Sequence[str] = ("png", "pdf")
) -> tuple[list[str], list[str]]:
    """Write every figure whose cases are there; return the names drawn and those left out.

    Raises InputError where the folder cannot be written.
    """
    drawn, missing = [], []
    for name, draw in FIGURES.items():
        with style():
            figure = draw(merged)
        if figure is not None:
            save(figure, Path(folder) / name, formats)
        (missing if figure is None else drawn).append(name)
    return drawn, missing


def profile(data: xr.Dataset, model: str, reference: float) -> tuple[np.ndarray, np.ndarray]:
    """Radii and normalised inflow (K, R) of a model at equally spaced azimuths; VPBFSM on the fine grid."""
    radius, inflow = {
        "free_wake": ("radius", "free_wake_inflow"),
        "vpbfsm": ("grid_radius", "vpbfsm_inflow_grid"),
        "printed": ("grid_radius", "printed_inflow_diameter"),
        "exact_image": ("grid_radius", "exact_image_inflow_diameter"),
    }[model]
    return data[radius].to_numpy(), data[inflow].to_numpy() / reference


def across_disk(data: xr.Dataset, model: str, reference: float) -> tuple[np.ndarray, np.ndarray]:
    """Normalised inflow of a model from the valley's tip over the hub to the mountain's."""
    r, inflow = profile(data, model, reference)
    return across(r, inflow[0], valley_side(inflow))


def loading_by_height(merged: xr.Dataset) -> Figure | None:
    """Fig. 6: the free wake's loading out of ground effect and over level ground."""
    cases = [Case(), *_level(merged)]
    if len(_with_data(merged, cases)) < 2:
        return None
    figure = new_figure()
    axes = figure.add_subplot()
    for data, case, colour in _coloured(merged, cases):
        axes.plot(data["radius"], data["free_wake_dct_dr"][0], color=colour, marker="o", label=named(data, case))
    axes.set(xlabel=r"$r/R$", ylabel=LOADING, xlim=(0, 1), title="Free wake: loading over height")
    axes.legend()
    return figure


def loading_out_of_ground(merged: xr.Dataset) -> Figure | None:
    """Fig. 7: loading out of ground effect, the free wake's and that of the pressure terms."""
    data = select(merged, Case())
    if data is None:
        return None
    figure = new_figure()
    axes = figure.add_subplot()
    axes.plot(data["radius"], data["free_wake_dct_dr"][0], color=FREE_WAKE, marker="o", label="free wake")
    label = "VPBFSM, three pressure terms" if data.sizes["mode"] else "VPBFSM"
    axes.plot(data["grid_radius"], data["vpbfsm_dct_dr_grid"][0], color=VPBFSM, linestyle="--", label=label)
    axes.set(xlabel=r"$r/R$", ylabel=LOADING, xlim=(0, 1), title="Loading out of ground effect")
    axes.legend()
    return figure


def inflow_by_terms(merged: xr.Dataset) -> Figure | None:
    """Fig. 8a: inflow out of ground effect for several numbers of pressure terms."""
    data = select(merged, Case())
    if data is None or "vpbfsm_inflow_by_terms" not in merged:
        return None
    reference = float(merged["reference_inflow"])
    figure = new_figure()
    axes = figure.add_subplot()
    r, inflow = profile(data, "free_wake", reference)
    axes.plot(r, inflow[0], color=INK, marker="o", label="free wake")
    terms = merged["terms"].to_numpy()
    for i, colour in enumerate(series_colours(len(terms))):
        curve = merged["vpbfsm_inflow_by_terms"][i] / reference
        label = f"VPBFSM, {terms[i]} term" + ("s" if terms[i] > 1 else "")
        axes.plot(merged["grid_radius"], curve, color=colour, linestyle="--", label=label)
    axes.set(xlabel=r"$r/R$", ylabel=INFLOW, xlim=(0, 1), title="Out of ground effect: number of pressure terms")
    axes.legend()
    return figure


def inflow_of(case: Case, title: str) -> Draw:
    """Figs. 8b, 9, 12: inflow of all models across the disk for one case."""

    def draw(merged: xr.Dataset) -> Figure | None:
        data = select(merged, case)
        if data is None:
            return None
        figure = new_figure()
        axes = figure.add_subplot()
        for model in ("free_wake", "vpbfsm", "printed") + (("exact_image",) if case.height is not None else ()):
            look = dict(MODEL_STYLE[model])
            if case.height is None and model == "vpbfsm":
                look["label"] = "VPBFSM, three pressure terms"
            axes.plot(*across_disk(data, model, float(merged["reference_inflow"])), **look)
        diameter_axes(axes, INFLOW, sides=case.slope_deg > 0)
        warning = "" if bool(data["converged"]) else " (not converged)"
        axes.set_title(title + warning, pad=18 if case.slope_deg else 6)
        legend_below(axes, 3)
        return figure

    return draw


def inflow_series(model: str, pick: Callable[[xr.Dataset], Sequence[Case]], title: str) -> Draw:
    """Figs. 10, 14, 16: inflow of one model across the disk for a series of cases."""

    def draw(merged: xr.Dataset) -> Figure | None:
        cases = pick(merged)
        if len(_with_data(merged, cases)) < 2:
            return None
        figure = new_figure()
        axes = figure.add_subplot()
        plot_series(axes, merged, model, cases)
        sloped = any(case.slope_deg for case in cases)
        diameter_axes(axes, INFLOW, sides=sloped)
        axes.set_title(title, pad=18 if sloped else 6)
        legend_below(axes, 3 if sloped else 4)
        return figure

    return draw


def plot_series(axes: Axes, merged: xr.Dataset, model: str, cases: Sequence[Case]) -> None:
    """Draw one model's inflow across the disk for each case."""
    marker = "o" if model == "free_wake" else None
    for data, case, colour in _coloured(merged, cases):
        line = across_disk(data, model, float(merged["reference_inflow"]))
        axes.plot(*line, color=colour, marker=marker, label=named(data, case))


def loading_contours(pick: Callable[[xr.Dataset], Sequence[Case]], title: str) -> Draw:
    """Figs. 11, 13, 15: the free wake's loading over the disk, one colour scale for all."""

    def draw(merged: xr.Dataset) -> Figure | None:
        cases = _with_data(merged, pick(merged))
        return contours(merged, cases, title) if cases else None

    return draw


def contours(merged: xr.Dataset, cases: Sequence[Case], title: str) -> Figure:
    """Polar contours of the free wake's loading, up to three in a row."""
    columns = min(len(cases), 3)
    rows = -(-len(cases) // columns)
    figure = new_figure(1.2 + 3.3 * columns, 0.7 + 3.3 * rows)
    fields = [merged.sel(case=case.name)["free_wake_dct_dr"].to_numpy() for case in cases]
    levels = shared_levels(fields)
    filled, drawn = None, []
    for i, (case, field) in enumerate(zip(cases, fields, strict=True)):
        axes = figure.add_subplot(rows, columns, i + 1, projection="polar")
        filled = polar_contour(axes, merged["radius"].to_numpy(), merged["azimuth"].to_numpy(), field, levels)
        axes.set_title(named(merged.sel(case=case.name), case), pad=10)
        drawn.append(axes)
    figure.colorbar(filled, ax=drawn, label=LOADING, shrink=0.8, pad=0.06)  # type: ignore[arg-type]
    figure.suptitle(title)
    return figure


def overview(merged: xr.Dataset) -> Figure | None:
    """The study at a glance: both models' inflow over height and on a slope, and the loading there."""
    level = [case for case in (Case(), Case(2.0), Case(1.0), Case(0.5)) if select(merged, case) is not None]
    sloped = Case(1.0, 15.0)
    if len(level) < 2 or select(merged, sloped) is None:
        return None
    figure = new_figure(12.5, 4.4)
    grid = figure.add_gridspec(1, 3, width_ratios=[1, 1, 0.85])
    _overview_level(figure.add_subplot(grid[0]), merged, level)
    axes = figure.add_subplot(grid[1])
    for model, look in MODEL_STYLE.items():
        axes.plot(*across_disk(merged.sel(case=sloped.name), model, float(merged["reference_inflow"])), **look)
    diameter_axes(axes, "", sides=True)
    axes.set_title(named(merged.sel(case=sloped.name), sloped), pad=18)
    legend_below(axes, 2)
    axes = figure.add_subplot(grid[2], projection="polar")
    field = merged.sel(case=sloped.name)["free_wake_dct_dr"].to_numpy()
    radius, azimuth = merged["radius"].to_numpy(), merged["azimuth"].to_numpy()
    filled = polar_contour(axes, radius, azimuth, field, shared_levels([field]))
    axes.set_title(f"{sloped.label}: free wake's loading", pad=24)
    figure.colorbar(filled, ax=axes, label=LOADING, shrink=0.75, pad=0.12)
    return figure


def _overview_level(axes: Axes, merged: xr.Dataset, cases: Sequence[Case]) -> None:
    """Free wake (points and lines) and VPBFSM (dashes) over height."""
    reference = float(merged["reference_inflow"])
    for data, case, colour in _coloured(merged, cases):
        axes.plot(*across_disk(data, "free_wake", reference), color=colour, marker="o", label=named(data, case))
        axes.plot(*across_disk(data, "vpbfsm", reference), color=colour, linestyle="--")
    diameter_axes(axes, INFLOW)
    axes.set_title("Level ground: free wake (points), VPBFSM (dashes)", pad=18)
    legend_below(axes, 4)


def _level(merged: xr.Dataset) -> list[Case]:
    return sorted((c for c in present(merged) if c.height and not c.slope_deg), key=lambda c: -(c.height or 0))


def _slopes(merged: xr.Dataset) -> list[Case]:
    return sorted((c for c in present(merged) if c.slope_deg and c.height == SLOPE_HEIGHT), key=lambda c: c.slope_deg)


def _steep(merged: xr.Dataset) -> list[Case]:
    return sorted((c for c in present(merged) if c.slope_deg == STEEP_DEG), key=lambda c: c.height or 0)


def named(data: xr.Dataset, case: Case) -> str:
    """Label of a case, with a warning where its wake did not converge: it is drawn as it was left."""
    return case.label + ("" if bool(data["converged"]) else " (not converged)")


def _with_data(merged: xr.Dataset, cases: Sequence[Case]) -> list[Case]:
    return [case for case in cases if select(merged, case) is not None]


def _coloured(merged: xr.Dataset, cases: Sequence[Case]) -> list[tuple[xr.Dataset, Case, object]]:
    """The cases that are there with a colour each; black out of ground effect."""
    cases = _with_data(merged, cases)
    grounded = [case for case in cases if case.height is not None]
    colours = dict(zip(grounded, series_colours(len(grounded))[::-1], strict=True))
    return [(merged.sel(case=case.name), case, colours.get(case, INK)) for case in cases]


def _other_slopes(merged: xr.Dataset) -> list[Case]:
    return [case for case in _slopes(merged) if case.slope_deg != 15]


def _steep_other_heights(merged: xr.Dataset) -> list[Case]:
    return [case for case in _steep(merged) if case.height != SLOPE_HEIGHT]


FIGURES: dict[str, Draw] = {
    "fig06": loading_by_height,
    "fig07": loading_out_of_ground,
    "fig08a": inflow_by_terms,
    "fig08b": inflow_of(Case(), "Out of ground effect"),
    "fig09": inflow_of(Case(1.0), "Level ground, h = 1"),
    "fig10a": inflow_series("free_wake", lambda m: [Case(), *_level(m)], "Free wake over height"),
    "fig10b": inflow_series("vpbfsm", lambda m: [Case(), *_level(m)], "VPBFSM over height"),
    "fig11": loading_contours(lambda m: [Case(1.0, 15.0)], "Free wake: loading over the disk"),
    "fig12": inflow_of(Case(1.0, 15.0), "h = 1, δ = 15°"),
    "fig13": loading_contours(_other_slopes, "Free wake: loading over the disk, h = 1"),
    "fig14a": inflow_series("free_wake", _slopes, "Free wake over slope, h = 1"),
    "fig14b": inflow_series("vpbfsm", _slopes, "VPBFSM over slope, h = 1"),
    "fig15": loading_contours(_steep_other_heights, "Free wake: loading over the disk, δ = 30°"),
    "fig16a": inflow_series("free_wake", _steep, "Free wake over height, δ = 30°"),
    "fig16b": inflow_series("vpbfsm", _steep, "VPBFSM over height, δ = 30°"),
    "overview": overview,
}
