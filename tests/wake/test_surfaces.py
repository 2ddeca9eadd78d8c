"""Solid surfaces under the free wake: one periodic hover beside a wall, its frames, its flow and a derivative."""

from dataclasses import replace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from wakes import COARSE

import rotorjax as rj
from rotorjax.errors import InputError
from rotorjax.frames import rotate_about_shaft
from rotorjax.panels.surface import normal_flow, solid
from rotorjax.wake.equilibrium import displacement, look
from rotorjax.wake.field import velocity

SETTINGS = rj.WakeSettings(**COARSE, azimuths=8, tip_core=0.05)
WALL = {"bottom": -1.0, "top": 1.0, "length": 3.0, "thickness": 0.6, "panel": 0.6}


def model(azimuth_deg=0.0):
    return rj.free_wake(*rj.rotor("uh60", 18.0), None, SETTINGS, rj.wall(1.2, azimuth_deg=azimuth_deg, **WALL))


@pytest.fixture(scope="module")
def beside():
    return rj.solve(model()).found


@pytest.fixture(scope="module")
def flow(beside):
    """Velocities (I, N, 3) at points at the instants of half a turn."""
    compiled = eqx.filter_jit(velocity)
    return lambda points, model: compiled(beside.state, jnp.asarray(points), model)[: len(beside.psi) // 2]


@pytest.mark.slow
def test_a_rotor_beside_a_wall_is_found(beside):
    assert beside.converged, beside.why
    assert beside.residual < 1e-6
    assert beside.psi.shape == (8,)
    # no node of the wake has gone through
    hub = rotate_about_shaft(beside.state.far, beside.psi[:, None, None])
    assert float(hub[..., 0].max()) < 1.2
    # the wall is felt, and most on its side of the disk
    change = np.abs(beside.dct_dr - beside.dct_dr.mean(axis=0)) @ beside.widths
    assert change.max() / beside.CT > 0.005


@pytest.mark.slow
def test_no_air_goes_through_the_wall(beside, flow):
    """At every instant: the wake's flow and what the panels make of it, a panel's own share the limit from the air."""
    surfaces = beside.model.surfaces
    panels = surfaces.panels
    open_air = flow(panels.middles, replace(beside.model, surfaces=None))
    through = jnp.sum(open_air * panels.normals, axis=-1)
    assert float(jnp.abs(through).max()) > 1e-3
    left = through + jax.vmap(lambda b: normal_flow(panels, None, surfaces.densities(b)))(through)
    np.testing.assert_allclose(left, 0, atol=1e-12)
    # and the flow that `velocity` gives just outside is along the wall
    outside = panels.middles + 0.01 * panels.normals
    normal = jnp.sum(flow(outside, beside.model) * panels.normals, axis=-1)
    assert float(jnp.abs(normal).max()) < 0.1 * float(jnp.abs(through).max())


@pytest.mark.slow
def test_a_wall_elsewhere_turns_the_wake_with_it(beside):
    """By a quarter of a turn, two slices of eight: what solves one case solves the other."""
    turned = jax.tree.map(lambda a: jnp.roll(a, 2, axis=0), beside.unknowns)
    moved, found = look(jax.tree.map(jnp.asarray, model(90.0)), turned)
    assert displacement(moved) < 2 * beside.residual + 1e-9
    np.testing.assert_allclose(found.loads.circulation, np.roll(beside.circulation, 2, axis=0), atol=1e-9)


@pytest.mark.slow
def test_how_the_flow_changes_as_the_wall_comes_nearer(beside, flow):
    """Of the wake as it is; forward mode through strengths and flow of the panels, against differences."""
    panels = beside.model.surfaces.panels
    points = jnp.asarray(np.random.default_rng(0).uniform(-0.8, 0.8, (5, 3)))

    def of(by):
        closed = solid(panels.moved(by * jnp.array([1.0, 0, 0])))
        return jnp.sum(flow(points, replace(beside.model, surfaces=closed))[..., 2])

    exact = jax.jit(lambda by: jax.jvp(of, (by,), (1.0,)))(0.0)[1]
    differences = (of(1e-4) - of(-1e-4)) / 2e-4
    assert abs(float(exact)) > 1e-4
    np.testing.assert_allclose(exact, differences, rtol=1e-6)


@pytest.mark.parametrize(
    ("surfaces", "words"),
    [
        (rj.wall(0.5, bottom=-1.0, top=1.0, length=2.0), r"keep clear of the disk, but panel \d+ comes to 0.5 R"),
        (rj.box((-3.0, -3.0, -0.3), (3.0, 3.0, 0.2)), "have the rotor outside, but encloses its hub"),
        ("wall", "be made by rj.box"),
    ],
)
def test_surfaces_that_no_rotor_can_turn_among_are_refused(surfaces, words):
    with pytest.raises(InputError, match=words):
        rj.free_wake(*rj.rotor("uh60", 18.0), None, SETTINGS, surfaces)
