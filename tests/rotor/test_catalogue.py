"""The catalogue and rotor files: what the rotors are, a user's own file, and one-line refusals."""

import jax.numpy as jnp
import numpy as np
import pytest

from rotorjax.errors import InputError
from rotorjax.rotor import airfoil_io, c81, catalogue, geometry
from rotorjax.rotor.airfoil import lift_drag


def test_names():
    known = ("caradonna_tung", "elliott_althoff", "knight_hefner_2", "knight_hefner_4", "tn2318_2", "uh60")
    assert catalogue.names() == known


def test_uh60_is_the_papers_table_1():
    rotor, point = catalogue.load("uh60")
    assert (rotor.name, rotor.blades) == ("UH-60A", 4)
    np.testing.assert_allclose(rotor.radius, 26.83 * 0.3048, rtol=1e-7)
    np.testing.assert_allclose(np.pi * (rotor.radius / 0.3048) ** 2, 2261.5, atol=0.05)
    chord = geometry.chord(rotor, jnp.array([0.3, 0.8, 0.95])) * rotor.radius / 0.0254
    np.testing.assert_allclose(chord, [20.76, 20.965, 20.76], rtol=1e-6)
    np.testing.assert_allclose(point.omega, 27.0, rtol=1e-12)
    np.testing.assert_allclose(point.tip_speed(rotor.radius) / 0.3048, 725, rtol=1e-3)
    np.testing.assert_allclose(jnp.rad2deg(point.collective), 18.0)
    np.testing.assert_allclose(jnp.rad2deg(geometry.twist(rotor, jnp.array([0.75, 1.0]))), [-9.65, -10.9], rtol=1e-12)


def test_uh60_hinge():
    hinge = catalogue.load("uh60")[0].hinge
    assert hinge is not None
    # The centre of mass of the blade is 3.31 m outboard of the hinge: within the blade, and less than its radius of
    # gyration.
    arm, gyration = hinge.first_moment / hinge.blade_mass, jnp.sqrt(hinge.flap_inertia / hinge.blade_mass)
    assert 3.0 < float(arm) < float(gyration) < 8.177 - 0.381
    assert hinge.damper_rate is not None
    assert hinge.damper_force is not None
    assert jnp.all(jnp.diff(hinge.damper_force) > 0)
    np.testing.assert_allclose(jnp.interp(0.0508, hinge.damper_rate, hinge.damper_force), 16280.49)


def test_caradonna_tung_has_the_reported_tip_mach_number():
    rotor, point = catalogue.load("caradonna_tung")
    assert (rotor.blades, rotor.hinge) == (2, None)
    np.testing.assert_allclose(point.tip_mach(rotor.radius), 0.439, atol=5e-5)
    np.testing.assert_allclose(geometry.solidity(rotor), 2 * 0.1905 / (np.pi * 1.143), rtol=1e-12)
    assert rotor.airfoil.prandtl_glauert


def test_the_coaxial_pair_of_tn_2318_has_the_reported_solidity():
    np.testing.assert_allclose(2 * geometry.solidity(catalogue.load("tn2318_2")[0]), 0.152, atol=1e-3)


def test_elliott_althoff_flies_at_its_reported_advance_ratio():
    rotor, point = catalogue.load("elliott_althoff")
    np.testing.assert_allclose(28.50 / point.tip_speed(rotor.radius), 0.15, atol=5e-4)
    twist = geometry.twist(rotor, jnp.array([0.0, 0.75, 1.0]))
    np.testing.assert_allclose(jnp.rad2deg(twist), [6, 0, -2], atol=1e-12)


def test_knight_and_hefners_section_has_the_reported_lift_slope_and_least_drag():
    table = catalogue.load("knight_hefner_2")[0].airfoil
    angle = jnp.deg2rad(jnp.linspace(0.0, 6.0, 25))
    lift, drag = lift_drag(table, angle, jnp.zeros_like(angle))
    assert float(jnp.sum(angle * lift) / jnp.sum(angle**2)) == pytest.approx(5.75, rel=0.03)
    assert float(jnp.min(drag)) == pytest.approx(0.0113, abs=2e-4)
    highest = jnp.max(lift_drag(table, jnp.deg2rad(jnp.linspace(6.0, 16.0, 81)), jnp.zeros(81))[0])
    assert float(highest) == pytest.approx(0.93, abs=0.02)


OWN = """
[rotor]
name = "mine"
blades = 2
radius = 1.5
root_cutout = 0.1
chord = 0.1
twist_deg = { r = [0.1, 1.0], value = [4.0, -4.0] }

[airfoil]
file = "mine.csv"

[operating]
rpm = 600
collective_deg = 6.0
"""
POLAR = "alpha_deg,cl,cd\n-180,0,0.02\n-10,-1,0.01\n0,0,0.01\n10,1,0.01\n180,0,0.02\n"


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "mine.csv").write_text(POLAR)
    return tmp_path


def write(folder, text):
    path = folder / "mine.toml"
    path.write_text(text)
    return path


def test_own_file(folder):
    rotor, point = catalogue.load(str(write(folder, OWN)))
    assert rotor.name == "mine"
    np.testing.assert_allclose(point.omega, 20 * np.pi)
    np.testing.assert_allclose(geometry.twist(rotor, jnp.array(0.55)), 0, atol=1e-15)
    np.testing.assert_allclose(lift_drag(rotor.airfoil, jnp.deg2rad(10.0), jnp.asarray(0.3)), [1, 0.01], atol=1e-13)


def test_own_file_with_a_c81_table(folder):
    alpha, cl, cd = airfoil_io.read_polar(folder / "mine.csv")
    table = [(alpha, np.zeros(1), c[:, None]) for c in (cl, cd, 0 * cl)]
    c81.write_c81(folder / "mine.c81", c81.C81("mine", *table))
    rotor, _ = catalogue.load(write(folder, OWN.replace("mine.csv", "mine.c81")))
    np.testing.assert_allclose(lift_drag(rotor.airfoil, jnp.deg2rad(10.0), jnp.asarray(0.3)), [1, 0.01], atol=1e-13)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("radius = 1.5", "raduis = 1.5", r"\[rotor\] has the unknown key 'raduis': did you mean 'radius'\?"),
        ("radius = 1.5", "", r"\[rotor\] must have the key 'radius' \(number\), but it is missing"),
        ("[operating]", "[operatng]", r"\[operatng\] is not a known table: did you mean 'operating'\?"),
        ("[rotor]", "[zzz]\n[rotor]", r"\[zzz\] is not a known table: it must be one of rotor, airfoil"),
        ("blades = 2", "blades = 2.0", r"\[rotor\] blades must be a whole number, but is 2.0"),
        ("blades = 2", "blades = -2", r"\[rotor\] blades must be a whole number from 1 to 20, but is -2"),
        ("radius = 1.5", "radius = nan", r"\[rotor\] radius must be a number in \[0.02, 200\] m, but is nan"),
        ("radius = 1.5", 'radius = "1.5"', r"\[rotor\] radius must be a finite number, but is '1.5'"),
        ("chord = 0.1", "chord = [0.1, 0.1]", r"\[rotor\] chord must be a number or a table of the two lists r and"),
        ("[4.0, -4.0]", "[4.0, -4.0, 1]", r"\[rotor\] twist_deg must hold as many values as stations"),
        ("[4.0, -4.0]", '["a", 1]', r"\[rotor\] twist_deg.value must be a list of numbers"),
        ("[0.1, 1.0]", "[0.1, 0.9]", r"\[rotor\] twist_deg.r must cover 0.1 to 1 \(r/R\), but is 0.1 to 0.9"),
        ("[0.1, 1.0]", "[1.0, 0.1]", r"\[rotor\] twist_deg.r must increase from root to tip, but is 1 followed by 0.1"),
        ("rpm = 600", "rpm = 0", r"\[operating\] rpm must be a number in \(0, 200000\] 1/min, but is 0$"),
        ("rpm = 600", "rpm = true", r"\[operating\] rpm must be a finite number, but is True"),
        ('file = "mine.csv"', 'file = "other.csv"', "other.csv: the file must be readable"),
        ('file = "mine.csv"', "", r"\[airfoil\] must have either 'file' or both 'lift_file' and 'drag_file'"),
        ('file = "mine.csv"', 'lift_file = "a"', r"\[airfoil\] must have either .* but has lift_file"),
        ('file = "mine.csv"', 'file = "mine.csv"\nsymmetric = 1', r"symmetric must be true or false, but is 1"),
        ("[rotor]", "[rotor", "must be TOML, but is not"),
    ],
)
def test_own_file_refuses(folder, old, new, message):
    assert old in OWN
    with pytest.raises(InputError, match=message) as caught:
        catalogue.load(write(folder, OWN.replace(old, new, 1)))
    assert "mine.toml" in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("uh-60", "must be a rotor of the catalogue or a .toml file, but is 'uh-60': did you mean 'uh60'?"),
        (
            "xyzzy",
            "it must be one of caradonna_tung, elliott_althoff, knight_hefner_2, knight_hefner_4, tn2318_2, uh60",
        ),
        (None, "but is None"),
    ],
)
def test_unknown_name(name, message):
    with pytest.raises(InputError) as caught:
        catalogue.load(name)
    assert message in str(caught.value)


def test_file_that_is_not_there(tmp_path):
    with pytest.raises(InputError, match="the file must be readable"):
        catalogue.load(tmp_path / "none.toml")
