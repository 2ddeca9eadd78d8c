"""A march paced by the clock: frame after frame at its time, late ones counted."""

import time
from collections.abc import Callable
from dataclasses import dataclass, field


@dataclass
class Pace:
    """Waits until a frame is due and shows it. late: frames that were not ready; frames: so far. worst: seconds by
    which one was late. waited: seconds in all.

    A late frame is shown at once; the next is due when it would have been.
    """

    show: Callable[[str], None]
    late: int = 0
    frames: int = 0
    worst: float = 0.0
    waited: float = 0.0
    _begun: float | None = field(default=None, init=False)

    def start(self) -> None:
        """Begin at time 0."""
        self._begun = time.perf_counter()

    def frame(self, due: float, line: str) -> None:
        """Show a frame that is due `due` seconds from the start."""
        if self._begun is None:
            self.start()
        assert self._begun is not None
        early = self._begun + due - time.perf_counter()
        self.frames += 1
        if early < 0:
            self.late += 1
            self.worst = max(self.worst, -early)
        else:
            time.sleep(early)
            self.waited += early
        self.show(f"{line}  late {self.late}")
