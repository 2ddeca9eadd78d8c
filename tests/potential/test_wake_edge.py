import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import quad
from scipy.linalg import eigh

from rotorjax.errors import InputError
from rotorjax.ground import plane
from rotorjax.panels.shapes import wall
from rotorjax.potential.contraction import contraction
from rotorjax.potential.model import finite_state_model, ground_upflow, mean_inflow, steady_state, velocity, wake_over
from rotorjax.potential.wake_edge import FADING, left_of_tilt
from rotorjax.region import half_plane

WAKE = contraction()
SLOPE = plane(1.0, 20.0)
TAU = jnp.zeros(9).at[:4].set(jnp.array([2.6e-3, -1.6e-3, 6e-4, 2e-4]))


def test_a_tilt_fades_as_disturbances_of_a_jet_whose_edge_is_at_the_airs_pressure():
    """The slowest decays of Laplace's equation in a cylinder with φ = 0 on it, by finite elements along the radius."""
    nodes = np.linspace(0, 1, 401)
    point, share = np.polynomial.legendre.leggauss(3)
    step = np.diff(nodes)
    r, weight = nodes[:-1, None] + step[:, None] * (point + 1) / 2, step[:, None] * share / 2
    shapes, slope = ((nodes[1:, None] - r) / step[:, None], (r - nodes[:-1, None]) / step[:, None]), 1 / step
    rates = []
    for m in (0, 1):
        stiff, mass = np.zeros((2, 401, 401))
        e = np.arange(400)
        for i, (one, sign) in enumerate(zip(shapes, (-1, 1), strict=True)):
            for j, (two, other) in enumerate(zip(shapes, (-1, 1), strict=True)):
                bend = (sign * other * slope[:, None] ** 2 + m**2 * one * two / r**2) * r * weight
                np.add.at(stiff, (e + i, e + j), bend.sum(axis=1))
                np.add.at(mass, (e + i, e + j), (one * two * r * weight).sum(axis=1))
        kept = slice(m, -1)  # φ = 0 on the edge, and for a harmonic on the axis
        rates.append(np.sqrt(eigh(stiff[kept, kept], mass[kept, kept], eigvals_only=True, subset_by_index=[0, 0])[0]))
    np.testing.assert_allclose(rates[1] - rates[0], FADING, rtol=1e-4)


def test_the_way_is_counted_in_radii_of_the_wake():
    wake = WAKE.over(jnp.asarray(1.0))
    radii = quad(lambda s: 1 / (wake.radius + (1 - wake.radius) * np.exp(-s / wake.length)), 0.3, 1.0)[0]
    np.testing.assert_allclose(left_of_tilt(wake, jnp.asarray(0.3), jnp.asarray(1.0)), np.exp(-FADING * radii))
    np.testing.assert_allclose(left_of_tilt(None, jnp.asarray(0.3), jnp.asarray(1.0)), np.exp(-FADING * 0.7))
    still = contraction(1.0)
    np.testing.assert_allclose(left_of_tilt(still, jnp.asarray(0.3), jnp.asarray(1.0)), np.exp(-FADING * 0.7))


def pair(ground, **choices):
    return [finite_state_model(ground, 1, ground_harmonics=1, wake_edge=edge, **choices) for edge in ("free", "rigid")]


@pytest.mark.parametrize("ground", [SLOPE, plane(0.6)], ids=["slope", "level"])
def test_on_the_disk_the_part_that_is_odd_across_the_shaft_is_weakened_and_nothing_else(ground):
    free, rigid = pair(ground)
    points = jnp.array([[0.4, 0.2, 0.0], [-0.4, -0.2, 0.0], [0.0, 0.9, 0.0], [0.0, -0.9, 0.0]])
    left = left_of_tilt(wake_over(free, ground), jnp.asarray(0.0), ground.height)
    for ours, theirs in zip(*(ground_upflow(model, ground, points) for model in (free, rigid)), strict=True):
        for here, there in ((0, 1), (2, 3)):
            np.testing.assert_allclose(ours[here] + ours[there], theirs[here] + theirs[there], atol=1e-14)
            np.testing.assert_allclose(ours[here] - ours[there], left * (theirs[here] - theirs[there]), atol=1e-14)


def test_ground_mean_and_states_are_those_of_a_rigid_edge():
    """The plane stays as closed, and the mean inflow, so that the mass flow and the states are the same."""
    free, rigid = pair(SLOPE)
    state, other = (steady_state(model, TAU) for model in (free, rigid))
    for ours, theirs in zip(jax.tree.leaves(state), jax.tree.leaves(other), strict=True):
        np.testing.assert_allclose(ours, theirs, rtol=1e-12, atol=1e-15)
    np.testing.assert_allclose(mean_inflow(state, free), mean_inflow(other, rigid), rtol=1e-13)
    x, y = jnp.array([0.3, -0.3, 0.0]), jnp.array([0.1, 0.1, -0.5])
    on_it = jnp.stack([x, y, x * jnp.tan(SLOPE.slope) - SLOPE.height + 1e-9], axis=-1)
    np.testing.assert_allclose(velocity(state, on_it, free), velocity(other, on_it, rigid), atol=1e-9)


def test_it_has_derivatives_at_the_axis_the_rim_and_the_ground():
    model = finite_state_model(SLOPE, 1, ground_harmonics=1)
    places = jnp.array([[0.0, 0, 0], [1, 0, 0], [0.6, 0.8, 0], [0, 0, -1], [1.5, 0, -0.2], [-3, 0, -1], [3.5, 0, 1]])

    def flow(height, points):
        plane_there = eqx.tree_at(lambda g: g.height, SLOPE, height)
        return ground_upflow(eqx.tree_at(lambda m: m.ground, model, plane_there), plane_there, points)

    assert np.all(np.isfinite(flow(SLOPE.height, places)))
    for take in (jax.jacfwd, jax.jacrev):
        for slopes in jax.jit(take(flow, argnums=(0, 1)))(SLOPE.height, places):
            assert np.all(np.isfinite(slopes))


def test_where_ground_ends_or_surfaces_stand_the_edge_is_rigid():
    assert finite_state_model(SLOPE).wake_edge == "free"
    assert finite_state_model(SLOPE, printed=True).wake_edge == "rigid"
    assert finite_state_model(plane(1.0), region=half_plane(0.3)).wake_edge == "rigid"
    assert finite_state_model(surfaces=wall(1.5, -1.0, 1.0)).wake_edge == "rigid"


def test_an_edge_that_does_not_exist_or_beside_surfaces_is_refused():
    with pytest.raises(InputError, match="`wake_edge` must be one of"):
        finite_state_model(wake_edge="loose")  # pyright: ignore[reportArgumentType]
    with pytest.raises(InputError, match="`wake_edge` must be 'rigid' beside surfaces"):
        finite_state_model(surfaces=wall(1.5, -1.0, 1.0), wake_edge="free")


def test_a_wake_that_leans_away_leaves_the_disk_to_the_ground():
    """By the share that two circles so far apart have in common, within a tenth: the whole in hover, none far away."""
    free, rigid = pair(plane(1.0))
    points = jnp.array([[0.5, 0.2, 0.0]])
    bare = ground_upflow(rigid, plane(1.0), points)

    def taken(lean):
        return bare - ground_upflow(eqx.tree_at(lambda m: m.lean, free, lean), plane(1.0), points)

    hover = taken(0.0)
    for apart in (0.5, 1.0, 1.5, 2.0):
        common = 2 / np.pi * (np.arccos(apart / 2) - apart / 2 * np.sqrt(1 - apart**2 / 4))
        np.testing.assert_allclose(taken(apart), common * hover, atol=0.1 * np.abs(hover).max())
