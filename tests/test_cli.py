"""The command line end to end with made-up wakes; bad input is one line and exit code 2."""

import json
import math
import os
import subprocess
import sys
from pathlib import Path

import pytest
from wakes import fails_at, made_up

from rotorjax.bench.single import single_case
from rotorjax.cli import HAS_OLDER_WAY, WITHOUT_FREE_WAKE, main
from rotorjax.io import netcdf
from rotorjax.study.run import solve_cases
from tests.browser import opens


@pytest.fixture
def solver(monkeypatch):
    def use(solver):
        for function in (solve_cases, single_case):
            monkeypatch.setitem(function.__kwdefaults__, "solver", solver)

    use(made_up)
    return use


def keys(entry):
    return {name: sorted(value) if isinstance(value, dict) else None for name, value in entry.items()}


def test_study_writes_everything_and_says_where(tmp_path, solver, capsys):
    out = tmp_path / "out"
    assert main(["study", "--out", str(out), "--quick"]) == 0
    assert "5 cases" in capsys.readouterr().out
    assert {p.name for p in out.iterdir()} >= {
        "report.md",
        "summary.json",
        "cases.nc",
        "cases",
        "fig06.png",
        "fig12.png",
    }
    assert not list(out.glob("*.pdf"))  # a first look needs none
    assert opens(out / "report.html", tmp_path)
    assert sorted(p.stem for p in (out / "cases").iterdir()) == ["h1", "h1-slope15", "h1.5", "h2", "oge"]


def test_a_diverged_case_gives_exit_code_1(tmp_path, solver, capsys):
    solver(fails_at((2.0, 0.0)))
    assert main(["study", "--out", str(tmp_path), "--heights", "2", "1", "--slopes", "--rigid"]) == 1
    assert "not converged: h = 2" in capsys.readouterr().out
    assert (tmp_path / "fig06.pdf").exists()
    text = (tmp_path / "report.md").read_text()
    assert "**Not converged:** h2 (made up to fail)" in text
    summary = json.loads((tmp_path / "summary.json").read_text())
    assert [case["free_wake"]["converged"] for case in summary["cases"]] == [True, False, True]


def test_an_interrupt_leaves_whole_files_and_code_130(tmp_path, solver, capsys):
    def interrupted(model, start, progress):
        if model.ground is not None:
            raise KeyboardInterrupt
        return made_up(model, start, progress)

    solver(interrupted)
    assert main(["study", "--out", str(tmp_path), "--quick"]) == 130
    assert "finished cases are kept, and the same command continues" in capsys.readouterr().err
    for path in (tmp_path / "cases").iterdir():
        netcdf.read(path)


def test_inflow_of_both_models_has_the_keys_of_a_study_case(tmp_path, solver, capsys):
    main(["study", "--out", str(tmp_path), "--heights", "1", "--slopes", "--rigid"])
    entry = json.loads((tmp_path / "summary.json").read_text())["cases"][1]
    files = {name: str(tmp_path / "one" / f"a.{name}") for name in ("json", "png", "nc")}
    arguments = ["--height", "1", "--json", files["json"], "--plot", files["png"], "--netcdf", files["nc"]]
    assert main(["inflow", *arguments]) == 0
    ours = json.loads(Path(files["json"]).read_text())
    assert keys(ours) == keys(entry)
    assert ours["inflow_rms_difference"] == pytest.approx(entry["inflow_rms_difference"])
    assert "vpbfsm_inflow" in netcdf.read(files["nc"])
    assert os.path.getsize(files["png"]) > 1000
    assert "mean inflow/ΩR, VPBFSM" in capsys.readouterr().out


def test_inflow_on_a_slope_with_the_finite_state_model_alone(tmp_path, capsys):
    path = tmp_path / "a.json"
    picture = tmp_path / "a.pdf"
    arguments = ["--height", "1", "--slope", "15", "--json", str(path), "--plot", str(picture)]
    assert main(["inflow", "--model", "vpbfsm", *arguments]) == 0
    found = json.loads(path.read_text())
    assert found["free_wake"] is None
    assert 0.004 < found["vpbfsm"]["CT"] < 0.012
    assert found["vpbfsm"]["ground_normal_velocity_rms"] < 0.03
    assert "mountain" in capsys.readouterr().out


def test_several_heights_are_a_curve(tmp_path, solver, capsys):
    file, picture = tmp_path / "a.json", tmp_path / "a.png"
    heights = ["--height", "1", "2", "--model", "freewake"]
    assert main(["inflow", *heights, "--json", str(file), "--plot", str(picture)]) == 0
    points = json.loads(file.read_text())["points"]
    assert [(p["model"], p["height"]) for p in points] == [("freewake", 1), ("freewake", 2)]
    assert points[0]["thrust_newton"] == pytest.approx(
        points[0]["CT"] * 1.225 * math.pi * 8.1778**2 * 220.8**2, rel=1e-3
    )
    assert picture.stat().st_size > 10_000
    assert "thrust, N" in capsys.readouterr().out


BAD = {
    "inflow --height 1 2 --html a.html": "--html goes with one height, but --height has 2",
    "inflow --height 1 0.2": "height",
    "inflow --height 0.5 --slope 30": "but is 0.5",
    "inflow --height 0": "but is 0.0",
    "inflow --height -1": "but is -1.0",
    "inflow --height nan": "but is nan",
    "inflow --height 3 --slope 60": "but is 60.0",
    "inflow --slope 5": "`height` must be given",
    "inflow --rotor uh61": "did you mean 'uh60'",
    "inflow --rotor missing.toml": "missing.toml",
    "inflow --collective 100": "but is 100",
    "inflow --climb 0.02 --height 1": "--climb must be 0 over ground",
    "inflow --harmonics 9 --height 1": "but is 9",
    "inflow --plot a.doc": "but is 'a.doc'",
    "inflow --model other": "invalid choice: 'other'",
    "inflow --height x": "invalid float value: 'x'",
    "linearise --out {tmp} --order=--": "argument --order: expected a value",
    "study --out {tmp} --heights=--": "argument --heights: expected a value",
    "inflow --json {tmp}": "must be a file, but is a folder",
    "inflow --netcdf {tmp}/file/a.nc": "must be writable",
    "trim --thrust-coefficient 0.006 --json {tmp}": "must be a file, but is a folder",
    f"inflow --json {'x' * 300}": "File name too long",
    f"inflow --rotor {'x' * 300}.toml": "File name too long",
    "study": "--out",
    "study --out {tmp}/file/out": "must be writable",
    "study --out {tmp}/out --heights 0": "but is 0.0",
    "study --out {tmp}/out --slopes 46": "must exceed tan",
    "study --out {tmp}/out --rotor {tmp}/misspelt.toml": "did you mean 'radius'",
    "study --out {tmp}/out --rotor {tmp}/gap.toml": "gap.csv",
    f"calibrate freewake --cases {'x' * 300} --out {{tmp}}/out": "File name too long",
    f"simulate --case {'x' * 300} --out {{tmp}}/out": "File name too long",
    "inflow --rotor {tmp}/pipe.toml": "pipe.toml: the path must be a file, but is a pipe",
    "inflow --rotor {tmp}/zero.toml": "zero.toml: the path must be a file, but is a device",
    "inflow --calibration {tmp}/pipe.toml": "but is a pipe",
    "simulate --case {tmp}/zero.toml --out {tmp}/out": "but is a device",
    "simulate --case {tmp}/flight.toml --out {tmp}/out --real-time": 'must come with inflow = "freewake"',
    "deck --case {tmp}/pipe.toml --out {tmp}/out": "but is a pipe",
    "unknown": "unknown",
    "": "COMMAND",
}


@pytest.mark.parametrize("line", BAD)
def test_bad_input_is_one_line_and_exit_code_2(line, tmp_path, capsys):
    (tmp_path / "file").write_text("")
    os.mkfifo(tmp_path / "pipe.toml")
    (tmp_path / "zero.toml").symlink_to("/dev/zero")
    (tmp_path / "misspelt.toml").write_text(ROTOR.replace("radius", "radus"))
    (tmp_path / "gap.toml").write_text(ROTOR)
    (tmp_path / "flight.toml").write_text("[flight]\nthrust_coefficient = 0.006\n[time]\nduration = 1.0\n")
    (tmp_path / "gap.csv").write_text("alpha_deg,cl,cd\n-180,0,0\n0,,0.01\n180,0,0\n")
    try:
        code = main(line.format(tmp=tmp_path).split())
    except SystemExit as stop:
        code = stop.code
    printed = capsys.readouterr()
    assert code == 2
    assert printed.out == ""
    assert len(printed.err.strip().splitlines()) == 1
    assert BAD[line] in printed.err


ROTOR = """
[rotor]
name = "mine"
blades = 2
radius = 1.0
root_cutout = 0.1
chord = 0.1
[airfoil]
file = "gap.csv"
[operating]
rpm = 600.0
collective_deg = 8.0
"""


def test_the_program_itself_needs_no_settings(tmp_path):
    run = subprocess.run(
        [sys.executable, "-m", "rotorjax.cli", "--version"], capture_output=True, text=True, cwd=tmp_path, check=True
    )
    assert run.stdout.startswith("rotorjax 0.")


def program(*arguments, **more):
    """The program in a process of its own, as a user starts it."""
    command = [sys.executable, "-m", "rotorjax.cli", *arguments]
    return subprocess.run(command, capture_output=True, check=False, env=os.environ | more)


def test_compiled_programs_are_kept_for_the_next_run(tmp_path):
    """In the user's cache folder, unless JAX is told another."""
    code = "import jax; from rotorjax import cli; cli._set_up_jax(); print(jax.config.jax_compilation_cache_dir)"

    def folder(**more):
        env = {key: value for key, value in os.environ.items() if not key.startswith("JAX_")} | more
        return subprocess.run([sys.executable, "-c", code], env=env, capture_output=True, text=True, check=True).stdout

    assert Path(folder(XDG_CACHE_HOME=str(tmp_path)).strip()).parent == tmp_path / "rotorjax" / "programs"
    assert folder(JAX_COMPILATION_CACHE_DIR="elsewhere").strip() == "elsewhere"


FLAGS = """
import sys, os
from rotorjax import cli
from rotorjax.commands import inflow, trim
inflow.run = trim.run = lambda _: print("FLAGS", os.environ["XLA_FLAGS"]) or 0
cli.main(sys.argv[1:])
"""


@pytest.mark.parametrize(
    ("line", "quick"),
    [("inflow", False), ("inflow --model vpbfsm", True), ("trim --thrust-coefficient 0.006", True)],
)
def test_only_what_solves_no_free_wake_is_compiled_the_older_way(line, quick):
    env = {k: v for k, v in os.environ.items() if k != "XLA_FLAGS"} | {"XLA_FLAGS": "--xla_cpu_enable_fast_math=false"}
    run = subprocess.run(
        [sys.executable, "-c", FLAGS, *line.split()], env=env, capture_output=True, text=True, check=True
    )
    flags = run.stdout.split()[1:]
    assert flags[-1] == "--xla_cpu_enable_fast_math=false"  # the user's own count
    assert (WITHOUT_FREE_WAKE in flags) == (quick and HAS_OLDER_WAY)


@pytest.mark.parametrize("encoding", ["latin-1", "cp1252", "ascii"])
def test_terminals_without_greek_letters_are_spelt_to(encoding):
    run = program("inflow", "--help", PYTHONIOENCODING=encoding)
    assert run.returncode == 0
    assert "climb velocity over OmegaR" in run.stdout.decode(encoding)


def test_help_needs_no_library():
    code = "import sys; from rotorjax.cli import parser; parser().format_help(); print(*sys.modules)"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert {"jax", "numpy", "scipy", "matplotlib", "xarray"}.isdisjoint(run.stdout.split())


def fails_with(error):
    def solver(model, start, progress):
        raise error

    return solver


def test_a_fault_of_ours_has_a_code_of_its_own_and_says_where(solver, capsys, monkeypatch):
    solver(fails_with(TypeError("unhashable\ntype")))
    assert main(["inflow"]) == 70
    told = capsys.readouterr().err
    assert "internal error: TypeError: unhashable type (test_cli.py:" in told
    assert "Traceback" not in told
    assert "please report it" in told
    monkeypatch.setenv("ROTORJAX_TRACEBACK", "1")
    assert main(["inflow"]) == 70
    assert "Traceback" in capsys.readouterr().err


def test_only_a_study_says_that_it_keeps_cases(solver, capsys):
    solver(fails_with(KeyboardInterrupt()))
    assert main(["inflow"]) == 130
    assert capsys.readouterr().err.strip().endswith("rotorjax inflow: interrupted")


LONG = "from rotorjax.commands import inflow; inflow.run = lambda _: print('x' * 2**20) or 0\n"


def test_a_reader_that_has_gone_is_no_fault():
    code = f"{LONG}from rotorjax.cli import main\nraise SystemExit(main(['inflow']))"
    line = f'{sys.executable} -c "{code}" | true; echo ${{PIPESTATUS[0]}}'
    run = subprocess.run(["bash", "-c", line], capture_output=True, text=True, check=True)
    assert run.stdout.strip() == "141"
    assert "Traceback" not in run.stderr
