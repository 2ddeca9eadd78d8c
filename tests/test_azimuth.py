"""Fourier series over the disk give back what made them."""

import numpy as np
import pytest

from rotorjax.bench.azimuth import refine_azimuth, valley_side


def field(psi):
    return np.stack([1 + 0.3 * np.cos(psi) - 0.2 * np.sin(psi), 2 - 0.1 * np.cos(psi)], axis=1)


@pytest.mark.parametrize("count", [4, 8, 9, 12, 15])
def test_the_valley_is_at_180_degrees_for_any_number_of_azimuths(count):
    values = field(2 * np.pi / count * np.arange(count))
    np.testing.assert_allclose(valley_side(values), [0.7, 2.1], rtol=1e-14)


def test_an_axisymmetric_field_is_the_same_on_both_sides():
    np.testing.assert_array_equal(valley_side(np.array([[1.0, 2.0]])), [1.0, 2.0])


@pytest.mark.parametrize("count", [8, 9])
def test_refined_fields_go_on_with_the_same_harmonics(count):
    psi = 2 * np.pi / count * np.arange(count)
    fine, values = refine_azimuth(psi, field(psi))
    np.testing.assert_allclose(values, field(fine), atol=1e-14)
