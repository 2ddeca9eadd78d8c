"""C81, the fixed-width airfoil format of the rotorcraft codes, as it is found.

A title and six two-digit counts, then lift, drag and moment, each with its own Mach numbers and angles, in columns of
seven characters, nine numbers a line after the first column. Read as well: lines before the title, all numbers of a row
on one line, columns of another width where blanks separate them.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from rotorjax.errors import InputError
from rotorjax.io.reading import read_text
from rotorjax.rotor.airfoil_text import Coefficient, number, require_increasing, require_lines

_PREAMBLE = 50  # lines in which the counts are looked for


@dataclass(frozen=True)
class C81:
    """The content of a C81 file: title, lift, drag and moment, each (angles in deg [N], Mach [C], values [N, C])."""

    title: str
    cl: Coefficient
    cd: Coefficient
    cm: Coefficient


def counts_of(line: str) -> list[int] | None:
    """The six counts that end a C81 title after column 30, or None where there are none."""
    for text in (line[30:42], line.rstrip()[-12:]):
        cells = [text[2 * k : 2 * k + 2].strip() for k in range(6)]
        if all(cell.isascii() and cell.isdigit() for cell in cells):
            return [int(cell) for cell in cells]
    return None


def read_c81(path: str | Path) -> C81:
    """Read a C81 file.

    Raises InputError, naming file and line, where it is cut short, ragged, not numeric or not increasing.
    """
    lines = require_lines(path, read_text(path))
    found = [(i, counts) for i, line in enumerate(lines[:_PREAMBLE]) if (counts := counts_of(line)) is not None]
    if not found:
        raise InputError(f"{path}, line 1: six two-digit counts must follow column 30, but it reads {lines[0][:60]!r}")
    start, counts = found[0]
    if min(counts[:4]) < 1 or (counts[4] == 0) != (counts[5] == 0):  # moments may be left out
        raise InputError(f"{path}, line {start + 1}: the six counts must be positive, but are {counts}")
    reader = _Reader(path, lines, start + 1)
    tables = [reader.coefficient(n_mach, n_alpha) for n_mach, n_alpha in zip(counts[::2], counts[1::2], strict=True)]
    return C81(lines[start][:30].strip(), *tables)


class _Reader:
    """Walks the lines of a C81 file."""

    def __init__(self, path: str | Path, lines: list[str], at: int):
        self.path, self.lines, self.at = path, lines, at

    def coefficient(self, n_mach: int, n_alpha: int) -> Coefficient:
        if n_mach == 0:
            return np.zeros(0), np.zeros(0), np.zeros((0, 0))
        first = self.at + 1
        mach = self._row(n_mach, labelled=False)
        require_increasing(self.path, "Mach numbers", mach, [first] * n_mach)
        rows, at = [], []
        for _ in range(n_alpha):
            at.append(self.at + 1)
            rows.append(self._row(n_mach + 1, labelled=True))
        table = np.array(rows)
        require_increasing(self.path, "angles", table[:, 0], at)
        return table[:, 0], mach, table[:, 1:]

    def _row(self, count: int, labelled: bool) -> np.ndarray:
        """The next `count` numbers, of which the first is the row's label in a column of its own."""
        values: list[float] = []
        while len(values) < count:
            if self.at >= len(self.lines):
                raise InputError(
                    f"{self.path}, line {self.at + 1}: {count - labelled} numbers must follow, but the file ends here"
                )
            cells = _cells(self.lines[self.at], count - len(values), labelled and not values)
            values += [number(cell, f"{self.path}, line {self.at + 1}") for cell in cells]
            self.at += 1
        return np.array(values)


def _cells(line: str, left: int, label: bool) -> list[str]:
    """The numbers of a line as text: between blanks where their count is right, else in columns of seven."""
    a_line = min(left, 9 + label)
    tokens = line.split()
    if len(tokens) in (left, a_line):
        return tokens
    wide = left if len(line.rstrip()) > 70 else a_line
    starts = range(0 if label else 1, wide + (0 if label else 1))
    return [line[7 * k : 7 * k + 7] for k in starts]


def write_c81(path: str | Path, content: C81) -> None:
    """Write a C81 file; a value keeps as many digits as seven characters hold.

    Raises InputError where a table has more than 99 angles or Mach numbers, which the format's two-digit counts cannot
    say.
    """
    tables = (content.cl, content.cd, content.cm)
    sizes = [n for t in tables for n in (t[1].size, t[0].size)]
    if max(sizes) > 99:
        raise InputError(f"A C81 table must have at most 99 angles and Mach numbers, but one has {max(sizes)}")
    out = [f"{content.title[:30]:<30}" + "".join(f"{n:2d}" for n in sizes)]
    for alpha, mach, values in tables:
        out += _rows(" " * 7, mach)
        for a, row in zip(alpha, values, strict=True):
            out += _rows(_seven(a), row)
    Path(path).write_text("\n".join(out) + "\n", encoding="utf-8")


def _rows(first: str, values: np.ndarray) -> list[str]:
    cells = [_seven(v) for v in values]
    return [(" " * 7 if k else first) + "".join(cells[k : k + 9]) for k in range(0, len(cells), 9)]


def _seven(value: float) -> str:
    """Write a number in seven characters with as many decimals as fit, then without the zeros at its end."""
    for decimals in range(6, 0, -1):
        text = f"{value:.{decimals}f}"
        short = text.replace("0.", ".", 1) if abs(value) < 1 else text
        if len(short) <= 7:
            kept = text.rstrip("0")
            kept += "0" if kept.endswith(".") else ""
            return "    0.0" if float(kept) == 0 else f"{kept if len(kept) <= 7 else short.rstrip('0'):>7}"
    raise InputError(f"A C81 value must fit in seven characters, but is {value}")
