"""Fourier series on equally spaced nodes of one period: interpolation as float64 numpy tables, transforms in JAX.

The transforms are matrix products: nodes are few (tens), and XLA's own transform may never return on a CPU. Since
openxla/xla 46347 (jaxlib 0.11) it shares its work out to the threads that run the programs, and waits on one of them;
where all of them wait, as with two cores and two transforms at a time, nobody works.
"""

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Complex, Float

from rotorjax.errors import InputError


def fourier_nodes(nodes: int) -> Float[np.ndarray, " K"]:
    """Nodes 0, 2π/K, ... of one period of 2π."""
    if nodes < 1:
        raise InputError(f"Argument `nodes` must be at least 1, but is {nodes}")
    return 2 * np.pi * np.arange(nodes) / nodes


def fourier_differentiation(nodes: int) -> Float[np.ndarray, "K K"]:
    """Matrix that differentiates the trigonometric interpolant with respect to an angle of period 2π, at its nodes.

    Exact for all harmonics below K/2; for an even K the highest one, K/2, is seen as zero (Trefethen 2000,
    doi:10.1137/1.9780898719598, chapter 3), so an odd K resolves one harmonic more per node.
    """
    gap = np.subtract.outer(np.arange(nodes), np.arange(nodes))
    half = np.pi * gap / nodes
    apart = gap != 0
    sine = np.where(apart, np.sin(half), 1.0)
    weight = np.cos(half) / sine if nodes % 2 == 0 else 1 / sine
    return np.where(apart, 0.5 * (-1.0) ** gap * weight, 0.0)


def fourier_interpolation(nodes: int, angles: Float[np.ndarray, " N"]) -> Float[np.ndarray, "N K"]:
    """Matrix from values at the nodes to those of the trigonometric interpolant at any angles."""
    harmonics = np.arange(1, (nodes - 1) // 2 + 1)
    gap = np.subtract.outer(np.asarray(angles, float), fourier_nodes(nodes))
    kernel = 1 + 2 * np.sum(np.cos(gap[..., None] * harmonics), axis=-1)
    if nodes % 2 == 0:
        kernel += np.cos(nodes / 2 * gap)
    return kernel / nodes


@partial(jax.jit, static_argnames="axis", inline=True)
def fourier_coefficients(values: Array, axis: int = 0) -> Array:
    """Σₖ vₖ e^(−ipψₖ) for p = 0 … K − 1 along an axis of K nodes, as `numpy.fft.fft`.

    >>> fourier_coefficients(jnp.array([1.0, 0.0, -1.0, 0.0])).real.tolist()  # cos ψ
    [0.0, 2.0, 0.0, 2.0]
    """
    return _along(_waves(values.shape[axis]), values, axis)


@partial(jax.jit, static_argnames="axis", inline=True)
def fourier_values(coefficients: Array, axis: int = 0) -> Array:
    """Values, complex, at the K nodes of all K coefficients along an axis, as `numpy.fft.ifft`."""
    nodes = coefficients.shape[axis]
    return _along(_waves(nodes).conj() / nodes, coefficients, axis)


@partial(jax.jit, static_argnames="axis", inline=True)
def half_coefficients(values: Array, axis: int = 0) -> Array:
    """The coefficients 0 … K/2 of real values, which are all: the others are their conjugates, as `numpy.fft.rfft`."""
    nodes = values.shape[axis]
    return _along(_waves(nodes)[: nodes // 2 + 1], values, axis)


@partial(jax.jit, static_argnames=("nodes", "axis"), inline=True)
def half_values(coefficients: Array, nodes: int, axis: int = 0) -> Array:
    """Real values at the nodes of the coefficients 0 … K/2, as `numpy.fft.irfft`."""
    number = np.arange(nodes // 2 + 1)
    twice = np.where((number == 0) | (2 * number == nodes), 1, 2) / nodes
    wave = twice * _waves(nodes)[:, : len(number)]
    return _along(wave.real, coefficients.real, axis) + _along(wave.imag, coefficients.imag, axis)


def _waves(nodes: int) -> Complex[np.ndarray, "K K"]:
    """e^(−ipψₖ), its angles reduced to one turn."""
    number = np.arange(nodes)
    return np.exp(-2j * np.pi / nodes * (np.outer(number, number) % nodes))


def _along(matrix: np.ndarray, values: Array, axis: int) -> Array:
    return jnp.moveaxis(jnp.tensordot(matrix, values, axes=(1, axis)), 0, axis)
