"""The UH-60."""

import pytest

from rotorjax.rotor.catalogue import load


@pytest.fixture(scope="session")
def uh60():
    return load("uh60")
