"""Performance of a rotor in its wake."""

import jax
import numpy as np

from rotorjax.wake.equilibrium import evaluate
from rotorjax.wake.performance import performance


def test_performance_is_that_of_the_solution(hover):
    found = jax.jit(lambda m, x: performance(m, evaluate(m, x)))(hover.model, hover.unknowns)
    expected = (hover.CT, hover.CP, hover.CP_induced, hover.CP_profile, hover.mean_inflow)
    np.testing.assert_allclose(found, expected, rtol=1e-10)
