"""The study with a known answer, made once."""

import pytest
from known_study import known_study


@pytest.fixture(scope="session")
def study():
    return known_study()
