"""A free-wake solution as a labelled data set, and back: what a finished case keeps."""

import json
from typing import Any

import jax.numpy as jnp
import numpy as np
import xarray as xr

from rotorjax.bench.cases import Case
from rotorjax.bench.settings import StudySettings
from rotorjax.wake.model import FreeWake, WakeState, free_wake
from rotorjax.wake.solution import Solution

STATE = "wake_state_"
# name in the data set: (attribute of the solution, dimensions, description)
ARRAYS: dict[str, tuple[str, tuple[str, ...], str]] = {
    "radius": ("r", ("radius",), "radius of the control points, over R"),
    "panel_width": ("widths", ("radius",), "width of the blade panels, over R"),
    "azimuth": ("psi", ("azimuth",), "azimuth in rad: 0 aft (mountain), counter-clockwise seen from above"),
    "free_wake_dct_dr": ("dct_dr", ("azimuth", "radius"), "free wake: dC_T/d(r/R) (Eq. 17)"),
    "free_wake_inflow": ("inflow", ("azimuth", "radius"), "free wake: induced inflow over ΩR, positive down"),
    "free_wake_circulation": ("circulation", ("azimuth", "radius"), "free wake: bound circulation over ΩR²"),
    "tip_vortex": (
        "tip_vortex",
        ("azimuth", "age", "xyz"),
        "tip vortex of the blade at this azimuth, over R, hub frame",
    ),
    "age": ("tip_vortex_age", ("age",), "wake age of the tip vortex in rad"),
}
NUMBERS: dict[str, tuple[str, str]] = {
    "CT": ("CT", "thrust coefficient T/(ρA(ΩR)²)"),
    "CP": ("CP", "power coefficient P/(ρA(ΩR)³)"),
    "CP_induced": ("CP_induced", "induced part of the power coefficient"),
    "CP_profile": ("CP_profile", "profile part of the power coefficient"),
    "free_wake_mean_inflow": (
        "mean_inflow",
        "free wake: mean induced inflow over ΩR, by area over what the blades sweep",
    ),
    "free_wake_residual": ("residual", "free wake: rms node displacement over one revolution, over R"),
    "free_wake_load_change": ("load_change", "free wake: relative change of C_T over one more revolution"),
    "free_wake_ground_normal_velocity_rms": (
        "ground_normal_velocity_rms",
        "free wake: rms normal velocity on the ground over √(C_T/2)",
    ),
    "iterations": ("iterations", "iterations of the free wake's solver"),
    "wall_time_s": ("wall_time_s", "wall-clock time of the free wake's solution in s, compilation included"),
    "compile_time_s": ("compile_time_s", "part of the wall-clock time spent compiling, in s"),
    "converged": ("converged", "1 where the free wake converged"),
}
_NO_VALUE = float("nan")


def to_dataset(case: Case, solution: Solution, settings: StudySettings) -> xr.Dataset:
    """Pack a solution: arrays, numbers, the whole wake state, and the settings it was made with."""
    data = xr.Dataset(attrs=attributes(case, settings, solution.why))
    climb = {"inflow": settings.climb_ratio, "mean_inflow": settings.climb_ratio}  # kept is what is induced
    for name, (attribute, dims, about) in ARRAYS.items():
        values = np.asarray(getattr(solution, attribute), float) - climb.get(attribute, 0.0)
        data[name] = (dims, values, {"units": _unit(about), "long_name": about})
    for name, (attribute, about) in NUMBERS.items():
        value = getattr(solution, attribute)
        value = _NO_VALUE if value is None else float(value) - climb.get(attribute, 0.0)
        data[name] = ((), value, {"units": _unit(about), "long_name": about})
    for name in WakeState.__dataclass_fields__:
        values = np.asarray(getattr(solution.state, name))
        dims = tuple(f"{name}_{axis}" for axis in range(values.ndim))
        data[STATE + name] = (dims, values, {"units": "1", "long_name": f"free-wake state {name}, rotor units"})
    return data.assign(place_of(case) | _reached(solution))


def attributes(case: Case, settings: StudySettings, why: str) -> dict[str, Any]:
    """What a data set was made of and with. why: the solver stopped."""
    table = settings.table()
    named = {name: table[name] for name in ("rotorjax", "rotor", "collective_deg")}
    made = {"fingerprint": settings.fingerprint(), "settings": json.dumps(table, ensure_ascii=False)}
    return {"case": case.name, "why": why, **named, "climb_ratio": settings.climb_ratio, **made}


def place_of(case: Case) -> dict[str, Any]:
    """Height and slope of a case as scalar variables."""
    height = _NO_VALUE if case.height is None else case.height
    return {
        "height": ((), height, {"units": "1", "long_name": "height of the hub over the ground, over R; NaN: none"}),
        "slope_deg": ((), case.slope_deg, {"units": "degree", "long_name": "slope of the ground"}),
    }


def _reached(solution: Solution) -> dict[str, Any]:
    """What the wake belongs to: the case, or where the solver lost it on the way there."""
    ground, about = solution.model.ground, "of the ground that the free wake reached"
    height, slope = (_NO_VALUE, 0.0) if ground is None else (float(ground.height), float(np.rad2deg(ground.slope)))
    return {
        "reached_height": ((), height, {"units": "1", "long_name": f"height of the hub over that {about}, over R"}),
        "reached_slope_deg": ((), slope, {"units": "degree", "long_name": f"slope {about}"}),
        "reached_washout": (
            (),
            float(solution.model.washout),
            {"units": "1", "long_name": "auxiliary flow that the free wake was left in, over ΩR"},
        ),
    }


def lost_at(data: xr.Dataset) -> str | None:
    """Where the free wake was lost on the way to its case, in words; None where it belongs to the case.

    A wake that reached its case and stalls there before it is accurate enough has not converged but belongs to it.
    """
    if "reached_height" not in data:
        return None
    height, slope, washout = (float(data[f"reached_{name}"]) for name in ("height", "slope_deg", "washout"))
    here = Case(None if np.isnan(height) else height, round(slope, 9))
    where = [] if _same_place(here, case_of(data)) else [here.label]
    return " ".join([*where, *([f"in an auxiliary flow of {washout:.3g} ΩR"] if washout else [])]) or None


def _same_place(here: Case, there: Case) -> bool:
    if here.height is None or there.height is None:
        return here.height == there.height
    return np.allclose([here.height, here.slope_deg], [there.height, there.slope_deg], rtol=1e-9, atol=1e-7)


def case_of(data: xr.Dataset) -> Case:
    """The case that a data set holds."""
    height = float(data["height"])
    return Case(None if np.isnan(height) else height, float(data["slope_deg"]))


def is_sound(data: xr.Dataset) -> bool:
    """Whether loads, inflow and state are finite and the rotor thrusts upward."""
    names = ["free_wake_dct_dr", "free_wake_inflow", "CT", *(n for n in data.data_vars if str(n).startswith(STATE))]
    return all(bool(np.all(np.isfinite(data[n]))) for n in names) and float(data["CT"]) > 0


def model_of(case: Case, settings: StudySettings) -> FreeWake:
    """The free wake of a case."""
    return free_wake(settings.rotor, settings.operating, case.ground, settings.wake)


def to_solution(data: xr.Dataset, settings: StudySettings) -> Solution:
    """Rebuild the solution, to start a neighbour from it."""
    fields: dict[str, Any] = {a: data[n].to_numpy() for n, (a, _, _) in ARRAYS.items()}
    fields |= {a: float(data[n]) for n, (a, _) in NUMBERS.items()}
    fields["converged"], fields["iterations"] = bool(fields["converged"]), int(fields["iterations"])
    if np.isnan(fields["ground_normal_velocity_rms"]):
        fields["ground_normal_velocity_rms"] = None
    names = WakeState.__dataclass_fields__
    state = WakeState(**{name: jnp.asarray(data[STATE + name].to_numpy()) for name in names})
    fields |= {"model": model_of(case_of(data), settings), "state": state, "why": data.attrs["why"]}
    for name in ("inflow", "mean_inflow"):
        fields[name] = fields[name] + settings.climb_ratio
    return Solution(**{name: value for name, value in fields.items() if name in Solution.__dataclass_fields__})


def state_arrays(solution: Solution) -> dict[str, np.ndarray]:
    """The wake's state by name: all that a neighbour's search needs of a solution besides its case and settings."""
    return {name: np.asarray(getattr(solution.state, name)) for name in WakeState.__dataclass_fields__}


def start_of(case: Case, settings: StudySettings, state: dict[str, np.ndarray]) -> Solution:
    """A converged solution of a case from its `state_arrays`, to start a neighbour from; nothing can be read off it."""
    unread: dict[str, Any] = dict.fromkeys(Solution.__dataclass_fields__, _NO_VALUE)
    wake = WakeState(**{name: jnp.asarray(values) for name, values in state.items()})
    known = {"model": model_of(case, settings), "state": wake, "converged": True, "why": "kept", "residuals": ()}
    return Solution(**unread | known)


def _unit(about: str) -> str:
    if " in rad" in about:
        return "rad"
    return "s" if " in s" in about else "1"
