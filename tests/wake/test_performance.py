"""Performance of a rotor in its wake."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from rotorjax.wake.equilibrium import evaluate
from rotorjax.wake.performance import disk_mean, performance


def test_performance_is_that_of_the_solution(hover):
    found = jax.jit(lambda m, x: performance(m, evaluate(m, x)))(hover.model, hover.unknowns)
    expected = (hover.CT, hover.CP, hover.CP_induced, hover.CP_profile, hover.mean_inflow)
    np.testing.assert_allclose(found, expected, rtol=1e-10)


def test_the_mean_inflow_is_over_what_the_blades_sweep(hover):
    """Panels by their area, the cut-out not at all: the innermost panel counts for no more than itself."""
    model, edges = hover.model, np.asarray(hover.model.edges)
    assert float(disk_mean(model, jnp.ones((3, edges.size - 1)))) == pytest.approx(1, rel=1e-14)
    middle = (edges[1:] ** 2 + edges[:-1] ** 2) / 2  # mean of r² over a panel
    assert float(disk_mean(model, jnp.asarray(middle)[None])) == pytest.approx((1 + edges[0] ** 2) / 2, rel=1e-14)
    innermost = jnp.zeros((1, edges.size - 1)).at[0, 0].set(1.0)
    assert float(disk_mean(model, innermost)) == pytest.approx((edges[1] ** 2 - edges[0] ** 2) / (1 - edges[0] ** 2))
