"""The cases of the paper's evaluation, and the order in which each one starts from a neighbour."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from rotorjax.errors import InputError
from rotorjax.ground import Plane, plane

HEIGHTS = (0.5, 0.75, 1.0, 1.5, 2.0, 3.0)
SLOPES_DEG = (5.0, 8.0, 10.0, 15.0, 30.0, 40.0)
SLOPE_HEIGHT = 1.0  # where all slopes are computed
STEEP_DEG, STEEP_HEIGHTS = 30.0, (1.5, 0.9)  # the slope that is also computed at other heights
QUICK_HEIGHTS = (1.0, 1.5, 2.0)
QUICK_SLOPES_DEG = (15.0,)


@dataclass(frozen=True)
class Case:
    """One steady hover. height: hub over the ground along the shaft, over R, or None out of ground effect."""

    height: float | None = None
    slope_deg: float = 0.0

    @property
    def name(self) -> str:
        """Short name, also of its file: oge, h0.75, h1-slope15."""
        if self.height is None:
            return "oge"
        return f"h{_digits(self.height)}" + (f"-slope{_digits(self.slope_deg)}" if self.slope_deg else "")

    @property
    def label(self) -> str:
        """Name for readers."""
        if self.height is None:
            return "OGE"
        return f"h = {_digits(self.height)}" + (f", δ = {_digits(self.slope_deg)}°" if self.slope_deg else "")

    @property
    def ground(self) -> Plane | None:
        """The ground plane. Raises InputError where the disk would cut it."""
        return None if self.height is None else plane(self.height, self.slope_deg)


def study_cases(heights: Iterable[float], slopes_deg: Iterable[float]) -> tuple[Case, ...]:
    """All cases of a study in solving order, each after the neighbour it starts from.

    Out of ground effect, from which the highest starts; level ground from there down; slopes at h = 1 (which brings in
    the level case there) from the gentlest up; the 30° slope at h = 1.5 and 0.9 where 30° is among the slopes. Raises
    InputError where a height or a slope is not allowed, a height is at or below the rotor's clearance, or a slope is
    zero.
    """
    heights, slopes = _numbers("heights", heights), _numbers("slopes", slopes_deg)
    if 0.0 in slopes:
        raise InputError("Argument `slopes` must be positive (level ground goes among `heights`), but holds 0")
    level = sorted(set(heights) | ({SLOPE_HEIGHT} if slopes else set()), reverse=True)
    cases = [Case(), *(Case(h) for h in level), *(Case(SLOPE_HEIGHT, s) for s in sorted(slopes))]
    if STEEP_DEG in slopes:
        cases += [Case(h, STEEP_DEG) for h in STEEP_HEIGHTS]
    for case in cases:
        _ = case.ground  # checks height, slope and clearance
    return tuple(cases)


def neighbour(case: Case, solved: Sequence[Case]) -> Case | None:
    """The solved case that `case` starts from; None where none is.

    Over ground the closest in slope, then in height, or the one out of ground effect.
    """
    if case.height is None:
        return None
    near = [other for other in solved if other.height is not None and other != case]
    distant = next((other for other in solved if other.height is None), None)
    return min(near, key=lambda other: _distance(case, other), default=distant)


def _digits(value: float) -> str:
    """As few digits as tell a number from all others, so that no two cases share a name."""
    return repr(float(value)).removesuffix(".0")


def _distance(case: Case, other: Case) -> tuple[float, float]:
    assert case.height is not None
    assert other.height is not None
    return abs(case.slope_deg - other.slope_deg), abs(math.log(case.height / other.height))


def _numbers(name: str, values: Iterable[float]) -> list[float]:
    numbers = [float(v) for v in values]
    for value in numbers:
        if not math.isfinite(value):
            raise InputError(f"Argument `{name}` must hold finite numbers, but holds {value}")
    return list(dict.fromkeys(numbers))
