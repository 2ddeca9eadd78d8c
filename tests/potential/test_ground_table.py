import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from rotorjax.errors import InputError
from rotorjax.ground import Plane
from rotorjax.potential.field import disk_functions
from rotorjax.potential.ground_source import DiskQuadrature
from rotorjax.potential.ground_table import disk_modes, disk_projection, ground_table, response
from rotorjax.potential.model import finite_state_model, ground_upflow
from rotorjax.potential.wake_transport import wake_transport
from rotorjax.region import half_plane

QUADRATURE = DiskQuadrature(12, 16)
MODEL = finite_state_model(harmonics=1, radial_terms=2, ground_harmonics=1, quadrature=QUADRATURE)
WAKE = wake_transport(2.0, 6)


def smooth_states(count, transport):
    """States that the wake may carry: a wave going down."""
    a = 0.05 / np.arange(1, count + 1)
    depths = np.zeros(1) if transport is None else transport.depths
    return jnp.array(np.concatenate([(a * np.cos(depths[:, None] + np.arange(count))).ravel(), [0.02, -0.01]]))


@pytest.mark.parametrize(
    ("slope", "transport", "worst"), [((0, 0), None, 1e-6), ((-8, 8), None, 1e-6), ((0, 0), WAKE, 1e-6)]
)
def test_table_is_the_untabulated_response(slope, transport, worst):
    table = ground_table(MODEL, (0.5, 1.9), slope, transport=transport)
    x = smooth_states(6, transport)
    for height, degrees in ((0.55, slope[0]), (1.13, 0.4 * slope[1]), (1.85, slope[1])):
        ground = Plane(jnp.array(height), jnp.deg2rad(jnp.array(float(degrees))))
        exact = response(MODEL, ground, transport)[0] @ x
        found = table.apply([jnp.sqrt(ground.height), ground.slope], x)
        np.testing.assert_allclose(found, exact, atol=worst * float(jnp.abs(exact).max()))


def test_level_table_has_one_block_a_harmonic_and_a_sloping_one_two():
    assert len(ground_table(MODEL, (1.0, 1.0)).rows) == 3
    assert len(ground_table(MODEL, (1.0, 1.0), (5.0, 5.0)).rows) == 2


def test_projection_is_the_flow_on_the_disk():
    ground = Plane(jnp.array(0.7), jnp.array(0.0))
    c = jnp.linspace(0.03, 0.01, len(MODEL.sources))
    x, y = jnp.array([0.1, 0.5, -0.9]), jnp.array([0.2, -0.7, 0.1])
    flow = c @ ground_upflow(MODEL, ground, jnp.stack([x, y, 0 * x], axis=-1))
    mine = (disk_projection(MODEL, ground) @ c) @ disk_functions(disk_modes(MODEL), x, y)
    np.testing.assert_allclose(mine, flow, atol=2e-3 * float(jnp.abs(flow).max()))


@pytest.mark.slow
def test_moving_edge():
    model = finite_state_model(
        radial_terms=2, ground_harmonics=2, ground_parity="odd", quadrature=QUADRATURE, region=half_plane(0.0)
    )
    table = ground_table(model, (0.9, 1.1), edge=(-0.6, 0.6), nodes=(6, 1, 33))
    x = smooth_states(2, None)
    for edge in (-0.55, 0.1, 0.47):
        chosen = eqx.tree_at(lambda m: m.region.edge, model, jnp.array(edge))
        exact = response(chosen, Plane(jnp.array(1.03), jnp.array(0.0)), None)[0] @ x
        found = table.apply([jnp.sqrt(1.03), jnp.array(0.0), jnp.array(edge)], x)
        np.testing.assert_allclose(found, exact, atol=1e-3 * float(jnp.abs(exact).max()))


@pytest.mark.slow
def test_derivatives_by_height_and_slope():
    table = ground_table(MODEL, (0.5, 1.9), (-8, 8))
    x = smooth_states(6, None)

    def f(v):
        return table.apply([jnp.sqrt(v[0]), v[1]], x)

    def untabulated(v):
        return response(MODEL, Plane(v[0], v[1]), None)[0] @ x

    v = jnp.array([1.2, 0.05])
    forward, step = jax.jacfwd(f)(v), 1e-5
    differences = np.stack([(f(v + step * e) - f(v - step * e)) / (2 * step) for e in np.eye(2)], axis=-1)
    np.testing.assert_allclose(forward, differences, rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(forward, jax.jacrev(f)(v), atol=1e-15)
    np.testing.assert_allclose(forward, jax.jit(jax.jacfwd(untabulated))(v), atol=1e-6)


@pytest.mark.parametrize(
    ("settings", "match"),
    [
        ({"height": (2.0, 1.0)}, r"`height` must be a range .* but is \(2\.0, 1\.0\)"),
        ({"height": (0.1, 1.0), "slope_deg": (0.0, 10.0)}, "must stay above 0.176"),
        ({"height": (0.5, 1.0), "slope_deg": (0.0, 70.0)}, "must stay above inf at 70 deg"),
        ({"height": (0.5, 3.0), "transport": WAKE}, "down to 3 R.* ends at 2"),
        ({"height": (0.5, 1.0), "edge": (-1.0, 1.0)}, "region is a half-plane"),
    ],
)
def test_bad_input(settings, match):
    with pytest.raises(InputError, match=match):
        ground_table(MODEL, **settings)
