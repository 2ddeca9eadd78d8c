"""Solved rotors as pictures."""

import jax.numpy as jnp
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
from rotorjax.wake.several_solution import SeveralSolution

COLOURS = {"free wake": FREE_WAKE, "finite state": VPBFSM}


def picture(data: xr.Dataset) -> Figure:
    """Inflow across the disk, and over it where it varies with azimuth; data: of `Solved.to_xarray`."""
    r, psi, inflow = (data[name].to_numpy() for name in ("radius", "azimuth", "inflow"))
    sloping, around = float(data["slope_deg"]) > 0, psi.size > 1  # beside surfaces it varies on the level, too
    mountain, valley = (inflow[0], valley_side(inflow)) if around else (inflow[0], inflow[0])
    where = "out of ground effect" if np.isnan(data["height"]) else f"h = {float(data['height']):g} R"
    where += f", slope {float(data['slope_deg']):g}°" if sloping else ""
    where += f", {data.attrs['panels']} panels" if data.attrs.get("panels") else ""
    with style():
        figure = new_figure(10.5 if around else 6.0, 4.0)
        axes = figure.add_subplot(1, 2 if around else 1, 1)
        axes.plot(*across(r, mountain, valley), color=COLOURS[data.attrs["model"]], label=data.attrs["model"])
        diameter_axes(axes, r"inflow over $\Omega R$, positive down", sides=sloping)
        lost = "" if bool(data["converged"]) else ", NOT CONVERGED"
        title = f"{data.attrs['rotor']}, {where}: $C_T$ = {float(data['CT']):.5f}{lost}"
        axes.set_title(title, pad=18 if sloping else 6)
        axes.legend(loc="best")
        if around:
            disk = figure.add_subplot(1, 2, 2, projection="polar")
            filled = polar_contour(disk, r, psi, inflow, shared_levels([inflow]))
            figure.colorbar(filled, ax=disk, label=r"inflow over $\Omega R$", shrink=0.8, pad=0.1)
    return figure


def together(solved: SeveralSolution, vortices: np.ndarray) -> Figure:
    """Mean flow of several rotors in the upright plane through their hubs, their disks, tip vortices and ground.

    vortices (N, B, A, 3): nodes in the common frame.
    """
    model = solved.model
    hubs, ground = np.asarray(model.places), model.wakes.ground
    floor = None if ground is None else float(hubs[0, 2] - ground.height[0])
    across_hubs = _direction(hubs)
    along = hubs @ across_hubs
    middle = hubs.mean(axis=0) * [1, 1, 0] - along.mean() * across_hubs
    span = np.linspace(along.min() - 1.8, along.max() + 1.8, 73)
    bottom = hubs[:, 2].min() - 2.0 if floor is None else floor
    height = np.linspace(bottom + 1e-3, hubs[:, 2].max() + 0.8, 55)
    s, z = np.meshgrid(span, height)
    points = middle + s[..., None] * across_hubs + z[..., None] * np.array([0.0, 0.0, 1.0])
    flow = np.asarray(solved.velocity(jnp.asarray(points.reshape(-1, 3)))).reshape(points.shape)
    with style():
        figure = new_figure(7.5, 1.2 + 7.0 * np.ptp(height) / np.ptp(span))
        axes = figure.add_subplot()
        most = float(np.quantile(np.abs(flow[..., 2]), 0.995))
        filled = axes.contourf(s, z, -flow[..., 2], levels=np.linspace(-most, most, 21), cmap="RdBu_r", extend="both")
        axes.streamplot(span, height, flow @ across_hubs, flow[..., 2], color="#666666", linewidth=0.5, arrowsize=0.6)
        for path in vortices.reshape(-1, *vortices.shape[2:]):
            axes.plot(path @ across_hubs, path[:, 2], color=FREE_WAKE, linewidth=0.6, alpha=0.7)
        turn = np.linspace(0, 2 * np.pi, 73)
        for hub, own in zip(hubs, np.asarray(model.axes), strict=True):
            rim = hub + np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=-1) @ own.T
            axes.plot(rim @ across_hubs, rim[:, 2], color="black", linewidth=2.5, solid_capstyle="butt")
        if floor is not None:
            axes.axhline(floor, color="#7a5c3e", linewidth=3)
        axes.set(xlim=span[[0, -1]], ylim=(bottom - 0.03, height[-1]), aspect="equal", ylabel="z/R")
        axes.set_xlabel("along the line of hubs, over R")
        axes.grid(visible=False)
        thrusts = ", ".join(f"{value:.5f}" for value in np.asarray(solved.CT))
        axes.set_title(f"{len(hubs)} rotors, $C_T$ = {thrusts}" + ("" if solved.converged else ", NOT CONVERGED"))
        figure.colorbar(filled, ax=axes, label=r"mean flow downward over $\Omega R$", shrink=0.9)
    return figure


def _direction(hubs: np.ndarray) -> np.ndarray:
    """Level unit vector along which hubs lie apart; to starboard where they are on one shaft."""
    level = (hubs - hubs.mean(axis=0)) * [1, 1, 0]
    if np.ptp(level) < 1e-9:
        return np.array([0.0, 1.0, 0.0])
    first = np.linalg.svd(level)[2][0]
    return first * np.sign(first[np.argmax(np.abs(first))])
