"""Stability of the axisymmetric wake, one azimuthal wave number at a time, and vortex pairing beside it.

A disturbance of wave number p is the same on all blades but for the phase e^{2πip/B} from one to the next. Wave numbers
do not mix, so B matrices of one slice's size hold the whole spectrum of the wake of B blades. The velocities' part of
each is assembled from the pairs (wake/influence.py), not by forward mode.

A long wake's matrix is far from normal: a rounding error of relative size ε moves an eigenvalue by up to κ ε ‖A‖ with κ
its condition number. Modes are listed with that figure, and those that rounding decides are not called modes.
"""

from dataclasses import dataclass

import numpy as np
import scipy.linalg
from jaxtyping import Complex

from rotorjax.linearisation.assembly import Assembly, assemble
from rotorjax.ode.threads import one_thread
from rotorjax.wake.solution import Solution


@dataclass(frozen=True)
class WaveMode:
    """One unstable mode. wave: p. exponent: λ, growth + i frequency per radian of azimuth (frequency in 1/rev, as seen
    from the blade). multiplier: e^{2πλ}, growth over a revolution. error: bound on what rounding moves the exponent by.
    """

    wave: int
    exponent: complex
    error: float

    @property
    def multiplier(self) -> complex:
        """Floquet multiplier over a revolution."""
        return complex(np.exp(2 * np.pi * self.exponent))


@dataclass(frozen=True)
class Pairing:
    """Growth rate of pairing in a row of vortices, πΓ/4b² (Lamb 1932, §156), for the wake's own tip vortex.

    circulation: Γ over ΩR². spacing: b over R, of neighbouring turns. rate: per rad. Smallest, median and largest
    over the free turns.
    """

    circulation: tuple[float, float, float]
    spacing: tuple[float, float, float]
    rate: tuple[float, float, float]


@dataclass(frozen=True)
class Spectrum:
    """Exponents of the axisymmetric wake.

    exponents: by wave number p = 0 … B/2, (n,) each, the fastest growing first; B − p has those of p, conjugate.
    modes: unstable ones, the fastest growing first. pairing: the rate they are compared with.
    """

    exponents: dict[int, Complex[np.ndarray, " n"]]
    modes: tuple[WaveMode, ...]
    pairing: Pairing


def wave_matrix(solution: Solution, wave: int, parts: Assembly | None = None) -> Complex[np.ndarray, "n n"]:
    """Derivative of `dynamics.rhs` at an axisymmetric wake, for disturbances of one wave number, per slice.

    n runs over a slice's state as `ravel_pytree` lays it out. Wave number 0 is `system.linear_wake`'s A. parts:
    `assemble(solution)`, made here by default. Raises InputError as `assemble` does.
    """
    parts = assemble(solution) if parts is None else parts
    return parts.jacobian(wave)[: parts.order]


@one_thread
def spectrum(solution: Solution, count: int = 4, parts: Assembly | None = None) -> Spectrum:
    """Exponents of all wave numbers, and the `count` fastest growing modes of each with what rounding does to them.

    parts: `assemble(solution)`, made here by default. Raises InputError as `assemble` does.
    """
    parts = assemble(solution) if parts is None else parts
    exponents, modes = {}, []
    for wave in range(solution.model.rotor.blades // 2 + 1):
        matrix = wave_matrix(solution, wave, parts)
        own = 2 * wave % solution.model.rotor.blades == 0  # its own conjugate: a real matrix
        matrix = np.real(matrix) if own else matrix
        values = np.linalg.eigvals(matrix)
        values = values[np.argsort(-np.real(values))]
        exponents[wave] = values
        leading = [v for v in values[: 2 * count] if not own or v.imag >= 0][:count]  # one of each conjugate pair
        modes += [WaveMode(wave, complex(v), rounding(matrix, v)) for v in leading if v.real > 0]
    modes.sort(key=lambda mode: -mode.exponent.real)
    return Spectrum(exponents, tuple(modes), pairing(solution))


def rounding(matrix: Complex[np.ndarray, "n n"], value: complex) -> float:
    """Bound on the error of an eigenvalue by rounding, κ ε ‖A‖, its vectors found by two inverse iterations."""
    n = matrix.shape[0]
    scale = float(np.linalg.norm(matrix))
    shift = value + 1e-10 * scale / n
    lu = scipy.linalg.lu_factor(matrix - shift * np.eye(n))
    right = left = np.ones(n, complex)
    for _ in range(2):
        right = scipy.linalg.lu_solve(lu, right)
        left = scipy.linalg.lu_solve(lu, left, trans=2)
        right, left = right / np.linalg.norm(right), left / np.linalg.norm(left)
    return float(np.finfo(float).eps * scale / np.abs(np.vdot(left, right)))


def pairing(solution: Solution) -> Pairing:
    """Pairing rate of a wake's tip vortex, from the distance in the (r, z) plane of turns 2π/B apart."""
    settings = solution.model.settings
    tip = solution.tip_vortex[0]
    passage = 2 * np.pi / solution.model.rotor.blades
    ages = settings.filament_ages
    radius = np.hypot(tip[:, 0], tip[:, 1])
    whole = ages[ages + passage <= ages[-1] + 1e-9]
    gaps = [np.interp(whole + passage, ages, q) - np.interp(whole, ages, q) for q in (radius, tip[:, 2])]
    spacing = np.hypot(*gaps)
    strength = np.interp(whole + 0.5 * passage, ages[1:], np.abs(np.asarray(solution.state.gamma_far[0, 0])))
    rate = np.pi * strength / (4 * spacing**2)

    def three(v: np.ndarray) -> tuple[float, float, float]:
        return float(v.min()), float(np.median(v)), float(v.max())

    return Pairing(three(strength), three(spacing), three(rate))
