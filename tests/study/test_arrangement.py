"""Case files of several rotors: what is read, what is refused, and what both models of a made-up wake leave behind."""

import json

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from wakes import made_up

import rotorjax as rj
from rotorjax.cli import main
from rotorjax.errors import InputError
from rotorjax.io import netcdf
from rotorjax.study.arranged import solve_arrangement
from rotorjax.study.arrangement import SCHEMA, Arrangement, read_arrangement
from rotorjax.wake.several_solution import SeveralSolution

CASE = """[rotors]
rotor = "knight_hefner_2"
collective_deg = 8.0
x = [0.0, 0.0]
y = [-1.2, 1.2]
[ground]
height = 1.0
[wall]
distance = 3.0
bottom = -1.0
top = 0.0
length = 2.0
panel = 1.0
[wake]
panels = 6
age_step_deg = 30.0
near_wake_deg = 120.0
free_turns = 2.0
azimuths = 8
closure_turns = 1
closure_bundles = 0
"""


def read(folder, text, quick=True):
    (folder / "pair.toml").write_text(text)
    return read_arrangement(folder / "pair.toml", quick)


def test_a_case_is_rotors_ground_and_surfaces(tmp_path):
    case = read(
        tmp_path, CASE.replace("panel = 1.0", "panel = 1.0\n[slab]\nlow = [-3.0, 2.0]\nhigh = [-2.0, 3.0]\ntop = -0.5")
    )
    np.testing.assert_allclose(case.places, [[0, -1.2, 0], [0, 1.2, 0]])
    assert case.senses.tolist() == [1, -1]
    assert float(case.ground.height) == 1
    assert (case.settings.wake.panels, float(case.settings.wake.tip_core)) == (6, 0.05)
    assert len(case.surfaces) == len(rj.wall(3.0, -1.0, 0.0, length=2.0, panel=1.0) + rj.slab((-3, 2), (-2, 3), -0.5))
    assert (case.wakes.slices, len(case.wakes)) == (8, 2)
    one = read(tmp_path, "[rotors]\nx = [0.0]\ny = [0.0]\n")
    assert (one.wakes.slices, one.surfaces, one.ground) == (1, None, None)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("[rotors]", "[rotor]", r"\[rotor\] is not a known table: did you mean 'rotors'"),
        ("y = [-1.2, 1.2]", "y = [-1.2]", "x, y and z must hold as many numbers, 1 to 8, but hold 2, 1, 2"),
        ("y = [-1.2, 1.2]", "", r"\[rotors\] must have the key 'y'"),
        ("y = [-1.2, 1.2]", "y = [-0.5, 0.5]", r"\[rotors\] x, y, z must keep the disks apart"),
        ("[ground]", "senses = [1]\n[ground]", "senses must hold 2 numbers"),
        ("[ground]", "senses = [1, 0.5]\n[ground]", "senses must hold 2 numbers, 1 "),
        ("distance = 3.0", "distance = 0.5", "must keep clear of the disk"),
        ("bottom = -1.0", "bottom = -1.5", "must stay above the ground"),
        ("[wall]", "[well]", "did you mean 'wall'"),
        ("panels = 6", "panals = 6", "did you mean 'panels'"),
    ],
)
def test_what_is_not_right_is_one_line_in_the_files_own_words(tmp_path, old, new, words):
    with pytest.raises(InputError, match=words) as caught:
        read(tmp_path, CASE.replace(old, new, 1))
    assert str(caught.value).startswith(str(tmp_path / "pair.toml"))
    assert "\n" not in str(caught.value)


def test_the_template_shows_every_key_and_is_read(tmp_path, monkeypatch):
    monkeypatch.setattr(Arrangement, "wakes", None)  # no matrix of panels to invert
    assert main(["new", "several", str(tmp_path / "mine")]) == 0
    case = read_arrangement(tmp_path / "mine" / "case.toml")
    assert (len(case.places), len(case.surfaces), float(case.ground.height)) == (2, 208, 1)
    text = (tmp_path / "mine" / "case.toml").read_text()
    keys = {key for table, of_table in SCHEMA.items() if table != "wake" for key in (table, *of_table)}
    assert not [key for key in keys if key not in text]


def alike(several, start=None, progress=None):
    """Every rotor with the loads of a made-up wake over its ground."""
    rotors = tuple(made_up(several.one(i)) for i in range(len(several)))
    count = several.slices
    state = jax.tree.map(lambda a: jnp.broadcast_to(a[0], (len(rotors), count, *a.shape[1:])), rotors[0].state)
    numbers = {n: np.array([getattr(one, n) for one in rotors]) for n in ("CT", "CP", "CP_induced", "mean_inflow")}
    return SeveralSolution(several, state, rotors, True, "made up", 1e-9, 3, **numbers)


def test_both_models_are_written_and_symmetric(tmp_path, monkeypatch):
    """By the command, without the wall: files, maps of equal loads that mirror each other, a table."""
    monkeypatch.setitem(solve_arrangement.__kwdefaults__, "solver", alike)
    monkeypatch.setattr(SeveralSolution, "velocity", lambda _, points: jnp.sin(points))
    (tmp_path / "pair.toml").write_text(CASE[: CASE.index("[wall]")] + CASE[CASE.index("[wake]") :])
    out = tmp_path / "out"
    assert main(["study", "--quick", "--config", str(tmp_path / "pair.toml"), "--out", str(out)]) == 0
    names = {"maps.nc", "maps.png", "outwash.png", "summary.json", "report.md", "report.html"}
    assert {p.name for p in out.iterdir()} == names
    maps = netcdf.read(out / "maps.nc").vpbfsm_inflow.to_numpy()
    np.testing.assert_allclose(maps[0], maps[1], atol=1e-12)  # each in its own sense
    assert np.ptp(maps[0].mean(axis=1)) > 1e-5  # the other rotor's ground sources
    found = json.loads((out / "summary.json").read_text())
    assert found["converged"]
    assert np.ptp(found["mean_inflow"]["vpbfsm"]) < 1e-12
    assert "| 1 | 0, 1.2, 0 | cw |" in (out / "report.md").read_text()


def test_other_options_are_refused_beside_a_case(tmp_path, capsys):
    (tmp_path / "pair.toml").write_text(CASE)
    given = ["--config", str(tmp_path / "pair.toml"), "--heights", "1"]
    assert main(["study", "--out", str(tmp_path / "out"), *given]) == 2
    assert "--heights must be left out with --config" in capsys.readouterr().err
