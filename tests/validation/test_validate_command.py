"""`rotorjax validate` end to end with made-up wakes; bad input is one line and exit code 2."""

import json

import matplotlib.image
import pytest
from wakes import fails_at, made_up

from rotorjax.cli import main
from rotorjax.validation import momentum
from rotorjax.validation.run import validate
from tests.browser import opens


@pytest.fixture
def solver(monkeypatch):
    def use(solver):
        monkeypatch.setitem(validate.__kwdefaults__, "solver", solver)

    use(made_up)
    monkeypatch.setattr(momentum, "disk_inflow", lambda solution: solution.mean_inflow)  # no wake to read it off
    return use


def test_one_case_writes_everything(tmp_path, solver, capsys):
    out = tmp_path / "out"
    assert main(["validate", "--out", str(out), "--quick", "--case", "momentum"]) == 1  # made up: no momentum theory
    names = {"validation.json", "validation.md", "validation.html", "momentum.png", "momentum.pdf"}
    assert {p.name for p in out.iterdir()} == names
    assert opens(out / "validation.html", tmp_path)
    found = json.loads((out / "validation.json").read_text())
    verdicts = [row["verdict"] for row in found["rows"]]
    assert found["out"] == verdicts.count("out") > 0
    assert found["met"] + found["out"] == len(verdicts)
    assert {wake["rotor"] for wake in found["wakes"]} == {"caradonna_tung"}  # one rotor, few programs to compile
    assert found["settings"]["wake.panels"] == 12
    text = (out / "validation.md").read_text()
    assert f"{found['met']} of {len(verdicts)} rows are met" in text
    assert text.count("**out**") == found["out"]
    assert matplotlib.image.imread(out / "momentum.png").std() > 0.05
    assert f"{found['met']} of {len(verdicts)} rows met" in capsys.readouterr().out


def test_rows_that_are_all_met_give_exit_code_0(tmp_path, solver):
    def ideal(model, start=None, progress=None):
        from dataclasses import replace

        solution = made_up(model, start, progress)
        return replace(
            solution,
            mean_inflow=(solution.CT / 2) ** 0.5,
            CP_induced=1.1 * solution.CT**1.5 / 2**0.5,
        )

    solver(ideal)
    arguments = ["--case", "momentum", "--rotor", "elliott_althoff", "--collective", "9"]
    assert main(["validate", "--out", str(tmp_path), *arguments]) == 0
    found = json.loads((tmp_path / "validation.json").read_text())
    assert [row["verdict"] for row in found["rows"]] == ["met"] * 2
    assert found["wakes"][0]["collective_deg"] == 9


def test_a_wake_that_does_not_converge_takes_its_rows_out(tmp_path, solver):
    solver(fails_at(None))
    arguments = ["--case", "momentum", "--rotor", "uh60", "--quick"]
    assert main(["validate", "--out", str(tmp_path), *arguments]) == 1
    found = json.loads((tmp_path / "validation.json").read_text())
    assert {row["verdict"] for row in found["rows"]} == {"out"}
    assert all(row["ours"] is None and "not converged: uh60 18°" in row["note"] for row in found["rows"])
    assert "**Not converged:** uh60 18°, OGE" in (tmp_path / "validation.md").read_text()


BAD = {
    "validate": "--out",
    "validate --out {tmp}/file/out": "must be writable",
    "validate --out {tmp}/out --case grond": "did you mean 'ground'",
    "validate --out {tmp}/out --collective 8": "must come with a rotor",
    "validate --out {tmp}/out --rotor uh61": "did you mean 'uh60'",
    "validate --out {tmp}/out --rotor uh60 --collective 100": "but is 100",
    "validate --out {tmp}/out --rotor uh60 --case caradonna-tung": "rotor of one's own",
}


@pytest.mark.parametrize("line", BAD)
def test_bad_input_is_one_line_and_exit_code_2(line, tmp_path, capsys):
    (tmp_path / "file").write_text("")
    try:
        code = main(line.format(tmp=tmp_path).split())
    except SystemExit as stop:
        code = stop.code
    printed = capsys.readouterr()
    assert code == 2
    assert len(printed.err.strip().splitlines()) == 1
    assert BAD[line] in printed.err
    assert not (tmp_path / "out").exists()
