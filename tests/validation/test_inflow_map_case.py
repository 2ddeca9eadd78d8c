"""The measured inflow map: its weights, and what a model has to do to be compared with it."""

import numpy as np
import pytest

from rotorjax.errors import InputError
from rotorjax.validation import inflow_map
from rotorjax.validation.case import Subject
from rotorjax.validation.cases import chosen_cases
from rotorjax.validation.output import wake_settings_of
from rotorjax.validation.run import Validation


def test_weights_integrate_over_the_disk():
    """Exact for a constant; a linear field in x has almost no mean although the rays are unevenly spaced."""
    data = inflow_map.measured()
    assert data.area.sum() == pytest.approx(1.0)
    assert np.all(data.area[data.r > 1] == 0)
    assert abs(data.area @ (data.r * np.cos(data.psi))) < 0.05
    assert data.area @ data.r**2 == pytest.approx(0.5, abs=0.05)
    assert data.psi.max() < 2 * np.pi


def test_the_measured_map_against_itself_and_nothing():
    data = inflow_map.measured()
    assert inflow_map.rms(data.area, data.inflow - data.inflow) == 0
    # upwash ahead of the rotor, most downwash aft: the whole map is as large as what uniform inflow misses of it
    assert inflow_map.rms(data.area, data.inflow) == pytest.approx(0.0264, abs=2e-4)
    ahead, aft = (data.inflow[(np.abs(data.psi - p) < 1e-9) & (data.r > 0.9)].mean() for p in (np.pi, 0.0))
    assert ahead < 0 < 0.04 < aft


def test_its_own_rotor_only():
    with pytest.raises(InputError, match="inflow-map"):
        chosen_cases(["inflow-map"], Subject(rotor="uh60"))


def test_a_case_without_wakes_has_no_wake_settings():
    found = Validation(Subject(), (inflow_map.CASE,), (), {}, 0.0)
    assert inflow_map.points(Subject()) == ()
    assert wake_settings_of(found) == {}
