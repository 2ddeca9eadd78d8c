"""Momentum theory in every state of flight: closed forms, signs, derivatives, the branch's name, both precisions."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from rotorjax.inflow.momentum import flight_state, hover_inflow, induced_inflow
from rotorjax.rotor.hub import rotor_inputs

CT = 0.0064
HOVER = np.sqrt(CT / 2)
RATIOS = np.array([-3.0, -2.5, -2.0, -1.9, -1.0, -0.4, -0.1, 0.0, 0.3, 1.0, 4.0])
induced = jax.jit(jax.vmap(induced_inflow))


def axial(ratio):
    """v/v_h in axial flight (Johnson, Helicopter Theory, section 3-2.1); the climb branch inside the vortex ring."""
    if ratio <= -2:
        return -ratio / 2 - np.sqrt(ratio**2 / 4 - 1)
    return -ratio / 2 + np.sqrt(ratio**2 / 4 + 1)


@pytest.mark.parametrize("sign", [1, -1])
def test_axial_flight_is_the_closed_form_and_symmetric(sign):
    found = induced(sign * CT * jnp.ones(RATIOS.size), sign * HOVER * RATIOS, jnp.zeros(RATIOS.size))
    np.testing.assert_allclose(sign * found / HOVER, [axial(x) for x in RATIOS], rtol=2e-8)


def test_every_root_satisfies_the_equation():
    """Any thrust, climb and wind, zeros and climb = −v_h among them: no NaN, and C_T = 2λ√(μ² + (λ + λ_c)²)."""
    values = jnp.array([-1.5, -1.0, -0.31, -1e-9, 0.0, 1e-9, 0.2, 1.0])
    thrust, climb, wind = (v.ravel() for v in jnp.meshgrid(CT * values, HOVER * values * 3, (HOVER * values) ** 2))
    found = induced(thrust, climb, wind)
    assert np.all(np.isfinite(found))
    np.testing.assert_allclose(2 * found * jnp.sqrt(wind + (found + climb) ** 2), thrust, atol=1e-7 * CT)
    assert np.all(found * thrust >= 0)


def test_wind_along_the_disk_is_glaucerts():
    """Far above hover's speed λ_i → C_T/2μ."""
    found = hover_inflow(jnp.asarray(CT), rotor_inputs(u=0.3))
    np.testing.assert_allclose(found, CT / 0.6, rtol=1e-3)


@pytest.mark.parametrize("ratio", [-3.0, -0.4, 0.0, 1.0])
def test_derivatives_are_those_of_the_closed_form(ratio):
    def closed(thrust, climb):
        half, v = climb / 2, jnp.sqrt(thrust / 2)
        return -half - jnp.sqrt(half**2 - v**2) if ratio < -2 else -half + jnp.sqrt(half**2 + v**2)

    at = (CT, ratio * HOVER)
    ours = jax.grad(induced_inflow, (0, 1))(*at)
    np.testing.assert_allclose(ours, jax.grad(closed, (0, 1))(*at), rtol=1e-9)
    np.testing.assert_allclose(jax.jacfwd(induced_inflow, (0, 1))(*at), ours, rtol=1e-12)


def test_single_precision_loses_its_own_rounding_only():
    with jax.enable_x64(False):
        found = induced(jnp.full(RATIOS.size, CT), jnp.asarray(HOVER * RATIOS), jnp.zeros(RATIOS.size))
        assert found.dtype == jnp.float32
        keep = np.abs(RATIOS + 2) > 0.05  # the end of the windmill brake state is a square root
        np.testing.assert_allclose((found / HOVER)[keep], [axial(x) for x in RATIOS[keep]], rtol=2e-6)


@pytest.mark.parametrize(
    ("ratio", "advance", "name"),
    [
        (0.5, 0, "climb"),
        (0.0, 0, "hover"),
        (-0.3, 0, "slow descent"),
        (-0.5, 0, "vortex ring"),
        (-1.99, 0.5, "vortex ring"),
        (-1.99, 1.1, "slow descent"),
        (-2.0, 0, "windmill brake"),
    ],
)
def test_states_are_named_and_mirror(ratio, advance, name):
    for sign in (1, -1):
        assert flight_state(sign * CT, sign * ratio * HOVER, advance * HOVER) == name
