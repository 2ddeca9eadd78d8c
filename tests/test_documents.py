"""Every code block of the README does what it says, in a fresh copy of the repository; every notebook runs."""

import importlib.util
import json
import os
import re
import shlex
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import matplotlib.pyplot as plt
import nbformat
import pytest
from browser import needs_browser, seen
from compiling import KERNEL
from nbclient import NotebookClient

import rotorjax as rj
from rotorjax import cli

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text()
BLOCKS = re.findall(r"```(sh|python)\n(.*?)```", README, re.DOTALL)
STUDY, TESTS, INFLOW, PYTHON = (text for _, text in BLOCKS)
NOTEBOOKS = sorted((ROOT / "notebooks").glob("*.ipynb"))
EXECUTED = ROOT / "build" / "notebooks"  # where the site finds them (docs/hooks.py)
PAGES = sorted((ROOT / "docs").rglob("*.md"))
PYTHON_BLOCK = re.compile(r"(?:<!-- not run: (.+) -->\n)?```python\n(.*?)```", re.DOTALL)
COMMAND = re.compile(r"^(?:\.venv/bin/)?rotorjax (.*)$", re.MULTILINE)


@pytest.fixture(scope="module")
def clone(tmp_path_factory):
    """The files that git tracks or would, without anything that was built."""
    listed = subprocess.run(
        ["git", "ls-files", "-co", "--exclude-standard"], cwd=ROOT, capture_output=True, text=True, check=True
    )
    folder = tmp_path_factory.mktemp("clone")
    for name in listed.stdout.split("\n"):
        if name and (ROOT / name).is_file():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(ROOT / name, folder / name)
    return folder


def sh(text, folder, *left_out):
    """Without what Python, pytest and `left_out` brought in. Modules are compiled where they are imported, not all that
    pip lays down.
    """
    left_out = ("PYTHON", "VIRTUAL_ENV", "PYTEST", *left_out)
    clean = {k: v for k, v in os.environ.items() if not k.startswith(left_out)} | {"PIP_NO_COMPILE": "no"}
    return subprocess.run(["sh", "-euc", text], cwd=folder, env=clean, capture_output=True, text=True, check=False)


def test_there_are_exactly_two_commands_to_begin_with():
    assert [line for _, text in BLOCKS for line in text.splitlines() if "-m venv" in line] == [
        STUDY.strip(),
        TESTS.strip(),
    ]


def test_ci_runs_the_readmes_test_command():
    assert TESTS.strip() in README
    script = (ROOT / ".ci" / "run").read_text()
    pattern = re.search(r'grep -E "(.*)" README.md', script)
    assert pattern is not None
    assert [line for line in README.splitlines() if re.search(pattern[1], line)] == [TESTS.strip()]
    assert TESTS.split(" && ")[-1].startswith(".venv/bin/pytest ")  # apart from what comes before, style beside it


@pytest.fixture(scope="module")
def studied(clone):
    """What the main command prints, and its folder `out`. The study runs longer than its programs are compiled."""
    return sh(STUDY, clone, "JAX_DISABLE_MOST_OPTIMIZATIONS"), clone / "out"


@pytest.mark.slow
def test_the_main_command_works_from_a_fresh_clone(clone, studied):
    run, out = studied
    assert run.returncode == 0, run.stderr[-2000:]
    # less inflow on the mountain side than on the valley side
    assert re.search(r"^\| Slope \|.*\| holds \|", (out / "report.md").read_text(), re.MULTILINE)
    for name in ("report.md", "summary.json", "cases.nc", "fig06.png", "overview.png"):
        assert (out / name).exists()
    inflow = sh(INFLOW, clone)
    assert inflow.returncode == 0, inflow.stderr[-2000:]
    assert (out / "inflow.png").exists()
    thrusts = [point["thrust_newton"] for point in json.loads((out / "inflow.json").read_text())["points"]]
    assert thrusts == sorted(thrusts, reverse=True)  # more near the ground


@pytest.mark.slow
@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
@pytest.mark.filterwarnings("ignore::DeprecationWarning")  # of the client's event loop, not of ours
def test_notebook_runs(path, studied, tmp_path):
    """From top to bottom, compiled as the tests are; where a notebook takes up the study, it finds the cases that the
    main command left.
    """
    shutil.copytree(studied[1] / "cases", tmp_path / "out" / "cases")
    notebook = nbformat.read(path, as_version=4)
    client = NotebookClient(
        notebook,
        timeout=900,
        kernel_name="python3",
        resources={"metadata": {"path": tmp_path}},
        extra_arguments=[f"--IPKernelApp.exec_lines={[KERNEL.format(tests=str(Path(__file__).parent))]!r}"],
    )
    client.execute()
    EXECUTED.mkdir(parents=True, exist_ok=True)
    nbformat.write(notebook, EXECUTED / path.name)
    pictures = [o for cell in notebook.cells for o in cell.get("outputs", []) if "image/png" in o.get("data", {})]
    assert pictures
    assert not any(cell.get("outputs") for cell in nbformat.read(path, as_version=4).cells)  # kept small


def run_blocks(page):
    """The Python blocks of a page that are to be run, as one text; the gallery's are scripts of their own."""
    blocks = PYTHON_BLOCK.findall(page.read_text())
    return "".join(text for not_run, text in blocks if not not_run and not text.startswith("--8<--"))


@pytest.fixture(scope="module")
def own_rotor(tmp_path_factory):
    """A folder with what `rotorjax new rotor mine` writes."""
    folder = tmp_path_factory.mktemp("own")
    assert cli.main(["new", "rotor", str(folder / "mine")]) == 0
    return folder


@pytest.mark.slow
@pytest.mark.parametrize("page", [p for p in PAGES if run_blocks(p)], ids=lambda p: p.stem)
def test_code_of_the_site_runs(page, own_rotor, monkeypatch, capsys):
    """Blocks of a page one after the other, as a reader would copy them; those marked "not run" say why."""
    monkeypatch.chdir(own_rotor)
    exec(compile(run_blocks(page), str(page), "exec"), {})
    assert "nan" not in capsys.readouterr().out


@pytest.mark.parametrize("page", [ROOT / "README.md", *PAGES], ids=lambda p: p.stem)
def test_commands_of_the_documents_are_commands(page):
    text = page.read_text()
    inline = [] if page.stem != "README" else re.findall(r"`(rotorjax [^`|]+)`", text)
    for line in COMMAND.findall("\n".join([*re.findall(r"```sh\n(.*?)```", text, re.DOTALL), *inline])):
        cli.parsed(shlex.split(line))


def test_python_example(capsys):
    exec(compile(PYTHON, "README.md", "exec"), {})
    thrust, slope = re.fullmatch(r"([\d.]+) kN, dC_T/dh = (\S+)\n", capsys.readouterr().out).groups()
    assert 60 < float(thrust) < 100
    assert -0.01 < float(slope) < -1e-4


def test_files_that_the_readme_names_exist():
    for name in re.findall(r"`((?:notebooks|rotorjax)/[\w./]+)`|\]\(([\w./-]+)\)", README):
        assert (ROOT / (name[0] or name[1])).exists(), name


def test_the_badges_are_true():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    told = re.findall(r'class="value">([^<]+)<', (ROOT / "docs" / "assets" / "badges.svg").read_text())
    assert told == [project["requires-python"].replace(">=", "≥ "), rj.__version__, project["license"]]


def lines_of(script):
    """The lines that do something: neither blank nor an import."""
    return [line for line in script.read_text().splitlines() if line and not line.startswith(("import ", "from "))]


def test_the_gallery_is_whole():
    """Every script has its picture and its place, in ten lines and sixty kilobytes."""
    folder = ROOT / "docs" / "gallery"
    scripts = [path for path in folder.glob("*.py") if path.name != "run.py"]
    page = (folder / "index.md").read_text()
    assert len(scripts) == 20
    assert {path.stem for path in scripts} == {path.stem for path in folder.glob("*.webp")}
    for script in scripts:
        assert len(lines_of(script)) <= 10, script
        assert (folder / f"{script.stem}.webp").stat().st_size <= 60_000
        assert f'"docs/gallery/{script.name}"' in page


@pytest.mark.slow
@pytest.mark.parametrize("name", ["blade", "airfoil", "heights"])
@pytest.mark.filterwarnings("ignore:FigureCanvasAgg is non-interactive")
def test_a_picture_of_the_gallery_is_drawn(name):
    """The cheapest; all of them by `python docs/gallery/run.py`."""
    spec = importlib.util.spec_from_file_location("gallery", ROOT / "docs" / "gallery" / "run.py")
    gallery = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(gallery)
    assert 3_000 < len(gallery.webp(gallery.figure_of(gallery.scripts()[name]))) <= gallery.MOST
    plt.close("all")


def test_every_name_of_the_door_is_documented():
    page = (ROOT / "docs" / "api" / "index.md").read_text()
    assert set(re.findall(r'heading: "rj\.(\w+)"', page)) == set(rj.__all__)


def test_every_page_is_in_the_navigation():
    """What mkdocs would only mention."""
    listed = set(re.findall(r": ([\w/.-]+\.md)$", (ROOT / "mkdocs.yml").read_text(), re.MULTILINE))
    made = {f"tutorials/{path.stem}.md" for path in NOTEBOOKS}
    listed |= set(re.findall(r"- ([\w/.-]+\.md)$", (ROOT / "mkdocs.yml").read_text(), re.MULTILINE))
    assert made <= listed
    assert listed - made == {str(path.relative_to(ROOT / "docs")) for path in PAGES}


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """The documentation, built strictly: a broken link or name is a failure. Notebooks as the tests left them."""
    folder = tmp_path_factory.mktemp("docs") / "site"
    env = os.environ | {"ROTORJAX_DOCS_EXECUTE": "0", "NO_MKDOCS_2_WARNING": "1"}
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--quiet", "--site-dir", str(folder)]
    built = subprocess.run(command, cwd=ROOT, env=env, capture_output=True, text=True, check=False)
    assert built.returncode == 0, built.stderr[-4000:]
    return folder


@pytest.mark.slow
def test_the_site_asks_nothing_of_the_network(site):
    fetched = re.compile(r"""<(?:script|img|iframe|source)[^>]* src=["']?https?:|<link[^>]* href=["']?https?:""")
    pages = list(site.rglob("*.html"))
    assert len(pages) > 40
    for page in pages:
        assert not fetched.search(page.read_text(encoding="utf-8")), page
    assert "<math" in (site / "theory" / "ground.html").read_text(encoding="utf-8")


@pytest.mark.slow
@needs_browser
def test_the_site_opens_from_a_file(site, tmp_path):
    picture, said = seen(site / "theory" / "free-wake.html", tmp_path)
    assert said == []
    assert picture.std() > 0.1
