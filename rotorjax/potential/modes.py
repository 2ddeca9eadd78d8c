"""Mode tables: which (m, n) and whether cosine or sine; the static choice that sets every array size."""

from collections.abc import Iterable
from typing import Literal, NamedTuple

import equinox as eqx
import numpy as np

from rotorjax.errors import InputError

HIGHEST_DEGREE = 15  # up to here the Legendre functions are proved to 1e-12


Parity = Literal["odd", "even", "both"]


class Mode(NamedTuple):
    """One term of the expansion: harmonic m, degree n, and "cos" or "sin"."""

    m: int
    n: int
    kind: Literal["cos", "sin"]


class ModeTable(eqx.Module):
    """M modes, all static.

    modes: tuple of M `Mode`; parity: "odd" where every n + m is odd (pressure jump, the rotor), "even" where it is even
    (mass source, the ground), "both" where a dynamic rotor has even states beside its odd ones.
    """

    modes: tuple[Mode, ...] = eqx.field(static=True)
    parity: Parity = eqx.field(static=True)

    def __init__(self, modes: Iterable[Mode], parity: Parity):
        """Check the modes and freeze them.

        Raises InputError where a mode has the wrong parity, n < m, a sine at m = 0, or a degree above 15.
        """
        self.modes = tuple(Mode(*mode) for mode in modes)
        self.parity = parity
        if not self.modes:
            raise InputError("Argument `modes` must hold at least one mode, but is empty")
        for mode in self.modes:
            m, n, kind = mode
            if not 0 <= m <= n <= HIGHEST_DEGREE:
                raise InputError(f"Argument `modes` must keep 0 <= m <= n <= {HIGHEST_DEGREE}, but has {mode}")
            if parity != "both" and (n + m) % 2 != (parity == "odd"):
                raise InputError(f"Argument `modes` must have n + m {parity}, but has {mode}")
            if kind not in (("cos",) if m == 0 else ("cos", "sin")):
                raise InputError(f"Argument `modes` must be cosine, or sine with m > 0, but has {mode}")
        if len(set(self.modes)) < len(self.modes):
            raise InputError("Argument `modes` must not repeat a mode")

    def __len__(self) -> int:
        """Return M."""
        return len(self.modes)

    @property
    def pairs(self) -> tuple[tuple[int, int], ...]:
        """(m, n) of each mode, (M,)."""
        return tuple((mode.m, mode.n) for mode in self.modes)

    @property
    def m(self) -> np.ndarray:
        """Harmonics, (M,)."""
        return np.array([mode.m for mode in self.modes])

    @property
    def n(self) -> np.ndarray:
        """Degrees, (M,)."""
        return np.array([mode.n for mode in self.modes])

    @property
    def odd(self) -> np.ndarray:
        """Whether n + m is odd, (M,): the modes that carry load."""
        return (self.m + self.n) % 2 == 1

    @property
    def diagonal(self) -> np.ndarray:
        """Whether n = m, (M,): the r = j terms of Appendix E."""
        return self.m == self.n

    def index(self, m: int, n: int, kind: Literal["cos", "sin"] = "cos") -> int:
        """Position of a mode. Raises InputError where the table lacks it."""
        if (mode := Mode(m, n, kind)) not in self.modes:
            raise InputError(f"The mode table must contain {mode}, but holds {self.modes}")
        return self.modes.index(mode)


def mode_table(first_degree: int, harmonics: int, radial_terms: int) -> ModeTable:
    """Make the table n = m + first_degree, + 2, + 4, … for m = 0 … harmonics.

    harmonics: the highest m (0 is axisymmetric); radial_terms: how many n for each m.
    Raises InputError where a count is too small or a degree exceeds 15.
    """
    if harmonics < 0:
        raise InputError(f"Argument `harmonics` must be at least 0 (the highest m), but is {harmonics}")
    if radial_terms < 1:
        raise InputError(f"Argument `radial_terms` must be at least 1, but is {radial_terms}")
    highest = harmonics + first_degree + 2 * (radial_terms - 1)
    if highest > HIGHEST_DEGREE:
        raise InputError(
            f"Arguments `harmonics`, `radial_terms` must keep degrees up to {HIGHEST_DEGREE}, but {harmonics} and "
            f"{radial_terms} need {highest}: take fewer of either"
        )
    kinds = ("cos", "sin")
    modes = [
        Mode(m, m + first_degree + 2 * i, kind)
        for m in range(harmonics + 1)
        for i in range(radial_terms)
        for kind in kinds[: 1 if m == 0 else 2]
    ]
    return ModeTable(modes, "odd" if first_degree % 2 else "even")


def rotor_modes(harmonics: int = 0, radial_terms: int = 3, even_terms: int = 0) -> ModeTable:
    """Make the rotor's table, n = m+1, m+3, … (Eq. 5); the default is the paper's τ₁, τ₃, τ₅.

    even_terms: how many n = m+2, m+4, … to add for each harmonic. They carry no load and vanish in steady flow; in
    unsteady flow the odd functions alone are not complete (Morillo and Peters 2002).
    """
    odd = mode_table(1, harmonics, radial_terms)
    if even_terms == 0:
        return odd
    return ModeTable(odd.modes + mode_table(2, harmonics, even_terms).modes, "both")


def ground_modes(harmonics: int = 0, radial_terms: int = 5, parity: Literal["even", "odd"] = "even") -> ModeTable:
    """Make the ground's table.

    parity "even" is the paper's j = r, r+2, … (Eq. 8), the r = j terms of Appendix E included; their flow crosses
    the plane outside the ground disk, which the correction factor makes up for. "odd" is j = r+1, r+3, … (after Eq.
    41): the functions of a source disk, which close the plane outside the disk too and need no factor.
    """
    return mode_table(0 if parity == "even" else 1, harmonics, radial_terms)
