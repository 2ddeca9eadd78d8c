import jax
import jax.numpy as jnp
import numpy as np
import pytest

from rotorjax.errors import InputError
from rotorjax.potential import contraction as module
from rotorjax.potential.contraction import contraction, disk_flow, disk_means, far_flow, near_flow, wake_flow
from rotorjax.potential.field import axial_functions, disk_functions, field_functions, pressure_functions
from rotorjax.potential.ground_source import DiskQuadrature
from rotorjax.potential.modes import rotor_modes

MODES, WAKE = rotor_modes(1, 2), contraction()
POINTS = jnp.array([[0.4, 0.2, 0.3], [0.6, -0.3, 0.0], [0.3, 0.1, -0.1], [0.2, 0.4, -1.5], [1.4, 0.0, -0.7]])


@pytest.mark.parametrize(
    "wake", [contraction(1.0), contraction().shared(jnp.asarray(0.0))], ids=["radius 1", "no share"]
)
def test_a_wake_that_does_not_contract_is_the_cylinder(wake):
    for functions in (axial_functions, field_functions):
        np.testing.assert_allclose(wake_flow(functions, MODES, POINTS, wake), functions(MODES, POINTS), atol=1e-12)


def test_far_below_it_is_momentum_theorys_slipstream():
    """Twice the disk's flow over half of its area, and none outside."""
    deep = jnp.array([[0.3, 0.2, -30.0], [0.75, 0.0, -30.0]])
    flow = wake_flow(axial_functions, MODES, deep, WAKE)
    inside = disk_functions(MODES, deep[0, 0] * np.sqrt(2), deep[0, 1] * np.sqrt(2))
    np.testing.assert_allclose(flow[:, 0], 2 * inside, atol=1e-3)
    np.testing.assert_allclose(flow[:, 1], 0, atol=1e-3)


def test_the_flow_is_continuous_through_the_disk():
    sides = jnp.array([[0.5, 0.2, 1e-9], [0.5, 0.2, 0.0], [0.5, 0.2, -1e-9]])
    flow = wake_flow(field_functions, MODES, sides, WAKE)
    np.testing.assert_allclose(flow[..., 0], flow[..., 1], atol=1e-7)
    np.testing.assert_allclose(flow[..., 2], flow[..., 1], atol=1e-7)
    np.testing.assert_allclose(-flow[2, :, 1], disk_flow(MODES, sides[1, 0], sides[1, 1], WAKE), rtol=1e-12)


@pytest.mark.parametrize("wake", [WAKE, contraction(0.85, 0.1), WAKE.over(jnp.asarray(0.5))])
def test_means_are_those_of_the_disk_and_the_first_is_the_cylinders(wake):
    x, y, nu, weights = (jnp.asarray(v) for v in DiskQuadrature(300, 4).rule())
    means = disk_flow(MODES, x, y, wake) @ (2 * nu * weights)
    np.testing.assert_allclose(disk_means(MODES, wake), means, atol=2e-5)
    np.testing.assert_allclose(disk_means(MODES, wake)[0], 2 / np.sqrt(3), rtol=1e-14)


def test_the_near_flow_keeps_the_cylinders_flux_far_below():
    """∫ of the deep near flow over the narrow wake is that of the cylinder, times the amplitude."""
    x, y, nu, weights = (jnp.asarray(v) for v in DiskQuadrature(40, 8).rule())
    points = jnp.stack([x * WAKE.radius, y * WAKE.radius, 0 * x - 30.0], axis=-1)
    flux = near_flow(axial_functions, MODES, points, WAKE) @ (2 * nu * weights) * WAKE.radius**2
    cylinder = axial_functions(MODES, points.at[:, :2].divide(WAKE.radius)) @ (2 * nu * weights)
    amplitude = flux[0] / cylinder[0]
    np.testing.assert_allclose(flux, amplitude * cylinder, atol=2e-3)
    assert 0.9 < amplitude < 1


def test_steps_are_fine_enough(monkeypatch):
    r = jnp.linspace(0.25, 0.95, 15)
    coarse = disk_flow(MODES, r, 0 * r, WAKE)
    monkeypatch.setattr(module, "STEPS", 48)
    fine = disk_flow(MODES, r, 0 * r, WAKE)
    rms = np.sqrt(np.mean(np.asarray(coarse - fine) ** 2, axis=1)) / (2 / np.sqrt(3))
    assert rms[0] < 2e-2


def test_ground_and_wind_take_the_contraction_away():
    heights = jnp.array([0.3, 0.9, 3.0, 30.0])
    radii = jax.vmap(lambda h: WAKE.over(h).radius)(heights)
    assert np.all(np.diff(radii) < 0)
    np.testing.assert_allclose(1 - radii[1], (1 - WAKE.radius) / 2, rtol=1e-12)  # at the clearance
    np.testing.assert_allclose(radii[-1], WAKE.radius, atol=1e-4)
    np.testing.assert_allclose(WAKE.in_stream(jnp.asarray(0.5)).radius, WAKE.radius, rtol=1e-12)  # hover
    np.testing.assert_allclose(WAKE.in_stream(jnp.asarray(1.0)).radius, 1.0, rtol=1e-12)  # cruise


def test_even_modes_stay_those_of_the_cylinder():
    both = rotor_modes(1, 2, 1)
    even = ~both.odd
    for functions in (pressure_functions, axial_functions):
        plain = functions(both, POINTS[:2])
        np.testing.assert_allclose(near_flow(functions, both, POINTS[:2], WAKE)[even], plain[even], rtol=1e-14)
        np.testing.assert_allclose(far_flow(functions, both, POINTS[:2], WAKE)[even], plain[even], rtol=1e-14)


@pytest.mark.parametrize("bad", [{"radius": 0.0}, {"radius": 1.2}, {"length": 0.0}, {"clearance": float("nan")}])
def test_bad_numbers_are_named(bad):
    with pytest.raises(InputError, match=f"`{next(iter(bad))}`"):
        contraction(**bad)
