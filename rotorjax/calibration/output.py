"""What a calibration leaves behind, whatever its target: calibration.toml, calibration.json and pictures."""

from functools import singledispatch
from pathlib import Path

from rotorjax.calibration import figures, freewake_run, hayden_run, measured_run
from rotorjax.calibration.calibration_file import Calibration, save
from rotorjax.calibration.freewake_run import FreeWakeRun
from rotorjax.calibration.hayden_run import HaydenRun
from rotorjax.calibration.measured_run import MeasuredRun
from rotorjax.io.atomic import make_folder, write_json

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
    figures.hayden_figure(result, folder / "hayden.png")


@draw.register
def _(result: FreeWakeRun, folder: Path) -> None:
    figures.rms_figure(result, folder / "rms.png")
    figures.held_figures(result, folder)


@draw.register
def _(result: MeasuredRun, folder: Path) -> None:
    figures.measured_figure(result, folder / "wake.png")
