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


def _inverse(operator: AgeOperator, slices: int, turn: int) -> Complex[np.ndarray, "K A A"]:
    unit = np.eye(len(operator.inlet))
    return np.stack([np.linalg.inv(operator.matrix + 1j * (p + turn) * unit) for p in harmonics(slices)])


def solve_scalar(operator: AgeOperator, f: Float[Array, "K F A"], inlet: Float[Array, "K F"]) -> Float[Array, "K F A"]:
    """Solve ∂g/∂ψ + ∂g/∂ζ = f for g periodic over the slices, with g = inlet at age 0."""
    inverse = jnp.asarray(_inverse(operator, f.shape[0], 0))
    source = jnp.fft.fft(f - operator.inlet * inlet[..., None], axis=0)
    return jnp.fft.ifft(jnp.einsum("kij,kfj->kfi", inverse, source), axis=0).real


def solve_nodes(
    operator: AgeOperator, velocity: Float[Array, "K F A 3"], inlet: Float[Array, "K F 3"]
) -> Float[Array, "K F A 3"]:
    """Solve ∂ρ/∂ψ + ẑ × ρ + ∂ρ/∂ζ = V for node positions in the blades' frames, ρ = inlet at age 0."""
    source = velocity - operator.inlet[:, None] * inlet[:, :, None]
    turned = jnp.asarray(_inverse(operator, velocity.shape[0], 1))
    plane = jnp.fft.fft(source[..., 0] + 1j * source[..., 1], axis=0)
    plane = jnp.fft.ifft(jnp.einsum("kij,kfj->kfi", turned, plane), axis=0)
    straight = jnp.asarray(_inverse(operator, velocity.shape[0], 0))
    axial = jnp.fft.ifft(jnp.einsum("kij,kfj->kfi", straight, jnp.fft.fft(source[..., 2], axis=0)), axis=0)
    return jnp.stack([plane.real, plane.imag, axial.real], axis=-1)


def lag(gamma: Float[Array, "K R"], time_constant: Float[Array, ""]) -> Float[Array, "K R"]:
    """Periodic solution of ∂Γ_b/∂ψ = (Γ − Γ_b)/time_constant."""
    p = jnp.asarray(harmonics(gamma.shape[0]))[:, None]
    return jnp.fft.ifft(jnp.fft.fft(gamma, axis=0) / (1 + 1j * p * time_constant), axis=0).real
