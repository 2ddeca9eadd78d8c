"""Tasks that need others' results, worked off by a few threads in order.

Most of a study's time is compilation, which XLA does in one thread without holding Python's lock: two threads that each
compile another kind of case halve it on two cores.
"""

import threading
from collections.abc import Callable, Collection, Hashable, Mapping, Sequence
from typing import Generic, TypeVar

Task = TypeVar("Task", bound=Hashable)
Result = TypeVar("Result")


class Stopped(Exception):
    """Raised in a worker's own callbacks once the schedule is being abandoned."""


def longest_chain_first(
    tasks: Sequence[Task], needs: Mapping[Task, Collection[Task]], lengths: Mapping[Task, float]
) -> list[Task]:
    """Tasks by how long it takes to work them off and what waits for them, one after the other, longest first.

    Those that take as long stay in order.
    """
    chains = dict(lengths)

    def lengthen(task: Task) -> None:
        for need in needs[task]:
            if chains[need] < lengths[need] + chains[task]:
                chains[need] = lengths[need] + chains[task]
                lengthen(need)

    for task in tasks:
        lengthen(task)
    return sorted(tasks, key=lambda task: -chains[task])


class Schedule(Generic[Task, Result]):
    """Works off `tasks`, the first ready one first; a task is ready when all that it `needs` are done.

    work(task, done) makes a result from those done so far; keep(task, result) is called for one at a time.
    """

    def __init__(
        self,
        tasks: Sequence[Task],
        needs: Mapping[Task, Collection[Task]],
        work: Callable[[Task, dict[Task, Result]], Result],
        keep: Callable[[Task, Result], None],
    ) -> None:
        """Set up; nothing runs before `run`."""
        self._tasks, self._needs, self._work, self._keep = tasks, needs, work, keep
        self._waiting, self._done = list(tasks), {}
        self._change = threading.Condition()
        self._errors: list[BaseException] = []
        self.stopping = False

    def run(self, workers: int) -> dict[Task, Result]:
        """Work all tasks off and return their results in the order of `tasks`.

        The first exception of a worker, or an interrupt, ends everything and is raised here; nothing is being kept at
        that moment. Workers that are still computing are left to die with the program.
        """
        threads = [threading.Thread(target=self._worker, daemon=True) for _ in range(workers)]
        try:
            for thread in threads:
                thread.start()
            for thread in threads:
                while thread.is_alive() and not self._errors:
                    thread.join(0.1)  # short waits, so that an interrupt gets through
        finally:
            with self._change:
                self.stopping = True
                self._change.notify_all()
        if self._errors:
            raise self._errors[0]
        return {task: self._done[task] for task in self._tasks}

    def check(self) -> None:
        """Raise `Stopped` if everything is being abandoned; for long work to call now and then."""
        if self.stopping:
            raise Stopped

    def _worker(self) -> None:
        try:
            while (task := self._take()) is not None:
                result = self._work(task, dict(self._done))
                with self._change:
                    self.check()
                    self._keep(task, result)
                    self._done[task] = result
                    self._change.notify_all()
        except Stopped:
            pass
        except BaseException as error:  # handed to the main thread
            with self._change:
                self._errors.append(error)
                self._change.notify_all()

    def _take(self) -> Task | None:
        with self._change:
            while self._waiting and not self.stopping and not self._errors:
                for task in self._waiting:
                    if all(need in self._done for need in self._needs[task]):
                        self._waiting.remove(task)
                        return task
                self._change.wait()
        return None
