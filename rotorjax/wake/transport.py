"""Transport along wake age and azimuth, and its inverse: the linear half of Eq. 13.

In the blade's frame Eq. 12 reads ∂ρ/∂ψ + ẑ × ρ + ∂ρ/∂ζ = V. Wake age is differenced by 5PBU4; over a periodic wake the
azimuth is differenced exactly for every harmonic that K slices can hold. Harmonics do not mix, and with u = x + iy the
turning term is a number, so the inverse is a small dense matrix for each harmonic.
"""

from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Complex, Float

from rotorjax.ode.age_difference import five_point_upwind


class AgeOperator(NamedTuple):
    """5PBU4 over ages 1…A: ∂f/∂ζ ≈ matrix @ f + inlet · f₀, per rad."""

    matrix: Float[np.ndarray, "A A"]
    inlet: Float[np.ndarray, " A"]


def age_operator(ages: int, step: float) -> AgeOperator:
    """Differences in wake age with spacing `step` (rad), node 0 given."""
    matrix, inlet = five_point_upwind(ages)
    return AgeOperator(matrix / step, inlet / step)


def harmonics(slices: int) -> Float[np.ndarray, " K"]:
    """Harmonic number of each Fourier coefficient over K slices; the lone highest one of an even K counts as zero."""
    numbers = np.fft.fftfreq(slices, 1 / slices)
    if slices % 2 == 0:
        numbers[slices // 2] = 0
    return numbers


def _solved(operator: AgeOperator, turn: int, source: Array) -> Array:
    """Solve ∂g/∂ψ + i turn g + matrix g = source for g periodic over the slices, both (K, F, A)."""
    inverse = _inverse(operator, source.shape[0], turn)
    if source.shape[0] == 1:  # the same at all azimuths
        return source @ (inverse[0] if turn else inverse[0].real).T
    return jnp.fft.ifft(jnp.einsum("kij,kfj->kfi", inverse, jnp.fft.fft(source, axis=0)), axis=0)


def _inverse(operator: AgeOperator, slices: int, turn: int) -> Complex[np.ndarray, "K A A"]:
    unit = np.eye(len(operator.inlet))
    return np.stack([np.linalg.inv(operator.matrix + 1j * (p + turn) * unit) for p in harmonics(slices)])


def solve_scalar(operator: AgeOperator, f: Float[Array, "K F A"], inlet: Float[Array, "K F"]) -> Float[Array, "K F A"]:
    """Solve ∂g/∂ψ + ∂g/∂ζ = f for g periodic over the slices, with g = inlet at age 0."""
    return _solved(operator, 0, f - operator.inlet * inlet[..., None]).real


def solve_nodes(
    operator: AgeOperator, velocity: Float[Array, "K F A 3"], inlet: Float[Array, "K F 3"]
) -> Float[Array, "K F A 3"]:
    """Solve ∂ρ/∂ψ + ẑ × ρ + ∂ρ/∂ζ = V for node positions in the blades' frames, ρ = inlet at age 0."""
    source = velocity - operator.inlet[:, None] * inlet[:, :, None]
    plane = _solved(operator, 1, source[..., 0] + 1j * source[..., 1])
    axial = _solved(operator, 0, source[..., 2])
    return jnp.stack([plane.real, plane.imag, axial.real], axis=-1)


def lag(gamma: Float[Array, "K R"], time_constant: Float[Array, ""]) -> Float[Array, "K R"]:
    """Periodic solution of ∂Γ_b/∂ψ = (Γ − Γ_b)/time_constant."""
    if gamma.shape[0] == 1:
        return gamma
    p = jnp.asarray(harmonics(gamma.shape[0]))[:, None]
    return jnp.fft.ifft(jnp.fft.fft(gamma, axis=0) / (1 + 1j * p * time_constant), axis=0).real
