import numpy as np
import pytest

from rotorjax.deck.case import read_case
from rotorjax.errors import InputError

CASE = """
[rotor]
name = "uh60"
collective_deg = 16.0
[time]
duration = 10.0
[path]
t = [0.0, 4.0, 10.0]
height = [2.0, 1.0, 1.0]
edge = [-1.5, 1.0, 1.5]
[deck]
heave = 0.1
heave_period = 5.0
pitch_deg = 3.0
pitch_period = 7.0
edge_azimuth_deg = 90.0
"""


def read(text, tmp_path):
    path = tmp_path / "case.toml"
    path.write_text(text)
    return read_case(path)


def test_motion_and_its_rates(tmp_path):
    case = read(CASE, tmp_path)
    np.testing.assert_allclose([*case.collective, case.edge_azimuth], np.deg2rad([*[16.0] * case.t.size, 90.0]))
    psi = np.linspace(0, 9.9 * case.omega, 4001)
    motion = case.motion(psi)
    jumps = np.abs(motion["climb_rate"] - np.gradient(motion["climb"], psi)) > 5e-6
    assert jumps.sum() <= 2  # where the path bends
    for name in ("height", "slope"):
        rate = np.gradient(motion[name], psi, edge_order=2)
        np.testing.assert_allclose(motion[f"{name}_rate"], rate, atol=5e-6)  # the path bends at its points
    np.testing.assert_allclose(motion["height"][0], 2.0)
    assert np.all(motion["climb"] <= 1e-15)
    np.testing.assert_allclose(np.ptp(motion["slope"]), 2 * np.deg2rad(3), rtol=1e-4)
    np.testing.assert_allclose(case.instants()[-1], 10.0 * case.omega)


def test_the_pilots_collective(tmp_path):
    own = CASE.replace("collective_deg = 16.0\n", "").replace("[deck]", "collective_deg = [16.0, 15.0, 15.5]\n[deck]")
    case = read(own, tmp_path)
    found = case.motion(np.array([0.0, 4.0, 10.0]) * case.omega)["collective"]
    np.testing.assert_allclose(np.rad2deg(found), [16.0, 15.0, 15.5])


def test_blades_flap_where_they_have_hinge_data(tmp_path):
    assert not read(CASE, tmp_path).rigid
    assert read(CASE.replace('"uh60"', '"uh60"\nrigid = true'), tmp_path).rigid
    assert read(CASE.replace('"uh60"', '"caradonna_tung"'), tmp_path).rigid
    with pytest.raises(InputError, match="hinge data, but is False"):
        read(CASE.replace('"uh60"', '"caradonna_tung"\nrigid = false'), tmp_path)


def test_rotor_file_beside_the_case(tmp_path):
    with pytest.raises(InputError, match=r"mine\.toml"):
        read(CASE.replace('"uh60"', '"mine.toml"'), tmp_path)


BAD = {
    "t = [0.0, 4.0, 4.0]": ("t = [0.0, 4.0, 10.0]", "must increase, but has 4 followed by 4"),
    "t = [0.0, 4.0, 9.0]": ("t = [0.0, 4.0, 10.0]", "must cover 0 to 10 s"),
    "t = [0.0, 10.0]": ("t = [0.0, 4.0, 10.0]", r"\[path\] height must hold 2 values"),
    "height = [2.0, -0.2, 1.0]": ("height = [2.0, 1.0, 1.0]", "where the disk cuts the ground"),
    "height = [0.42, 0.39, 0.39]": ("height = [2.0, 1.0, 1.0]", r"at .* s: .*`height` must be at least 0.3 for vpbfsm"),
    "height = [5.0, 1.0, 1.0]": ("height = [2.0, 1.0, 1.0]", "must keep the rotor out of the vortex ring state"),
    "collective_deg = -20.0": ("collective_deg = 16.0", "must give a loading that thrusts upward"),
    'height = "low"': ("height = [2.0, 1.0, 1.0]", "list of numbers"),
    "heave = -0.1": ("heave = 0.1", "but is -0.1"),
    "heaf = 0.1": ("heave = 0.1", r"\[deck\] has the unknown key 'heaf': did you mean 'heave'"),
    "[dek]": ("[deck]", r"\[dek\] is not a known table"),
    "duration = 0.0": ("duration = 10.0", r"\[0.001, 100000\] s, but is 0"),
    "steps_per_turn = 16": ("duration = 10.0", "must have the key 'duration'"),
    "duration = 1e9": ("duration = 10.0", r"duration must be .*, but is 1e\+09"),
    'name = "uh61"': ('name = "uh60"', "did you mean 'uh60'"),
    "pitch_deg = 40.0": ("pitch_deg = 3.0", "but is 40"),
    '[model]\nvariant = "quick"\n[time]': ("[time]", "but is 'quick'"),
    "[model]\nharmonics = 1.5\n[time]": ("[time]", "must be a whole number, but is 1.5"),
    'name = "uh60"\nrigid = 1': ('name = "uh60"', "must be true or false"),
    "heave = = 1": ("heave = 0.1", "must be TOML"),
}


@pytest.mark.parametrize("new", BAD)
def test_bad_input(new, tmp_path):
    old, match = BAD[new]
    with pytest.raises(InputError, match=match) as error:
        read(CASE.replace(old, new), tmp_path)
    assert "case.toml" in str(error.value)


@pytest.mark.parametrize(
    ("values", "match"),
    [
        ("[16.0, 15.0, 15.0]", r"\[rotor\] collective_deg must be absent"),
        ("[16.0, 15.0]", r"collective_deg must hold 3 values"),
    ],
)
def test_bad_collectives(values, match, tmp_path):
    text = CASE if "absent" in match else CASE.replace("collective_deg = 16.0\n", "")
    with pytest.raises(InputError, match=match):
        read(text.replace("[deck]", f"collective_deg = {values}\n[deck]"), tmp_path)


def test_missing_file(tmp_path):
    with pytest.raises(InputError, match="No such file"):
        read_case(tmp_path / "none.toml")
