from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from rotorjax.errors import InputError
from rotorjax.ground import Plane
from rotorjax.potential.field import pressure_functions
from rotorjax.potential.ground_source import rotor_on_ground
from rotorjax.potential.matrices import apparent_mass, damping
from rotorjax.potential.model import finite_state_model, wake_over
from rotorjax.potential.wake_transport import transported_flow, wake_transport

cylinder_model = partial(finite_state_model, printed=True, strengths="closed")  # the linear flow of a cylinder

GROUND = Plane(jnp.array(1.0), jnp.array(0.2))
X, Y = jnp.array([0.4, -0.2, 0.9]), jnp.array([0.0, 0.3, 0.1])


@pytest.mark.parametrize("choices", [{"wake": None, "mass_flow": "linear"}, {"wake": None, "mass_flow": "paper"}, {}])
def test_settled_wake_is_the_steady_flow(choices):
    model = finite_state_model(harmonics=1, **choices)
    flow = transported_flow(model, wake_transport(2.0), GROUND, X, Y).sum(axis=-1)
    steady = rotor_on_ground(model.modes, GROUND, X, Y, wake_over(model, GROUND))
    np.testing.assert_allclose(flow, steady.T, atol=1e-13)


def along_streamline(x, depth, omega):
    """Complex amplitude of ∫ (−∂Φ₁/∂z) e^{−iωs} ds down to a depth, for τ₁ = e^{iωψ} at unit speed: the exact flow."""
    modes = cylinder_model(radial_terms=1).modes
    node, weight = np.polynomial.legendre.leggauss(40)
    edges = np.sort(np.append(np.concatenate([np.linspace(0, 5 + depth, 11), np.linspace(10, 180, 60)]), depth))
    widths = np.diff(edges)
    s = (edges[:-1, None] + widths[:, None] * (node + 1) / 2).ravel()
    points = jnp.stack([jnp.full(s.size, x), jnp.zeros(s.size), jnp.array(s - depth)], axis=-1)
    up = jnp.zeros_like(points).at[:, 2].set(1.0)
    slope = -np.array(jax.jvp(lambda p: pressure_functions(modes, p)[0], (points,), (up,))[1])
    return slope @ ((widths[:, None] * weight / 2).ravel() * np.exp(-1j * omega * s))


@pytest.mark.parametrize(("omega", "worst"), [(0.3, 0.015), (1.0, 0.015)])
def test_unsteady_flow_against_integration_along_streamlines(omega, worst):
    """Causal, from rotor states alone: odd and even ones, whose truncation is what is left (of 2.5)."""
    model = cylinder_model(radial_terms=4, even_terms=3, mass_flow="linear")
    d, mass = damping(model.modes, model.modes), apparent_mass(model.modes, model.modes)
    a = np.linalg.solve(1j * omega * mass + d, d[:, 0])
    transport = wake_transport(2.5, 10)
    carried = a * np.exp(-1j * omega * transport.depths)[:, None]
    for depth in (0.5, 1.0, 2.0):
        ground = Plane(jnp.array(depth), jnp.array(0.0))
        flow = np.array(transported_flow(model, transport, ground, jnp.array([0.4]), jnp.array([0.0])))[0]
        exact = along_streamline(0.4, depth, omega)
        assert abs(np.einsum("mk,km->", flow, carried) - exact) < worst * 2.5
        present = a @ np.array(rotor_on_ground(model.modes, ground, jnp.array([0.4]), jnp.array([0.0])))[:, 0]
        assert abs(present - exact) > 4 * worst * 2.5  # without the transit time


def test_wake_carries_a_wave_down():
    transport, speed, omega = wake_transport(2.0, 14), 0.5, 0.6
    wave = np.cos(-omega * transport.depths / speed)
    rate = transport.rate(jnp.array([wave[0]]), jnp.array(wave[1:, None]), jnp.array(speed))[:, 0]
    np.testing.assert_allclose(rate, -omega * np.sin(-omega * transport.depths[1:] / speed), atol=1e-8)


def test_transport_is_stable():
    for nodes in (4, 8, 16):
        slope = wake_transport(2.0, nodes).slope
        assert np.linalg.eigvals(-slope[1:, 1:]).real.max() < -0.5


def test_weights_reproduce_polynomials():
    transport = wake_transport(3.0, 6)
    np.testing.assert_allclose(transport.weights(jnp.array([0.7, 2.2])) @ transport.depths**5, [0.7**5, 2.2**5])
    np.testing.assert_allclose(transport.slope @ transport.depths**3, 3 * transport.depths**2, atol=1e-12)


@pytest.mark.parametrize(("length", "nodes", "match"), [(0.0, 8, "but is 0.0"), (np.nan, 8, "nan"), (1.0, 1, "is 1")])
def test_bad_input(length, nodes, match):
    with pytest.raises(InputError, match=match):
        wake_transport(length, nodes)
