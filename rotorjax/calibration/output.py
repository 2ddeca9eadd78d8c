"""What a calibration leaves behind, whatever its target: calibration.toml, calibration.json and pictures."""

from collections.abc import Sequence
from functools import singledispatch
from pathlib import Path
from typing import Any

import jax.numpy as jnp
import numpy as np
from matplotlib.axes import Axes

from rotorjax.bench.plotting import (
    FREE_WAKE,
    INK,
    MODEL_STYLE,
    across,
    diameter_axes,
    legend_below,
    new_figure,
    save_file,
    style,
)
from rotorjax.calibration import freewake_run, hayden, hayden_run, measured_run
from rotorjax.calibration.calibration_file import Calibration, save
from rotorjax.calibration.freewake_run import FreeWakeRun
from rotorjax.calibration.hayden_run import HaydenRun
from rotorjax.calibration.measured import AGES_DEG
from rotorjax.calibration.measured_run import MeasuredRun
from rotorjax.io.atomic import make_folder, write_json
from rotorjax.reference.published import caradonna_tung, hayden_factor

Run = HaydenRun | FreeWakeRun | MeasuredRun
TARGETS = {HaydenRun: hayden_run, FreeWakeRun: freewake_run, MeasuredRun: measured_run}


def report(result: Run) -> str:
    """What was fitted, as text for the screen."""
    return TARGETS[type(result)].report(result)


def write(result: Run, folder: str | Path) -> Calibration:
    """Write calibration.toml, calibration.json and pictures into a folder. Raises InputError where it cannot be."""
    folder, target = make_folder(folder), TARGETS[type(result)]
    calibration = target.calibration_of(result)
    save(folder / "calibration.toml", calibration)
    write_json(folder / "calibration.json", target.record(result))
    draw(result, folder)
    return calibration


@singledispatch
def draw(result: Run, folder: Path) -> None:
    """Draw the pictures of a calibration into a folder."""
    raise TypeError(f"no calibration: {type(result)}")


@draw.register
def _(result: HaydenRun, folder: Path) -> None:
    hayden_figure(result, folder / "hayden.png")


@draw.register
def _(result: FreeWakeRun, folder: Path) -> None:
    rms_figure(result, folder / "rms.png")
    held_figures(result, folder)


@draw.register
def _(result: MeasuredRun, folder: Path) -> None:
    measured_figure(result, folder / "wake.png")


CALIBRATED = "#CC79A7"  # of the same palette as the models' colours
DRIVERS = {"least_squares": "least squares", "lbfgs": "L-BFGS", "adam": "Adam"}
CALIBRATED_STYLE: dict[str, Any] = {"color": CALIBRATED, "linestyle": "-", "label": "VPBFSM, calibrated"}


def hayden_figure(result: HaydenRun, path: str | Path) -> None:
    """Inflow ratio over height beside Hayden's factor, and the rms over the steps of each driver."""
    with style():
        figure = new_figure(10.0, 4.2)
        left, right = figure.subplots(1, 2)
        fine = np.linspace(min(hayden.HEIGHTS[0], float(jnp.min(result.data.heights))), 3.5, 101)
        left.plot(fine, hayden_factor(jnp.asarray(fine)), color=INK, label="Hayden")
        h = np.asarray(result.data.heights)
        order = np.argsort(h)
        radius, clearance = result.all_values
        fitted = f"VPBFSM, fitted: radius {radius:.3f}, clearance {clearance:.2f}"
        left.plot(h[order], result.ratios()[order], "o", color=CALIBRATED, label=fitted, markersize=6)
        printed = MODEL_STYLE["vpbfsm"] | {"marker": "s"}
        left.plot(h[order], result.ratios(printed=True)[order], **printed)
        left.set(xlabel="height of the hub, h/R", ylabel="mean inflow / OGE, same thrust", ylim=(0, 1.05))
        legend_below(left, 1)
        for name, fit in result.fits.items():
            steps = np.arange(1, fit.history.size + 1)
            right.loglog(steps, fit.history, label=DRIVERS[name])
        right.set(xlabel="step", ylabel="rms of the inflow ratio")
        legend_below(right, 3)
    save_file(figure, path)


def case_figure(result: FreeWakeRun, name: str, path: str | Path) -> None:
    """Inflow of one case across the diameter: free wake, default, calibrated."""
    with style():
        figure = new_figure(6.0, 4.2)
        draw_case(figure.add_subplot(), result, name)
    save_file(figure, path)


def draw_case(axes: Axes, result: FreeWakeRun, name: str) -> None:
    """Draw one case into axes."""
    row = result.data.names.index(name)
    slope = float(result.data.slopes[row])
    fields = {
        "free_wake": np.asarray(result.data.inflow[row]),
        "vpbfsm": result.inflow_printed[row],
        "calibrated": result.inflow[row],
    }
    for model, field in fields.items():
        look = CALIBRATED_STYLE if model == "calibrated" else MODEL_STYLE[model]
        mountain, valley = (field[0], field[field.shape[0] // 2]) if slope else (field.mean(0), field.mean(0))
        axes.plot(*across(np.asarray(result.data.r), mountain, valley), **look)
    diameter_axes(axes, "inflow / mean OGE inflow of the free wake", sides=slope > 0)
    held = "held out" if name in result.held else "taught"
    title = f"{label(result, name)} ({held}): rms {result.printed[row]:.3f} → {result.taught[row]:.3f}"
    axes.set_title(title, pad=18 if slope else 6)
    legend_below(axes, 3)


def rms_figure(result: FreeWakeRun, path: str | Path) -> None:
    """Rms difference of every case before and after, the held-out ones marked."""
    with style():
        figure = new_figure(9.0, 4.2)
        axes = figure.add_subplot()
        place = np.arange(len(result.data.names))
        axes.bar(place - 0.2, result.printed, 0.4, color=MODEL_STYLE["vpbfsm"]["color"], label="default")
        axes.bar(place + 0.2, result.taught, 0.4, color=CALIBRATED, label="calibrated")
        labels = [label(result, n) + (" *" if n in result.held else "") for n in result.data.names]
        axes.set_xticks(place, labels, rotation=45, ha="right", rotation_mode="anchor")
        axes.set(ylabel="rms difference from the free wake", title="* held out of the fit")
        axes.axhline(0, color=FREE_WAKE, linewidth=1)
        axes.legend()
    save_file(figure, path)


def label(result: FreeWakeRun, name: str) -> str:
    """A case's name for readers."""
    row = result.data.names.index(name)
    if not float(result.data.over_ground[row]):
        return "OGE"
    slope = np.rad2deg(float(result.data.slopes[row]))
    return f"h = {float(result.data.heights[row]):g}" + (f", δ = {slope:.3g}°" if slope else "")


def held_figures(result: FreeWakeRun, folder: str | Path) -> Sequence[Path]:
    """One picture for each held-out case; returns their paths."""
    paths = [Path(folder) / f"held_{name}.png" for name in result.held]
    for name, path in zip(result.held, paths, strict=True):
        case_figure(result, name, path)
    return paths


def measured_figure(result: MeasuredRun, path: str | Path) -> None:
    """Section lift and path of the tip vortex: measured, with the default settings and with the fitted ones."""
    groups = np.array(result.data.groups)
    panels = {
        "lift": (caradonna_tung().r, r"$r/R$", r"section lift $c_l$"),
        "r": (AGES_DEG, "wake age, deg", r"tip vortex $r/R$"),
        "z": (AGES_DEG, "wake age, deg", r"tip vortex $z/R$"),
    }
    with style():
        figure = new_figure(10.5, 3.8)
        for axes, (group, (places, xlabel, ylabel)) in zip(figure.subplots(1, 3), panels.items(), strict=True):
            rows = groups == group
            target, margin = result.data.target[rows], result.data.margin[rows]
            axes.errorbar(places, target, margin, fmt="s", color=INK, capsize=3, label="measured, allowed range")
            axes.plot(places, result.before[rows], "o--", color=FREE_WAKE, label="default settings")
            axes.plot(places, result.after[rows], "o-", color=CALIBRATED, label="fitted settings")
            axes.set(xlabel=xlabel, ylabel=ylabel, title="fitted" if result.taught[rows].all() else "held out")
        figure.legend(*figure.axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=3)
        thrust = [v[groups == "CT"][0] for v in (result.data.target, result.before, result.after)]
        told = "fitted" if result.taught[groups == "CT"].all() else "held out"
        figure.suptitle("$C_T$ ({}): measured {:.5f}, default {:.5f}, fitted {:.5f}".format(told, *thrust), fontsize=10)
    save_file(figure, path)
