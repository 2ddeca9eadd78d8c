"""What a case of the validation is, and whose wakes it looks at."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from matplotlib.figure import Figure

from rotorjax.validation.point import Point, point
from rotorjax.validation.row import Row
from rotorjax.wake.solution import Solution

Wakes = Mapping[Point, Solution]


@dataclass(frozen=True)
class Subject:
    """What is validated. rotor, collective_deg: those asked for; None: the rotors of each case. quick: coarse wakes.

    measured: points (C_T, C_Q) that the user has of a case's rotors, by what they were measured on.
    """

    rotor: str | None = None
    collective_deg: float | None = None
    quick: bool = False
    measured: Mapping[str, Sequence[tuple[float, float]]] | None = None

    def hovers(self, *default: Point) -> tuple[Point, ...]:
        """The rotor that was asked for, at its collective, or a case's own points."""
        return default if self.rotor is None else (point(self.rotor, self.collective_deg),)


@dataclass(frozen=True)
class Comparison:
    """What a case came to. rows: with verdicts. draw: makes its picture."""

    rows: Sequence[Row]
    draw: Callable[[], Figure]


@dataclass(frozen=True)
class ValidationCase:
    """One comparison. points: the wakes that it needs, each before those that start from it. compare: rows and picture.

    known: what is known about rows of it that are out. length: how long a comparison takes, in wakes.
    """

    name: str
    title: str
    points: Callable[[Subject], Sequence[Point]]
    compare: Callable[[Subject, Wakes], Comparison]
    known: str = ""
    length: float = 0.1
