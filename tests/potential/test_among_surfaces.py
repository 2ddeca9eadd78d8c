"""Surfaces beside the finite-state flow: exact image, the ground's own sources, no flow through, mirrors, limits."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import rotorjax as rj
from rotorjax.errors import InputError
from rotorjax.panels.surface import Panels, normal_flow, refitted
from rotorjax.potential import rigid_cylinder
from rotorjax.potential.model import (
    FiniteState,
    disk_inflow,
    finite_state_model,
    steady_state,
    unit_inflow,
    unit_states,
    velocity,
)
from rotorjax.potential.rotors import rotors, steady
from rotorjax.potential.rotors import velocity as velocity_of_all
from rotorjax.potential.surfaces import RIM, shadow
from rotorjax.region import half_plane

SIZE = {"harmonics": 1, "radial_terms": 2, "ground_harmonics": 1, "ground_radial_terms": 7}
CT = 0.006
TAU = jnp.zeros(6).at[0].set(np.sqrt(3) / 4 * CT).at[1].set(5e-4).at[2].set(3e-4).at[5].set(-2e-4)
X, Y = jnp.array([0.9, 0.2, -0.6, 0.1]), jnp.array([0.0, -0.7, 0.3, 0.8])
GROUND = rj.plane(1.0)
HANGAR = rj.wall(1.2, -1.0, 1.0, length=3.0, azimuth_deg=90.0, panel=0.5)
HOUSE = HANGAR + rj.box((-0.5, -2.0, -1.0), (1.0, 0.4, -0.5), panel=0.5)


def model(ground=None, surfaces=None, **settings):
    return finite_state_model(ground, **SIZE, surfaces=surfaces, **settings)


@eqx.filter_jit
def units(among):
    """What unit states make, and their inflow at X, Y: one program for as many panels."""
    unit = unit_states(among)
    return unit, unit_inflow(among, unit, X, Y)


@eqx.filter_jit
def flow(among, tau, points, y=Y):
    """State, inflow at (X, y) and velocity at points under a load: likewise."""
    state = steady_state(among, tau)
    return state, disk_inflow(state, X, y, among), velocity(state, points, among)


def round_patch(rings: int, outside: int = 0) -> Panels:
    """A flat disk a radius below the hub, of radius 1 or with more rings to 8; panels even where loads are smooth."""
    r = np.sqrt(1 - np.linspace(1, 0, rings + 1) ** 2)
    r = np.append(r, np.geomspace(1, 8, outside + 1)[1:])
    psi = np.linspace(0, 2 * np.pi, 4 * rings + 1)
    x, y = r[:, None] * np.cos(psi), r[:, None] * np.sin(psi)
    node = np.stack([x, y, np.full_like(x, -1.0)], axis=-1)
    a, b, c, d = (v.reshape(-1, 3) for v in (node[:-1, :-1], node[1:, :-1], node[1:, 1:], node[:-1, 1:]))
    return Panels(jnp.asarray(np.stack([a, b, c, d], axis=1)))


def test_a_large_plane_of_panels_is_the_exact_image_of_the_rigid_cylinder():
    """The error falls with the panels' number, to a hundredth of the ground's upflow; the states of all kinds."""
    exact = model(GROUND, wake=None)
    a = jnp.array([1.0, 0.2, 0.3, 0.0, -0.2, 0.1])
    wanted = rigid_cylinder.disk_inflow(FiniteState(a, jnp.zeros(1)), X, Y, exact)
    alone = disk_inflow(FiniteState(a, jnp.zeros(len(exact.sources))), X, Y, model(wake=None))
    off = []
    for patch in (round_patch(4, 5), round_patch(8, 10)):
        found = a @ units(model(None, patch, wake=None))[1]
        off.append(float(jnp.max(jnp.abs(found - wanted)) / jnp.max(jnp.abs(alone - wanted))))
    assert off[1] < 0.5 * off[0], off
    assert off[1] < 0.02, off


def test_a_patch_of_the_ground_disks_size_is_the_ground_of_the_models_own_sources():
    """Both close the footprint alone: panels of constant density tend to the modes with their number."""
    own = unit_states(model(GROUND, wake=None, ground_radius=1.0)).up
    off = [jnp.abs(units(model(None, round_patch(rings), wake=None))[0].up - own) for rings in (6, 12)]
    assert float(off[1][0]) < 0.3 * float(off[0][0]), off
    assert bool(jnp.all(off[1] < 0.002 * own[0])), (off, own)


def test_no_air_goes_through_a_panels_middle():
    """The whole velocity there, a panel's own share the limit from the air; under the wake only in the mean."""
    among = model(GROUND, HOUSE)
    panels = among.surfaces.panels
    state, _, there = flow(among, TAU, panels.middles)
    density = state.c[len(among.sources) :]
    blown = jnp.sum(there * panels.normals, axis=1)
    under = (panels.normals[:, 2] > 0.5) & (jnp.hypot(panels.middles[:, 0], panels.middles[:, 1]) < 1.4)
    np.testing.assert_allclose(jnp.where(under, 0.0, blown + 0.5 * density), 0.0, atol=1e-12)
    points, shares = panels.spots(3)
    np.testing.assert_allclose(jnp.sum(points * shares[..., None], axis=1), panels.middles, atol=1e-14)
    assert float(jnp.max(jnp.abs(normal_flow(panels, GROUND, density)))) > 1e-3


def test_rotors_together_are_mirror_images_and_blow_none_through():
    """Two that turn against each other, over ground before a wall aft: the answers to each add up."""
    wall = rj.wall(1.3, -1.0, 0.5, length=4.0, panel=0.7)
    pair = rotors(model(), [(0, -1.2, 0), (0, 1.2, 0)], senses=[1, -1], ground=GROUND, surfaces=wall)
    a = steady(pair, jnp.broadcast_to(TAU, (2, 6)))
    np.testing.assert_allclose(a[0], a[1], rtol=1e-10)
    panels = pair.surfaces.panels
    density = jnp.einsum("bsm,bm->s", pair.sources, a)[len(pair.model.sources) :]
    there = velocity_of_all(a, panels.middles, pair)
    np.testing.assert_allclose(jnp.sum(there * panels.normals, axis=1) + 0.5 * density, 0.0, atol=1e-12)
    assert float(jnp.max(jnp.abs(density))) > 1e-3
    mirrored = velocity_of_all(a, panels.middles * jnp.array([1, -1, 1]), pair)
    np.testing.assert_allclose(mirrored, there * jnp.array([1, -1, 1]), atol=1e-12)
    with pytest.raises(InputError, match="`tilts_deg` must be zero among surfaces"):
        rotors(model(), [(0, 0, 0)], tilts_deg=[(5, 0)], surfaces=wall)
    with pytest.raises(InputError, match="must have odd ground sources"):
        rotors(model(printed=True), [(0, 0, 0)], surfaces=wall)
    with pytest.raises(InputError, match="give them to `rotors`"):
        rotors(model(None, wall), [(0, 0, 0)])


def test_what_lies_in_a_surfaces_shadow_sees_no_jet():
    """On the ground under a deck, on its lower side and behind it is none of the column's air; beside it is all."""
    deck = rj.slab((-12.0, -12.0), (0.5, 12.0), -0.5, 0.2, panel=0.5)
    x = jnp.array([-0.4, 0.5 - 1.01 * RIM, 0.5, 0.5 + 1.01 * RIM, 0.8])
    under = jnp.stack([x, 0.1 + 0 * x, 0 * x - 1.0], axis=-1)
    np.testing.assert_allclose(shadow(deck, under), [1.0, 1.0, 0.5, 0.0, 0.0], atol=0.02)
    upright = deck.normals[:, 2]  # nothing falls on the sides
    level = np.abs(upright) > 0.5
    np.testing.assert_array_equal(shadow(deck, deck.middles)[level], jnp.where(upright < 0, 1.0, 0.0)[level])
    hill = rj.terrain(
        [-2, -1, 0, 1, 2], [-1, 0, 1], -1.0 + 0.4 * np.array([[0, 0, 0], [1, 1, 1], [0, 2, 0], [1, 1, 1], [0, 0, 0]])
    )
    np.testing.assert_array_equal(shadow(hill, hill.middles), 0.0)


def test_a_house_to_port_is_one_to_starboard_in_a_mirror():
    """cos terms stay, sin terms change sign."""
    sign = np.array([-1 if mode.kind == "sin" else 1 for mode in model().modes.modes])
    mirrored = model(GROUND, Panels((HOUSE.corners * jnp.array([1, -1, 1]))[:, ::-1]))
    points = mirrored.surfaces.panels.middles
    here = flow(model(GROUND, HOUSE), TAU, points)[1]
    np.testing.assert_allclose(flow(mirrored, sign * TAU, points, -Y)[1], here, atol=1e-14)
    assert float(jnp.max(jnp.abs(here - flow(model(GROUND), TAU, points)[1]))) > 1e-4


def test_a_house_far_away_changes_nothing():
    alone, beside = model(GROUND), model(GROUND, HOUSE.moved((0.0, 30.0, 0.0)))
    points = model(GROUND, HOUSE).surfaces.panels.middles
    (_, inflow, there), (_, own, own_there) = (flow(m, TAU, points) for m in (beside, alone))
    np.testing.assert_allclose(inflow, own, atol=1e-6)
    np.testing.assert_allclose(there[:, 2], own_there[:, 2], atol=1e-6)


def test_derivatives_by_the_place_of_surfaces():
    """Compiled and in reverse, against differences: of a wall and of a deck whose shadow moves."""
    both = HANGAR + rj.slab((-3.0, -1.0), (0.3, 0.5), -0.5, 0.3, panel=0.8)
    among = finite_state_model(None, 0, 1, 0, 1, surfaces=both, wake=None)
    way = jnp.array([0.8, 0.5, 0.3])

    @jax.jit
    @jax.value_and_grad
    def inflow(by):
        solid = eqx.tree_at(lambda s: s.panels, among.surfaces, among.surfaces.panels.moved(by * way))
        here = eqx.tree_at(lambda m: m.surfaces, among, refitted(solid, None))
        return unit_inflow(here, unit_states(here), X, Y)[0] @ (X + Y)

    step = 1e-5
    values, (_, slope, _) = zip(*(inflow(0.02 + by) for by in (-step, 0.0, step)), strict=True)
    assert abs(float(slope)) > 1e-4
    np.testing.assert_allclose(slope, (values[2] - values[0]) / (2 * step), rtol=1e-6)


def test_a_rotors_thrust_rises_as_a_roof_comes_under_it():
    """By the front door. With its edge under the hub air leaves round it: little thrust, a load where the roof is."""
    rotor, hover = rj.rotor("knight_hefner_2", 8.0)
    roof = rj.slab((-3.0, -2.0), (0.0, 2.0), -1.0, panel=0.4)
    none, half, whole = (
        rj.solve(rj.finite_state(rotor, hover, surfaces=roof.moved(by)))  # far below it is none, by one program
        for by in ((0.0, 0.0, -50.0), (0.0, 0.0, 0.0), (2.0, 0.0, 0.0))
    )
    assert max(float(none.CT), float(half.CT)) < 0.98 * float(whole.CT)
    ahead = -jnp.cos(half.psi)[:, None] * half.r * half.found.widths
    assert float(jnp.sum(half.dct_dr * ahead)) > 1e-3 * float(jnp.sum(half.dct_dr * jnp.abs(ahead)))


def test_errors():
    rotor, hover = rj.rotor("knight_hefner_2", 8.0, climb=1.0)
    with pytest.raises(InputError, match="climb over ground or surfaces"):
        rj.finite_state(rotor, hover, surfaces=HANGAR)
    with pytest.raises(InputError, match="must be level beside surfaces, but its slope is 10 deg"):
        model(rj.plane(1.0, 10.0), HANGAR)
    with pytest.raises(InputError, match="must be 'odd' beside surfaces"):
        model(GROUND, HANGAR, printed=True)
    with pytest.raises(InputError, match="keep clear of the disk"):
        model(None, HANGAR.moved((0.0, -0.5, 0.0)))
    with pytest.raises(InputError, match="`region` must be left out"):
        model(GROUND, HANGAR, region=half_plane(0.0))
    with pytest.raises(InputError, match="`even_terms` must be 0"):
        model(None, HANGAR, even_terms=1)
    with pytest.raises(InputError, match=r"be made by rj\.box"):
        model(None, "wall")
