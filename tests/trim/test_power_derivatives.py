"""Power of a rotor trimmed over ground: its derivatives by height, twist and chord against trims made anew."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from rotorjax.trim.run import request, run
from rotorjax.trim.solve import power, trim, trimmed_power

STEP = 1e-4


@pytest.mark.slow
def test_derivatives_of_trimmed_power_by_height_twist_and_chord():
    """With the uniform inflow over ground; height in R, twist and chord by shares of themselves."""
    found = run(request("uh60", 0.00575, "uniform", height=0.75, azimuths=8)).trimmed
    assert found.outcome.converged

    def moved(v):
        rotor = found.p.rotor
        p = eqx.tree_at(
            lambda p: (p.rotor.twist.values, p.rotor.chord.values),
            found.p,
            (rotor.twist.values * (1 + v[1]), rotor.chord.values * (1 + v[2])),
        )
        return eqx.tree_at(lambda f: f.height, found.flight, found.flight.height + v[0]), p

    def again(v):
        flight, p = moved(v)
        return power(trim(p, flight, start=found.z, azimuths=8).z, flight, p)

    for way in jnp.eye(3):
        _, slope = jax.jvp(lambda v: trimmed_power(found, *moved(v)), (jnp.zeros(3),), (way,))
        near = (again(STEP * way) - again(-STEP * way)) / (2 * STEP)
        np.testing.assert_allclose(slope, near, rtol=1e-6)
