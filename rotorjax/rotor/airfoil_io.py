"""Reading and writing airfoil tables: CSV files and C81, the fixed-width format of the rotorcraft codes.

CSV: lines that start with `#` are comments. The first other line names the columns: `alpha_deg,cl,cd` (more columns are
ignored) for one Mach number, or `alpha_deg` and the Mach numbers for one coefficient over both. Angles in degrees.

C81: a title and six counts, then lift, drag and moment, each with its own angles and Mach numbers, in columns of seven
characters.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from rotorjax.errors import InputError

Coefficient = tuple[np.ndarray, np.ndarray, np.ndarray]
"""(angles in degrees [N], Mach numbers [C], values [N, C])."""


@dataclass(frozen=True)
class C81:
    """The content of a C81 file: title, lift, drag and moment, each (angles in deg [N], Mach [C], values [N, C])."""

    title: str
    cl: Coefficient
    cd: Coefficient
    cm: Coefficient


def read_polar(path: str | Path) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Read angles (deg), cl and cd, each [N], from a CSV file with the columns alpha_deg, cl, cd.

    Raises InputError, naming file and line, where the file is not there, a column is missing, a row is ragged or holds
    something that is not a finite number, or the angles do not increase.
    """
    alpha, cl, cd = read_columns(path, ("alpha_deg", "cl", "cd"))
    return alpha, cl, cd


def read_alpha_mach(path: str | Path) -> Coefficient:
    """Read a coefficient over angle (deg, rows) and Mach number (columns) from a CSV file. Raises as `read_polar`."""
    header, rows = _read_csv(path)
    try:
        mach = np.array([float(c) for c in header[1:]])
    except ValueError:
        raise InputError(f"{path}: the header must be alpha_deg and Mach numbers, but is {header}") from None
    if mach.size == 0 or np.any(np.diff(mach) <= 0) or not np.all(np.isfinite(mach)):
        raise InputError(f"{path}: the header's Mach numbers must increase, but are {header[1:]}")
    return rows[:, 0], mach, rows[:, 1:]


def read_columns(path: str | Path, names: tuple[str, ...]) -> tuple[np.ndarray, ...]:
    """Read the named columns, each [N], from a CSV file whose first column increases. Raises as `read_polar` does."""
    header, rows = _read_csv(path)
    missing = [c for c in names if c not in header]
    if missing:
        raise InputError(f"{path}: columns must include {', '.join(names)}, but {missing[0]!r} is not among {header}")
    return tuple(rows[:, header.index(c)] for c in names)


def mirror(alpha: np.ndarray, cl: np.ndarray, cd: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Complete the table of a symmetric section from its angles 0 to 180: cl odd, cd even.

    Raises InputError where the angles do not hold 0 and 180, the lift is not zero there, or a negative angle that is
    listed contradicts the mirror image.
    """
    for angle in (0.0, 180.0):
        lift = cl[alpha == angle]
        if lift.size != 1 or lift[0] != 0:
            raise InputError(f"A symmetric table must hold cl = 0 at {angle:g} deg, but holds {lift.tolist()}")
    keep = alpha >= 0
    full = (
        np.concatenate([-alpha[keep][:0:-1], alpha[keep]]),
        np.concatenate([-cl[keep][:0:-1], cl[keep]]),
        np.concatenate([cd[keep][:0:-1], cd[keep]]),
    )
    for a, l, d in zip(alpha[~keep], cl[~keep], cd[~keep], strict=True):
        image = np.isclose(full[0], a)
        if not (image.any() and np.allclose([full[1][image][0], full[2][image][0]], [l, d], atol=1e-6)):
            raise InputError(
                f"A symmetric table must mirror itself, but at {a:g} deg cl, cd = {l:g}, {d:g} has no such image"
            )
    return full


def extend(inner: Coefficient, alpha: np.ndarray, values: np.ndarray) -> Coefficient:
    """Continue a coefficient over angle and Mach number by a full-range one (alpha [N], values [N]).

    The full-range values serve every Mach number.     The inner table wins where both have a say. Nothing is blended:
    the interpolant joins the last inner row to the first outer one.
    """
    outside = (alpha < inner[0][0]) | (alpha > inner[0][-1])
    angles = np.concatenate([inner[0], alpha[outside]])
    table = np.concatenate([inner[2], np.repeat(values[outside][:, None], inner[1].size, axis=1)])
    order = np.argsort(angles)
    return angles[order], inner[1], table[order]


def resample(coefficient: Coefficient, alpha: np.ndarray, mach: np.ndarray) -> np.ndarray:
    """Read a coefficient on other angles and Mach numbers by straight lines, as C81 is read, constant beyond."""
    along = np.stack([np.interp(alpha, coefficient[0], column) for column in coefficient[2].T], axis=1)
    return np.stack([np.interp(mach, coefficient[1], row) for row in along])


def common_grid(lift: Coefficient, drag: Coefficient) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Put lift and drag on one grid that has every angle and Mach number of either: (alpha, mach, cl, cd)."""
    alpha, mach = np.union1d(lift[0], drag[0]), np.union1d(lift[1], drag[1])
    return alpha, mach, resample(lift, alpha, mach), resample(drag, alpha, mach)


def c81_tables(content: C81) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Lift and drag of a C81 file on one grid, as `airfoil_table` takes them."""
    return common_grid(content.cl, content.cd)


def read_c81(path: str | Path) -> C81:
    """Read a C81 file.

    Raises InputError, naming file and line, where it is cut short, ragged, not numeric or not increasing.
    """
    lines = _lines(path)
    head = lines[0]
    try:
        counts = [int(head[30 + 2 * k : 32 + 2 * k]) for k in range(6)]
    except ValueError:
        raise InputError(f"{path}, line 1: six two-digit counts must follow column 30, but it reads {head!r}") from None
    if min(counts) < 1:
        raise InputError(f"{path}, line 1: the six counts must be positive, but are {counts}")
    reader = _C81Reader(path, lines)
    tables = [reader.coefficient(n_mach, n_alpha) for n_mach, n_alpha in zip(counts[::2], counts[1::2], strict=True)]
    return C81(head[:30].strip(), *tables)


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
        out += _c81_rows(" " * 7, mach)
        for a, row in zip(alpha, values, strict=True):
            out += _c81_rows(_seven(a), row)
    Path(path).write_text("\n".join(out) + "\n")


class _C81Reader:
    """Walks the lines of a C81 file, nine numbers a line after a first column of its own."""

    def __init__(self, path: str | Path, lines: list[str]):
        self.path, self.lines, self.at = path, lines, 1

    def coefficient(self, n_mach: int, n_alpha: int) -> Coefficient:
        mach = self._row(n_mach, labelled=False)[1]
        rows = [self._row(n_mach, labelled=True) for _ in range(n_alpha)]
        alpha = np.array([a for a, _ in rows])
        for name, x in (("Mach numbers", mach), ("angles", alpha)):
            if np.any(np.diff(x) <= 0):
                i = int(np.flatnonzero(np.diff(x) <= 0)[0])
                raise InputError(
                    f"{self.path}, line {self.at}: {name} must increase, but {x[i]:g} is followed by {x[i + 1]:g}"
                )
        return alpha, mach, np.stack([v for _, v in rows])

    def _row(self, count: int, labelled: bool) -> tuple[float, np.ndarray]:
        label, values = 0.0, []
        for start in range(0, count, 9):
            if self.at >= len(self.lines):
                raise InputError(
                    f"{self.path}, line {self.at + 1}: {count} numbers must follow, but the file ends here"
                )
            line = self.lines[self.at]
            if labelled and start == 0:
                label = self._number(line[:7])
            values += [self._number(line[7 * k : 7 * k + 7]) for k in range(1, min(9, count - start) + 1)]
            self.at += 1
        return label, np.array(values)

    def _number(self, text: str) -> float:
        return _number(text, f"{self.path}, line {self.at + 1}")


def _c81_rows(first: str, values: np.ndarray) -> list[str]:
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


def _read_csv(path: str | Path) -> tuple[list[str], np.ndarray]:
    """Header and rows [N, columns] of a CSV file whose first column increases."""
    numbered = [(i, line) for i, line in enumerate(_lines(path), 1) if line.strip() and not line.startswith("#")]
    if len(numbered) < 3:
        raise InputError(
            f"{path}: the file must hold a header of column names and two or more rows, but has {len(numbered)} lines"
        )
    header = [c.strip() for c in numbered[0][1].split(",")]
    rows: list[list[float]] = []
    for i, line in numbered[1:]:
        cells = line.split(",")
        if len(cells) != len(header):
            raise InputError(f"{path}, line {i}: a row must have {len(header)} columns, but has {len(cells)}")
        row = [_number(c, f"{path}, line {i}") for c in cells]
        if rows and row[0] <= rows[-1][0]:
            raise InputError(
                f"{path}, line {i}: {header[0]} must increase, but {rows[-1][0]:g} is followed by {row[0]:g}"
            )
        rows.append(row)
    return header, np.array(rows)


def _number(text: str, where: str) -> float:
    try:
        number = float(text)
    except ValueError:
        number = np.nan
    if not np.isfinite(number):
        raise InputError(f"{where}: every value must be a finite number, but one is {text.strip()!r}")
    return number


def _lines(path: str | Path) -> list[str]:
    try:
        lines = Path(path).read_text().splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"File {path} must be a readable text file, but is not: {error}") from None
    if not lines:
        raise InputError(f"File {path} must not be empty")
    return lines
