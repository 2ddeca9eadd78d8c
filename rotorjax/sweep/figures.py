"""Pictures of a sweep: polars, maps over two axes, curves over one, for as many axes as there are."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from rotorjax.bench import plotting
from rotorjax.bench.curves import plain
from rotorjax.sweep.table import axes_of

LABELS = {
    "height": r"height of the hub over $R$",
    "slope_deg": "slope, deg",
    "climb": r"climb over $\Omega R$",
    "collective_deg": "collective, deg",
    "thrust_coefficient": r"wanted $C_T$",
    "weight": "weight, N",
    "altitude": "altitude, m",
    "density": "density, kg/m³",
    "advance_ratio": r"advance ratio $\mu$",
    "speed": "speed, m/s",
    "tilt_deg": "shaft forward, deg",
    "drag_area": "drag area, m²",
    "CT": r"$C_T$",
    "CP": r"$C_P$",
    "figure_of_merit": "figure of merit",
    "lambda_0": r"$\lambda_0$ over $\Omega R$",
    "lambda_1c": r"$\lambda_{1c}$ over $\Omega R$",
    "power": "power, W",
}
PITCH = ("collective_deg", "thrust_coefficient", "weight")
MAPPED = ("CT", "lambda_0", "lambda_1c", "CP")
MOST_CURVES = 8
REST = "Other axes stand at their first value."


def draw_all(data: xr.Dataset, folder: Path) -> dict[str, str]:
    """Draw what suits the axes into a folder; {file: caption}."""
    drawn = {}
    for name, figure, caption in figures(data):
        plotting.save(figure, folder / name)
        drawn[f"{name}.png"] = caption
    return drawn


def figures(data: xr.Dataset) -> list[tuple[str, Figure, str]]:
    """Pictures with the names of their files and their captions; none of a sweep in which nothing converged."""
    shown = _converged(data)
    if not np.isfinite(shown["CT"]).any() if "CT" in shown else True:
        return []
    if data.attrs["design"] == "random":
        return [("scatter", scatter(shown), "Every point that converged, over each axis.")]
    found = []
    long = [name for name in axes_of(data) if data.sizes[name] > 1]
    pitch = next((name for name in long if name in PITCH), None)
    if pitch is not None:
        about = "C_T over C_P, and the figure of merit of hovers; a curve for each value of the next axis."
        found.append(("polar", polar(shown, pitch, long), about))
    for name in long:
        if name != pitch:
            about = f"Over the {_plain(name)}, a curve for each value of the next axis. {REST}"
            found.append((f"over_{_file(name)}", curves(shown, name, long), about))
    if len(long) >= 2:
        about = f"Over the {_plain(long[0])} and the {_plain(long[1])}; white where there is no solution. {REST}"
        found.append(("map", maps(shown, long[0], long[1]), about))
    return found


def polar(data: xr.Dataset, along: str, axes: Sequence[str]) -> Figure:
    """C_T over C_P, and over C_T the figure of merit, or the inflow where no point hovers."""
    shown = "figure_of_merit" if np.isfinite(data["figure_of_merit"]).any() else "lambda_0"
    with plotting.style():
        figure = plotting.new_figure(9.0, 3.8)
        left, right = figure.subplots(1, 2)
        series = _series(data, along, axes)
        for (label, one), colour in zip(series, plotting.series_colours(len(series)), strict=True):
            order = np.argsort(one["CT"].to_numpy())
            thrust, power = (one[name].to_numpy()[order] for name in ("CT", "CP"))
            left.plot(power, thrust, color=colour, marker="o", label=label)
            right.plot(thrust, one[shown].to_numpy()[order], color=colour, marker="o")
        left.set(xlabel=LABELS["CP"], ylabel=LABELS["CT"])
        right.set(xlabel=LABELS["CT"], ylabel=LABELS[shown])
        for panel in (left, right):
            panel.locator_params(axis="x", nbins=5)
        _legend(left, series)
        figure.suptitle(data.attrs["title"], fontsize=10)
    return figure


def curves(data: xr.Dataset, along: str, axes: Sequence[str]) -> Figure:
    """Thrust, power and inflow over an axis."""
    shown = [name for name in ("CT", "CP", "lambda_0", "lambda_1c") if name in data]
    with plotting.style():
        figure = plotting.new_figure(9.0, 6.4)
        series = _series(data, along, axes)
        for name, panel in zip(shown, figure.subplots(2, 2).ravel(), strict=True):
            for (label, one), colour in zip(series, plotting.series_colours(len(series)), strict=True):
                x = one[along].to_numpy()
                finite = np.isfinite(x)
                panel.plot(x[finite], one[name].to_numpy()[finite], color=colour, marker="o", label=label)
                if not finite.all():
                    panel.axhline(one[name].to_numpy()[~finite][0], color=colour, linestyle=":", linewidth=1.0)
            panel.set(xlabel=_label(along), ylabel=LABELS[name])
        _legend(figure.axes[0], series)
        free = "; dotted: out of ground effect" if not np.isfinite(data[along]).all() else ""
        figure.suptitle(data.attrs["title"] + free, fontsize=10)
    return figure


def maps(data: xr.Dataset, across: str, up: str) -> Figure:
    """Filled contours over two axes, with the points that were solved."""
    flat = data.isel({name: 0 for name in axes_of(data) if name not in (across, up)})
    flat = flat.isel({name: np.isfinite(flat[name].to_numpy()) for name in (across, up)})
    with plotting.style():
        figure = plotting.new_figure(9.0, 6.4)
        for name, panel in zip(MAPPED, figure.subplots(2, 2).ravel(), strict=True):
            values = flat[name].transpose(up, across).to_numpy()
            _map(figure, panel, flat[across].to_numpy(), flat[up].to_numpy(), values)
            panel.set(xlabel=_label(across), ylabel=_label(up), title=LABELS[name])
        figure.suptitle(data.attrs["title"], fontsize=10)
    return figure


def _map(figure: Figure, panel: Axes, x: np.ndarray, y: np.ndarray, values: np.ndarray) -> None:
    """One map; a field that does not vary, or a single row, has no contours."""
    there = np.isfinite(values)
    if min(values.shape) < 2 or not there.any():
        panel.text(0.5, 0.5, "too few points", ha="center", transform=panel.transAxes)
        return
    levels = plotting.shared_levels([values[there]], 12)
    filled = panel.contourf(x, y, np.ma.masked_invalid(values), levels=levels, cmap="viridis")
    columns, lines = np.meshgrid(x, y)
    for of, mark, colour in ((there, ".", "white"), (~there, "x", plotting.INK)):
        if of.any():
            panel.plot(columns[of], lines[of], mark, markersize=4, clip_on=False, color=colour)
    panel.grid(False)
    figure.colorbar(filled, ax=panel)


def scatter(data: xr.Dataset) -> Figure:
    """Thrust and power over each axis of a random design, coloured by inflow."""
    axes = axes_of(data)
    with plotting.style():
        figure = plotting.new_figure(max(3.0 * len(axes), 5.0), 5.6)
        panels = figure.subplots(2, len(axes), squeeze=False, sharey="row")
        for row, name in zip(panels, ("CT", "CP"), strict=True):
            for panel, axis in zip(row, axes, strict=True):
                seen = panel.scatter(data[axis], data[name], c=data["lambda_0"], s=14, cmap="viridis")
                panel.set(xlabel=_label(axis))
            row[0].set(ylabel=LABELS[name])
        figure.colorbar(seen, ax=panels.ravel().tolist(), label=LABELS["lambda_0"])
        figure.suptitle(data.attrs["title"], fontsize=10)
    return figure


def _converged(data: xr.Dataset) -> xr.Dataset:
    """Numbers of the points that converged alone."""
    numbers = [name for name in data.data_vars if name != "verdict"]
    return data[numbers].where(data["verdict"] == "converged")


def _series(data: xr.Dataset, along: str, axes: Sequence[str]) -> list[tuple[str, xr.Dataset]]:
    """Curves over an axis, one for each value of the next, other axes at their first value; with labels."""
    others = [name for name in axes_of(data) if name != along]
    next_one = next((name for name in axes if name != along), None)
    first = data.isel({name: 0 for name in others if name != next_one})
    if next_one is None:
        return [("", first)]
    count = data.sizes[next_one]
    chosen = np.unique(np.linspace(0, count - 1, min(count, MOST_CURVES)).round().astype(int))
    found = [(_value(next_one, float(first[next_one][k])), first.isel({next_one: int(k)})) for k in chosen]
    return [(label, one) for label, one in found if np.isfinite(one["CT"]).any()]


def _value(name: str, value: float) -> str:
    if np.isinf(value):
        return "out of ground effect"
    symbol = {"height": "h", "slope_deg": "δ", "advance_ratio": "μ", "collective_deg": "θ₀"}.get(name, name)
    return f"{symbol} = {value:.6g}" + ("°" if name.endswith("_deg") else "")


def _legend(panel: Axes, series: Sequence[tuple[str, xr.Dataset]]) -> None:
    if len(series) > 1:
        panel.legend(loc="best", fontsize=8)


def _label(name: str) -> str:
    return LABELS.get(name, name)


def _plain(name: str) -> str:
    """The same for a sentence."""
    return plain(_label(name)).partition(",")[0]


def _file(name: str) -> str:
    return name.replace(".", "_")
