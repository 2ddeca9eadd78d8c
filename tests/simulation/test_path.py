"""The hub's attitude and height against closed forms: steady rates, a full roll, a walk over a slope, a turn."""

import jax.numpy as jnp
import numpy as np
import pytest
from scipy.interpolate import PPoly

from rotorjax.errors import InputError
from rotorjax.ground import TurnedPlane
from rotorjax.rotor.hub import rotor_inputs
from rotorjax.simulation.path import Above, angles, hub_path

END = 20.0


def steady(**values):
    """u, v, w, p, q, r that do not change."""
    columns = [values.get(name, 0.0) for name in "uvwpqr"]
    return PPoly(np.array(columns)[None, None], np.array([0.0, END]))


def test_a_steady_pitch_rate_raises_the_nose_by_q_t():
    """From 4 degrees nose down, through the vertical, where roll and heading are one."""
    rate, start = 0.1, np.deg2rad(-4.0)
    path = hub_path(steady(q=rate), np.zeros(3), start, END)
    for t in (0.0, 3.3, 12.0, 17.0):
        roll, pitch, heading = angles(jnp.asarray(path(t)))
        expected = start + rate * t
        folded = expected if expected < np.pi / 2 else np.pi - expected
        assert float(pitch) == pytest.approx(folded, abs=1e-9)
        assert np.cos(float(roll)) * np.cos(float(heading)) == pytest.approx(1.0)
        if expected < np.pi / 2:
            np.testing.assert_allclose([roll, heading], 0.0, atol=1e-9)


def test_the_ground_comes_back_after_a_full_roll():
    """Half way round it is overhead, at a quarter beside the hub: to port where it rolls to starboard."""
    turn = 2 * np.pi / END
    path = hub_path(steady(p=turn), np.zeros(3), 0.0, END)

    def seen(t):
        roll, pitch, heading = angles(jnp.asarray(path(t)))
        u = rotor_inputs(roll=float(roll), pitch=float(pitch), heading=float(heading))
        return TurnedPlane(jnp.asarray(1.5), jnp.asarray(0.2), u.turn)

    first, last = seen(0.0), seen(END)
    np.testing.assert_allclose(last.normal, first.normal, atol=1e-9)
    point = jnp.array([0.3, -0.2, 0.1])
    np.testing.assert_allclose(last.reflect_points(point), first.reflect_points(point), atol=1e-9)
    np.testing.assert_allclose(seen(END / 2).normal, first.normal * jnp.array([1.0, 1.0, -1.0]), atol=1e-9)
    assert float(seen(END / 4).normal[1]) == pytest.approx(-np.cos(0.2))


def test_a_slope_comes_nearer_as_the_hub_backs_into_it():
    """Its mountain side is aft; a hub that has headed about by a right angle goes along the contour."""
    slope = 0.2
    path = hub_path(steady(u=-0.02, w=-0.01), np.zeros(3), 0.0, END, Above(1.0, slope, "freewake", 27.0))
    np.testing.assert_allclose(path(10.0)[4], 1.0 - 0.2 * np.tan(slope) + 0.1, rtol=1e-9)
    rate = np.pi / 2 / END
    turned = hub_path(steady(r=rate, u=0.05), np.zeros(3), 0.0, END, Above(1.0, slope, "freewake", 27.0))
    ahead = 0.05 * np.sin(rate * 10.0) / rate
    np.testing.assert_allclose(turned(10.0)[4], 1.0 + ahead * np.tan(slope), rtol=1e-9)
    np.testing.assert_allclose(np.asarray(angles(jnp.asarray(turned(10.0)[:4]))), [0, 0, rate * 10.0], atol=1e-9)


def test_flight_along_a_tilted_shaft_keeps_its_height_until_the_nose_comes_up():
    tilt, speed, rate = 0.1, 0.15, 0.02
    velocity = speed * np.array([np.cos(tilt), 0.0, -np.sin(tilt)])
    level = hub_path(steady(), velocity, -tilt, END, Above(2.0, 0.0, "freewake", 27.0))
    np.testing.assert_allclose(level(END)[4], 2.0, atol=1e-9)
    raised = hub_path(steady(q=rate), velocity, -tilt, END, Above(2.0, 0.0, "freewake", 27.0))
    np.testing.assert_allclose(raised(10.0)[4], 2.0 + speed * (1 - np.cos(rate * 10.0)) / rate, rtol=1e-9)


@pytest.mark.parametrize(
    ("inflow", "rates", "words"),
    [
        ("freewake", {"w": 0.05}, r"cuts it at 0\.\d\d s, to -0\.\d"),
        ("freewake", {"p": 0.2}, r"clearance of its rim over R\), but cuts it at 0\.\d\d s"),
        ("pitt-peters", {"q": 0.02}, "within 15 deg of the ground, all that pitt-peters knows"),
        ("uniform", {"w": 0.02}, r"above 0\.5 R"),
    ],
)
def test_paths_that_the_disk_or_the_inflow_cannot_take_are_refused(inflow, rates, words):
    with pytest.raises(InputError, match=words):
        hub_path(steady(**rates), np.zeros(3), 0.0, END, Above(0.9, 0.0, inflow, 27.0))
