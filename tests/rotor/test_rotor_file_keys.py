"""No key of a rotor file is accepted without effect: random combinations of all keys, each taken away in turn."""

from pathlib import Path
from random import Random

import jax
import numpy as np
import pytest

from rotorjax.errors import InputError
from rotorjax.rotor import catalogue, geometry
from rotorjax.rotor.rotor_file import SCHEMA

REPORTS = Path(__file__).parents[1] / "data" / "reports"
NEEDED = {"rotor": 'name = "T"\nblades = 2\nradius = 1.0\nroot_cutout = 0.15\nchord = 0.08\n'}
NEEDED |= {"airfoil": "", "operating": "rpm = 1200.0\ncollective_deg = 8.0\n"}
NEEDED |= {"hinge": "offset = 0.05\nblade_mass = 1.2\nfirst_moment = 0.55\nflap_inertia = 0.33\n"}
FURTHER = {
    "rotor": {
        "tip_loss": ["0.96"],
        "twist_deg": ["{ r = [0.0, 1.0], value = [4.0, -4.0] }"],
        "linear_twist_deg": ["-8.0"],
        "sweep_deg": ["5.0"],
        "rotation": ['"clockwise"'],
    },
    "airfoil": {
        "name": ['"a"'],
        "file": ['"full.csv"', '"short.csv"', '"half.csv"', '"limited.C81"'],
        "lift_file": ['"cl.csv"'],
        "drag_file": ['"cd.csv"'],
        "full_range_file": ['"full.csv"'],
        "full_range": ['"flat plate"'],
        "symmetric": ["true"],
        "prandtl_glauert": ["true"],
    },
    "operating": {
        "density": ["1.1"],
        "sound_speed": ["300.0"],
        "viscosity": ["2e-5"],
        "climb": ["1.0"],
    },
    "hinge": {
        "delta3_deg": ["5.0"],
        "precone_deg": ["2.0"],
        "flap_spring": ["3.0"],
        "lag_spring": ["4.0"],
        "lag_damper_file": ['"damper.csv"'],
        "lag_damper_arm": ["0.1"],
    },
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("keys")
    for name in ("full.csv", "limited.C81", "damper.csv"):
        (folder / name).write_bytes((REPORTS / "keys_ignored" / name).read_bytes())
    rows = [line.split(",") for line in (folder / "full.csv").read_text().split()]
    half = [row for row in rows[1:] if float(row[0]) >= 0]
    half[0][1] = half[-1][1] = "0"
    short = [row for row in rows[1:] if abs(float(row[0])) <= 12]
    for name, head, body in (("half.csv", rows[0], half), ("short.csv", rows[0], short)):
        (folder / name).write_text("\n".join(",".join(row) for row in [head, *body]) + "\n")
    for name, column in (("cl.csv", 1), ("cd.csv", 2)):
        body = [f"{row[0]},{row[column]},{row[column]}" for row in short]
        (folder / name).write_text("\n".join(["alpha_deg,0.0,0.9", *body]) + "\n")
    return folder


def load(folder, tables):
    text = "".join(
        f"[{table}]\n{NEEDED[table]}" + "".join(f"{key} = {value}\n" for key, value in keys.items())
        for table, keys in tables.items()
    )
    (folder / "rotor.toml").write_text(text)
    return catalogue.load(folder / "rotor.toml")


def same(a, b):
    (a, a_way), (b, b_way) = jax.tree.flatten(a), jax.tree.flatten(b)
    return a_way == b_way and all(np.array_equal(x, y) for x, y in zip(a, b, strict=True))


def combinations(rng):
    """Tables with a random choice of the further keys, each with one of its values."""
    tables = {}
    for table, keys in FURTHER.items():
        if table != "hinge" or rng.random() < 0.5:
            chosen = [key for key in keys if rng.random() < 0.45]
            tables[table] = {key: rng.choice(keys[key]) for key in chosen}
    if rng.random() < 0.8:  # most files are of one table or of two
        for key in ("lift_file", "drag_file"):
            tables["airfoil"].pop(key, None)
        tables["airfoil"]["file"] = rng.choice(FURTHER["airfoil"]["file"])
    return tables


def test_all_keys_are_here():
    for table, keys in SCHEMA.items():
        assert {key for key, what in keys.items() if not what.required} == set(FURTHER[table])


def test_a_rotor_without_a_tip_loss_has_the_one_of_most(folder):
    rotor, _ = load(folder, {"rotor": {}, "airfoil": {"file": '"full.csv"'}, "operating": {}})
    assert float(rotor.tip_loss) == geometry.TIP_LOSS


def test_every_key_that_is_accepted_has_an_effect(folder):
    rng, accepted = Random(0), 0
    for _ in range(200):
        tables = combinations(rng)
        try:
            whole = load(folder, tables)
        except InputError:
            continue
        accepted += 1
        for table, key in [(table, key) for table, keys in tables.items() for key in keys]:
            if key == "symmetric" and tables["airfoil"].get("file") in ('"full.csv"', '"short.csv"', '"limited.C81"'):
                continue  # a claim about both sides, which is checked
            less = {t: {k: v for k, v in keys.items() if (t, k) != (table, key)} for t, keys in tables.items()}
            try:
                without = load(folder, less)
            except InputError:
                continue
            assert not same(whole, without), f"[{table}] {key} has no effect in {tables}"
    assert accepted > 15
