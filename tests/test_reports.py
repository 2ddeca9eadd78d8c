"""Inputs that were once answered wrongly without a word, or ended in a traceback: each with what is right.

tests/data/reports holds rotor files, tables and cases made after reports of users of comparable tools.
"""

from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from rotorjax.errors import InputError
from rotorjax.rotor import catalogue, geometry
from rotorjax.rotor.airfoil import lift_drag
from rotorjax.simulation.case import read_case

REPORTS = Path(__file__).parent / "data" / "reports"
ROTOR = """
[rotor]
name = "T"
blades = 2
radius = 1.0
root_cutout = 0.15
chord = 0.08
[airfoil]
file = "FILE"
[operating]
rpm = 1200.0
collective_deg = 8.0
"""
at = jax.jit(lift_drag)


def section(path):
    return catalogue.load(REPORTS / path)[0].airfoil


def own(tmp_path, text):
    """A rotor file of its own beside the reports' table."""
    (tmp_path / "rotor.toml").write_text(text.replace("FILE", str(REPORTS / "foil.csv")))
    return catalogue.load(tmp_path / "rotor.toml")


REFUSED = {
    "keys_ignored/arm_without_damper.toml": r"\[hinge\] lag_damper_arm must come with lag_damper_file",
    "keys_ignored/damper_offset.toml": r"\[hinge\] lag_damper_file must begin with no force .* but is 300 at 0",
    "keys_ignored/c81_clamped_ends.toml": r"lift table must run from -180 to 180 deg, but runs from -12 to 14",
    "mach_effect_twice/double_glauert.toml": r"`prandtl_glauert` must be false .* \d Mach numbers",
    "short_drag_table/short_drag_c81.toml": r"the drag table must run from -180 to 180 deg, but runs from -10 to 10",
    "c81_layouts/descending.toml": r"desc.c81, line 4: angles must increase, but 180 is followed by 170",
    "table_formats/a.toml": r"lift table must run from -180 to 180 deg, .* give full_range_file or full_range",
    "units/chord_in_mm.toml": r"solidity .* must be at most 0.5, but is 50.9: check chord \(up to 80 m\)|chord must",
    "units/rpm_times_ten.toml": r"tip Mach number must be at most 1.2, but is 3.69: check rpm \(12000\)",
    "rotation/negative_rpm.toml": r"\[operating\] rpm must be .* but is -1200: .* rotation = \"clockwise\"",
}


@pytest.mark.parametrize("path", REFUSED)
def test_refused_by_name(path):
    with pytest.raises(InputError, match=REFUSED[path]) as caught:
        catalogue.load(REPORTS / path)
    assert Path(path).name in str(caught.value)


def test_a_full_range_file_continues_a_c81_table():
    """Own rows within their range, the other table's beyond, at every Mach number."""
    table = section("keys_ignored/c81_full_range_ignored.toml")
    alpha = jnp.deg2rad(jnp.array([4.0, 30.0, -120.0]))
    cl, cd = at(table, alpha, jnp.array(0.5))
    np.testing.assert_allclose(cl, [0.4619, 0.952628, 0.952628], atol=1e-12)
    np.testing.assert_allclose(cd, [0.0106, 0.445, 1.295], atol=1e-12)


def test_a_symmetric_c81_table_is_mirrored():
    table = section("keys_ignored/c81_symmetric_ignored.toml")
    alpha = jnp.deg2rad(jnp.linspace(1.0, 179.0, 90))
    for mach in (0.0, 0.6):
        (cl, cd), (back, drag) = (at(table, s * alpha, jnp.array(mach)) for s in (1, -1))
        np.testing.assert_allclose(back, -cl, atol=1e-12)
        np.testing.assert_allclose(drag, cd, atol=1e-12)


def test_mach_columns_alone_give_the_effect_once():
    """c_l at 4 deg and Mach 0.5 as the table has it, 0.4/√(1 − 0.5²)."""
    cl, _ = at(section("mach_effect_twice/reference.toml"), jnp.deg2rad(4.0), jnp.array(0.5))
    np.testing.assert_allclose(cl, 0.4 / np.sqrt(0.75), rtol=1e-3)


@pytest.mark.parametrize("path", ["c81_layouts/dust_preamble.toml", "c81_layouts/one_line_rows.toml"])
def test_c81_files_as_they_are_found(path):
    cl, cd = at(section(path), jnp.deg2rad(jnp.array([4.0, -90.0])), jnp.array(0.0))
    np.testing.assert_allclose(cl, [0.4, 0.0], atol=1e-12)
    np.testing.assert_allclose(cd, [0.0106, 1.72], atol=1e-12)


@pytest.mark.parametrize("path", ["table_formats/d.toml", "table_formats/e.toml", "table_formats/n.toml"])
def test_byte_order_mark_semicolons_and_aerodyn_load(path):
    cl, cd = at(section(path), jnp.deg2rad(jnp.array([-150.0, 10.0])), jnp.array(0.0))
    np.testing.assert_allclose(cl, [0.952628, 1.0], atol=1e-4)
    np.testing.assert_allclose(cd, [0.445, 0.019], atol=1e-4)


def test_an_xfoil_polar_is_continued_by_a_flat_plate(tmp_path):
    """cl = sin 2α, cd = 2 sin²α and the polar's least drag beyond its last angle; the polar's own values within."""
    text = ROTOR.replace('"FILE"', f'"{REPORTS / "table_formats" / "polar.txt"}"\nfull_range = "flat plate"')
    (tmp_path / "rotor.toml").write_text(text)
    table = catalogue.load(tmp_path / "rotor.toml")[0].airfoil
    assert "flat plate" in table.name
    cl, cd = at(table, jnp.deg2rad(jnp.array([3.0, 45.0, -90.0])), jnp.array(0.3))
    np.testing.assert_allclose(cl, [0.3, 1.0, 0.0], atol=1e-12)
    np.testing.assert_allclose(cd, [0.0099, 1.009, 2.009], atol=1e-12)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("chord = 0.08", "chord = 0.08\ntwist_deg = -8.0", r"linear_twist_deg = -8 \(zero at 0.75 R\)"),
        ("chord = 0.08", "chord = 0.08\ntwist_deg.r=[0,1]\ntwist_deg.value=[0,1]\nlinear_twist_deg=1", "has both"),
        (
            '"FILE"',
            '"FILE"\nfull_range = "flat plate"',
            "must continue a table, but lift and drag run from -180 to 180",
        ),
        ('"FILE"', '"FILE"\nfull_range_file = "FILE"', "must continue a table"),
        ('"FILE"', '"FILE"\nfull_range_file = "FILE"\nfull_range = "flat plate"', "but has both"),
        ('"FILE"', '"a\\u0000b"', r"\[airfoil\] file must be text of 1 to 250 printable characters"),
        ('"FILE"', f'"{"x" * 5000}"', r"printable characters, but is 'xxx.*… \(5002 characters\)$"),
        ("blades = 2", "blades = 2147483648", "whole number from 1 to 20, but is 2147483648"),
        ("radius = 1.0", f"radius = 1{'0' * 400}", r"radius must be a number in \[0.02, 200\] m, but is 1000"),
        ("radius = 1.0", f"radius = 1{'0' * 5000}", "must be TOML, but is not: Exceeds the limit"),
        ("radius = 1.0", f"radius = {'[' * 3000}", "its brackets are nested too deeply"),
        ("radius = 1.0", "radius = 1.0\nradius = 2.0", "must be TOML, but is not: Cannot overwrite"),
        (
            "collective_deg = 8.0",
            "collective_deg = 90",
            r"collective_deg must be a number in \[-45, 45\] deg.* 90",
        ),
        ("[rotor]", "x = 1\n[rotor]", r"\[x\] is not a known table"),
    ],
)
def test_further_mistakes_of_each_kind(tmp_path, old, new, message):
    assert old in ROTOR
    with pytest.raises(InputError, match=message) as caught:
        own(tmp_path, ROTOR.replace(old, new, 1))
    assert len(str(caught.value)) < 600


def test_linear_twist_is_zero_at_three_quarters(tmp_path):
    rotor, _ = own(tmp_path, ROTOR.replace("chord", "linear_twist_deg = -8.0\nchord", 1))
    twist = jnp.rad2deg(geometry.twist(rotor, jnp.array([0.0, 0.75, 1.0])))
    np.testing.assert_allclose(twist, [6.0, 0.0, -2.0], atol=1e-12)


def test_a_clockwise_rotor_is_told(tmp_path):
    """Its sense stays with it, and flights to one side are refused rather than mirrored without a word."""
    (tmp_path / "case.toml").write_text(
        '[flight]\nrotor = "rotor.toml"\nthrust_coefficient = 0.006\n[time]\nduration = 1.0\n'
        "[history]\nt = [0.0, 1.0]\np_deg = [0.0, 1.0]\n"
    )
    rotor, _ = own(tmp_path, ROTOR.replace("chord", 'rotation = "clockwise"\nchord', 1))
    assert (rotor.rotation, rotor.side) == ("clockwise", -1.0)
    with pytest.raises(InputError, match=r"\[history\] p_deg must be 0 for a clockwise rotor"):
        read_case(tmp_path / "case.toml")


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16", "latin-1"])
def test_encodings(tmp_path, encoding):
    """A byte-order mark just loads; what is not UTF-8 is named."""
    text = ROTOR.replace('"T"', '"Größe"').replace("FILE", str(REPORTS / "foil.csv"))
    (tmp_path / "rotor.toml").write_bytes(text.encode(encoding))
    if encoding == "utf-8-sig":
        assert catalogue.load(tmp_path / "rotor.toml")[0].name == "Größe"
    else:
        with pytest.raises(InputError, match=r"rotor\.toml: the file must be text in UTF-8"):
            catalogue.load(tmp_path / "rotor.toml")
