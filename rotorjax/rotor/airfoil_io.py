"""Reading lift and drag of a section from the files that people have: CSV, C81, XFOIL's and AeroDyn's polars.

CSV: lines that start with `#`, `!` or `%` are comments. The first other line names the columns: `alpha_deg,cl,cd` for
one Mach number, with `mach` for several, each over the same angles (more columns are left out), or `alpha_deg` and the
Mach numbers for one coefficient over both. Angles in degrees. Columns are separated by commas, or by semicolons, tabs
or blanks; with semicolons or tabs a comma is a decimal sign. Columns and rows that a spreadsheet leaves empty do not
count. XFOIL's polars are read as XFOIL saves them (PACC) and as airfoiltools.com does (CSV).

All files are UTF-8, with or without a byte-order mark. The format is found by the content, C81 by `.c81` too.
"""

import math
import re
from pathlib import Path

import numpy as np

from rotorjax.errors import InputError
from rotorjax.io.reading import read_text
from rotorjax.rotor.airfoil_text import Coefficient, number, require_increasing, require_lines
from rotorjax.rotor.c81 import counts_of, read_c81

Section = tuple[Coefficient, Coefficient]
"""Lift and drag."""


def read_section(path: str | Path, drag_path: str | Path | None = None) -> Section:
    """Read lift and drag, each over its own angles and Mach numbers: from one file, or from one CSV file for each.

    A polar without a Mach number of its own has Mach 0. Raises InputError, naming file and line, where something in
    them cannot be read.
    """
    if drag_path is not None:
        return read_alpha_mach(path), read_alpha_mach(drag_path)
    kind = format_of(path)
    if kind == "C81":
        content = read_c81(path)
        return content.cl, content.cd
    if kind == "CSV":
        return _read_table(path)
    alpha, cl, cd, mach = _POLARS[kind](path)
    at = np.array([mach])
    return (alpha, at, cl[:, None]), (alpha, at, cd[:, None])


def format_of(path: str | Path) -> str:
    """CSV, C81, XFOIL, airfoiltools or AeroDyn, by the first lines. Raises InputError where it cannot be read."""
    lines = require_lines(path, read_text(path))[:60]
    if any(map(_is_airfoiltools, lines)):
        return "airfoiltools"
    if any("XFOIL" in line or "Calculated polar for" in line for line in lines[:15]):
        return "XFOIL"
    if any(re.match(r"\s*\d+\s+NumAlf\b", line) for line in lines) or "AirfoilInfo" in lines[0]:
        return "AeroDyn"
    if "AeroDyn" in lines[0]:
        raise InputError(
            f"{path}: an AeroDyn file must be of version 15 (with a line NumAlf), but is older: keep its rows of "
            "angle, lift and drag under the header alpha_deg cl cd"
        )
    return "C81" if Path(path).suffix.lower() == ".c81" or any(map(counts_of, lines)) else "CSV"


def read_polar(path: str | Path) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Read angles (deg), cl and cd, each [N], from a CSV file with the columns alpha_deg, cl, cd.

    Raises InputError, naming file and line, where the file is not there, a column is missing, a row is ragged or holds
    something that is not a finite number, or the angles do not increase.
    """
    alpha, cl, cd = read_columns(path, ("alpha_deg", "cl", "cd"))
    return alpha, cl, cd


def _read_table(path: str | Path) -> Section:
    """Lift and drag of a CSV file: of one Mach number, or of all in a column `mach`, each over the same angles."""
    header, rows, lines = _read_csv(path)
    if "mach" not in header:
        alpha, cl, cd = read_polar(path)
        return (alpha, np.zeros(1), cl[:, None]), (alpha, np.zeros(1), cd[:, None])
    columns = _columns(path, header, rows, ("alpha_deg", "mach", "cl", "cd"))
    alpha, mach = columns[:2]
    machs = np.unique(mach)
    parts = [np.flatnonzero(mach == one) for one in machs]
    for one, part in zip(machs, parts, strict=True):
        require_increasing(path, f"alpha_deg at Mach {one:g}", alpha[part], [lines[i] for i in part])
        if not np.array_equal(alpha[part], alpha[parts[0]]):
            raise InputError(
                f"{path}: alpha_deg must be the same for every Mach number, but at {one:g} there are {part.size} "
                f"angles from {alpha[part[0]]:g} to {alpha[part[-1]]:g} that are not those at {machs[0]:g}"
            )
    cl, cd = (np.stack([column[part] for part in parts], axis=1) for column in columns[2:])
    return (alpha[parts[0]], machs, cl), (alpha[parts[0]], machs, cd)


def read_alpha_mach(path: str | Path) -> Coefficient:
    """Read a coefficient over angle (deg, rows) and Mach number (columns) from a CSV file. Raises as `read_polar`."""
    header, rows, lines = _read_csv(path)
    try:
        mach = np.array([float(c) for c in header[1:]])
    except ValueError:
        mach = np.zeros(0)
    if mach.size == 0 or header[0] != "alpha_deg":
        raise InputError(f"{path}: the header must be alpha_deg and Mach numbers, but is {header}")
    if np.any(np.diff(mach) <= 0) or not np.all(np.isfinite(mach)):
        raise InputError(f"{path}: the header's Mach numbers must increase, but are {header[1:]}")
    require_increasing(path, "alpha_deg", rows[:, 0], lines)
    return rows[:, 0], mach, rows[:, 1:]


def read_columns(path: str | Path, names: tuple[str, ...]) -> tuple[np.ndarray, ...]:
    """Read the named columns, each [N], from a CSV file; the first of them increases. Raises as `read_polar` does."""
    header, rows, lines = _read_csv(path)
    columns = _columns(path, header, rows, names)
    require_increasing(path, names[0], columns[0], lines)
    return columns


def _columns(path: str | Path, header: list[str], rows: np.ndarray, names: tuple[str, ...]) -> tuple[np.ndarray, ...]:
    """The named columns. Raises InputError where one is missing or there twice."""
    for name in names:
        if header.count(name) == 1:
            continue
        what = f"columns must include {', '.join(names)}"
        if name in header:
            raise InputError(f"{path}: {what}, each once, but {name!r} is there {header.count(name)} times")
        hint = ": angles in degrees go under that name" if name == "alpha_deg" else ""
        raise InputError(f"{path}: {what}, but {name!r} is not among {header}{hint}")
    return tuple(rows[:, header.index(name)] for name in names)


def _read_csv(path: str | Path, after: int = 0) -> tuple[list[str], np.ndarray, list[int]]:
    """Header in small letters, rows [N, columns], and the line of each row. after: lines that are passed over."""
    numbered = [
        (i, line)
        for i, line in enumerate(require_lines(path, read_text(path)), 1)
        if i > after and line.strip(" ,;\t") and line.lstrip()[0] not in "#!%" and not line.startswith("sep=")
    ]
    if len(numbered) < 3:
        raise InputError(
            f"{path}: the file must hold a header of column names and two or more rows, but has {len(numbered)} lines"
        )
    separator = next((s for s in (";", "\t", ",") if s in numbered[0][1]), None)
    header = [cell.strip('"').lower() for cell in _cells(numbered[0][1], separator)]
    if all(map(_is_number, header)):
        raise InputError(f"{path}, line {numbered[0][0]}: the first line must name the columns, but holds {header}")
    width = max(i for i, name in enumerate(header, 1) if name)
    rows = []
    for i, line in numbered[1:]:
        cells = _cells(line, separator)
        if len(cells) < width or any(cells[width:]):
            hint = ": a decimal comma needs ; between the columns" if len(cells) > width else ""
            raise InputError(f"{path}, line {i}: a row must have {width} columns, but has {len(cells)}{hint}")
        rows.append([number(cell, f"{path}, line {i}") for cell in cells[:width]])
    return header[:width], np.array(rows), [i for i, _ in numbered[1:]]


def _is_number(text: str) -> bool:
    try:
        return math.isfinite(float(text))
    except ValueError:
        return False


def _cells(line: str, separator: str | None) -> list[str]:
    cells = [cell.strip() for cell in line.split(separator)]
    return [cell.replace(",", ".") for cell in cells] if separator in (";", "\t") else cells


def _is_airfoiltools(line: str) -> bool:
    return line.lower().startswith("alpha,cl,cd,cdp")


def _read_airfoiltools(path: str | Path) -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
    """Angles, cl, cd and Mach number of a polar as airfoiltools.com saves it."""
    lines = require_lines(path, read_text(path))
    head = next(i for i, line in enumerate(lines) if _is_airfoiltools(line))
    _fixed_mach(path, lines[:head])
    header, rows, at = _read_csv(path, after=head)
    alpha, cl, cd = _columns(path, header, rows, ("alpha", "cl", "cd"))
    require_increasing(path, "Alpha", alpha, at)
    mach = next((line.split(",")[1] for line in lines[:head] if line.startswith("Mach,")), "0")
    return alpha, cl, cd, number(mach, f"{path}: Mach")


def _fixed_mach(path: str | Path, lines: list[str]) -> None:
    """Raise InputError where XFOIL let the Mach number follow the lift."""
    if any("Mach number ~" in line for line in lines):
        raise InputError(f"{path}: an XFOIL polar must be of type 1, but its Mach number changes with the lift")


def _read_xfoil(path: str | Path) -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
    """Angles, cl, cd and Mach number of a polar that XFOIL saved (PACC)."""
    lines = require_lines(path, read_text(path))
    rule = next((i for i, line in enumerate(lines) if i and line.strip() and not line.strip(" -")), None)
    names = [] if rule is None else lines[rule - 1].lower().split()
    if rule is None or not {"alpha", "cl", "cd"} <= set(names):
        raise InputError(f"{path}: an XFOIL polar must have the columns alpha, CL and CD over a rule of dashes")
    _fixed_mach(path, lines[:rule])
    mach = re.search(r"Mach\s*=\s*([\d.]+)", "\n".join(lines[:rule]))
    rows, at = _rows_of(path, lines, rule + 1, len(lines), len(names))
    columns = rows[:, [names.index(name) for name in ("alpha", "cl", "cd")]]
    columns, order = np.unique(columns, axis=0, return_index=True)  # saved as computed: up from zero, then down from it
    alpha, cl, cd = columns.T
    require_increasing(path, "the angle of attack", alpha, [at[i] for i in order])
    return alpha, cl, cd, number(mach[1], f"{path}: Mach") if mach else 0.0


def _read_aerodyn(path: str | Path) -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
    """Angles, cl and cd of an AeroDyn 15 file of one table, whose Mach number it does not give."""
    lines = require_lines(path, read_text(path))
    found = [(i, int(m[1])) for i, line in enumerate(lines) if (m := re.match(r"\s*(\d{1,6})\s+NumAlf\b", line))]
    if len(found) != 1:
        raise InputError(f"{path}: an AeroDyn file must hold one table (one line NumAlf), but holds {len(found)}")
    at, count = found[0]
    first = next((i for i in range(at + 1, len(lines)) if not lines[i].lstrip().startswith("!")), len(lines))
    rows, at_lines = _rows_of(path, lines, first, first + count)
    if len(rows) != count:
        raise InputError(f"{path}, line {len(lines)}: NumAlf says {count} rows, but the file ends after {len(rows)}")
    require_increasing(path, "the angle of attack", rows[:, 0], at_lines)
    if any(map(_is_number, " ".join(lines[first + count : first + count + 1]).split()[:1])):
        raise InputError(f"{path}, line {first + count + 1}: NumAlf says {count} rows, but more follow")
    return rows[:, 0], rows[:, 1], rows[:, 2], 0.0


def _rows_of(
    path: str | Path, lines: list[str], first: int, last: int, columns: int | None = None
) -> tuple[np.ndarray, list[int]]:
    """Rows of numbers between blanks, at least three each and two in all, and the line of each."""
    numbered = [(i, line.split()) for i, line in enumerate(lines[first:last], first + 1) if line.strip()]
    width = columns or (len(numbered[0][1]) if numbered else 3)
    for i, cells in numbered:
        if len(cells) != width or width < 3:
            raise InputError(f"{path}, line {i}: a row must have {max(width, 3)} columns, but has {len(cells)}")
    if len(numbered) < 2:
        raise InputError(f"{path}: the polar must have two or more rows, but has {len(numbered)}")
    return np.array([[number(cell, f"{path}, line {i}") for cell in cells] for i, cells in numbered]), [
        i for i, _ in numbered
    ]


_POLARS = {"XFOIL": _read_xfoil, "airfoiltools": _read_airfoiltools, "AeroDyn": _read_aerodyn}
