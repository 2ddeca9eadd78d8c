"""The house: three floors, arrows down only. Every import counts, local and for type checking too."""

import ast
from functools import cache
from graphlib import TopologicalSorter
from pathlib import Path

import numpy as np
import pytest

PACKAGE = Path(__file__).parent.parent / "rotorjax"
FLOORS = (  # from the ground up; a room may import from lower floors, and from earlier rooms of its own
    ("errors", "checks", "device", "frames", "io"),
    ("ground", "region", "operating", "ode"),
    ("rotor", "panels", "potential"),
    ("inflow", "wake", "reference"),
    ("limits",),
    ("coupled_wake", "coupled"),
    ("bench",),
    ("trim", "calibration", "simulation", "linearisation", "deck", "sweep"),
    ("study", "validation"),
    ("api",),
    ("commands",),
    ("cli",),
)
ROOMS = [room for floor in FLOORS for room in floor]


def module_of(path: Path) -> str:
    return ".".join(("rotorjax", *path.relative_to(PACKAGE).with_suffix("").parts)).removesuffix(".__init__")


def room_of(module: str) -> str:
    return module.split(".")[1]


def named(path: Path) -> set[str]:
    """Everything that a file imports, by its full name, wherever in the file it does so."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.level == 0 and node.module:
            found |= {f"{node.module}.{alias.name}" for alias in node.names}
    return found


@cache
def imports() -> dict[str, set[str]]:
    """Modules of the package and the modules of the package that they import."""
    paths = {module_of(path): path for path in PACKAGE.rglob("*.py")}

    def module(name: str) -> str | None:
        return name if name in paths else (head if (head := name.rpartition(".")[0]) in paths else None)

    return {m: {t for n in named(path) if (t := module(n)) and t not in ("rotorjax", m)} for m, path in paths.items()}


def arrows(room: str) -> set[str]:
    """Rooms that a room imports from."""
    files = [m for m in imports() if m != "rotorjax" and room_of(m) == room]
    return {room_of(target) for m in files for target in imports()[m]} - {room}


def test_every_room_has_its_floor():
    assert {room_of(m) for m in imports() if m != "rotorjax"} == set(ROOMS)


@pytest.mark.parametrize("room", ROOMS)
def test_arrows_point_down(room):
    """An import of a later room, by any of its files, is an arrow up."""
    allowed = set(ROOMS[: ROOMS.index(room)])
    assert arrows(room) <= allowed


def test_the_potential_and_the_wake_do_not_know_each_other():
    assert "wake" not in arrows("potential")
    assert "potential" not in arrows("wake")


def test_what_ode_integrates_it_does_not_know():
    assert arrows("ode") <= {"errors", "checks", "io"}


def test_files_import_in_no_circle():
    """Raises CycleError with the circle."""
    list(TopologicalSorter(imports()).static_order())


def test_a_class_has_a_name_of_its_own():
    """One of each thing, and no name for two."""
    found = {}
    for path in PACKAGE.rglob("*.py"):
        for node in ast.parse(path.read_text(encoding="utf-8")).body:
            if isinstance(node, ast.ClassDef):
                found.setdefault(node.name, []).append(module_of(path))
    assert {name: modules for name, modules in found.items() if len(modules) > 1} == {}


def test_no_transform_of_xla():
    # it may wait for ever on a CPU: rotorjax/ode/fourier.py
    found = [path.name for path in PACKAGE.rglob("*.py") if "jnp.fft" in path.read_text(encoding="utf-8")]
    assert not found


def lines(function: ast.FunctionDef | ast.AsyncFunctionDef) -> int:
    """Lines from `def` to the end; the docstring does not count, decorators neither."""
    first = function.body[0]
    docstring = first.end_lineno - first.lineno + 1 if ast.get_docstring(function) is not None else 0
    return function.end_lineno - function.lineno + 1 - docstring


def lengths() -> dict[str, int]:
    """Every function of the package, nested ones and methods too, and its lines."""
    return {
        f"{path.relative_to(PACKAGE)}:{node.lineno} {node.name}": lines(node)
        for path in PACKAGE.rglob("*.py")
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)
    }


def test_functions_are_short():
    found = lengths()
    assert {name: n for name, n in found.items() if n > 45} == {}
    assert np.median(list(found.values())) <= 8
    assert np.percentile(list(found.values()), 90) <= 25


def test_few_arguments_are_told_apart_by_their_place():
    found = {}
    for path in PACKAGE.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
                names = [a.arg for a in node.args.posonlyargs + node.args.args if a.arg not in ("self", "cls")]
                found[f"{path.relative_to(PACKAGE)}:{node.lineno} {node.name}"] = len(names)
    assert {name: n for name, n in found.items() if n > 8} == {}
