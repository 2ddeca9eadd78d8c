"""What a compiler must get right, run by test_canary.py in processes that compile as users do."""

import jax
import jax.numpy as jnp
import numpy as np

from rotorjax.rotor import catalogue
from rotorjax.rotor.airfoil import lift_drag
from rotorjax.simulation.march import compiled


def products(width, rows):
    """Jitted and eager matrix products are numpy's."""
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


def airfoil():
    """The jitted airfoil table is the eager one."""
    table = catalogue.load("uh60")[0].airfoil
    rng = np.random.default_rng(1)
    alpha, mach = rng.uniform(-4, 4, 16_385), rng.uniform(0, 1.1, 16_385)
    for jitted, eager in zip(jax.jit(lift_drag)(table, alpha, mach), lift_drag(table, alpha, mach), strict=True):
        np.testing.assert_allclose(jitted, eager, rtol=0, atol=1e-13)


def wide(dtype, count=2000):
    """A march's programs are numpy's. With 512-bit registers jax 0.11.2 computes half of this one's numbers wrong, in
    both precisions, and some calls of it NaN.
    """
    x = np.linspace(0.1, 0.9, count, dtype=dtype)
    program = compiled(lambda x, y: (jnp.log1p(x) + jnp.arctan(x))[:, None] * y, x, y := np.array([1, 2, 3], dtype))
    for _ in range(3):
        np.testing.assert_allclose(program(x, y), (np.log1p(x) + np.arctan(x))[:, None] * y, rtol=1e-5)


if __name__ == "__main__":
    jax.config.update("jax_enable_x64", True)
    for width in (3, 8):
        for rows in (16_384, 16_385, 20_000):
            products(width, rows)
    airfoil()
    wide(np.float32)
    wide(np.float64)
    print("right")
