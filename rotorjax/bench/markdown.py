"""Markdown tables."""

from collections.abc import Iterable, Sequence

import numpy as np

ROUNDING = 1e-14  # of numbers about one


def table(head: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """A Markdown table; numbers that are not finite become a dash, and rounding the zero that it is."""
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    lines += ["| " + " | ".join(_cell(v) for v in row) + " |" for row in rows]
    return "\n".join(lines)


def _cell(value: object) -> str:
    if isinstance(value, float):
        return f"{value if abs(value) > ROUNDING else 0.0:.4g}" if np.isfinite(value) else "–"
    return str(value)
