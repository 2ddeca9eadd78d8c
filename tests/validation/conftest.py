"""A coarse wake of Caradonna and Tung's rotor, solved once."""

import pytest

from rotorjax.rotor.catalogue import load
from rotorjax.wake.model import free_wake
from rotorjax.wake.settings import wake_settings
from rotorjax.wake.solution import solve

COARSE = {"panels": 8, "age_step_deg": 20.0, "near_wake_deg": 100.0, "closure_turns": 1, "closure_bundles": 2}


@pytest.fixture(scope="session")
def coarse_hover():
    return solve(free_wake(*load("caradonna_tung"), None, wake_settings(**COARSE, azimuths=4)))
