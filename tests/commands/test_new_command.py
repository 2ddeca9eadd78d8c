"""`rotorjax new` and `doctor`: what is written runs unchanged, and nothing is replaced."""

import json
import subprocess
import tomllib

import pytest

from rotorjax.cli import main
from rotorjax.commands.new import TRY


def command(kind, folder):
    return TRY[kind].format(folder).split()[1:]


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["rotor", "simulate", "deck"])
def test_what_is_written_runs_as_it_is_told(kind, tmp_path, capsys, monkeypatch):
    """With fewer looks at the deck and no pictures, which test_deck_command.py draws."""
    monkeypatch.setattr("rotorjax.deck.run.FRAMES", 6)
    monkeypatch.setattr("rotorjax.bench.plotting.save", lambda figure, stem: [])
    folder = tmp_path / "mine"
    assert main(["new", kind, str(folder)]) == 0
    printed = capsys.readouterr().out
    assert f"try: {TRY[kind].format(folder)}" in printed
    assert main(command(kind, folder)) == 0
    if kind == "rotor":
        assert "three blades: 3 blades, R = 4 m" in capsys.readouterr().out
    else:
        assert json.loads((folder / "out" / "report.json").read_text())["histories"]


def test_a_sweep_is_read_and_shows_every_key(tmp_path):
    """tests/sweep runs one like it."""
    from rotorjax.sweep.case import SCHEMA, read_case

    assert main(["new", "sweep", str(tmp_path)]) == 0
    assert [axis.name for axis in read_case(tmp_path / "case.toml").axes] == ["height", "slope_deg"]
    text = (tmp_path / "case.toml").read_text()
    shown = {**SCHEMA["case"], **SCHEMA["design"]}
    assert not [key for key in shown if key not in text]


@pytest.mark.parametrize("kind", ["gust", "freewake"])
def test_what_takes_longer_is_read_and_allowed(kind, tmp_path):
    from rotorjax.simulation.case import read_case
    from rotorjax.wake.settings import wake_settings

    assert main(["new", kind, str(tmp_path)]) == 0
    case = read_case(tmp_path / "case.toml")
    assert case.request.inflow == {"gust": "vpbfsm", "freewake": "freewake"}[kind]
    if kind == "freewake":
        assert wake_settings(**case.wake).panels == 8


def test_every_key_of_a_rotor_file_is_shown(tmp_path):
    from rotorjax.rotor.rotor_file import SCHEMA

    assert main(["new", "rotor", str(tmp_path)]) == 0
    text = (tmp_path / "rotor.toml").read_text()
    missing = [key for table in SCHEMA.values() for key in table if key not in text]
    assert not missing


def test_nothing_is_replaced(tmp_path, capsys):
    (tmp_path / "case.toml").write_text("mine")
    assert main(["new", "deck", str(tmp_path)]) == 2
    assert "case.toml: is there already and is not replaced" in capsys.readouterr().err
    assert (tmp_path / "case.toml").read_text() == "mine"


def test_without_a_folder_it_is_printed(capsys):
    assert main(["new", "deck"]) == 0
    assert tomllib.loads(capsys.readouterr().out)["rotor"]["name"] == "uh60"
    assert main(["new", "rotor"]) == 2
    assert "refers to naca0012_sandia.csv" in capsys.readouterr().err


def test_bash_completes_commands_options_and_files(tmp_path, capsys):
    assert main(["completion", "bash"]) == 0
    script = tmp_path / "rotorjax.bash"
    script.write_text(capsys.readouterr().out)
    (tmp_path / "case.toml").touch()

    def completed(*words):
        ask = (
            f"source {script}; COMP_WORDS=({' '.join(words)}); COMP_CWORD={len(words) - 1}; "
            '_shtab_rotorjax; echo "${COMPREPLY[@]}"'
        )
        return subprocess.run(
            ["bash", "-c", ask], capture_output=True, text=True, check=True, cwd=tmp_path
        ).stdout.split()

    assert completed("rotorjax", "li") == ["linearise"]
    assert completed("rotorjax", "trim", "--thrust") == ["--thrust-coefficient"]
    assert completed("rotorjax", "new", "si") == ["simulate"]
    assert "case.toml" in completed("rotorjax", "deck", "--case", "ca")


def test_doctor_tells_what_a_report_needs(capsys):
    assert main(["doctor"]) == 0
    told = capsys.readouterr().out
    for name in ("rotorjax", "packages", "devices", "cores", "precision", "compiler"):
        assert f"\n{name}" in f"\n{told}"
    assert told.rstrip().endswith("right")
