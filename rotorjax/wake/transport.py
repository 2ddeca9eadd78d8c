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
from rotorjax.ode.fourier import fourier_coefficients, fourier_values
from rotorjax.wake.age_grid import AgeGrid

ORDER = 4
"""Power of a harmonic's number over the highest one's with which its damping goes."""


class AgeOperator(NamedTuple):
    """5PBU4 over ages 1…A: ∂f/∂ζ ≈ matrix @ f + inlet · f₀, per rad; turned, turned_inlet: ∂u/∂ζ + iu of u = x + iy.

    damping: rate (per rad) at which the highest harmonic over the azimuth fades.
    """

    matrix: Float[np.ndarray, "A A"]
    inlet: Float[np.ndarray, " A"]
    turned: Complex[np.ndarray, "A A"]
    turned_inlet: Complex[np.ndarray, " A"]
    damping: float = 0.0


def age_operator(ages: int, step: float, grid: AgeGrid | None = None, damping: float = 0.0) -> AgeOperator:
    """Differences in wake age with spacing `step` (rad), node 0 given.

    grid: ages in steps where they are not all one step apart. ∂f/∂ζ = ∂f/∂s / (dζ/ds) keeps the order, and u is
    differenced as e^{iζ}u, which does not go round with the blade: long steps would wind a helix up. damping: rate per
    rad at which the highest harmonic over the azimuth fades (`dampings`).
    """
    matrix, inlet = five_point_upwind(ages)
    if grid is None:
        return AgeOperator(matrix / step, inlet / step, matrix / step + 1j * np.eye(ages), inlet / step + 0j, damping)
    steps, round_ = step * grid.spacing[1:], np.exp(1j * step * grid.nodes)
    matrix, inlet = matrix / steps[:, None], inlet / steps
    still = np.conj(round_[1:])
    return AgeOperator(matrix, inlet, still[:, None] * matrix * round_[1:], still * inlet * round_[0], damping)


def harmonics(slices: int) -> Float[np.ndarray, " K"]:
    """Harmonic number of each Fourier coefficient over K slices; the lone highest one of an even K counts as zero."""
    numbers = np.fft.fftfreq(slices, 1 / slices)
    if slices % 2 == 0:
        numbers[slices // 2] = 0
    return numbers


def dampings(slices: int, highest: float) -> Float[np.ndarray, " K"]:
    """Rate (per rad) at which each harmonic p of K slices fades: `highest` (2p/K)^ORDER, with p as it is differenced.

    So the lone harmonic K/2 keeps all of it. A given harmonic's rate goes as K^−ORDER, the order of the differences in
    age.
    """
    return highest * np.abs(2 * harmonics(slices) / slices) ** ORDER


def _solved(matrix: Complex[np.ndarray, "A A"] | Float[np.ndarray, "A A"], source: Array, damping: float) -> Array:
    """Solve ∂g/∂ψ + damping g + matrix g = source for g periodic over the slices, both (K, F, A)."""
    inverse = _inverse(matrix, source.shape[0], damping)
    if source.shape[0] == 1:  # the same at all azimuths
        return source @ (inverse[0] if np.iscomplexobj(matrix) else inverse[0].real).T
    return fourier_values(jnp.einsum("kij,kfj->kfi", inverse, fourier_coefficients(source)))


def _inverse(matrix: np.ndarray, slices: int, damping: float) -> Complex[np.ndarray, "K A A"]:
    unit, rates = np.eye(len(matrix)), 1j * harmonics(slices) + dampings(slices, damping)
    return np.stack([np.linalg.inv(matrix + rate * unit) for rate in rates])


def solve_scalar(operator: AgeOperator, f: Float[Array, "K F A"], inlet: Float[Array, "K F"]) -> Float[Array, "K F A"]:
    """Solve ∂g/∂ψ + ∂g/∂ζ = f for g periodic over the slices, with g = inlet at age 0."""
    return _solved(operator.matrix, f - operator.inlet * inlet[..., None], operator.damping).real


def solve_nodes(
    operator: AgeOperator, velocity: Float[Array, "K F A 3"], inlet: Float[Array, "K F 3"]
) -> Float[Array, "K F A 3"]:
    """Solve ∂ρ/∂ψ + ẑ × ρ + ∂ρ/∂ζ = V for node positions in the blades' frames, ρ = inlet at age 0."""
    across, released = velocity[..., 0] + 1j * velocity[..., 1], inlet[..., 0] + 1j * inlet[..., 1]
    plane = _solved(operator.turned, across - operator.turned_inlet * released[..., None], operator.damping)
    axial = _solved(operator.matrix, velocity[..., 2] - operator.inlet * inlet[..., 2, None], operator.damping)
    return jnp.stack([plane.real, plane.imag, axial.real], axis=-1)


def lag(gamma: Float[Array, "K R"], time_constant: Float[Array, ""]) -> Float[Array, "K R"]:
    """Periodic solution of ∂Γ_b/∂ψ = (Γ − Γ_b)/time_constant."""
    if gamma.shape[0] == 1:
        return gamma
    p = jnp.asarray(harmonics(gamma.shape[0]))[:, None]
    return fourier_values(fourier_coefficients(gamma) / (1 + 1j * p * time_constant)).real
