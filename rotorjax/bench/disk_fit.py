"""The inflow over the disk as three numbers: λ₀, λ₁c, λ₁s."""

import numpy as np
from jaxtyping import Float


def disk_fit(
    r: Float[np.ndarray, " R"],
    widths: Float[np.ndarray, " R"],
    psi: Float[np.ndarray, " K"],
    inflow: Float[np.ndarray, "K R"],
) -> Float[np.ndarray, "3"]:
    """Least-squares fit of λ₀ + λ₁c r cos ψ + λ₁s r sin ψ over the annulus that the blades sweep.

    r, widths over R; psi (rad) equally spaced over a turn, one alone where nothing changes with it.
    """
    area = r * widths / np.sum(r * widths)
    mean = float(inflow.mean(axis=0) @ area)
    if psi.size == 1:
        return np.array([mean, 0.0, 0.0])
    slope = np.sum(area * r**2) / 2
    around = np.stack([np.cos(psi), np.sin(psi)]) @ inflow / psi.size
    return np.array([mean, *(around @ (area * r) / slope)])
