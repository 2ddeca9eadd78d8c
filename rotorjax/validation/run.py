"""Validation: solve the wakes that the cases ask for, two at a time, and compare."""

import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace

from tqdm import tqdm

from rotorjax.bench.schedule import Schedule
from rotorjax.bench.single import Solver
from rotorjax.validation.case import Comparison, Subject, ValidationCase
from rotorjax.validation.point import Point, needed
from rotorjax.validation.row import Row
from rotorjax.wake.solution import Solution, solve


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
    """Solve all wakes of the cases and compare. Every row that is read from a wake that did not converge is out.

    show: progress bar on stderr. workers: threads. Raises InputError where a rotor or a setting is not allowed.
    """
    started = time.perf_counter()
    wakes = solve_points(_ordered(cases, subject), subject.quick, show=show, solver=solver, workers=workers)
    compared = tuple(_compare(case, subject, wakes) for case in cases)
    return Validation(subject, tuple(cases), compared, wakes, time.perf_counter() - started)


def solve_points(
    tasks: Sequence[Point], quick: bool, *, show: bool = True, solver: Solver = solve, workers: int = 2
) -> dict[Point, Solution]:
    """Solve wakes in order, each from the nearest one before it; the same settings for all of them.

    Raises InputError where a rotor or a setting is not allowed.
    """
    models = {task: task.model(quick) for task in tasks}
    with tqdm(total=len(tasks), desc="validate", unit="wake", disable=not show, file=sys.stderr) as bar:

        def work(task: Point, done: dict[Point, Solution]) -> Solution:
            def progress(stage: str, residual: float) -> None:
                schedule.check()
                bar.set_postfix_str(f"{task.label}: {stage}, residual {residual:.1e}")

            near = needed(task, tasks)
            start = None if near is None or not done[near].converged else done[near]
            return solver(models[task], start, progress)

        def keep(task: Point, solution: Solution) -> None:
            bar.update(1)
            if not solution.converged:
                bar.write(f"{task.label} did not converge: {solution.why}", file=sys.stderr)

        schedule = Schedule(tasks, lambda task: needed(task, tasks), work, keep)
        return schedule.run(workers)


def _ordered(cases: Sequence[ValidationCase], subject: Subject) -> list[Point]:
    """All points once: those that start from nothing first, since compiling takes longest, the others as they come."""
    every = list(dict.fromkeys(p for case in cases for p in case.points(subject)))
    return sorted(every, key=lambda p: needed(p, every) is not None)


def _compare(case: ValidationCase, subject: Subject, wakes: dict[Point, Solution]) -> Comparison:
    failed = [p.label for p in case.points(subject) if not wakes[p].converged]
    found = case.compare(subject, wakes)
    return replace(found, rows=[_without(row, failed) for row in found.rows])


def _without(row: Row, failed: list[str]) -> Row:
    """The row, out where one of its wakes failed."""
    missing = [label for label in failed if not row.wakes or label in row.wakes]
    return replace(row, ours=float("nan"), note="not converged: " + "; ".join(missing)) if missing else row
