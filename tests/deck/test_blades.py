import jax
import jax.numpy as jnp
import numpy as np
import pytest

from rotorjax.deck.blades import SectionBlades, linear_blades, pressure_matrix, stations
from rotorjax.errors import InputError
from rotorjax.potential.loading import from_distribution, thrust_coefficient
from rotorjax.potential.modes import rotor_modes
from rotorjax.rotor.blade_element import disk_loading, section_loads
from rotorjax.rotor.catalogue import load

MODES = rotor_modes(1, 3)


def test_thrust_of_linear_blades_is_the_textbook_one():
    """C_T = σa/2 (θ/3 (1 + 3μ²/2) − λ/2), no root cut-out."""
    at, mu, lam, theta = stations(0.0, 8, 8), 0.1, 0.03, 0.12
    down = jnp.full((8, 8), lam)
    load_ = linear_blades(0.08).loading(down, jnp.array(theta), jnp.array(mu), at)
    tau = pressure_matrix(at, MODES) @ load_.ravel()
    expected = 0.08 * 5.73 / 2 * (theta / 3 * (1 + 1.5 * mu**2) - lam / 2)
    np.testing.assert_allclose(thrust_coefficient(tau, MODES), expected, rtol=1e-12)


def test_pressure_matrix_is_the_loading_integral():
    at = stations(0.1, 6, 5)
    load_ = jnp.sin(at.r) * (1 + 0.2 * jnp.cos(at.psi - 0.3))[:, None]
    expected = from_distribution(load_, at.r, at.widths, at.psi, MODES)
    np.testing.assert_allclose(pressure_matrix(at, MODES) @ load_.ravel(), expected, rtol=1e-13, atol=1e-17)


def test_section_blades_are_the_blade_element_up_to_the_tip_loss():
    rotor, operating = load("uh60")
    at, down = stations(0.2, 6, 4), jnp.full((4, 6), 0.05)
    mine = SectionBlades(rotor, operating).loading(down, jnp.array(0.3), jnp.array(0.0), at)
    loads = section_loads(rotor, operating, at.r, jnp.broadcast_to(at.r, down.shape), down, jnp.array(0.3))
    inner = 0.2 + np.cumsum(at.widths) - np.array(at.widths)
    lifting = np.clip((0.97 - inner) / np.array(at.widths), 0, 1)
    assert lifting[-1] < 1
    assert lifting[-3] == 1
    np.testing.assert_allclose(mine, disk_loading(rotor, loads) * lifting, rtol=1e-14)
    advancing = SectionBlades(rotor, operating).loading(down, jnp.array(0.3), jnp.array(0.1), at)
    assert np.all(advancing[1] > advancing[3])


def test_derivatives():
    at = stations(0.1, 4, 4)

    def f(v):
        return linear_blades(0.08).loading(jnp.full((4, 4), v[0]), v[1], v[2], at).sum()

    v, step = jnp.array([0.04, 0.1, 0.05]), 1e-6
    differences = [(f(v + step * e) - f(v - step * e)) / (2 * step) for e in np.eye(3)]
    np.testing.assert_allclose(jax.jacfwd(f)(v), differences, rtol=1e-6)
    np.testing.assert_allclose(jax.jacrev(f)(v), jax.jacfwd(f)(v), rtol=1e-13)


@pytest.mark.parametrize(
    ("make", "match"),
    [
        (lambda: stations(1.0), "but is 1.0"),
        (lambda: stations(0.1, 0), "at least 1"),
        (lambda: linear_blades(-0.1), "`solidity`"),
        (lambda: linear_blades(0.1, 0.0), "`lift_slope`"),
    ],
)
def test_bad_input(make, match):
    with pytest.raises(InputError, match=match):
        make()
