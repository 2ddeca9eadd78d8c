"""One case as a picture."""

from pathlib import Path

import xarray as xr

from rotorjax.bench.plotting import (
    MODEL_STYLE,
    across,
    diameter_axes,
    legend_below,
    new_figure,
    polar_contour,
    save_file,
    shared_levels,
    style,
)
from rotorjax.bench.single_output import FIELDS, along, title_of
from rotorjax.bench.wake_file import case_of


def picture(data: xr.Dataset, reference: float | None, path: Path) -> None:
    """Inflow across the disk and, on a slope, contours of the free wake's loading (or the VPBFSM's inflow)."""
    case, scale = case_of(data), reference or 1.0
    label = "inflow / mean OGE inflow of the free wake" if reference else "inflow over ΩR"
    with style():
        figure = new_figure(10.5 if case.slope_deg else 6.0, 4.0)
        axes = figure.add_subplot(1, 2 if case.slope_deg else 1, 1)
        for model, (name, _) in FIELDS.items():
            if name not in data or (case.height is None and model == "exact_image"):
                continue
            field = data[name].to_numpy() / scale
            axes.plot(*across(data["radius"].to_numpy(), along(field, 0), along(field, 1)), **MODEL_STYLE[model])
        diameter_axes(axes, label, sides=case.slope_deg > 0)
        axes.set_title(title_of(data), pad=18 if case.slope_deg else 6)
        legend_below(axes, 3)
        if case.slope_deg:
            wake = "free_wake_inflow" in data
            field = data["free_wake_inflow" if wake else "vpbfsm_inflow"].to_numpy() / scale
            psi = data["azimuth" if wake else "station_azimuth"].to_numpy()
            disk = figure.add_subplot(1, 2, 2, projection="polar")
            filled = polar_contour(disk, data["radius"].to_numpy(), psi, field, shared_levels([field]))
            disk.set_title("free wake" if wake else "VPBFSM", pad=24)
            figure.colorbar(filled, ax=disk, label=label, shrink=0.8, pad=0.1)
    save_file(figure, path)
