"""The operating point: derived speeds, defaults, derivatives and what the constructor refuses."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from rotorjax.errors import InputError
from rotorjax.operating import operating_point


def test_derived_speeds():
    point = operating_point(27.0, sound_speed=340.0, climb=2.2)
    assert float(point.tip_speed(jnp.array(8.0))) == 216.0
    np.testing.assert_allclose(point.tip_mach(jnp.array(8.0)), 216 / 340, rtol=1e-15)
    np.testing.assert_allclose(point.climb_ratio(jnp.array(8.0)), 2.2 / 216, rtol=1e-15)


def test_air_defaults_to_the_standard_atmosphere():
    point = operating_point(10.0)
    # a² = γRT and ρ = p/(RT) with R = 287.053, T = 288.15 K, p = 101 325 Pa (ISO 2533); Sutherland's viscosity.
    np.testing.assert_allclose(point.sound_speed, np.sqrt(1.4 * 287.05287 * 288.15), rtol=1e-5)
    np.testing.assert_allclose(point.density, 101325 / (287.05287 * 288.15), rtol=1e-4)
    sutherland = 1.458e-6 * 288.15**1.5 / (288.15 + 110.4)
    np.testing.assert_allclose(point.viscosity, sutherland / 1.225, rtol=1e-4)


def test_constructor_may_be_differentiated_through():
    slope = jax.jit(jax.grad(lambda omega: operating_point(omega).tip_mach(jnp.array(8.0))))(27.0)
    np.testing.assert_allclose(slope, 8.0 / 340.294, rtol=1e-15)


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        ({"omega": 0.0}, r"Argument `omega` must be a number in \(0, 21000\] rad/s, but is 0"),
        ({"omega": -27.0}, "Argument `omega` must"),
        ({"omega": float("nan")}, "Argument `omega` must .* but is nan"),
        ({"omega": "27"}, "Argument `omega` must .* but is '27'"),
        ({"omega": None}, "Argument `omega` must"),
        ({"omega": True}, "Argument `omega` must"),
        ({"omega": [1.0, 2.0]}, "Argument `omega` must"),
        ({"omega": 27.0, "density": 0.0}, "Argument `density` must"),
        ({"omega": 27.0, "sound_speed": float("inf")}, "Argument `sound_speed` must"),
        ({"omega": 27.0, "viscosity": -1e-5}, "Argument `viscosity` must"),
        ({"omega": 27.0, "collective": 18.0}, "Argument `collective` must be a number in .* but is 18"),
        ({"omega": 27.0, "climb": float("nan")}, r"Argument `climb` must be a number in \[-200, 200\] m/s, but is nan"),
    ],
)
def test_refuses(arguments, text):
    with pytest.raises(InputError, match=text):
        operating_point(**arguments)
