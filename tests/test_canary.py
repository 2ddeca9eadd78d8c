"""Watches for miscompiled code: the reason of the jax pin in pyproject.toml.

jax 0.10.2 on a CPU makes the jitted `vmap(sum((M @ row)**2))` 0.8 % wrong at 16 385 float64 rows and right below (jax
issue 39103).
"""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from rotorjax.rotor import catalogue
from rotorjax.rotor.airfoil import lift_drag


@pytest.mark.parametrize("rows", [16_384, 16_385, 20_000])
@pytest.mark.parametrize("width", [3, 8])
def test_jitted_matrix_products_are_right_at_the_size_that_broke(rows, width):
    rng = np.random.default_rng(0)
    matrix, vectors = rng.normal(size=(width, width)), rng.normal(size=(rows, width))

    def energy(row):
        return jnp.sum((jnp.asarray(matrix) @ row) ** 2)

    expected = np.sum((vectors @ matrix.T) ** 2, axis=1)
    eager = jax.vmap(energy)(vectors)
    jitted = jax.jit(jax.vmap(energy))(vectors)
    assert jitted.dtype == jnp.float64
    np.testing.assert_allclose(eager, expected, rtol=1e-12)
    np.testing.assert_allclose(jitted, expected, rtol=1e-12)


def test_jitted_airfoil_table_equals_eager():
    table = catalogue.load("uh60")[0].airfoil
    rng = np.random.default_rng(1)
    alpha, mach = rng.uniform(-4, 4, 16_385), rng.uniform(0, 1.1, 16_385)
    for jitted, eager in zip(jax.jit(lift_drag)(table, alpha, mach), lift_drag(table, alpha, mach), strict=True):
        np.testing.assert_allclose(jitted, eager, rtol=0, atol=1e-13)
