"""Wall time and compile time."""

import time

import jax


class Clock:
    """Wall time, and the part of it that XLA spent compiling, from jax's own monitoring events."""

    seconds = 0.0
    listening = False

    def __init__(self) -> None:
        """Start, and listen to compilation from the first clock on."""
        if not Clock.listening:
            jax.monitoring.register_event_duration_secs_listener(Clock.hear)
            Clock.listening = True
        self.wall, self.compiling = time.perf_counter(), Clock.seconds

    @staticmethod
    def hear(event: str, duration_secs: float, **_: str | int) -> None:
        """Add up the durations of jax's compilation events."""
        if event.startswith("/jax/core/compile"):
            Clock.seconds += duration_secs

    def read(self) -> tuple[float, float]:
        """Seconds since the start: in all, and of them spent compiling (nested events may count twice)."""
        return time.perf_counter() - self.wall, Clock.seconds - self.compiling
