"""Periodic linear models in the frequency domain: Floquet exponents and harmonic transfer functions without marching.

With x(t) = Σ x_h e^{(s + ihω)t} a periodic model is one constant matrix over the harmonics, Hill's: blocks
A_{k−l} − ikω δ_kl of the Fourier coefficients of A(t) (Wereley & Hall 1990, doi:10.1109/CDC.1990.203516). Every Floquet
exponent is an eigenvalue of it, and so is each of its copies s − ikω; the copy whose motion has most of its weight at
harmonic 0 is what an observer calls its frequency. No growth over a period is formed, so fast decay costs no digits.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Complex, Float

from rotorjax.errors import InputError
from rotorjax.ode.models import PeriodicModel
from rotorjax.ode.threads import one_thread

NEGLIGIBLE = 1e-9
"""Share of A's largest coefficient below which a harmonic counts as absent."""


class Exponents(NamedTuple):
    """Floquet exponents (n,), the least damped first. modes (n, n): columns, harmonic 0 of each. participation (n, n):
    of each state (row) in each mode (column), columns adding up to 1.
    """

    values: Complex[np.ndarray, " n"]
    modes: Complex[np.ndarray, "n n"]
    participation: Float[np.ndarray, "n n"]


def present(model: PeriodicModel) -> int:
    """Largest number that all harmonics of A(t) are multiples of; 0 where A is constant."""
    size = np.abs(_coefficients(model.a)).max(axis=(1, 2))
    return int(np.gcd.reduce([k for k in range(1, size.size) if size[k] > NEGLIGIBLE * size[0]] or [0]))


def _coefficients(values: Float[np.ndarray, "K i j"]) -> Complex[np.ndarray, "H i j"]:
    """Fourier coefficients of harmonics 0 … (K − 1)//2."""
    nodes = values.shape[0]
    return np.fft.rfft(values, axis=0)[: (nodes - 1) // 2 + 1] / nodes


def _toeplitz(values: Float[np.ndarray, "K i j"], rows: range, columns: range) -> Complex[np.ndarray, "I J"]:
    """Blocks V_{k−l}, k over rows and l over columns, absent beyond what the times can tell."""
    held = _coefficients(values)

    def block(h: int) -> np.ndarray:
        if abs(h) >= held.shape[0]:
            return np.zeros_like(held[0])
        return held[h] if h >= 0 else held[-h].conj()

    return np.block([[block(k - m) for m in columns] for k in rows])


def _matrix(model: PeriodicModel, numbers: range) -> Complex[np.ndarray, "N N"]:
    omega = 2 * np.pi / model.period
    turning = np.repeat(1j * omega * np.array(numbers), model.order)
    return _toeplitz(model.a, numbers, numbers) - np.diag(turning)


def _numbers(model: PeriodicModel, copies: int) -> range:
    """Harmonics −copies … copies of those that A couples."""
    step = present(model)
    return range(-copies * step, copies * step + 1, step) if step else range(1)


@one_thread
def exponents(model: PeriodicModel, copies: int = 4) -> Exponents:
    """Floquet exponents with their frequencies as seen from the model's own axes; copies: harmonics held to each side,
    in multiples of the lowest that A has.
    """
    numbers = _numbers(model, copies)
    values, right = np.linalg.eig(_matrix(model, numbers))
    middle = slice(len(numbers) // 2 * model.order, (len(numbers) // 2 + 1) * model.order)
    # Over all eigenvalues the shares of harmonic 0 add up to n: near 1 for n of them, near 0 for their copies.
    shares = right[middle].T * np.linalg.inv(right)[:, middle]
    chosen = np.argsort(-np.abs(shares.sum(axis=1)))[: model.order]
    chosen = chosen[np.argsort(-np.real(values[chosen]))]
    weight = np.abs(shares[chosen]).T
    return Exponents(values[chosen], right[middle][:, chosen], weight / weight.sum(axis=0))


@one_thread
def harmonic_transfer(
    model: PeriodicModel, frequencies: Float[np.ndarray, " W"], harmonics: tuple[int, ...] = (0,), copies: int = 4
) -> Complex[np.ndarray, "W H q m"]:
    """Harmonic transfer functions G_k(iω): output at ω + kω₀ for an input at ω alone; k = 0 is what an LTI model means.

    frequencies: rad per unit of time. harmonics: k, multiples of the lowest harmonic that A has. Raises InputError for
    a harmonic that is not among those held.
    """
    numbers = _numbers(model, copies)
    if not set(harmonics) <= set(numbers):
        raise InputError(f"Argument `harmonics` must be among {list(numbers)}, but is {list(harmonics)}")
    b, c, d = (
        _toeplitz(v, rows, columns)
        for v, rows, columns in (
            (model.b, numbers, range(1)),
            (model.c, numbers, numbers),
            (model.d, numbers, range(1)),
        )
    )
    values, right = np.linalg.eig(_matrix(model, numbers))
    drive, see = np.linalg.solve(right, b), c @ right
    found = np.stack([see @ (drive / (1j * w - values)[:, None]) + d for w in frequencies])
    found = found.reshape(len(frequencies), len(numbers), len(model.outputs), len(model.inputs))
    return found[:, [numbers.index(k) for k in harmonics]]
