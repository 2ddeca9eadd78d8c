"""The sweep itself: take up what is kept, solve the rest in the plan's order, keep each as it is done."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import equinox as eqx
import jax

from rotorjax.bench.progress import ProgressLine
from rotorjax.errors import InputError
from rotorjax.sweep.case import SweepCase
from rotorjax.sweep.design import DesignPoint, plan, points_of
from rotorjax.sweep.found import Found, Neighbour, PointSolver, refused
from rotorjax.sweep.kept import PointShelf
from rotorjax.sweep.pools import Here, Job, Pool
from rotorjax.sweep.problem import Problem, problem_of, table_of

Task = tuple[DesignPoint, ...]


@dataclass(frozen=True)
class Swept:
    """A sweep that ran to its end. points, found: in the order of the case's table. table: what it was made with."""

    case: SweepCase
    points: tuple[DesignPoint, ...]
    found: tuple[Found, ...]
    table: dict[str, Any]

    @property
    def failures(self) -> list[tuple[DesignPoint, Found]]:
        """Points that did not converge."""
        return [(p, one) for p, one in zip(self.points, self.found, strict=True) if not one.solved]


@dataclass(frozen=True)
class Work:
    """What there is to do. prepared: of each point that is allowed; refused: the others. tasks: in solving order, each
    with the point that it would start from.
    """

    prepared: dict[DesignPoint, Any]
    refused: dict[DesignPoint, Found]
    tasks: tuple[Task, ...]
    nearest: dict[DesignPoint, DesignPoint | None]


def prepare(case: SweepCase, problem: Problem) -> Work:
    """Look at every point before the first is solved. Raises InputError where none is allowed, with a reason."""
    prepared, not_allowed = {}, {}
    for point in points_of(case):
        try:
            prepared[point] = problem.prepare(case, point)
        except InputError as error:
            not_allowed[point] = refused(str(error))
    if not prepared:
        point, first = next(iter(not_allowed.items()))
        raise InputError(f"No point of the sweep is allowed; at {point.label}: {first.verdict}")
    if problem.batch > 1:
        return Work(prepared, not_allowed, _batches(prepared, problem.batch), dict.fromkeys(prepared))
    planned = plan(tuple(prepared))
    return Work(prepared, not_allowed, tuple((point,) for point in planned.order), planned.nearest)


def _batches(prepared: dict[DesignPoint, Any], size: int) -> tuple[Task, ...]:
    """Points whose arrays have the same shapes, so many at a time; the same points make the same batches."""
    alike: dict[Any, list[DesignPoint]] = {}
    for point, one in prepared.items():
        arrays, rest = eqx.partition(one.arrays, eqx.is_array)
        key = (str(jax.tree.structure(rest)), tuple(leaf.shape for leaf in jax.tree.leaves(arrays)))
        alike.setdefault(key, []).append(point)
    return tuple(tuple(points[k : k + size]) for points in alike.values() for k in range(0, len(points), size))


def sweep(
    case: SweepCase,
    folder: str | Path,
    *,
    pool: Callable[[ProgressLine], Pool] | None = None,
    solver: PointSolver | None = None,
) -> Swept:
    """Solve all points, keeping each in folder/points as soon as it is done; what is there is not solved again.

    pool: makes the workers, given the progress line; this process by default. solver: in place of the case's own. Each
    point starts from its nearest solved neighbour in the plan, so that stopping and going on changes nothing. Raises
    InputError where no point is allowed, or the folder cannot be written or holds another sweep.
    """
    problem, shelf = problem_of(case), PointShelf(Path(folder), table_of(case))
    work = prepare(case, problem)
    shelf.open()
    points = points_of(case)
    with ProgressLine("sweep", len(points)) as progress:
        found = dict(work.refused)
        for task in work.tasks:
            kept = shelf.take_up(task, progress.say)
            found |= {} if kept is None else dict(zip(task, kept, strict=True))
        progress.begin(len(found))
        if any(point not in found for task in work.tasks for point in task):
            workers = Here(progress.stage) if pool is None else pool(progress)
            try:
                _work_off(work, solver or problem.solve, workers, found, shelf, progress)
            finally:
                workers.close()
    return Swept(case, points, tuple(found[point] for point in points), shelf.table)


def _work_off(
    work: Work,
    solver: PointSolver,
    pool: Pool,
    found: dict[DesignPoint, Found],
    shelf: PointShelf,
    progress: ProgressLine,
) -> None:
    """Submit each task once the point that it starts from is done, and keep what comes back."""
    waiting = [task for task in work.tasks if task[0] not in found]
    under_way = 0
    while waiting or under_way:
        ready = [task for task in waiting if _is_ready(task, work, found)]
        for task in ready[: max(pool.size - under_way, 0)]:
            waiting.remove(task)
            prepared = [work.prepared[point] for point in task]
            pool.submit(task, Job(solved, (solver, prepared, start_of(task[0], work, found))))
            under_way += 1
        for task, results in pool.finished():
            under_way -= 1
            shelf.keep(task, results)
            found.update(zip(task, results, strict=True))
            progress.advance(len(task))
            for point, one in zip(task, results, strict=True):
                if not one.solved:
                    progress.say(f"{point.label}: {one.verdict}")


def solved(
    solver: PointSolver, prepared: Sequence[Any], start: Neighbour | None, show: Callable[[str, float], None] | None
) -> list[Found]:
    """What a solver finds; what it refuses is a point without a solution."""
    try:
        return solver(prepared, start, show)
    except InputError as error:
        return [refused(str(error))] * len(prepared)


def _is_ready(task: Task, work: Work, found: dict[DesignPoint, Found]) -> bool:
    near = work.nearest[task[0]]
    return near is None or near in found


def start_of(point: DesignPoint, work: Work, found: dict[DesignPoint, Found]) -> Neighbour | None:
    """The nearest point of the plan that converged, and where it did not, the one that it was to start from, and on."""
    near = work.nearest[point]
    while near is not None and not (found[near].solved and found[near].state):
        near = work.nearest[near]
    return None if near is None else Neighbour(work.prepared[near], found[near])
