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


ROWS = [(-180, 0, 0.1), (-10, -1, 0.02), (0, 0, 0.01), (10, 1, 0.02), (180, 0, 0.1)]


def as_csv(rows, header, end=""):
    return "\n".join([header, *(",".join(map(str, row)) + end for row in rows)]) + "\n"


def read(tmp_path, text, name="a.csv"):
    (tmp_path / name).write_text(text)
    return io.read_section(tmp_path / name)


def test_a_mach_column_makes_a_table_over_mach(tmp_path):
    """In blocks of any order, or side by side; not one angle may be missing."""
    rows = [(a, m, cl * (1 + m), cd) for m in (0.6, 0.3) for a, cl, cd in ROWS]
    for order in (rows, sorted(rows)):
        (alpha, mach, cl), (_, _, cd) = read(tmp_path, as_csv(order, "alpha_deg,mach,cl,cd"))
        np.testing.assert_array_equal(mach, [0.3, 0.6])
        np.testing.assert_allclose(cl[alpha == 10], [[1.3, 1.6]])
        np.testing.assert_allclose(cd[:, 1], [row[2] for row in ROWS])
    with pytest.raises(InputError, match=r"must be the same for every Mach number, but at 0.6 there are 4"):
        read(tmp_path, as_csv(rows[1:], "alpha_deg,mach,cl,cd"))
    with pytest.raises(InputError, match=r"line 3: alpha_deg at Mach 0.6 must increase"):
        read(tmp_path, as_csv([*rows[1::-1], *rows[2:]], "alpha_deg,mach,cl,cd"))


@pytest.mark.parametrize(
    "text",
    [
        as_csv(ROWS, "Alpha_Deg,CL,CD"),
        as_csv(ROWS, "alpha_deg,cl,cd,", ","),
        as_csv(ROWS, "! a note\n% another\nalpha_deg,cl,cd") + ",,\n,,\n",
        as_csv(ROWS, "alpha_deg,cl,cd").replace("0.02", "2.0D-02"),
    ],
    ids=["capitals", "an empty column", "notes and empty rows", "fortran"],
)
def test_what_spreadsheets_and_fortran_leave_is_read(tmp_path, text):
    (alpha, _, cl), (_, _, cd) = read(tmp_path, text)
    np.testing.assert_array_equal(np.column_stack([alpha, cl, cd]), np.array(ROWS, float))


def test_an_airfoiltools_polar_is_read_with_its_mach_number(tmp_path):
    head = "Xfoil polar. Reynolds number fixed. Mach number fixed\nAirfoil,n0012-il\nMach,0.2\n\n"
    rows = [(a, cl, cd, 0, 0, 1, 1) for a, cl, cd in ROWS[1:4]]
    (alpha, mach, cl), _ = read(tmp_path, as_csv(rows, head + "Alpha,Cl,Cd,Cdp,Cm,Top_Xtr,Bot_Xtr"))
    np.testing.assert_array_equal(alpha, [-10, 0, 10])
    np.testing.assert_array_equal(cl[:, 0], [-1, 0, 1])
    assert mach == [0.2]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (as_csv(ROWS, "alpha,cl,cd"), "'alpha_deg' is not among .*: angles in degrees go under that name"),
        (as_csv([(*row, 9) for row in ROWS], "alpha_deg,cl,cd,cl"), "each once, but 'cl' is there 2 times"),
        (as_csv(ROWS[1:], "-180,0,0.1"), "line 1: the first line must name the columns, but holds"),
        (as_csv(ROWS, "AeroDyn airfoil file, v13"), "must be of version 15 .* but is older"),
    ],
)
def test_other_headers_are_refused_with_the_way_out(tmp_path, text, message):
    with pytest.raises(InputError, match=f"a.csv.*{message}"):
        read(tmp_path, text)


def test_an_xfoil_polar_may_go_up_and_then_down(tmp_path):
    """As ASEQ 0 10 and ASEQ 0 -10 leave it, zero there twice; of one Mach number."""
    text = "XFOIL Version 6.99\nMach number fixed\nMach = 0.200\n\nalpha CL CD\n----- ---- ----\n"
    text += "0 0 .01\n5 .5 .012\n10 1 .02\n0 0 .01\n-5 -.5 .012\n"
    (alpha, mach, _), _ = read(tmp_path, text, "a.pol")
    np.testing.assert_array_equal(alpha, [-5, 0, 5, 10])
    assert mach == [0.2]
    with pytest.raises(InputError, match="must be of type 1, but its Mach number changes with the lift"):
        read(tmp_path, text.replace("number fixed", "number ~ 1/sqrt(CL)"), "a.pol")


def test_an_aerodyn_table_longer_than_it_says_is_refused(tmp_path):
    rows = "".join(f"{a} {cl} {cd} 0\n" for a, cl, cd in ROWS)
    assert len(read(tmp_path, f"! AirfoilInfo\n5 NumAlf\n{rows}", "a.dat")[0][0]) == 5
    with pytest.raises(InputError, match="line 6: NumAlf says 3 rows, but more follow"):
        read(tmp_path, f"! AirfoilInfo\n3 NumAlf\n{rows}", "a.dat")


def test_a_flat_plate_continues_no_half_of_a_section():
    half = tuple((np.array([0.0, 10.0]), np.zeros(1), np.array(values)) for values in ([[0], [1]], [[0.01], [0.02]]))
    with pytest.raises(InputError, match=r"both sides of 0 .* but runs from 0 to 10: give symmetric = true"):
        full_range.completed(*half, "flat plate")
    full_range.completed(*half, "flat plate", symmetric=True)
