"""Airfoil files: round trips, and messages that name file and line."""

import numpy as np
import pytest

from rotorjax.errors import InputError
from rotorjax.rotor import airfoil_io as io
from rotorjax.rotor import c81, full_range
from rotorjax.rotor.catalogue import _folder


def sc1095():
    lift, drag = (io.read_alpha_mach(_folder() / f"sc1095_{c}.csv") for c in ("cl", "cd"))
    return c81.C81("SC1095", lift, drag, (lift[0], lift[1], np.zeros_like(lift[2])))


def test_c81_round_trip_is_exact_for_a_real_table(tmp_path):
    """Every SC1095 value fits seven characters, eleven Mach numbers take a second line a row."""
    content = sc1095()
    c81.write_c81(tmp_path / "a.c81", content)
    back = c81.read_c81(tmp_path / "a.c81")
    assert back.title == "SC1095"
    for wrote, read in zip((content.cl, content.cd, content.cm), (back.cl, back.cd, back.cm), strict=True):
        for a, b in zip(wrote, read, strict=True):
            np.testing.assert_array_equal(a, b)


def test_c81_layout_is_the_fixed_width_one(tmp_path):
    values = np.array([[0.0, -0.00775], [1.23456789, 2.0], [0, 0]])
    table = (np.array([-180.0, 0.0, 180.0]), np.array([0.0, 0.5]), values)
    c81.write_c81(tmp_path / "a.c81", c81.C81("title", table, table, table))
    lines = (tmp_path / "a.c81").read_text().splitlines()
    assert lines[0] == f"{'title':<30} 2 3 2 3 2 3"
    assert lines[1] == " " * 7 + "    0.0    0.5"
    assert lines[2] == " -180.0    0.0-.00775"
    assert lines[3] == "    0.01.23457    2.0"


def test_c81_written_twice_is_the_same_file(tmp_path):
    rng = np.random.default_rng(0)
    table = (np.linspace(-180, 180, 13), np.linspace(0, 1, 10), rng.normal(size=(13, 10)))
    c81.write_c81(tmp_path / "a.c81", c81.C81("x", table, table, table))
    c81.write_c81(tmp_path / "b.c81", c81.read_c81(tmp_path / "a.c81"))
    assert (tmp_path / "a.c81").read_text() == (tmp_path / "b.c81").read_text()
    np.testing.assert_allclose(c81.read_c81(tmp_path / "a.c81").cl[2], table[2], atol=5.1e-5)


def test_common_grid_keeps_every_node_of_both():
    lift = (np.array([0.0, 10.0]), np.array([0.0, 1.0]), np.array([[0.0, 0.0], [1.0, 2.0]]))
    drag = (np.array([0.0, 5.0, 10.0]), np.array([0.0]), np.array([[0.01], [0.02], [0.05]]))
    alpha, mach, cl, cd = full_range.common_grid(lift, drag)
    np.testing.assert_array_equal(alpha, [0, 5, 10])
    np.testing.assert_array_equal(mach, [0, 1])
    np.testing.assert_allclose(cl, [[0, 0], [0.5, 1], [1, 2]])
    np.testing.assert_allclose(cd, [[0.01, 0.01], [0.02, 0.02], [0.05, 0.05]])


def test_extend_lets_the_inner_table_win():
    inner = (np.array([-1.0, 1.0]), np.array([0.0, 0.5]), np.array([[1.0, 2.0], [3.0, 4.0]]))
    alpha, _, values = full_range.extend(inner, np.array([-2.0, 0.0, 1.0, 2.0]), np.array([9.0, 8.0, 7.0, 6.0]))
    np.testing.assert_array_equal(alpha, [-2, -1, 1, 2])
    np.testing.assert_array_equal(values, [[9, 9], [1, 2], [3, 4], [6, 6]])


def of_file(name):
    alpha, cl, cd = io.read_polar(_folder() / name)
    return (alpha, np.zeros(1), cl[:, None]), (alpha, np.zeros(1), cd[:, None])


def test_mirror_makes_lift_odd_and_drag_even():
    lift, drag = of_file("naca0012_sandia.csv")
    (alpha, _, cl), (_, _, cd) = full_range.mirror(lift, -1), full_range.mirror(drag, 1)
    assert alpha[0] == -180
    np.testing.assert_array_equal(alpha, -alpha[::-1])
    np.testing.assert_array_equal(cl, -cl[::-1])
    np.testing.assert_array_equal(cd, cd[::-1])


def test_mirror_refuses_a_table_that_is_not_symmetric():
    with pytest.raises(InputError, match=r"must mirror itself, but at -175 deg"):
        full_range.mirror(of_file("naca0012_tn3361.csv")[0], -1)
    with pytest.raises(InputError, match="must hold cl = 0 at 0 deg"):
        full_range.mirror((np.array([0.0, 180.0]), np.zeros(1), np.array([[0.1], [0.0]])), -1)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("alpha_deg,cl,cd\n0,0,0.01\n1,0.1\n", "line 3: a row must have 3 columns, but has 2"),
        ("# note\nalpha_deg,cl,cd\n0,0,0.01\n1,,0.01\n", "line 4: every value must be a finite number, but one is ''"),
        ("alpha_deg,cl,cd\n0,0,0.01\n1,nan,0.01\n", "line 3: every value must be a finite number, but one is 'nan'"),
        ("alpha_deg,cl,cd\n0,0,x\n1,0.1,0.01\n", "line 2: .* but one is 'x'"),
        ("alpha_deg,cl,cd\n1,0,0.01\n0,0.1,0.01\n", "line 3: alpha_deg must increase, but 1 is followed by 0"),
        ("alpha_deg,cl\n0,0\n1,1\n", "columns must include alpha_deg, cl, cd, but 'cd' is not among"),
        ("alpha_deg,cl,cd\n", "must hold a header of column names and two or more rows, but has 1 lines"),
        ("", "must not be empty"),
    ],
)
def test_polar_refuses(tmp_path, text, message):
    path = tmp_path / "polar.csv"
    path.write_text(text)
    with pytest.raises(InputError, match=f"polar.csv.*{message}"):
        io.read_polar(path)


def test_alpha_mach_refuses_a_header_without_mach_numbers(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("alpha_deg,low,high\n0,0,0\n1,1,1\n")
    with pytest.raises(InputError, match="header must be alpha_deg and Mach numbers"):
        io.read_alpha_mach(path)
    path.write_text("alpha_deg,0.5,0.2\n0,0,0\n1,1,1\n")
    with pytest.raises(InputError, match="Mach numbers must increase"):
        io.read_alpha_mach(path)


def test_missing_file_is_an_input_error(tmp_path):
    with pytest.raises(InputError, match=r"nothing.csv: the file must be readable"):
        io.read_polar(tmp_path / "nothing.csv")


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (lambda lines: lines[:-3], r"line \d+: 11 numbers must follow, but the file ends here"),
        (lambda lines: ["no counts here", *lines[1:]], "line 1: six two-digit counts"),
        (lambda lines: [lines[0].replace("1133", " 033", 1), *lines[1:]], "line 1: the six counts must be positive"),
        (lambda lines: [*lines[:3], lines[3][:21] + "   oops" + lines[3][28:], *lines[4:]], "line 4: .* 'oops'"),
        (lambda lines: [*lines[:5], *lines[3:5], *lines[7:]], "angles must increase, but -32 is followed by -32"),
        (lambda lines: [*lines[:3], lines[3][:40], *lines[4:]], "line 4: every value must be a finite number"),
    ],
)
def test_c81_refuses(tmp_path, spoil, message):
    path = tmp_path / "a.c81"
    c81.write_c81(path, sc1095())
    path.write_text("\n".join(spoil(path.read_text().splitlines())) + "\n")
    with pytest.raises(InputError, match=message):
        c81.read_c81(path)


def test_c81_refuses_what_its_format_cannot_hold(tmp_path):
    small = (np.array([0.0, 1.0]), np.array([0.0]), np.array([[0.0], [1.0]]))
    long = (np.arange(100.0), np.array([0.0]), np.zeros((100, 1)))
    with pytest.raises(InputError, match="at most 99"):
        c81.write_c81(tmp_path / "a.c81", c81.C81("x", long, small, small))
    big = (small[0], small[1], np.array([[0.0], [1e9]]))
    with pytest.raises(InputError, match="seven characters"):
        c81.write_c81(tmp_path / "a.c81", c81.C81("x", big, small, small))
