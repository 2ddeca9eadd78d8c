"""A whole study with made-up wakes: every case of the paper, every output, in seconds."""

import time

import pytest
from wakes import made_up

from rotorjax.bench.cases import HEIGHTS, SLOPES_DEG, study_cases
from rotorjax.bench.dataset import combine
from rotorjax.bench.settings import study_settings
from rotorjax.study.run import solve_cases


@pytest.fixture(scope="session")
def settings():
    return study_settings()


@pytest.fixture(scope="session")
def studied(settings, tmp_path_factory):
    folder = tmp_path_factory.mktemp("study")
    return solve_cases(study_cases(HEIGHTS, SLOPES_DEG), settings, folder, show=False, solver=made_up), folder


@pytest.fixture(scope="session")
def merged(studied, settings):
    return combine(studied[0].cases, settings)


@pytest.fixture(scope="session")
def written(studied, settings):
    from rotorjax.study.output import write_all

    write_all(studied[0].cases, settings, studied[1], time.perf_counter())
    return studied[1]
