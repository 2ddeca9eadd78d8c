"""What the readers of airfoil files share: lines, numbers, and the coefficient over angle and Mach number."""

import re
from pathlib import Path

import numpy as np

from rotorjax.checks import shown
from rotorjax.errors import InputError

Coefficient = tuple[np.ndarray, np.ndarray, np.ndarray]
"""(angles in degrees [N], Mach numbers [C], values [N, C])."""
_FORTRAN = re.compile(r"(?<=[\d.])[dD](?=[+-]?\d)")  # 1.0D-01
_MOST = 1e12  # nothing in these files is larger, and squares and slopes of it stay finite


def require_lines(path: str | Path, text: str) -> list[str]:
    """The lines of a file. Raises InputError where there are none."""
    lines = text.splitlines()
    if not lines:
        raise InputError(f"File {path} must not be empty")
    return lines


def number(text: str, where: str) -> float:
    """A number. Raises InputError, naming `where`, where it is none, not finite, or beyond all sense."""
    try:
        found = float(_FORTRAN.sub("e", text)) if "_" not in text else np.nan
    except ValueError:
        found = np.nan
    if not abs(found) <= _MOST:
        hint = " (a decimal comma needs ; between the columns)" if "," in text else ""
        raise InputError(f"{where}: every value must be a finite number, but one is {shown(text.strip())}{hint}")
    return found


def require_increasing(path: str | Path, name: str, values: np.ndarray, lines: list[int]) -> None:
    """Raise InputError, naming file and line, where a column does not increase. lines [N]: where its values stand."""
    late = np.flatnonzero(np.diff(values) <= 0)
    if late.size:
        i = int(late[0])
        raise InputError(
            f"{path}, line {lines[i + 1]}: {name} must increase, but {values[i]:g} is followed by {values[i + 1]:g}"
        )
