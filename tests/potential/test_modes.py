import pytest

from rotorjax.errors import InputError
from rotorjax.potential.modes import Mode, ModeTable, ground_modes, rotor_modes


def test_rotor_and_ground_tables():
    assert rotor_modes(0, 3).modes == (Mode(0, 1, "cos"), Mode(0, 3, "cos"), Mode(0, 5, "cos"))
    table = rotor_modes(1, 2)
    assert table.pairs == ((0, 1), (0, 3), (1, 2), (1, 2), (1, 4), (1, 4))
    assert len(table) == 6
    assert ground_modes(1, 2).pairs == ((0, 0), (0, 2), (1, 1), (1, 1), (1, 3), (1, 3))
    assert list(ground_modes(1, 2).diagonal) == [True, False, True, True, False, False]


def test_even_terms_follow_the_odd_ones():
    table = rotor_modes(1, 1, even_terms=1)
    assert table.pairs == ((0, 1), (1, 2), (1, 2), (0, 2), (1, 3), (1, 3))
    assert table.parity == "both"
    assert list(table.odd) == [True, True, True, False, False, False]


def test_index():
    assert rotor_modes(1, 1).index(1, 2, "sin") == 2
    with pytest.raises(InputError, match="must contain"):
        rotor_modes(0, 1).index(0, 3)


@pytest.mark.parametrize(
    ("modes", "parity", "word"),
    [
        ([], "odd", "empty"),
        ([(0, 2, "cos")], "odd", "n \\+ m odd"),
        ([(0, 1, "cos")], "even", "n \\+ m even"),
        ([(0, 1, "sin")], "odd", "sine with m > 0"),
        ([(2, 1, "cos")], "odd", "0 <= m <= n"),
        ([(0, 17, "cos")], "odd", "0 <= m <= n <= 15"),
        ([(0, 1, "cos"), (0, 1, "cos")], "odd", "repeat"),
    ],
)
def test_bad_modes_are_refused(modes, parity, word):
    with pytest.raises(InputError, match=word):
        ModeTable([Mode(*m) for m in modes], parity)


@pytest.mark.parametrize(("harmonics", "terms"), [(-1, 1), (0, 0), (10, 4)])
def test_bad_counts_are_refused(harmonics, terms):
    with pytest.raises(InputError, match=r"harmonics|radial_terms"):
        rotor_modes(harmonics, terms)
