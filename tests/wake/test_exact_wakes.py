"""Wakes with an exact solution: helices from the blade on, the vortex cylinder, the ring that carries itself."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.special import ellipe, ellipk, elliprf, elliprj, iv, ivp, kv, kvp

from rotorjax.frames import rotate_about_shaft
from rotorjax.wake import field, segments
from rotorjax.wake.biot_savart import filament_velocity, segment_velocity
from rotorjax.wake.model import WakeState, free_wake
from rotorjax.wake.roll_up import Release
from rotorjax.wake.settings import wake_settings

THIN = 1e-6
far_filaments, self_induction = eqx.filter_jit(segments.far_filaments), eqx.filter_jit(field.self_induction)


def kawada_hardin(r, pitch, blades=1):
    """Axial and tangential velocity of `blades` endless helices of radius 1, pitch 2π·pitch and Γ = 1 each, at a point
    at radius r and on the level of one of them (Hardin 1982, doi:10.1063/1.863684; B helices keep every B-th harmonic).
    """
    m = blades * np.arange(1, 400)
    with np.errstate(over="ignore", invalid="ignore", under="ignore"):
        product = kvp(m, m / pitch) * iv(m, m * r / pitch) if r < 1 else ivp(m, m / pitch) * kv(m, m * r / pitch)
    s = np.nansum(m * product)
    inside = 1.0 if r < 1 else 0.0
    axial = inside / (2 * np.pi * pitch) - s / (np.pi * pitch**2)
    return blades * axial, blades * ((1 - inside) / (2 * np.pi * r) + s / (np.pi * r * pitch))


@pytest.mark.parametrize("blades", [1, 4])
@pytest.mark.parametrize("r", [0.5, 0.8, 1.3])
def test_semi_infinite_helices_give_half_of_endless_ones(r, blades):
    """On the radius through its start half a helix gives half: turned over about that radius it is the other half.

    The end that is cut off is a vortex cylinder seen from far away, whose velocity is added.
    """
    pitch, turns, per_turn = 0.5, 150, 240
    t = jnp.linspace(0, 2 * jnp.pi * turns, turns * per_turn + 1)
    helix = jnp.stack([jnp.cos(t), jnp.sin(t), pitch * t], axis=-1)[None]
    ones = jnp.ones((1, turns * per_turn))
    v = filament_velocity(jnp.array([[r, 0.0, 0.0]]), helix, ones, THIN * ones, blades=blades)[0]
    length = 2 * np.pi * pitch * turns
    lost = blades / (2 * np.pi * pitch) * (0.25 / length**2)
    axial, swirl = kawada_hardin(r, pitch, blades)
    np.testing.assert_allclose([v[2] + lost, v[1]], [axial / 2, swirl / 2], rtol=1e-3, atol=1e-4)


@pytest.fixture(scope="module")
def helical(uh60):
    """A wake without ground whose settings have a fine age step, hardly a core, and the default closure."""
    settings = wake_settings(
        panels=6,
        age_step_deg=5.0,
        near_wake_deg=20.0,
        free_turns=2.0,
        tip_core=1e-4,
        turbulence=0.0,
        self_induction_core=0.01,
        inboard=(0.45,),
        impulse_kept=0.0,
    )
    model = free_wake(*uh60, None, settings)
    return eqx.tree_at(lambda m: m.operating.viscosity, model, jnp.asarray(1e-9))


def with_filaments(model, nodes, strength):
    """One slice of a wake, nothing in it but far filaments along the same nodes."""
    panels, ages, far = model.settings.panels, model.settings.near_ages, len(nodes)
    nothing = jnp.zeros((panels, ages))
    near = jnp.zeros((panels + 1, ages, 3))
    everywhere = jnp.broadcast_to(strength[:, None], (len(strength), far))
    return WakeState(near, jnp.stack([nodes] * len(strength)), nothing, everywhere, nothing[:, 0])


@pytest.mark.parametrize("r", [0.5, 0.8, 1.3])
def test_the_wakes_own_filament_and_closure_make_a_semi_infinite_helix(helical, r):
    """Velocity on the radius through the release point, all blades together, in the wake's own segments."""
    pitch, settings = 0.3, helical.settings
    age = settings.age_step * np.arange(settings.near_ages, settings.near_ages + settings.far_ages + 1)
    nodes = jnp.asarray(np.stack([np.cos(age), -np.sin(age), -pitch * age], axis=-1))
    alone = jnp.array([1.0, 0.0])  # the tip vortex
    state = with_filaments(helical, nodes[1:], alone)
    segments = far_filaments(helical, state, Release(jnp.stack([nodes[0]] * 2), alone), jnp.zeros(()))
    point = r * nodes[0, :2] / jnp.linalg.norm(nodes[0, :2])
    point = jnp.concatenate([point, nodes[0, 2:]])[None]
    blades = helical.rotor.blades
    v = rotate_about_shaft(segment_velocity(point, *segments, blades=blades), jnp.asarray(age[0]))[0]
    # the wake is Kawada's helix turned over about that radius
    axial, swirl = kawada_hardin(r, pitch, blades)
    np.testing.assert_allclose([-v[2], -v[1]], [axial / 2, swirl / 2], rtol=2e-3, atol=1e-3)


def cylinder(r, z):
    """Axial and radial velocity of a semi-infinite vortex cylinder of radius 1 (z ≥ 0) and sheet strength 1.

    Callaghan & Maslen 1960 (NASA TN D-465), Branlard & Gaunaa 2015 (doi:10.1002/we.1800); elliptic integrals by
    Carlson's forms.
    """
    m = 4 * r / ((1 + r) ** 2 + z**2)
    n = 4 * r / (1 + r) ** 2
    third = elliprf(0, 1 - m, 1) + n / 3 * elliprj(0, 1 - m, 1, 1 - n)
    root = np.sqrt(m / r)
    axial = 0.5 * (np.where(r < 1, 1.0, 0.0) + z * root / (2 * np.pi) * (ellipk(m) + (1 - r) / (1 + r) * third))
    radial = -1 / (2 * np.pi * np.sqrt(r)) * ((2 - m) / np.sqrt(m) * ellipk(m) - 2 / np.sqrt(m) * ellipe(m))
    return axial, radial


def test_stack_of_rings_is_a_vortex_cylinder():
    """Half inside and nothing outside in the plane of its end, elliptic integrals elsewhere; the far end closed as a
    cylinder of its own.
    """
    spacing, rings, around = 0.05, 800, 360
    t = jnp.linspace(0, 2 * jnp.pi, around + 1)
    # a polygon of the circle's area
    radius = jnp.sqrt(t[1] / jnp.sin(t[1]))
    circle = radius * jnp.stack([jnp.cos(t), jnp.sin(t), 0 * t], axis=-1)
    heights = spacing * (jnp.arange(rings) + 0.5)
    nodes = circle[None] + heights[:, None, None] * jnp.array([0.0, 0.0, 1.0])
    r = np.array([0.2, 0.5, 0.7, 1.5, 2.0, 0.4, 0.6, 1.4])
    z = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.4, -0.5, 0.3])
    points = jnp.asarray(np.stack([r, 0 * r, z], axis=-1))
    ones = jnp.full((rings, around), spacing)
    v = filament_velocity(points, nodes, ones, THIN * jnp.ones_like(ones))
    near, far = cylinder(r, z), cylinder(r, z - spacing * rings)
    np.testing.assert_allclose(near[0][z == 0], np.where(r < 1, 0.5, 0)[z == 0], atol=1e-14)
    np.testing.assert_allclose(v[:, 2], near[0] - far[0], atol=2e-4)
    np.testing.assert_allclose(v[:, 0], near[1] - far[1], atol=2e-4)


def test_a_ring_in_the_wakes_discretisation_has_the_speed_of_its_core(helical):
    """Straight segments and the local term together: Γ/4πR (ln(8R/r_c) − 0.444), Lamb–Oseen (Saffman 1992, §10.3).

    The local term completes a ring of arcs. Chords beside the node give γ − ½ = 0.077 Γ/4πR more than the arcs they
    stand for, however short: 1.3 % of the ring's speed here.
    """
    settings, gamma, radius = helical.settings, 0.02, 0.8
    age = settings.age_step * np.arange(settings.far_ages + 1)
    ring = jnp.asarray(np.stack([radius * np.cos(age), -radius * np.sin(age), 0 * age], axis=-1))
    state = with_filaments(helical, ring[1:], jnp.full(2, gamma))
    turn, node = settings.steps_per_turn, settings.far_ages // 2
    strength = jnp.full((1, turn), gamma)
    resolved = filament_velocity(ring[node][None], ring[: turn + 1][None], strength, THIN * strength)[0, 2]
    local = self_induction(helical, state)[0, node - 1, 2]
    unit = gamma / (4 * np.pi * radius)
    arcs = unit * np.log(4 * radius / (2 * radius * np.sin(settings.age_step / 2)))
    np.testing.assert_allclose(-resolved, arcs + unit * (np.euler_gamma - 0.5), rtol=1e-3)
    whole = unit * (np.log(8 * radius / float(settings.self_induction_core)) - 0.444)
    np.testing.assert_allclose(-(resolved + local), whole, rtol=0.015)
