"""Finished flights of a sweep in files of their own: what takes long to find is kept, the rest is made of it anew."""

import json
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from rotorjax.bench.kept import check_same, fingerprint, taken_up
from rotorjax.bench.settings import StudySettings
from rotorjax.io import netcdf
from rotorjax.io.atomic import json_text, make_folder
from rotorjax.linearisation.flight import Dear, LinearFlight, completed
from rotorjax.linearisation.found import Wanted
from rotorjax.linearisation.modes import RotorMode
from rotorjax.linearisation.stages import Stages
from rotorjax.linearisation.wake_flight import WakeFindings
from rotorjax.ode.export import periodic_of, to_dataset
from rotorjax.ode.outcome import Outcome
from rotorjax.trim.means import Means
from rotorjax.trim.run import FREE_WAKE, Request, Result, restored, unknowns
from rotorjax.trim.verdict import Verdict
from rotorjax.wake.settings import flight_settings

FILE = "flight.nc"
STATE = "trim_"
NUMBERS = ("states", "azimuths", "residual", "thrust")
"""Of `WakeFindings`, kept as they are."""


def folder_of(request: Request) -> str:
    """Name of a flight's own folder."""
    return f"advance_{request.advance:g}_{above(request.height)}"


def above(height: float | None) -> str:
    """A height in a file's name."""
    return "free_air" if height is None else f"height_{height:g}"


def table_of(request: Request, wanted: Wanted) -> dict[str, Any]:
    """Everything that decides what is kept of a flight but its speed and height, as plain values. The order and the
    harmonics of what is made of it do not.
    """
    settings = request.wake or flight_settings(request.rotor.blades)
    made = StudySettings(request.rotor, request.operating, settings).table()
    own = ("rotorjax", "rotor", "operating.", *(("wake.",) if request.inflow == FREE_WAKE else ()))
    asked = {name: getattr(request, name) for name in ("inflow", "thrust", "slope_deg", "climb", "tilt_deg")}
    return {
        **{name: value for name, value in made.items() if name.startswith(own)},
        **asked,
        "inputs": ",".join(wanted.inputs),
        "outputs": ",".join(wanted.outputs),
        "azimuths": wanted.azimuths,
    }


@dataclass(frozen=True)
class FlightShelf:
    """The folder of a sweep, a folder for each flight in it. say: hears of a file that is set aside."""

    folder: Path
    wanted: Wanted
    say: Callable[[str], None]

    def keep(self, found: LinearFlight) -> None:
        """Keep a finished flight. Raises InputError where it cannot be written."""
        request = found.result.request
        table = table_of(request, self.wanted)
        about = {"fingerprint": fingerprint(table), "settings": json.dumps(table, ensure_ascii=False)}
        place = make_folder(self.folder / folder_of(request))
        netcdf.write(place / FILE, _dataset(found).assign_attrs(about))

    def take_up(self, request: Request) -> LinearFlight | None:
        """What is kept of a flight, None where nothing is; a file that is damaged or of another flight is set aside.

        Raises InputError where it was made with other settings.
        """
        table = table_of(request, self.wanted)

        def stranger(data: xr.Dataset) -> str | None:
            check_same(data, fingerprint(table), table, self.folder, "sweep")
            return None if data.attrs["flight"] == _label(request) else data.attrs["flight"]

        data = taken_up(self.folder / folder_of(request) / FILE, stranger, self.say, "flight")
        return None if data is None else _flight(data, request, self.wanted)


def _label(request: Request) -> str:
    return f"advance ratio {request.advance!r}, height {request.height!r}"


def _dataset(found: LinearFlight) -> xr.Dataset:
    """The periodic model in azimuth and rotor units, the trim's unknowns, and what was measured."""
    result, wake = found.result, found.wake
    outcome = {name: getattr(result.trimmed.outcome, name) for name in ("residual", "why")}
    outcome |= {"iterations": result.trimmed.iterations}
    data = to_dataset(found.periodic).assign(step_error=(("output", "input"), found.step_error))
    for name, values in unknowns(result.trimmed).items():
        data[STATE + name] = (tuple(f"{STATE}{name}_{axis}" for axis in range(values.ndim)), values)
    texts = {
        "outcome": outcome,
        "means": asdict(result.means),
        "verdict": asdict(result.verdict),
        "wall_time_s": result.wall_time_s,
        "seconds": found.seconds,
        "modes": list(map(_plain, found.modes)),
        "notes": dict(found.periodic.notes),
    }
    if wake is not None:
        data["basis"] = (("all_states", "condensed"), wake.basis)
        data["condensed_error"] = (("output", "input"), wake.condensed_error)
        texts["wake"] = {name: getattr(wake, name) for name in NUMBERS} | {"modes": list(map(_plain, wake.modes))}
    texts = {name: json_text(value) for name, value in texts.items()}
    return data.assign_attrs(flight=_label(result.request), **texts)


def _flight(data: xr.Dataset, request: Request, wanted: Wanted) -> LinearFlight:
    """The flight that `_dataset` was made of."""
    told = {name: json.loads(data.attrs[name]) for name in ("outcome", "means", "seconds", "modes", "verdict")}
    state = {str(n).removeprefix(STATE): data[n].to_numpy() for n in data.data_vars if str(n).startswith(STATE)}
    end, verdict = told["outcome"], Verdict(**told["verdict"])
    outcome = Outcome(None, end["residual"], (), end["iterations"], True, end["why"], 0.0)
    trimmed = restored(request, state, outcome, verdict.damping)
    flown: dict[str, Any] = {k: np.array(v) if isinstance(v, list) else v for k, v in told["means"].items()}
    means = Means(**flown)
    result = Result(request, trimmed, means, verdict, json.loads(data.attrs["wall_time_s"]))
    periodic = periodic_of(data, json.loads(data.attrs["notes"]))
    modes = tuple(map(_mode, told["modes"]))
    clock = Stages(None)
    clock.seconds |= told["seconds"]
    return completed(result, Dear(periodic, modes, data["step_error"].to_numpy(), _in_wake(data)), wanted, clock)


def _in_wake(data: xr.Dataset) -> WakeFindings | None:
    if "wake" not in data.attrs:
        return None
    told = json.loads(data.attrs["wake"])
    own: dict[str, Any] = {name: np.nan if told[name] is None else told[name] for name in NUMBERS}
    return WakeFindings(
        **own,
        modes=tuple(map(_mode, told["modes"])),
        step_error=data["step_error"].to_numpy(),
        condensed_error=data["condensed_error"].to_numpy(),
        basis=data["basis"].to_numpy(),
    )


def _plain(mode: RotorMode) -> dict[str, Any]:
    return asdict(mode) | {"exponent": [mode.exponent.real, mode.exponent.imag]}


def _mode(told: dict[str, Any]) -> RotorMode:
    return RotorMode(told["name"], complex(*told["exponent"]), told["shares"], told["states"])
