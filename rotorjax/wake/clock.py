"""Wall time and compile time."""

import threading
import time

import jax


class Clock:
    """Wall time, and the part of it that XLA spent compiling, from jax's own monitoring events."""

    compiled = threading.local()
    listening = False

    def __init__(self) -> None:
        """Start, and listen to compilation from the first clock on."""
        if not Clock.listening:
            jax.monitoring.register_event_duration_secs_listener(Clock.hear)
            Clock.listening = True
        self.wall, self.compiling = time.perf_counter(), Clock._so_far()

    @staticmethod
    def _so_far() -> float:
        return getattr(Clock.compiled, "seconds", 0.0)

    @staticmethod
    def hear(event: str, duration_secs: float, **_: str | int) -> None:
        """Add up the durations of XLA's compilations (tracing nests, and would count twice)."""
        if event == "/jax/core/compile/backend_compile_duration":
            Clock.compiled.seconds = Clock._so_far() + duration_secs

    def read(self) -> tuple[float, float]:
        """Seconds since the start: in all, and of them spent compiling by XLA in this thread."""
        return time.perf_counter() - self.wall, Clock._so_far() - self.compiling
