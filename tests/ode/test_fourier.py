import numpy as np
import pytest

from rotorjax.errors import InputError
from rotorjax.ode.fourier import (
    fourier_coefficients,
    fourier_differentiation,
    fourier_interpolation,
    fourier_nodes,
    fourier_values,
    half_coefficients,
    half_values,
)


@pytest.mark.parametrize("nodes", [1, 2, 3, 8, 9, 24, 25])
def test_exact_below_half(nodes):
    psi = fourier_nodes(nodes)
    for k in range((nodes + 1) // 2):
        f, slope = np.cos(k * psi + 0.3), -k * np.sin(k * psi + 0.3)
        np.testing.assert_allclose(fourier_differentiation(nodes) @ f, slope, atol=1e-12)
        where = np.linspace(-1, 9, 23)
        np.testing.assert_allclose(fourier_interpolation(nodes, where) @ f, np.cos(k * where + 0.3), atol=1e-12)


def test_no_nodes_are_refused():
    with pytest.raises(InputError, match="nodes"):
        fourier_nodes(0)


@pytest.mark.parametrize("nodes", [1, 2, 3, 8, 9, 24, 25])
@pytest.mark.parametrize("axis", [0, 1])
def test_transforms_are_those_of_numpy(nodes, axis):
    rng = np.random.default_rng(nodes)
    shape = (nodes, 5, 3) if axis == 0 else (5, nodes, 3)
    real, other = rng.normal(size=(2, *shape))
    np.testing.assert_allclose(fourier_coefficients(real + 1j * other, axis), np.fft.fft(real + 1j * other, axis=axis))
    np.testing.assert_allclose(fourier_values(real + 1j * other, axis), np.fft.ifft(real + 1j * other, axis=axis))
    half = half_coefficients(real, axis)
    np.testing.assert_allclose(half, np.fft.rfft(real, axis=axis), atol=1e-13)
    np.testing.assert_allclose(half_values(half, nodes, axis), real, atol=1e-13)
    free = half + (0.5 + 0.3j)  # a mean and a highest harmonic with imaginary parts, which no real values have
    np.testing.assert_allclose(half_values(free, nodes, axis), np.fft.irfft(free, nodes, axis=axis), atol=1e-13)
    assert fourier_values(fourier_coefficients(real, axis), axis).real == pytest.approx(real, abs=1e-13)
