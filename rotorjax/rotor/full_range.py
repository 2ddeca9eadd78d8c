"""Lift and drag for every angle of attack from what a table has: its mirror image, a full-range table, a flat plate.

Nothing is filled in without being asked for: a table that stops short of ±180° is refused with the ways out.
"""

import numpy as np

from rotorjax.errors import InputError
from rotorjax.rotor.airfoil_io import Section
from rotorjax.rotor.airfoil_text import Coefficient

FLAT_PLATE = "flat plate"
_FAR = 20.0  # degrees between the last two rows from which on equal ones are taken for a value that was carried on


def completed(
    lift: Coefficient, drag: Coefficient, outer: Section | str | None = None, *, symmetric: bool = False
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """(alpha, mach, cl, cd) on one grid from −180° to 180°, as `airfoil_table` takes them.

    outer: lift and drag that reach ±180° at one Mach number, or "flat plate", for the angles beyond the table's.
    symmetric: complete the section by its mirror image. Raises InputError where lift or drag stops short of ±180° and
    nothing continues it, or `outer` would have no effect.
    """
    if symmetric:
        lift, drag = mirror(lift, -1), mirror(drag, 1)
    lift, drag = _without_carried_ends(lift, drag)
    both = {"lift": lift, "drag": drag}
    for name, (alpha, _, _) in both.items():
        if alpha[0] < -180 or alpha[-1] > 180:
            raise InputError(f"The {name} table must lie within -180 to 180 deg, but runs {_span(alpha)}")
        if outer == FLAT_PLATE and not alpha[0] < 0 < alpha[-1]:  # the plate would be half of what lifts
            raise InputError(
                f"[airfoil] the {name} table must hold angles on both sides of 0 for full_range = {FLAT_PLATE!r}, but "
                f"runs {_span(alpha)}" + (": give symmetric = true, if the section is" if alpha[0] == 0 else "")
            )
    if outer is not None:
        if all(_reaches(c) for c in both.values()):
            key = "full_range" if isinstance(outer, str) else "full_range_file"
            raise InputError(
                f"[airfoil] {key} must continue a table, but lift and drag run from -180 to 180 deg already"
            )
        far = _flat_plate(drag) if isinstance(outer, str) else _full(outer, symmetric)
        lift, drag = (extend(c, f[0], f[2][:, 0]) for c, f in zip((lift, drag), far, strict=True))
    for name, c in (("lift", lift), ("drag", drag)):
        if not _reaches(c):
            raise InputError(_short(name, c[0]))
    return common_grid(lift, drag)


def mirror(coefficient: Coefficient, sign: int) -> Coefficient:
    """Complete a symmetric section's coefficient from its angles from 0 on; sign: −1 for lift (odd), 1 for drag (even).

    Raises InputError where the angle 0 is missing, the lift is not zero there or at 180, or a negative angle that is
    listed contradicts the mirror image.
    """
    alpha, mach, values = coefficient
    for angle in (0.0, 180.0):
        here = values[alpha == angle]
        if (angle == 0 and len(here) != 1) or (sign < 0 and np.any(here != 0)):
            raise InputError(f"A symmetric table must hold cl = 0 at {angle:g} deg, but holds {here.ravel().tolist()}")
    keep = alpha >= 0
    full = np.concatenate([-alpha[keep][:0:-1], alpha[keep]])
    table = np.concatenate([sign * values[keep][:0:-1], values[keep]])
    for a, row in zip(alpha[~keep], values[~keep], strict=True):
        image = np.isclose(full, a)
        if not (image.any() and np.allclose(table[image][0], row, atol=1e-6)):
            name = "cl" if sign < 0 else "cd"
            raise InputError(
                f"A symmetric table must mirror itself, but at {a:g} deg {name} = {row[0]:g} has no such image"
            )
    return full, mach, table


def extend(inner: Coefficient, alpha: np.ndarray, values: np.ndarray) -> Coefficient:
    """Continue a coefficient over angle and Mach number by a full-range one (alpha [N], values [N]).

    The full-range values serve every Mach number. The inner table wins where both have a say. Nothing is blended:
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


def _flat_plate(drag: Coefficient) -> Section:
    """A plate whose normal force is 2 sin α: cl = sin 2α, cd = 2 sin²α above the section's least drag.

    The drag coefficient 2 at 90° is that of a plate in two dimensions (Hoerner, Fluid-Dynamic Drag, 1965, chapter 3).
    """
    alpha = np.arange(-180.0, 181.0, 5.0)
    angle, one = np.deg2rad(alpha), np.zeros(1)
    lift, least = np.sin(2 * angle), float(drag[2].min())
    lift[[0, -1]] = 0.0
    return (alpha, one, lift[:, None]), (alpha, one, (least + 2 * np.sin(angle) ** 2)[:, None])


def _full(outer: Section, symmetric: bool) -> Section:
    lift, drag = (mirror(outer[0], -1), mirror(outer[1], 1)) if symmetric else outer
    for name, c in (("lift", lift), ("drag", drag)):
        if not _reaches(c) or c[1].size != 1:
            raise InputError(
                f"[airfoil] full_range_file must run from -180 to 180 deg at one Mach number, but its {name} runs "
                f"{_span(c[0])} at {c[1].size}"
            )
    return lift, drag


def _without_carried_ends(lift: Coefficient, drag: Coefficient) -> Section:
    """Without rows at ±180° that repeat the last measured ones, where the lift cannot be other than zero."""
    for end, inner, rest in ((0, 1, slice(1, None)), (-1, -2, slice(None, -1))):
        carried = _repeats(lift, end, inner) and np.any(lift[2][end] != 0)
        if carried and _repeats(drag, end, inner):
            drag = drag[0][rest], drag[1], drag[2][rest]
        if carried:
            lift = lift[0][rest], lift[1], lift[2][rest]
    return lift, drag


def _repeats(c: Coefficient, end: int, inner: int) -> bool:
    far = abs(c[0][end] - c[0][inner]) > _FAR and abs(c[0][end]) == 180
    return len(c[0]) > 3 and bool(far) and bool(np.array_equal(c[2][end], c[2][inner]))


def _reaches(c: Coefficient) -> bool:
    return c[0][0] == -180 and c[0][-1] == 180


def _span(alpha: np.ndarray) -> str:
    return f"from {alpha[0]:g} to {alpha[-1]:g}"


def _short(name: str, alpha: np.ndarray) -> str:
    half = "symmetric = true, " if alpha[0] == 0 else ""
    return (
        f"[airfoil] the {name} table must run from -180 to 180 deg, but runs {_span(alpha)} (a last value that is "
        f'carried on does not count): give {half}full_range_file or full_range = "{FLAT_PLATE}"'
    )
