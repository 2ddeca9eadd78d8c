"""Every task runs after what it needs; errors and interrupts come through and keep nothing half."""

import threading
import time

import pytest

from rotorjax.bench.schedule import Schedule, longest_chain_first

NEEDS = {"a": "", "b": "", "c": "a", "d": "b", "e": "da"}


@pytest.mark.parametrize("workers", [1, 2, 4])
def test_order(workers):
    kept = []

    def work(task, done):
        assert set(NEEDS[task]) <= set(done)
        return task.upper()

    schedule = Schedule(list(NEEDS), NEEDS, work, lambda task, result: kept.append(task))
    assert schedule.run(workers) == {task: task.upper() for task in NEEDS}
    assert sorted(kept) == sorted(NEEDS)


def test_the_longest_chain_is_first():
    alike = dict.fromkeys(NEEDS, 1.0)
    assert longest_chain_first(list(NEEDS), NEEDS, alike) == ["b", "a", "d", "c", "e"]
    assert longest_chain_first(list("edcba"), NEEDS, alike) == ["b", "d", "a", "e", "c"]
    assert longest_chain_first(list(NEEDS), NEEDS, alike | {"c": 5.0}) == ["a", "c", "b", "d", "e"]


def test_two_workers_work_at_the_same_time():
    meeting = threading.Barrier(2, timeout=10)
    Schedule(["a", "b"], NEEDS, lambda task, done: meeting.wait(), lambda task, result: None).run(2)


def test_an_error_ends_everything():
    kept = []

    def work(task, done):
        if task == "c":
            raise ValueError("no c")
        return task

    schedule = Schedule(list(NEEDS), NEEDS, work, lambda task, result: kept.append(task))
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

    schedule = Schedule(["a"], NEEDS, work, lambda task, result: pytest.fail("kept"))

    class Interrupting(threading.Thread):
        def join(self, timeout=None):
            raise KeyboardInterrupt

    monkeypatch.setattr("rotorjax.bench.schedule.threading.Thread", Interrupting)
    with pytest.raises(KeyboardInterrupt):
        schedule.run(1)
    assert ended.wait(10)
