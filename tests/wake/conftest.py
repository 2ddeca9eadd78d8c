"""A coarse UH-60 wake that compiles and solves in seconds."""

import pytest
from wakes import COARSE

from rotorjax.rotor.catalogue import load
from rotorjax.wake.model import free_wake
from rotorjax.wake.settings import wake_settings
from rotorjax.wake.solution import solve


@pytest.fixture(scope="session")
def uh60():
    return load("uh60")


@pytest.fixture(scope="session")
def coarse():
    return wake_settings(**COARSE, azimuths=4)


@pytest.fixture(scope="session")
def coarse_slope():
    """Eight azimuths: four hold no second harmonic."""
    return wake_settings(**COARSE, azimuths=8)


@pytest.fixture(scope="session")
def hover(uh60, coarse):
    return solve(free_wake(*uh60, None, coarse))
