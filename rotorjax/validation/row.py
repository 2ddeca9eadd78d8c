"""One comparison: what was computed, what it is compared with, what may lie between them, and the verdict."""

import math
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Against:
    """What a number is compared with. source: of the reference; uncertainty: its own; reason: of the allowed range."""

    source: str
    uncertainty: str
    reason: str


@dataclass(frozen=True)
class Allowed:
    """Where a number has to lie. reference: None where there is only a range. low, high: both ends included; either
    may be infinite. allowed: the same in words.
    """

    reference: float | None
    low: float
    high: float
    allowed: str


@dataclass(frozen=True)
class Row:
    """A row of the validation's table.

    case: its case's name. quantity: in words, the place included. ours: the free wake's number. note: what else has to
    be known, such as a wake that did not converge. wakes: labels of those that it is read from; none: all of its case.
    """

    case: str
    quantity: str
    ours: float
    limits: Allowed
    against: Against
    note: str = ""
    wakes: tuple[str, ...] = ()

    @property
    def met(self) -> bool:
        """Whether the number lies in its range; one that is not finite does not."""
        return math.isfinite(self.ours) and self.limits.low <= self.ours <= self.limits.high

    @property
    def verdict(self) -> str:
        """Return "met" or "out"."""
        return "met" if self.met else "out"

    @property
    def difference(self) -> float | None:
        """Ours less the reference, where there is one."""
        return None if self.limits.reference is None else self.ours - self.limits.reference

    def table(self) -> dict[str, Any]:
        """The row as plain values, for validation.json."""
        return {
            "case": self.case,
            "quantity": self.quantity,
            "ours": self.ours,
            "reference": self.limits.reference,
            "difference": self.difference,
            "source": self.against.source,
            "uncertainty": self.against.uncertainty,
            "low": self.limits.low,
            "high": self.limits.high,
            "allowed": self.limits.allowed,
            "reason": self.against.reason,
            "verdict": self.verdict,
            "note": self.note,
        }


def relative(share: float, reference: float) -> Allowed:
    """Within a share of the reference on either side of it (0.03 is 3 %)."""
    margin = share * abs(reference)
    return Allowed(reference, reference - margin, reference + margin, f"±{100 * share:.3g} %")


def absolute(margin: float, reference: float) -> Allowed:
    """Within a margin on either side of the reference, in its own unit."""
    return Allowed(reference, reference - margin, reference + margin, f"±{margin:.3g}")


def between(low: float, high: float) -> Allowed:
    """A range without a reference; either end may be infinite."""
    if math.isinf(high):
        return Allowed(None, low, high, f"at least {low:.3g}")
    return Allowed(None, low, high, f"at most {high:.3g}" if math.isinf(low) else f"{low:.3g} to {high:.3g}")


def above_zero() -> Allowed:
    """Any positive number."""
    return Allowed(None, math.nextafter(0.0, 1.0), math.inf, "above 0")
