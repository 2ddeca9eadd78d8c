"""A straight elliptic wing on the wake's own near-wake lattice: lifting-line theory's exact answers."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from rotorjax.wake.biot_savart import segment_velocity
from rotorjax.wake.lifting_surface import chord_downwash
from rotorjax.wake.model import WakeState, free_wake
from rotorjax.wake.segments import near_lattice
from rotorjax.wake.settings import wake_settings

FAR = 1e4  # where the lattice ends, over R


def wing(uh60, panels, core):
    """Downwash on the lifting line by the panels' circulation (R, R), stations over the semi-span, edges, semi-span.

    The blade stands for the wing: root cut-out to tip is its span, and the near wake leaves straight to the rear.
    """
    settings = wake_settings(panels=panels, age_step_deg=15.0, near_wake_deg=60.0)
    model = eqx.tree_at(lambda m: m.rotor.root_cutout, free_wake(*uh60, None, settings), jnp.asarray(0.2))
    ages = settings.near_ages
    rear = FAR * jnp.arange(1, ages + 1)[:, None] * jnp.array([0.0, -1.0, 0.0])
    near = model.leading[:, None] + rear
    points = jnp.stack([model.stations, 0 * model.stations, 0 * model.stations], axis=-1)

    def downwash(gamma):
        slice_ = WakeState(
            near,
            jnp.zeros((2, settings.far_ages, 3)),
            jnp.repeat(gamma[:, None], ages, axis=1),
            jnp.zeros((2, settings.far_ages)),
            gamma,
        )
        return -segment_velocity(points, *near_lattice(model, slice_, jnp.asarray(core)))[:, 2]

    return model, np.asarray(jax.lax.map(downwash, jnp.eye(panels))).T  # it is linear


def polar(model, downwash, aspect, behind=0.0):
    """Lift slope and induced drag over C_L² of the wing with an elliptic chord, by Kutta and Joukowski."""
    y, edges = np.asarray(model.stations), np.asarray(model.edges)
    half, middle = 0.5 * (edges[-1] - edges[0]), 0.5 * (edges[-1] + edges[0])
    chord = 8 * half / (np.pi * aspect) * np.sqrt(1 - ((y - middle) / half) ** 2)
    area = np.pi / 4 * 2 * half * (8 * half / (np.pi * aspect))
    seen = downwash + np.asarray(chord_downwash(*map(jnp.asarray, (y, edges, behind * chord)))) if behind else downwash
    gamma = np.linalg.solve(np.eye(len(y)) + np.pi * chord[:, None] * seen, np.pi * chord)
    widths = np.diff(edges)
    lift = 2 * gamma @ widths / area
    drag = 2 * (gamma * (downwash @ gamma)) @ widths / area
    return lift, drag / lift**2


@pytest.fixture(scope="module")
def flat(uh60):
    return wing(uh60, 40, 1e-6)


@pytest.mark.parametrize("aspect", [6.0, 15.0])
def test_lift_slope_and_induced_drag_are_prandtls(flat, aspect):
    """2π/(1 + 2/A), and C_L²/πA to many digits: cosine spacing is exact for elliptic loading."""
    slope, drag = polar(*flat, aspect)
    assert slope == pytest.approx(2 * np.pi / (1 + 2 / aspect), rel=5e-4)
    assert drag == pytest.approx(1 / (np.pi * aspect), rel=1e-6)


def test_span_efficiency_at_the_wakes_own_panels_and_core(uh60):
    """Default panels and core at the control points: the core takes some tip loss away, up to two per cent of drag."""
    settings = wake_settings()
    aspect = 15.0
    slope, drag = polar(*wing(uh60, settings.panels, settings.control_core), aspect)
    assert slope == pytest.approx(2 * np.pi / (1 + 2 / aspect), rel=0.005)
    assert 1 / (np.pi * aspect * drag) == pytest.approx(1.0, abs=0.02)


def test_half_a_chord_behind_lowers_the_lift_and_leaves_the_efficiency(flat):
    """The three-quarter-chord condition at an aspect ratio of 6: some 4 % less lift, the same drag for the lift."""
    line, surface = polar(*flat, 6.0), polar(*flat, 6.0, behind=0.5)
    assert 0.91 < surface[0] / line[0] < 0.97
    assert surface[1] == pytest.approx(line[1], rel=0.01)
