import mpmath
import numpy as np
import pytest
import scipy.linalg

from rotorjax.errors import InputError
from rotorjax.ode import age_difference
from rotorjax.ode.age_difference import five_point_upwind


@pytest.mark.parametrize("ages", [4, 5, 6, 24])
def test_quartics_are_exact(ages):
    matrix, boundary = five_point_upwind(ages)
    nodes = np.arange(ages + 1.0) / ages
    for power in range(5):
        f = nodes**power
        slope = (matrix @ f[1:] + boundary * f[0]) * ages
        np.testing.assert_allclose(slope, power * nodes[1:] ** max(power - 1, 0), atol=1e-12)


def test_order_is_four():
    """Every row by itself, by regression on the log error in the maximum norm."""
    sizes = np.array([32, 48, 64, 96, 128])
    errors = []
    for ages in sizes:
        nodes = np.linspace(0, 2, ages + 1)
        matrix, boundary = five_point_upwind(ages)
        slope = (matrix @ np.sin(3 * nodes[1:]) + boundary * np.sin(3 * nodes[0])) * ages / 2
        errors.append(np.abs(slope - 3 * np.cos(3 * nodes[1:])).max())
    order = -np.polyfit(np.log(sizes), np.log(errors), 1)[0]
    assert abs(order - 4) < 0.2


@pytest.mark.parametrize("ages", [8, 12, 18])
def test_rightmost_eigenvalue(ages):
    """In 40 digits: double-precision eigenvalues of so non-normal a matrix are rounding noise."""
    with mpmath.workdps(40):
        values = mpmath.eig(mpmath.matrix((-12 * five_point_upwind(ages)[0]).tolist()) / 12, left=False, right=False)
    assert abs(float(max(v.real for v in values)) + 0.2153) < 5e-4


@pytest.mark.parametrize("ages", [24, 72])
def test_transient_growth_is_bounded_and_decays(ages):
    matrix, _ = five_point_upwind(ages)
    leap = scipy.linalg.expm(-matrix)
    growth, state = [], np.eye(ages)
    for _ in range(3 * ages):
        state = leap @ state
        growth.append(np.linalg.norm(state, 2))
    assert 1 < max(growth) <= 3.1
    assert growth[-1] < 1e-3


def test_broken_stencil_is_refused():
    with pytest.raises(ValueError, match="moment condition of power 0"):
        age_difference._weights(-3, (-1, 6, -18, 10, 4))


def test_too_few_ages_are_refused():
    with pytest.raises(InputError, match=r"`ages` must be at least 4 .* but is 3"):
        five_point_upwind(3)
