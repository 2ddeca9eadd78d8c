"""Every task runs after what it needs; errors and interrupts come through and keep nothing half."""

import threading
import time

import pytest

from rotorjax.bench.schedule import Schedule

NEEDS = {"a": None, "b": None, "c": "a", "d": "b", "e": "d"}


@pytest.mark.parametrize("workers", [1, 2, 4])
def test_order(workers):
    kept = []

    def work(task, done):
        assert NEEDS[task] is None or NEEDS[task] in done
        return task.upper()

    schedule = Schedule(list(NEEDS), NEEDS.get, work, lambda task, result: kept.append(task))
    assert schedule.run(workers) == {task: task.upper() for task in NEEDS}
    assert sorted(kept) == sorted(NEEDS)


def test_two_workers_work_at_the_same_time():
    meeting = threading.Barrier(2, timeout=10)
    Schedule(["a", "b"], NEEDS.get, lambda task, done: meeting.wait(), lambda task, result: None).run(2)


def test_an_error_ends_everything():
    kept = []

    def work(task, done):
        if task == "c":
            raise ValueError("no c")
        return task

    schedule = Schedule(list(NEEDS), NEEDS.get, work, lambda task, result: kept.append(task))
    with pytest.raises(ValueError, match="no c"):
        schedule.run(1)
    assert kept == ["a", "b"]


def test_an_interrupt_stops_workers_at_their_next_check(monkeypatch):
    ended = threading.Event()

    def work(task, done):
        try:
            while True:
                schedule.check()
                time.sleep(0.01)
        finally:
            ended.set()

    schedule = Schedule(["a"], NEEDS.get, work, lambda task, result: pytest.fail("kept"))

    class Interrupting(threading.Thread):
        def join(self, timeout=None):
            raise KeyboardInterrupt

    monkeypatch.setattr("rotorjax.bench.schedule.threading.Thread", Interrupting)
    with pytest.raises(KeyboardInterrupt):
        schedule.run(1)
    assert ended.wait(10)
