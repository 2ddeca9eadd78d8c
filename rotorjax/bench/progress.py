"""One line of progress with a forecast: it turns in a terminal, and in a log file a new one comes now and then."""

import sys
import time
from types import TracebackType
from typing import TextIO

from tqdm import tqdm

EVERY = 20.0  # s between lines in a file


class ProgressLine:
    """Counts what is done of `total`, shows a stage, and says when it will be over; on stderr unless told otherwise."""

    def __init__(self, what: str, total: int, unit: str = "point", stream: TextIO | None = None) -> None:
        """Begin with nothing done."""
        self._stream = sys.stderr if stream is None else stream
        self._what, self._total, self._unit = what, total, unit
        self._begun, self._first, self.done, self._shown = time.monotonic(), 0, 0, 0.0
        self._bar = None
        if self._stream.isatty():
            self._bar = tqdm(desc=what, total=total, unit=unit, file=self._stream, leave=False)

    def __enter__(self) -> "ProgressLine":
        """Begin a block."""
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None):
        """End it."""
        if self._bar is not None:
            self._bar.close()

    def begin(self, done: int) -> None:
        """Say what was done before; the forecast counts from here."""
        self._begun, self._first, self.done = time.monotonic(), done, done
        if self._bar is not None:
            self._bar.reset(self._total)
            self._bar.initial = self._bar.n = done
            self._bar.refresh()

    def stage(self, text: str, residual: float = 0.0) -> None:
        """Show what is being done now, and how far it is."""
        if self._bar is not None:
            self._bar.set_postfix_str(f"{text}, residual {residual:.1e}" if residual else text)

    def advance(self, count: int = 1) -> None:
        """Count what is done."""
        self.done += count
        if self._bar is not None:
            self._bar.update(count)
        elif self.done == self._total or time.monotonic() - self._shown > EVERY:
            self._shown = time.monotonic()
            print(self.line(time.monotonic() - self._begun), file=self._stream, flush=True)

    def line(self, seconds: float) -> str:
        """How things stand after some seconds."""
        left = self._total - self.done
        made = self.done - self._first
        forecast = f", about {_span(seconds * left / made)} left" if left and made else ""
        return f"{self._what}: {self.done} of {self._total} {self._unit}s in {_span(seconds)}{forecast}"

    def say(self, line: str) -> None:
        """Print a line of its own."""
        if self._bar is not None:
            self._bar.write(line, file=self._stream)
        else:
            print(line, file=self._stream, flush=True)


def _span(seconds: float) -> str:
    if seconds < 90:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 5400 else f"{seconds / 3600:.1f} h"
