"""Settings refuse what cannot be, and say what can."""

from dataclasses import replace

import numpy as np
import pytest

from rotorjax.errors import InputError
from rotorjax.ground import plane
from rotorjax.operating import operating_point
from rotorjax.wake.model import free_wake
from rotorjax.wake.settings import MARCHED, hover_settings, quick_settings, wake_settings


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("panels", 2),
        ("panels", 6.5),
        ("age_step_deg", 7.0),
        ("age_step_deg", -15.0),
        ("near_wake_deg", 40.0),
        ("roll_up_start", 0.0),
        ("roll_up_start", 1.1),
        ("free_turns", 1.0),
        ("stretch", 5),
        ("spreading", -0.1),
        ("roll_up", "none"),
        ("inboard", (1.2,)),
        ("inboard", (0.5, 0.4)),
        ("tip_core", 0.0),
        ("inboard_decay", -1.0),
        ("release_band", 0.2),
        ("impulse_kept", 1.5),
        ("sharpness", float("nan")),
    ],
)
def test_bad_values_are_named(name, value):
    with pytest.raises(InputError, match=f"`{name}`"):
        wake_settings(**{name: value})


def test_counts_follow_from_angles():
    settings = wake_settings(age_step_deg=15.0, near_wake_deg=60.0, free_turns=3.5, inboard=(0.4,))
    assert (settings.near_ages, settings.far_ages, settings.steps_per_turn, settings.filaments) == (4, 84, 24, 2)
    assert settings.release_ages == 4
    halfway = replace(settings, roll_up_start=0.5)
    assert (halfway.near_ages, halfway.release_ages) == (4, 2)
    assert np.rad2deg(halfway.tip_ages[[0, 1, 2, 3, -1]]) == pytest.approx([0, 15, 30, 45, 30 + 3.5 * 360])
    assert replace(settings, roll_up_start=0.01).release_ages == 1


@pytest.mark.parametrize(("step", "lattice"), [(7.5, 90.0), (10.0, 90.0), (15.0, 90.0), (20.0, 80.0), (30.0, 120.0)])
def test_a_lattice_that_is_not_asked_for_has_whole_steps(step, lattice):
    assert wake_settings(age_step_deg=step).near_wake_deg == lattice


def test_long_steps_need_room_and_divide_a_turn():
    with pytest.raises(InputError, match=r"`free_turns` must be at least 2\.75 where stretch is 2"):
        wake_settings(free_turns=2.5, stretch=2)
    with pytest.raises(InputError, match="`stretch` must divide the 18 steps"):
        wake_settings(free_turns=6.0, stretch=4, age_step_deg=20.0, near_wake_deg=80.0)
    steps = np.rad2deg(np.diff(hover_settings().filament_ages))
    assert (steps[0], steps[-24], steps[-1]) == pytest.approx((15, 30, 30))


def test_a_march_has_what_the_wake_in_hover_adds_to():
    plain, hover = wake_settings(), hover_settings()
    changed = {n for n in plain.__dataclass_fields__ if getattr(plain, n) != getattr(hover, n)}
    assert changed == set(MARCHED)
    assert all(getattr(plain, n) == v for n, v in MARCHED.items())


def test_quick_settings_are_coarser_and_can_be_overridden():
    assert quick_settings().panels < wake_settings().panels
    assert quick_settings(panels=9).panels == 9


def test_climb_over_ground_is_refused(uh60):
    rotor, _ = uh60
    with pytest.raises(InputError, match="climb"):
        free_wake(rotor, operating_point(27.0, climb=1.0), plane(1.0))


def test_azimuths_have_to_suit_the_blades(uh60):
    with pytest.raises(InputError, match="azimuths"):
        free_wake(*uh60, None, wake_settings(azimuths=10))
