"""A solved rotor as a picture."""

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from rotorjax.bench.azimuth import valley_side
from rotorjax.bench.plotting import (
    FREE_WAKE,
    VPBFSM,
    across,
    diameter_axes,
    new_figure,
    polar_contour,
    shared_levels,
    style,
)

COLOURS = {"free wake": FREE_WAKE, "finite state": VPBFSM}


def picture(data: xr.Dataset) -> Figure:
    """Inflow across the disk, and over it where it varies with azimuth; data: of `Solved.to_xarray`."""
    r, psi, inflow = (data[name].to_numpy() for name in ("radius", "azimuth", "inflow"))
    sloping = float(data["slope_deg"]) > 0
    mountain, valley = (inflow[0], valley_side(inflow)) if psi.size > 1 else (inflow[0], inflow[0])
    where = "out of ground effect" if np.isnan(data["height"]) else f"h = {float(data['height']):g} R"
    where += f", slope {float(data['slope_deg']):g}°" if sloping else ""
    with style():
        figure = new_figure(10.5 if sloping else 6.0, 4.0)
        axes = figure.add_subplot(1, 2 if sloping else 1, 1)
        axes.plot(*across(r, mountain, valley), color=COLOURS[data.attrs["model"]], label=data.attrs["model"])
        diameter_axes(axes, r"inflow over $\Omega R$, positive down", sides=sloping)
        lost = "" if bool(data["converged"]) else ", NOT CONVERGED"
        title = f"{data.attrs['rotor']}, {where}: $C_T$ = {float(data['CT']):.5f}{lost}"
        axes.set_title(title, pad=18 if sloping else 6)
        axes.legend(loc="best")
        if sloping:
            disk = figure.add_subplot(1, 2, 2, projection="polar")
            filled = polar_contour(disk, r, psi, inflow, shared_levels([inflow]))
            figure.colorbar(filled, ax=disk, label=r"inflow over $\Omega R$", shrink=0.8, pad=0.1)
    return figure
