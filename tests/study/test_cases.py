"""Which cases a study has and which neighbour each starts from."""

import math

import pytest

from rotorjax.bench.cases import HEIGHTS, SLOPES_DEG, Case, neighbour, study_cases
from rotorjax.errors import InputError


def test_the_papers_cases():
    names = [case.name for case in study_cases(HEIGHTS, SLOPES_DEG)]
    level = ["h3", "h2", "h1.5", "h1", "h0.75", "h0.5"]
    slopes = [f"h1-slope{s}" for s in (5, 8, 10, 15, 30, 40)]
    assert names == ["oge", *level, *slopes, "h1.5-slope30", "h0.9-slope30"]


def test_slopes_bring_level_ground_along():
    assert [c.name for c in study_cases([0.5], [15.0])] == ["oge", "h1", "h0.5", "h1-slope15"]
    assert [c.name for c in study_cases([], [])] == ["oge"]


def test_each_case_starts_from_its_neighbour():
    cases = study_cases(HEIGHTS, SLOPES_DEG)
    found = {case.name: neighbour(case, cases[:i]) for i, case in enumerate(cases)}
    assert found["oge"] is None
    assert found["h3"] == Case()  # no ground yet to start from
    assert found["h0.5"] == Case(0.75)
    assert found["h1-slope5"] == Case(1.0)
    assert found["h1-slope40"] == Case(1.0, 30.0)
    assert found["h1.5-slope30"] == found["h0.9-slope30"] == Case(1.0, 30.0)


@pytest.mark.parametrize(
    ("heights", "slopes", "words"),
    [
        ([0.0], [], "`height` must be positive"),
        ([-1.0], [], "`height` must be positive"),
        ([math.nan], [], "`heights` must hold finite"),
        ([1.0], [60.0], r"\[0, 60\)"),
        ([1.0], [0.0], "`slopes` must be positive"),
        ([1.0], [46.0], "must exceed tan"),
    ],
)
def test_what_is_not_allowed(heights, slopes, words):
    with pytest.raises(InputError, match=words):
        study_cases(heights, slopes)
