"""Partial ground: masks, the condition on the region only, limits, symmetry, and an edge that passes the rotor."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from rotorjax.errors import InputError
from rotorjax.ground import plane
from rotorjax.potential import rigid_cylinder
from rotorjax.potential.ground_source import DiskQuadrature
from rotorjax.potential.model import (
    disk_inflow,
    finite_state_model,
    ground_normal_velocity_rms,
    inflow,
    mean_inflow,
    steady_state,
)
from rotorjax.region import Mask, disk, half_plane, rectangle, smooth_step

LEVEL = plane(1.0)
TAU = jnp.zeros(9).at[:3].set(jnp.array([np.sqrt(3) / 4 * 0.006, 5e-4, 2e-4]))
R, PSI = jnp.array([0.3, 0.6, 0.9]), jnp.array([0.0, 0.7, np.pi / 2, np.pi, 5.0])


CYLINDER = {"wake": None, "slope": "sheared", "ground_in_mass_flow": False, "mass_flow": "paper", "wake_edge": "rigid"}
"""A region cuts the sources: seen alone where nothing else, neither wake nor mass flow, knows of the ground."""


def model(region=None, radius=None, ground=LEVEL):
    return finite_state_model(
        ground,
        harmonics=1,
        ground_harmonics=6,
        ground_radial_terms=5,
        ground_parity="odd",
        quadrature=DiskQuadrature(24, 32),
        region=region,
        ground_radius=radius,
        **CYLINDER,
    )


def fields(chosen):
    state = steady_state(chosen, TAU)
    return inflow(state, R, PSI, chosen), mean_inflow(state, chosen), ground_normal_velocity_rms(state, chosen)


@eqx.filter_jit
def sweep(edges, azimuth=0.0):
    """Inflow, its mean and the ground's residual with the edge at each place."""

    def one(edge):
        return fields(eqx.tree_at(lambda m: m.region, model(half_plane(0.0)), moved(edge, azimuth)))

    return jax.lax.map(one, edges)


def moved(edge, azimuth):
    return eqx.tree_at(lambda h: (h.edge, h.azimuth), half_plane(0.0), (edge, jnp.asarray(azimuth)))


@pytest.mark.parametrize(
    "region",
    [
        half_plane(1.4),
        rectangle((-1.4, -1.4, -1.0), (1.4, 1.4, -1.0), LEVEL),
        disk((0.0, 0.0, -1.0), 1.5, LEVEL),
        Mask(lambda x, y: jnp.ones_like(x * y)),
    ],
    ids=["half-plane", "rectangle", "disk", "mask"],
)
def test_region_that_holds_the_whole_disk_is_full_ground(region):
    np.testing.assert_allclose(fields(model(region))[0], fields(model())[0], atol=1e-6 * 0.05)


def test_no_region_is_no_ground():
    free, none = fields(model(half_plane(-1.4))), finite_state_model(harmonics=1, **CYLINDER)
    np.testing.assert_allclose(free[0], inflow(steady_state(none, TAU), R, PSI, none), atol=1e-6 * 0.05)


def test_inflow_falls_steadily_as_the_edge_passes_under_the_rotor():
    lam, mean, _ = sweep(jnp.linspace(-1.4, 1.4, 43))
    assert np.all(np.diff(mean) < 1e-15)
    np.testing.assert_allclose(mean[0], sweep(jnp.array([-1.4]))[1][0], rtol=1e-14)
    assert mean[-1] < 0.6 * mean[0]
    middle = lam[21]
    assert middle[0, 2] > 1.2 * middle[3, 2]  # the ground is forward of an edge at 0 with azimuth 0


def test_ground_condition_holds_on_the_region():
    """≤ 3 % of the flow into the region where it is a good part of the disk; slivers are as fine as the modes."""
    edges = np.array([-0.8, -0.4, 0.0, 0.4, 0.8])
    left = sweep(jnp.array(edges))[2]
    assert np.all(left[1:] < 0.03)
    assert left[0] < 0.06


def test_turned_edge_gives_the_turned_flow():
    """Mirror images: the edge to starboard and to port, and aft and forward; the loading is axisymmetric."""
    east, north, west = (fields(model(half_plane(0.3, a)))[0] for a in (90.0, 0.0, 270.0))
    mirrored = jnp.array([0.0, -0.7, -np.pi / 2, np.pi, -5.0])
    chosen = model(half_plane(0.3, 270.0))
    np.testing.assert_allclose(east, inflow(steady_state(chosen, TAU), R, mirrored, chosen), atol=1e-12)
    np.testing.assert_allclose(east[2], north[0], atol=1e-10)
    np.testing.assert_allclose(west[0], east[0], atol=1e-12)


def test_ground_disk_of_another_radius():
    """A wider ground disk meets the flow outside the wake too, and the rotor feels little of it."""
    wide, one = fields(model(None, 1.25)), fields(model(None, 1.0))
    np.testing.assert_allclose(one[0], fields(model())[0], atol=1e-15)
    np.testing.assert_allclose(wide[1], one[1], rtol=0.1)
    assert wide[2] < 0.1


def test_slope_and_region_together():
    sloping = plane(1.0, 10.0)
    left = fields(model(half_plane(0.4), None, sloping))[2]
    assert left < 0.03


@pytest.mark.slow
def test_derivative_by_the_edge():
    def mean(edge):
        return sweep(jnp.stack([edge]))[1][0]

    edge, step = jnp.array(0.23), 1e-5
    difference = (mean(edge + step) - mean(edge - step)) / (2 * step)
    np.testing.assert_allclose(jax.jacfwd(mean)(edge), difference, rtol=1e-6)
    np.testing.assert_allclose(jax.jacrev(mean)(edge), difference, rtol=1e-6)


def test_smooth_step():
    s, width = jnp.array([-0.31, -0.3, 0.0, 0.3, 0.5]), jnp.array(0.3)
    np.testing.assert_allclose(smooth_step(s, width), [0, 0, 0.5, 1, 1], atol=1e-16)
    for order in (1, 2):
        f = smooth_step
        for _ in range(order):
            f = jax.grad(f)
        np.testing.assert_allclose(f(jnp.array(0.2999999), width), 0, atol=1e-3)


def test_disk_mask_is_smooth_at_its_centre():
    pad = disk((0.2, 0.0, -1.0), 0.5, LEVEL)
    slope = jax.grad(lambda x: pad.mask(x, jnp.array(0.0)))(jnp.array(0.2))
    assert slope == 0
    np.testing.assert_allclose(pad.mask(jnp.array([0.7, -0.3]), jnp.zeros(2)), 0.5, atol=1e-14)


def test_exact_image_refuses_a_region():
    chosen = model(half_plane(0.0))
    with pytest.raises(InputError, match="has a region"):
        rigid_cylinder.disk_inflow(steady_state(chosen, TAU), R, 0 * R, chosen)
    assert disk_inflow(steady_state(chosen, TAU), R, 0 * R, chosen).shape == (3,)


@pytest.mark.parametrize(
    ("make", "match"),
    [
        (lambda: half_plane(np.nan), "`edge` must be finite"),
        (lambda: half_plane(0.0, width=0.0), "`width` must be positive"),
        (lambda: rectangle((-1, -1, -1), (1, 1, -0.9), LEVEL), r"is 0\.1 R off it: z must be -1"),
        (lambda: rectangle((-1, -1, -1), (1, -0.8, -1), LEVEL), "more than 2 width"),
        (lambda: disk((0, 0, 0.5), 1.0, LEVEL), "must lie on the plane"),
        (lambda: disk((0, 0, -1), -1.0, LEVEL), "`radius` must be positive"),
        (lambda: model(None, -1.0), "`ground_radius` must be positive"),
    ],
)
def test_bad_input(make, match):
    with pytest.raises(InputError, match=match):
        make()
