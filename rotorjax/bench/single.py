"""One case with the VPBFSM, the free wake or both, as `rotorjax inflow` asks for it."""

import time
from typing import Literal, Protocol

import jax
import numpy as np
import xarray as xr

from rotorjax.bench import finite_state, wake_file
from rotorjax.bench.cases import Case, neighbour
from rotorjax.bench.record import add_finite_state, variables_of
from rotorjax.bench.settings import StudySettings
from rotorjax.errors import InputError
from rotorjax.limits import check_axial, check_place
from rotorjax.wake.model import FreeWake
from rotorjax.wake.search import Progress
from rotorjax.wake.solution import Solution, solve


class Solver(Protocol):
    """What solves the free wake: rotorjax.wake.solution.solve."""

    def __call__(self, model: FreeWake, start: Solution | None, progress: Progress | None) -> Solution:
        """Return the periodic wake of `model`."""
        ...


Model = Literal["vpbfsm", "freewake", "both"]


def check_case(case: Case, settings: StudySettings, model: Model = "freewake") -> None:
    """Raise InputError where the disk would cut the ground, the rotor climbs over it, or a model is not for that."""
    _ = case.ground
    for name in ("vpbfsm", "freewake") if model == "both" else (model,):
        check_place(name, case.height, case.slope_deg)
        check_axial(name, settings.rotor, settings.operating)
    if case.height is not None and settings.climb_ratio:
        raise InputError(
            f"Argument `climb` must be 0 over ground (a steady state needs a fixed height), "
            f"but is {settings.climb_ratio:g}"
        )


def single_case(
    case: Case, settings: StudySettings, model: Model, progress: Progress | None = None, *, solver: Solver = solve
) -> tuple[xr.Dataset, float | None]:
    """Solve one case; return it and the free wake's mean inflow out of ground effect, over ΩR, where it is needed.

    "vpbfsm" takes the blade loads of its own inflow; "freewake" its own; "both" drives the VPBFSM with the free wake's
    loads and solves out of ground effect too, for the reference. Raises InputError where the case is not allowed.
    """
    check_case(case, settings, model)
    if model == "vpbfsm":
        return _finite_state_alone(case, settings), None
    data = wake_file.to_dataset(case, solve_wake(case, settings, {}, progress, solver), settings)
    data = add_finite_state(data, settings)
    if model == "freewake":
        return data, None
    if case.height is None:
        return data, float(data["free_wake_mean_inflow"])
    free = solver(wake_file.model_of(Case(), settings), None, progress)
    return data, float(free.mean_inflow) - settings.climb_ratio


def solve_wake(
    case: Case,
    settings: StudySettings,
    done: dict[Case, xr.Dataset],
    progress: Progress | None = None,
    solver: Solver = solve,
) -> Solution:
    """The free wake of a case with rigid blades, from its nearest converged neighbour among `done` if there is one."""
    near = neighbour(case, [other for other, data in done.items() if bool(data["converged"])])
    start = None if near is None else wake_file.to_solution(done[near], settings)
    return solver(wake_file.model_of(case, settings), start, progress)


def _finite_state_alone(case: Case, settings: StudySettings) -> xr.Dataset:
    start = time.perf_counter()
    result, found = finite_state.alone(case, settings)
    jax.block_until_ready(result)
    first = time.perf_counter() - start
    start = time.perf_counter()
    jax.block_until_ready(finite_state.alone(case, settings)[0])
    again = time.perf_counter() - start
    numbers = {
        "CT": (float(found.CT), "thrust coefficient T/(ρA(ΩR)²)"),
        "CP": (float(found.CP), "power coefficient P/(ρA(ΩR)³)"),
        "CP_induced": (float(found.CP_induced), "induced part of the power coefficient"),
        "CP_profile": (float(found.CP_profile), "profile part of the power coefficient"),
        "wall_time_s": (first, "wall-clock time in s, compilation included"),
        "compile_time_s": (max(first - again, 0.0), "part of the wall-clock time spent compiling, in s"),
    }
    variables = {
        k: ((), v, {"units": "s" if k.endswith("_s") else "1", "long_name": t}) for k, (v, t) in numbers.items()
    }
    data = xr.Dataset(wake_file.place_of(case) | variables, attrs=wake_file.attributes(case, settings, "VPBFSM alone"))
    data = data.assign_coords(radius=("radius", np.asarray(found.r), {"units": "1", "long_name": "radius over R"}))
    return data.assign(variables_of(result, found.stations, finite_state.model_of(case, settings).modes))
