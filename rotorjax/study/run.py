"""The study itself: solve the cases in order, keep each as it finishes, then write pictures, tables and report."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from json import loads
from pathlib import Path
from typing import Protocol

import xarray as xr
from tqdm import tqdm

from rotorjax.errors import InputError
from rotorjax.io import netcdf
from rotorjax.io.atomic import make_folder
from rotorjax.study import wake_file
from rotorjax.study.cases import Case, neighbour
from rotorjax.study.record import add_finite_state
from rotorjax.study.settings import StudySettings, differences
from rotorjax.wake.model import FreeWake
from rotorjax.wake.solution import Solution, solve

Progress = Callable[[str, float], None]


class Solver(Protocol):
    """What solves the free wake: rotorjax.wake.solution.solve."""

    def __call__(self, model: FreeWake, start: Solution | None, progress: Progress | None) -> Solution:
        """Return the periodic wake of `model`."""
        ...


@dataclass(frozen=True)
class StudyResult:
    """Finished cases in order, and the labels of those that did not converge."""

    cases: tuple[xr.Dataset, ...]
    diverged: tuple[str, ...]


def solve_cases(
    cases: Sequence[Case], settings: StudySettings, folder: str | Path, *, show: bool = True, solver: Solver = solve
) -> StudyResult:
    """Solve all cases of a study, keeping each in folder/cases as soon as it is done; what is there is not redone.

    show: progress bars. A case that does not converge is kept with its last good state, and no other starts from it.
    Raises InputError where the folder cannot be written or holds another study.
    """
    kept = make_folder(make_folder(folder) / "cases")
    done: dict[Case, xr.Dataset] = {}
    with tqdm(total=len(cases), desc="study", unit="case", disable=not show) as bar:
        for case in cases:
            path = kept / f"{case.name}.nc"
            data = _reload(path, settings) if path.exists() else None
            if data is None:
                bar.set_description(f"study: {case.label}")
                data = solve_case(case, settings, done, _meter(bar), solver)
                netcdf.write(path, data)
            done[case] = data
            bar.update(1)
            if not bool(data["converged"]):
                bar.write(f"{case.label} did not converge: {data.attrs['why']}")
    diverged = tuple(case.label for case, data in done.items() if not bool(data["converged"]))
    return StudyResult(tuple(done.values()), diverged)


def solve_case(
    case: Case,
    settings: StudySettings,
    done: dict[Case, xr.Dataset],
    progress: Progress | None = None,
    solver: Solver = solve,
) -> xr.Dataset:
    """Solve one case with both models, from its nearest converged neighbour among `done` where there is one."""
    near = neighbour(case, [other for other, data in done.items() if bool(data["converged"])])
    start = None if near is None else wake_file.to_solution(done[near], settings)
    solution = solver(wake_file.model_of(case, settings), start, progress)
    return add_finite_state(wake_file.to_dataset(case, solution, settings), settings)


def _meter(bar: tqdm) -> Progress:
    def progress(stage: str, residual: float) -> None:
        bar.set_postfix_str(f"{stage}, residual {residual:.1e}")

    return progress


def _reload(path: Path, settings: StudySettings) -> xr.Dataset:
    data = netcdf.read(path)
    if data.attrs.get("fingerprint") == settings.fingerprint():
        return data
    ours, theirs = settings.table(), loads(data.attrs.get("settings", "{}"))
    what = ", ".join(differences(ours, theirs)[:3]) or "other settings"
    raise InputError(
        f"{path.parent.parent}: the output folder must be new or of the same study, but holds one with {what}"
    )
