"""How long each stage of a linearisation took."""

import time

from rotorjax.wake.search import Progress


class Stages:
    """Wall time of each stage, shown as it ends."""

    def __init__(self, progress: Progress | None) -> None:
        """Start counting. progress(stage, residual) is called as each stage ends."""
        self._progress, self._last = progress, time.perf_counter()
        self.seconds: dict[str, float] = {}

    def done(self, stage: str) -> None:
        """End a stage."""
        now = time.perf_counter()
        self.seconds[stage], self._last = now - self._last, now
        if self._progress is not None:
            self._progress(f"{stage} done", 0.0)
