"""The coaxial pair's case: momentum theory at its two ends, the user's points, and rows of made-up wakes."""

from types import SimpleNamespace

import numpy as np
import pytest

from rotorjax.errors import InputError
from rotorjax.validation import coaxial
from rotorjax.validation.case import Subject
from rotorjax.validation.cases import chosen_cases

PAIR = SimpleNamespace(CT=np.array([0.0045, 0.0035]), CP_induced=1.3 * np.array([1e-4, 1e-4]), converged=True, why="")
SINGLE = SimpleNamespace(CT=0.004, CP=2.5e-4, CP_induced=1e-4, converged=True)


def test_momentum_theory_with_the_lower_rotor_in_the_far_wake():
    """Mass, momentum and energy between far above and far below, solved for τ = 1 by hand: s² + s = 4."""
    assert coaxial.far_flow(1.0) == pytest.approx((np.sqrt(17) - 1) / 2)
    ratio = 1 / coaxial.far_balance() - 1
    assert ratio * coaxial.far_flow(ratio) == pytest.approx(1)
    s, below = coaxial.far_flow(0.7), 2 * 1.7 / coaxial.far_flow(0.7)
    assert 2 * 0.7 * s == pytest.approx(0.5 * s * below**2 - 2)
    assert coaxial.far_flow(1e-9) == pytest.approx(1)  # a rotor without load: half of its disk in air at 2 v


def compared(measured=None):
    subject = Subject(measured=measured)
    wakes, pairs = {}, []
    for at, scale in zip(coaxial.points(subject), (0.5, 1.0, 1.5, 2.0), strict=True):
        power = scale**1.5
        wakes[at] = SimpleNamespace(
            **vars(SINGLE) | {"CT": 0.004 * scale, "CP": 2.5e-4 * power, "CP_induced": 1e-4 * power}
        )
        pair = SimpleNamespace(**vars(PAIR) | {"CT": PAIR.CT * scale, "CP_induced": PAIR.CP_induced * power})
        pair.CP = pair.CP_induced
        pairs.append(coaxial.Balanced(pair, 0.001, 0.5))
    return subject, wakes, pairs


def test_rows_of_pairs_between_the_two_ends():
    rows = coaxial.momentum_rows(*compared())
    assert [row.met for row in rows] == [True] * 8
    assert rows[0].ours == pytest.approx(1.3)
    assert (rows[0].limits.low, rows[0].limits.high) == (pytest.approx(1.2810, abs=1e-4), pytest.approx(np.sqrt(2)))
    subject, wakes, pairs = compared()
    lost = coaxial.momentum_rows(subject, wakes, [coaxial.Balanced(pairs[0].pair, 0.1, 0.5), *pairs[1:]])
    assert [row.met for row in lost] == [False] * 2 + [True] * 6
    assert "torques differ by 10.0 %" in lost[0].note


def test_the_users_points(tmp_path):
    path = tmp_path / "points.csv"
    path.write_text("# read off a figure\nrotors, CT, CQ\nsingle,0.006,0.00046\npair,0.008,0.0003\npair,0.05,0.01\n")
    subject, wakes, pairs = compared(coaxial.read_measured(path))
    rows = coaxial.measured_rows(subject, coaxial.polar(subject, wakes, pairs))
    assert rows[0].ours == pytest.approx(2.5e-4 * 1.5**1.5)
    assert rows[1].ours == pytest.approx(2.6e-4)
    assert [row.met for row in rows] == [True, False, False]
    assert "beyond" in rows[2].note
    coaxial.draw(subject, coaxial.polar(subject, wakes, pairs))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("CT,CQ\n1,2\n", "first line must be rotors,CT,CQ, but is 'CT,CQ'"),
        (
            "rotors,CT,CQ\npairs,0.01,0.001\n",
            "line 2: rotors must be single or pair, but is 'pairs': did you mean 'pair'",
        ),
        ("rotors,CT,CQ\npair,0.01\n", r"line 2: CT and CQ must be numbers in \(0, 0.1\), but are 0.01, None"),
        ("rotors,CT,CQ\npair,8,0.001\n", "but are 8, 0.001"),
        ("rotors,CT,CQ\n", "one point or more"),
        ("", "first line must be"),
    ],
)
def test_points_that_are_none(tmp_path, text, words):
    (tmp_path / "points.csv").write_text(text)
    with pytest.raises(InputError, match=words):
        coaxial.read_measured(tmp_path / "points.csv")


def test_it_is_solved_where_it_is_asked_for():
    points = {"pair": [(0.01, 0.001)]}
    assert [c.name for c in chosen_cases(["coaxial"], Subject(measured=points))] == ["coaxial"]
    with pytest.raises(InputError, match="must come with the case 'coaxial'"):
        chosen_cases(None, Subject(measured=points))
