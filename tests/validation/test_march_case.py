"""A disturbance of the periodic wake, marched, against the linear wake's fastest mode."""

import numpy as np
import pytest
from jax.flatten_util import ravel_pytree

from rotorjax.linearisation.waves import WaveMode, pairing
from rotorjax.validation.disturbance import Disturbed, Fastest, disturbed, left_vector
from rotorjax.wake.solution import solve


def made_up(rate):
    """Two wave numbers that grow together, and a mode that stops growing where they are no longer small."""
    psi = np.linspace(0, 20, 241)
    total = np.minimum(1e-5 * np.exp(0.4 * psi), 1e-2)
    share = np.exp(rate * psi) * np.where(total < 1e-3, 1, 0.1)
    return Disturbed(psi, np.stack([0.6 * total, 0.8 * total], axis=1), share, None)


def test_growth_is_read_while_the_disturbance_is_small():
    found = made_up(0.3 + 1.7j)
    np.testing.assert_allclose(found.total[0], 1e-5)
    assert found.exponent(1e-3) == pytest.approx(0.3 + 1.7j, rel=1e-9)
    assert found.steepest(1e-3) == pytest.approx(0.4, rel=1e-2)
    assert np.isnan(found.steepest(1e-5))


def test_left_vector_picks_one_mode_out():
    matrix = np.random.default_rng(1).normal(size=(30, 30))
    values, right = np.linalg.eig(matrix)
    left = left_vector(matrix.astype(complex), complex(values[0]))
    weights = np.abs(left.conj() @ right)
    assert np.all(weights[1:] < 1e-9 * weights[0])


def test_a_small_disturbance_of_the_march_is_as_much_larger_as_it_starts_larger(coarse_hover):
    """The nonlinear march of both blades' wakes from rest: linear in what it starts with, whatever it is read with."""
    rest = solve(coarse_hover.model, coarse_hover, tol=1e-11)  # what is left of a residual of 1e-7 would move off too
    left = np.random.default_rng(2).normal(size=ravel_pytree(rest.state)[0].size) + 0j
    along = Fastest(WaveMode(1, 0.3 + 0j, 0.0), left, 250.0, pairing(rest))
    one, two = (disturbed(rest, along, size, 0.25, samples=8, progress=False) for size in (1e-6, 2e-6))
    np.testing.assert_allclose(one.psi, np.linspace(0, np.pi / 2, 3))
    assert one.total[0] == pytest.approx(1e-6, rel=0.05)
    np.testing.assert_allclose(two.displacement, 2 * one.displacement, rtol=1e-3)
    np.testing.assert_allclose(two.share, one.share, rtol=2e-3)
    assert np.all(one.total < 1e-5)  # and it has not moved off by itself
