"""A rotor over a ship's deck: pictures, animation and report of its histories."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from rotorjax.bench import plotting
from rotorjax.bench.film import write_film
from rotorjax.bench.markdown import table
from rotorjax.io import netcdf
from rotorjax.io.atomic import write_json
from rotorjax.io.page import write_page

DYNAMIC, STATIC = plotting.FREE_WAKE, plotting.VPBFSM
FLAPPING = {"beta_0": r"$\beta_0$", "beta_1c": r"$\beta_{1c}$", "beta_1s": r"$\beta_{1s}$"}
_SNAPSHOTS = 4


def write_all(data: xr.Dataset, figures: dict[str, float], out: Path, *, animated: bool = False) -> dict[str, Any]:
    """Write history.nc, report.json, report.html, histories and disk as PNG and PDF; on request animation.gif.

    Returns the content of report.json. Raises InputError where a file cannot be written.
    """
    netcdf.write(out / "history.nc", data)
    found = report(data, figures)
    write_json(out / "report.json", found)
    plotting.save(histories(data), out / "histories")
    plotting.save(snapshots(data), out / "disk")
    if animated:
        animation(data, out / "animation.gif")
    write_page(out / "report.html", markdown(found, data, animated=animated))
    return found


def markdown(found: dict[str, Any], data: xr.Dataset, *, animated: bool = False) -> str:
    """The page of a case: what the ground did, pictures, histories."""
    most, rows = found["largest_difference_from_static"], found["histories"]
    thrust = rows["thrust"]
    pictures = {
        "histories.png": "The deck under the hub, inflow, thrust and flapping. Dashed: the steady ground effect "
        "of each instant.",
        "disk.png": "The inflow over the disk, seen from above.",
        **({"animation.gif": "The rotor over its deck."} if animated else {}),
    }
    head = ("history", "unit", "first", "last", "least", "most")
    cells = [
        (n, data[n].attrs.get("units", ""), *(r[k] for k in ("first", "last", "min", "max"))) for n, r in rows.items()
    ]
    parts = [
        f"# Over a deck: {found['rotor']}, {found['variant']} ground effect",
        f"- From a collective of {found['collective_deg']:.2f}° on C_T goes from {thrust['first']:.5f} to "
        f"{thrust['last']:.5f}, between {thrust['min']:.5f} and {thrust['max']:.5f}.\n"
        f"- The mean inflow differs from the steady one of the same instant by up to {100 * most['relative']:.1f} %, "
        f"at {most['time_s']:.1f} s.\n"
        f"- At most {100 * found['ground_residual_max']:.1f} % of the flow into the deck is left on it.\n"
        f"- {found['simulated_s']:.1f} s in {found['steps']} steps of {found['step_us']:.0f} µs.",
        *(f"![{name}]({name})\n\n{caption}" for name, caption in pictures.items()),
        "## Histories\n\n" + table(head, cells),
        "history.nc holds all of it over time. λ positive down, over ΩR; heights over R; C_T = T/(ρA(ΩR)²).",
    ]
    return "\n\n".join(parts) + "\n"


def report(data: xr.Dataset, figures: dict[str, float]) -> dict[str, Any]:
    """Return the numbers of report.json: measured figures, and extremes, ends and lag of the histories."""
    names = (
        "height",
        "slope",
        "collective",
        "uniform",
        "cosine",
        "sine",
        "thrust",
        "static_uniform",
        "static_thrust",
        *FLAPPING,
    )
    series = {
        name: {
            "first": float(data[name][0]),
            "last": float(data[name][-1]),
            "min": float(data[name].min()),
            "max": float(data[name].max()),
        }
        for name in names
        if name in data
    }
    steady = data["static_uniform"].values
    difference = np.abs(data["uniform"].values - steady)
    at = int(difference.argmax())
    return {
        "rotor": data.attrs["rotor"],
        "variant": data.attrs["variant"],
        "collective_deg": data.attrs["collective_deg"],
        "histories": series,
        "largest_difference_from_static": {
            "uniform": float(difference[at]),
            "time_s": float(data["time"][at]),
            "relative": float(difference[at] / steady[at]),
        },
        "ground_residual_max": figures["ground_residual_max"],
        "simulated_s": figures["simulated_s"],
        "steps": int(figures["steps"]),
        "march_s": figures["march_s"],
        "step_us": figures["step_us"],
        "build_s": figures["build_s"],
    }


def histories(data: xr.Dataset) -> Figure:
    """Draw deck's motion, inflow's three parts, thrust and collective, and flapping over time, beside the static
    ground effect.
    """
    flapping = "beta_0" in data
    with plotting.style():
        figure = plotting.new_figure(7.5, 9.8 if flapping else 8.0)
        axes = figure.subplots(5 if flapping else 4, 1, sharex=True)
        t = data["time"].values
        axes[0].plot(t, data["height"], color=plotting.INK, label="hub over deck, h/R")
        if float(data["has_edge"]):
            axes[0].plot(t, data["edge"], color="#CC79A7", label="edge of the deck aft of the hub, x/R")
        axes[0].set_ylabel("over R")
        slope = axes[0].twinx()
        slope.plot(t, data["slope"], color="#56B4E9", lw=1.0, label="slope, deg (right)")
        slope.set_ylabel("deg")
        slope.grid(visible=False)
        lines = [*axes[0].get_lines(), *slope.get_lines()]
        _legend(axes[0], lines)
        _pair(axes[1], t, data["uniform"], data["static_uniform"], r"$\lambda_0/\Omega R$", data.attrs["variant"])
        _pair(axes[2], t, data["cosine"], data["static_cosine"], r"$\lambda_{1c},\ \lambda_{1s}$", r"$\lambda_{1c}$")
        axes[2].plot(t, data["sine"], color="#009E73", lw=1.0, label=r"$\lambda_{1s}$")
        _legend(axes[2], axes[2].get_lines())
        _pair(axes[3], t, data["thrust"], data["static_thrust"], r"$C_T$", data.attrs["variant"])
        if float(np.ptp(data["collective"].values)) > 0:
            _collective(axes[3], data)
        if flapping:
            _flapping(axes[4], data)
        axes[-1].set_xlabel("time, s")
        axes[0].set_xlim(float(t[0]), float(t[-1]))
    return figure


def _pair(axes: Any, t: np.ndarray, ours: xr.DataArray, steady: xr.DataArray, label: str, name: str) -> None:
    axes.plot(t, steady, color=STATIC, ls="--", lw=1.1, label="steady at each instant")
    axes.plot(t, ours, color=DYNAMIC, label=name)
    axes.set_ylabel(label)
    _legend(axes, axes.get_lines())


def _legend(axes: Any, lines: Sequence[Any]) -> None:
    """A legend above the axes, where it hides no curve."""
    axes.legend(lines, [str(line.get_label()) for line in lines], ncols=3, loc="lower left", bbox_to_anchor=(0, 1))


def _collective(axes: Any, data: xr.Dataset) -> None:
    """Collective on the right."""
    right = axes.twinx()
    right.grid(visible=False)
    lines = right.plot(data["time"], data["collective"], color="#009E73", lw=1.0, label=r"$\theta_0$ (right)")
    right.set_ylabel("deg")
    _legend(axes, [*axes.get_lines(), *lines])


def _flapping(axes: Any, data: xr.Dataset) -> None:
    """Tilt of the tip-path plane and, on the right, coning; dashed what is steady at each instant."""
    right = axes.twinx()
    right.grid(visible=False)
    lines = []
    for side, name, colour in ((axes, "beta_1c", DYNAMIC), (axes, "beta_1s", "#009E73"), (right, "beta_0", "#56B4E9")):
        label = FLAPPING[name] + (" (right)" if side is right else "")
        side.plot(data["time"], data[f"static_{name}"], color=colour, ls="--", lw=0.9)
        lines += side.plot(data["time"], data[name], color=colour, lw=1.1, label=label)
    axes.set_ylabel("tilt, deg")
    right.set_ylabel("coning, deg")
    _legend(axes, lines)


def snapshots(data: xr.Dataset) -> Figure:
    """Draw the inflow over the disk at four instants, seen from above; forward is left, starboard up."""
    frames = np.linspace(0, data.sizes["frame"] - 1, _SNAPSHOTS).astype(int)
    with plotting.style():
        figure = plotting.new_figure(9.0, 3.0)
        axes = figure.subplots(1, _SNAPSHOTS)
        x, y, fields = _mesh(data)
        levels = plotting.shared_levels([fields[i] for i in frames])
        filled = None
        for one, i in zip(axes, frames, strict=True):
            filled = one.contourf(x, y, fields[i], levels=levels, cmap="viridis")
            _disk_axes(one, f"t = {float(data['frame_time'][i]):.1f} s")
        if filled is not None:
            figure.colorbar(filled, ax=axes, label=r"$\lambda/\Omega R$", shrink=0.8)
    return figure


def _mesh(data: xr.Dataset) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Stations and fields with the azimuth closed."""
    psi = np.append(data["psi"].values, 2 * np.pi)
    r, fields = data["r"].values, data["inflow"].values
    return r * np.cos(psi)[:, None], r * np.sin(psi)[:, None], np.concatenate([fields, fields[:, :1]], axis=1)


def _disk_axes(axes: Any, title: str) -> None:
    axes.set(aspect="equal", xticks=[], yticks=[], title=title)
    axes.grid(visible=False)
    for side in axes.spines.values():
        side.set_visible(False)
    axes.set_xlabel("forward ← → aft\nseen from above", fontsize=8)


def animation(data: xr.Dataset, path: str | Path, frames_per_second: int = 12) -> None:
    """Write a GIF: the rotor over the moving deck from the side, its inflow from above, and the mean inflow so far."""
    x, y, fields = _mesh(data)
    times = data["frame_time"].values
    at = np.searchsorted(data["time"].values, times - 1e-9)

    def build(figure: Figure) -> Callable[[int], None]:
        side, disk, history = figure.subplots(1, 3, width_ratios=(1.3, 1.0, 1.2))
        low, high = float(fields.min()), float(fields.max())
        mesh = disk.pcolormesh(x, y, fields[0], shading="gouraud", vmin=low, vmax=high, cmap="viridis")
        _disk_axes(disk, "inflow from above")
        figure.colorbar(mesh, ax=disk, shrink=0.7, label=r"$\lambda/\Omega R$")
        history.plot(data["time"], data["static_uniform"], color=STATIC, ls="--", lw=1.0, label="steady")
        history.plot(data["time"], data["uniform"], color=DYNAMIC, label=data.attrs["variant"])
        (dot,) = history.plot([], [], "o", color=plotting.INK, ms=5)
        history.set(xlabel="time, s", ylabel=r"$\lambda_0/\Omega R$")
        history.legend(loc="best")

        def draw(frame: int) -> None:
            _side_view(side, data.isel(time=int(at[frame])), float(data["height"].max()))
            mesh.set_array(fields[frame])
            dot.set_data([times[frame]], [float(data["uniform"][at[frame]])])

        return draw

    write_film(path, build, data.sizes["frame"], (8.5, 3.4), frames_per_second)


def _side_view(axes: Any, now: xr.Dataset, highest: float) -> None:
    """Rotor at its place, deck below, wake between them; forward is left."""
    axes.clear()
    end = float(now["edge"]) if float(now["has_edge"]) else 2.0
    slope = np.tan(np.deg2rad(float(now["slope"])))
    height = float(now["height"])
    cone, tilt = (np.deg2rad(float(now[name])) if name in now else 0.0 for name in ("beta_0", "beta_1c"))
    tips = [np.sin(cone - tilt), 0.0, np.sin(cone + tilt)]  # of the blades ahead and aft
    axes.plot([-1, 0, 1], tips, color=plotting.INK, lw=3, solid_capstyle="round", solid_joinstyle="round")
    axes.plot([0], [0], "o", color=plotting.INK, ms=5)
    start = -2.0
    if end > start:
        ends = np.array([start, min(end, 2.0)])
        axes.fill_between(ends, -height + slope * ends, -highest - 0.6, color="#999999", lw=0)
    x = np.array([-1.0, *np.repeat(np.clip(end, -1, 1), 2), 1.0])
    deep = np.where([end > -1, end > -1, end >= 1, end >= 1], -height + slope * x, -highest - 0.6)
    axes.fill([*x, 1, -1], [*deep, 0, 0], color=DYNAMIC, alpha=0.12, lw=0)
    axes.set(xlim=(-2, 2), ylim=(-highest - 0.6, 0.6), aspect="equal", title=f"t = {float(now['time']):.1f} s")
    axes.set(xticks=[], yticks=[])
    axes.set_xlabel("forward ← → aft", fontsize=8)
    axes.grid(visible=False)
