"""Trigonometric interpolation on equally spaced nodes of one period, as float64 numpy tables."""

import numpy as np
from jaxtyping import Float

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
