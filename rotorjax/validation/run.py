"""Validation: solve the wakes that the cases ask for and compare, two at a time."""

import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace

from tqdm import tqdm

from rotorjax.bench.schedule import Schedule, longest_chain_first
from rotorjax.bench.single import Solver
from rotorjax.validation.case import Comparison, Subject, ValidationCase
from rotorjax.validation.point import Point, needed
from rotorjax.validation.row import Row
from rotorjax.wake.solution import Solution, solve

Task = Point | ValidationCase


@dataclass(frozen=True)
class Validation:
    """A finished validation. comparisons: one for each case. wakes: every one that was solved."""

    subject: Subject
    cases: tuple[ValidationCase, ...]
    comparisons: tuple[Comparison, ...]
    wakes: dict[Point, Solution]
    wall_time_s: float

    @property
    def rows(self) -> tuple[Row, ...]:
        """Rows of all cases, in order."""
        return tuple(row for found in self.comparisons for row in found.rows)

    @property
    def out(self) -> tuple[Row, ...]:
        """Rows whose number is not where it has to be."""
        return tuple(row for row in self.rows if not row.met)


def validate(
    cases: Sequence[ValidationCase],
    subject: Subject,
    *,
    show: bool = True,
    solver: Solver = solve,
    workers: int = 2,
) -> Validation:
    """Solve all wakes of the cases, each from the nearest one before it, and compare each case once it has its own.

    Every row that is read from a wake that did not converge is out.

    show: progress bar on stderr. workers: threads. Raises InputError where a rotor or a setting is not allowed.
    """
    started = time.perf_counter()
    points = list(dict.fromkeys(p for case in cases for p in case.points(subject)))
    models = {at: at.model(subject.quick) for at in points}
    needs: dict[Task, tuple[Task, ...]] = {task: _needs(task, points, subject) for task in (*cases, *points)}
    with tqdm(total=len(needs), desc="validate", unit="step", disable=not show, file=sys.stderr) as bar:

        def work(task: Task, done: dict[Task, Solution | Comparison]) -> Solution | Comparison:
            found = _wakes(done, needs[task])
            if isinstance(task, ValidationCase):
                return _compare(task, subject, found)

            def progress(stage: str, residual: float) -> None:
                schedule.check()
                bar.set_postfix_str(f"{task.label}: {stage}, residual {residual:.1e}")

            start = next((near for near in found.values() if near.converged), None)
            return solver(models[task], start, progress)

        def keep(task: Task, found: Solution | Comparison) -> None:
            bar.update(1)
            if isinstance(task, Point) and isinstance(found, Solution) and not found.converged:
                bar.write(f"{task.label} did not converge: {found.why}", file=sys.stderr)

        lengths = {task: task.length for task in needs}
        schedule = Schedule(longest_chain_first(list(needs), needs, lengths), needs, work, keep)
        done = schedule.run(workers)
    compared = tuple(found for case in cases if isinstance(found := done[case], Comparison))
    return Validation(subject, tuple(cases), compared, _wakes(done, points), time.perf_counter() - started)


def _wakes(done: dict[Task, Solution | Comparison], tasks: Sequence[Task]) -> dict[Point, Solution]:
    return {at: found for at in tasks if isinstance(at, Point) and isinstance(found := done[at], Solution)}


def _needs(task: Task, points: Sequence[Point], subject: Subject) -> tuple[Point, ...]:
    """What a case compares; what a wake starts from."""
    if isinstance(task, ValidationCase):
        return tuple(task.points(subject))
    near = needed(task, points)
    return () if near is None else (near,)


def _compare(case: ValidationCase, subject: Subject, wakes: dict[Point, Solution]) -> Comparison:
    failed = [p.label for p in case.points(subject) if not wakes[p].converged]
    found = case.compare(subject, wakes)
    return replace(found, rows=[_without(row, failed) for row in found.rows])


def _without(row: Row, failed: list[str]) -> Row:
    """The row, out where one of its wakes failed."""
    missing = [label for label in failed if not row.wakes or label in row.wakes]
    return replace(row, ours=float("nan"), note="not converged: " + "; ".join(missing)) if missing else row
