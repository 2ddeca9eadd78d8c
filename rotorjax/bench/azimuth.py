"""Fields over the disk at other azimuths than they are given at, by their Fourier series."""

import numpy as np
from jaxtyping import Float


def refine_azimuth(
    psi: Float[np.ndarray, " K"], values: Float[np.ndarray, "K R"], count: int = 72
) -> tuple[Float[np.ndarray, " N"], Float[np.ndarray, "N R"]]:
    """Values at equally spaced azimuths from 0, at `count` of them instead where these are more."""
    if psi.size >= count:
        return psi, values
    spectrum = np.fft.rfft(values, axis=0)
    if psi.size % 2 == 0 and psi.size > 1:
        spectrum[-1] *= 0.5  # the highest cosine is shared by two frequencies of the finer grid
    fine = np.fft.irfft(spectrum, count, axis=0) * count / psi.size
    return 2 * np.pi / count * np.arange(count), fine


def valley_side(values: Float[np.ndarray, "K R"]) -> Float[np.ndarray, " R"]:
    """Values at ψ = 180° of a field at K equally spaced azimuths from 0; K may be odd, as with three blades.

    Σₖ f̂ₖ eⁱᵏᵠ at ψ = π, where the harmonics alternate in sign.
    """
    count = values.shape[0]
    if count % 2 == 0:
        return values[count // 2]
    if count == 1:
        return values[0]
    spectrum = np.fft.rfft(values, axis=0).real / count
    signs = np.where(np.arange(len(spectrum)) % 2, -2.0, 2.0)
    signs[0] = 1.0
    return signs @ spectrum
