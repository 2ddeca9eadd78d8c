"""Case files of sweeps, and the points and the plan that they make."""

import math

import numpy as np
import pytest

from rotorjax.errors import InputError
from rotorjax.sweep.case import read_case, sweep_case
from rotorjax.sweep.design import plan, points_of
from rotorjax.sweep.rotors import rotor_of, values_of

GOOD = """
[case]
command = "inflow"
collective_deg = 16.0
[axes]
height = [0.8, 1.0, inf]
slope_deg = { from = 0.0, to = 10.0, points = 3 }
rotor.linear_twist_deg = [-8.0]
"""


def written(tmp_path, text):
    (tmp_path / "case.toml").write_text(text)
    return tmp_path / "case.toml"


def test_a_grid_is_all_combinations(tmp_path):
    case = read_case(written(tmp_path, GOOD))
    points = points_of(case)
    assert len(points) == 9
    assert points[1].values == (("height", 0.8), ("slope_deg", 5.0), ("rotor.linear_twist_deg", -8.0))
    free = values_of(case, points[-1])
    assert (free["height"], free["slope_deg"]) == (None, 0.0)


def test_keys_of_a_rotor_file_take_the_place_of_its_own():
    axes = {"rotor": {"linear_twist_deg": [-8.0], "chord": [0.5], "radius": [7.0]}, "operating.rpm": [270.0]}
    case = sweep_case("inflow", axes, collective_deg=14.0, altitude=1000.0)
    (point,) = points_of(case)
    rotor, operating = rotor_of(case, values_of(case, point))
    np.testing.assert_allclose(rotor.twist.values, np.deg2rad([6.0, -2.0]))
    np.testing.assert_allclose(rotor.chord.values, 0.5)
    assert float(rotor.radius) == 7.0
    assert float(operating.omega) == pytest.approx(270 * np.pi / 30)
    assert float(operating.density) == pytest.approx(1.1116, rel=1e-4)


def random_case(seed):
    axes = {"collective_deg": {"from": 8.0, "to": 16.0}, "height": [0.8, 1.0, 2.0]}
    return sweep_case("inflow", axes, {"kind": "random", "points": 12, "seed": seed})


def test_a_random_design_is_seeded_and_fills_every_axis():
    points = points_of(random_case(3))
    assert points == points_of(random_case(3))
    assert points != points_of(random_case(4))
    columns = np.array([[value for _, value in point.values] for point in points])
    parts = np.floor((columns[:, 0] - 8.0) / 8.0 * 12)
    assert sorted(parts) == list(range(12))  # a Latin hypercube
    assert [int(np.sum(columns[:, 1] == h)) for h in (0.8, 1.0, 2.0)] == [4, 4, 4]


def test_the_plan_goes_from_the_easiest_point_to_the_nearest():
    case = sweep_case("inflow", {"height": [0.6, 0.8, 1.0, math.inf], "slope_deg": [0.0, 5.0]}, collective_deg=16.0)
    points = points_of(case)
    planned = plan(points)
    assert [planned.order[0].values[k][1] for k in (0, 1)] == [math.inf, 0.0]
    assert set(planned.order) == set(points)
    for k, point in enumerate(planned.order[1:], 1):
        assert planned.nearest[point] in planned.order[:k]
    level = {point.values[0][1]: point for point in points if point.values[1][1] == 0.0}
    assert planned.nearest[level[0.6]] == level[0.8]
    assert planned.nearest[level[0.8]] == level[1.0]
    assert plan(points).nearest == planned.nearest


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('"inflow"', '"inflw"', "command must be one of inflow, trim"),
        ("collective_deg = 16.0", "colective_deg = 16.0", "did you mean 'collective_deg'"),
        ("height =", "heigth =", "did you mean 'height'"),
        ("height =", "speed =", "unknown key 'speed' for inflow"),
        ("[0.8, 1.0, inf]", "[]", "height must be a list"),
        ("[0.8, 1.0, inf]", "[0.8, 0.8]", "each value once"),
        ("[0.8, 1.0, inf]", "[0.8, -1.0]", "height must be a number in"),
        ("[0.8, 1.0, inf]", "[0.8, true]", "must hold numbers"),
        ("points = 3", "points = 1", "two or more points"),
        ("points = 3", "step = 3", r"\{from, to, points\}"),
        ("rotor.linear_twist_deg", "rotor.linear_twist", "did you mean 'rotor.linear_twist_deg'"),
        ("rotor.linear_twist_deg", "rotor.twist_deg", "take rotor.linear_twist_deg"),
        ("rotor.linear_twist_deg", "rotor.name", "unknown key 'rotor.name'"),
        ("rotor.linear_twist_deg", "operating.collective_deg", "take collective_deg or a thrust"),
        ("rotor.linear_twist_deg", "weight", "weight must be a finite number|weight must be a number"),
        ("rotor.linear_twist_deg = [-8.0]", "collective_deg = [14.0]", "collective_deg must be left out"),
        ("rotor.linear_twist_deg = [-8.0]", "weight = [5e4]", "one of collective_deg"),
        ("collective_deg = 16.0", 'aim = "flapping"', "aim must be left out"),
        ("[axes]", "quick = true\n[axes]", "quick must come with the free wake"),
        ("[axes]", 'model = "freewake"\nharmonics = 2\n[axes]', "harmonics must come with"),
        ("[axes]", "[wake]\npanels = 8\n[axes]", "must come with the free wake"),
        ("[axes]", "[design]\nseed = 1\n[axes]", "kind = 'random'"),
        ("[axes]", '[design]\nkind = "random"\n[axes]', "points must say"),
        ("[axes]", '[design]\nkind = "random"\npoints = 3\n[axes]', "finite in a random design"),
        ("16.0", '16.0\nrotor = "uh61"', "did you mean 'uh60'"),
        ("16.0\n[axes]", '16.0\nmodel = "freewake"\nthrust_coefficient = 0.005\n[axes]', "hold one of"),
    ],
)
def test_what_is_wrong_is_one_line_with_the_files_key(tmp_path, old, new, words):
    assert old in GOOD
    with pytest.raises(InputError, match=words) as caught:
        read_case(written(tmp_path, GOOD.replace(old, new)))
    assert "case.toml" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_trim_needs_a_thrust_and_a_slope_a_height():
    with pytest.raises(InputError, match="thrust_coefficient or weight"):
        sweep_case("trim", {"advance_ratio": [0.0, 0.1]})
    with pytest.raises(InputError, match="height where there is slope_deg"):
        sweep_case("inflow", {"slope_deg": [0.0, 5.0]}, collective_deg=16.0)
    with pytest.raises(InputError, match=r"must be empty|is empty"):
        sweep_case("inflow", {}, collective_deg=16.0)
    with pytest.raises(InputError, match="command = 'trim'"):
        sweep_case("inflow", {"weight": [5e4, 6e4]}, model="freewake")
