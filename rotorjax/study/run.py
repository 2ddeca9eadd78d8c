"""The study itself: solve the cases in order, keep each as it finishes, then write pictures, tables and report."""

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from threading import Thread

import xarray as xr
from tqdm import tqdm

from rotorjax.bench import wake_file
from rotorjax.bench.cases import Case, neighbour
from rotorjax.bench.flapping import flapping_dataset
from rotorjax.bench.record import add_finite_state
from rotorjax.bench.schedule import Schedule
from rotorjax.bench.settings import StudySettings
from rotorjax.bench.single import Solver, solve_wake
from rotorjax.study import kept
from rotorjax.trim.held import let_flap
from rotorjax.wake.search import Progress
from rotorjax.wake.solution import rehearse, solve


@dataclass(frozen=True)
class StudyResult:
    """Finished cases in order, and the labels of those that did not converge."""

    cases: tuple[xr.Dataset, ...]
    diverged: tuple[str, ...]


def solve_cases(
    cases: Sequence[Case],
    settings: StudySettings,
    folder: str | Path,
    *,
    show: bool = True,
    solver: Solver = solve,
    workers: int = 2,
) -> StudyResult:
    """Solve all cases of a study, keeping each in folder/cases as soon as it is done; what is there is not redone.

    A kept file that is damaged or holds another case is set aside with a line on stderr, and its case solved again.
    show: progress bar. workers: threads. A case that does not converge is kept with its last good state, and no other
    starts from it. Raises InputError where the folder cannot be written or holds another study.
    """
    folder = Path(folder)
    found = kept.take_up(folder, cases, settings, lambda line: tqdm.write(line, file=sys.stderr))
    todo = [case for case in cases if case not in found]
    with tqdm(total=len(cases), initial=len(found), desc="study", unit="case", disable=not show) as bar:

        def work(case: Case, done: dict[Case, xr.Dataset]) -> xr.Dataset:
            def progress(stage: str, residual: float) -> None:
                schedule.check()
                bar.set_postfix_str(f"{case.label}: {stage}, residual {residual:.1e}")

            return solve_case(case, settings, found | done, progress, solver)

        def keep(case: Case, data: xr.Dataset) -> None:
            kept.keep(folder, case, data)
            bar.update(1)
            if not bool(data["converged"]):
                bar.write(f"{case.label} did not converge: {data.attrs['why']}")

        schedule = Schedule(todo, {case: _needed(case, cases, found) for case in todo}, work, keep)
        if solver is solve and workers > 1 and todo and todo[0].height is None:
            Thread(target=_rehearse, args=(todo, settings), daemon=True).start()
        done = found | schedule.run(workers)
    results = tuple(done[case] for case in cases)
    return StudyResult(results, tuple(c.label for c in cases if not bool(done[c]["converged"])))


def _rehearse(todo: Sequence[Case], settings: StudySettings) -> None:
    """Compile both models' programs for slopes, then for level ground, while the first case leaves a core idle."""
    for tilted in (True, False):
        of_kind = [case for case in todo if case.height is not None and bool(case.slope_deg) == tilted]
        if of_kind:
            solution = rehearse(wake_file.model_of(of_kind[0], settings))
            add_finite_state(wake_file.to_dataset(of_kind[0], solution, settings), settings)


def _needed(case: Case, cases: Sequence[Case], found: dict[Case, xr.Dataset]) -> tuple[Case, ...]:
    """The case that has to be solved before this one, where one has."""
    near = neighbour(case, cases[: cases.index(case)])
    return () if near is None or near in found else (near,)


def solve_case(
    case: Case,
    settings: StudySettings,
    done: dict[Case, xr.Dataset],
    progress: Progress | None = None,
    solver: Solver = solve,
) -> xr.Dataset:
    """Solve one case with both models, from its nearest converged neighbour among `done` where there is one."""
    rigid = solve_wake(case, settings, done, progress, solver)
    if settings.flapping and rigid.converged:
        freed = let_flap(rigid, progress)
        data = flapping_dataset(case, rigid, freed.solution, freed.flap, settings)
    else:
        data = wake_file.to_dataset(case, rigid, settings)
    return add_finite_state(data, settings)
