"""`rotorjax new`: a folder to begin with, every line of it explained and ready to run."""

import argparse
from pathlib import Path

PACKAGE = Path(__file__).parent.parent
WITH = {"rotor": (PACKAGE / "rotor" / "data" / "naca0012_sandia.csv",)}  # what an example's files refer to
TRY = {
    "rotor": "rotorjax inflow --rotor {}/rotor.toml --model vpbfsm --height 1",
    "simulate": "rotorjax simulate --case {0}/case.toml --out {0}/out",
    "gust": "rotorjax simulate --case {0}/case.toml --out {0}/out",
    "freewake": "rotorjax simulate --case {0}/case.toml --out {0}/out",
    "sweep": "rotorjax sweep --case {0}/case.toml --out {0}/out --table {0}/out/table.txt",
    "several": "rotorjax study --quick --config {0}/case.toml --out {0}/out",
    "deck": "rotorjax deck --case {0}/case.toml --out {0}/out",
}


def register(commands: argparse._SubParsersAction) -> None:
    """Add the command."""
    parser = commands.add_parser(
        "new",
        help="a rotor or a case to begin with",
        description="Write a commented rotor file or case and say how to run it: rotor (three blades, every key), "
        "simulate (a step of collective close to the ground), gust, freewake (a step with the free wake), sweep "
        "(heights and slopes), several (two rotors beside a hangar), deck (a landing). Files that are there are not "
        "replaced. Without a folder a case is printed.",
    )
    parser.add_argument("kind", choices=tuple(TRY), help="what to write")
    parser.add_argument("folder", nargs="?", type=Path, metavar="DIR", help="where (none: to the screen)")
    parser.set_defaults(run=run, free_wake=lambda _: False)


def run(chosen: argparse.Namespace) -> int:
    """Write the files; the exit code."""
    from rotorjax.errors import InputError
    from rotorjax.io.atomic import make_folder, write_bytes

    (case,) = (PACKAGE / "examples" / chosen.kind).glob("*.toml")
    if chosen.folder is None and chosen.kind in WITH:
        others = ", ".join(file.name for file in WITH[chosen.kind])
        raise InputError(f"Argument `DIR` must be given with {chosen.kind}, whose file refers to {others} beside it")
    if chosen.folder is None:
        print(case.read_text(encoding="utf-8"), end="")
        return 0
    files = (case, *WITH.get(chosen.kind, ()))
    for file in files:
        if (there := chosen.folder / file.name).exists():
            raise InputError(f"{there}: is there already and is not replaced; take another folder than {chosen.folder}")
    folder = make_folder(chosen.folder)
    for file in files:
        write_bytes(folder / file.name, file.read_bytes())
        print(f"written: {folder / file.name}")
    print(f"try: {TRY[chosen.kind].format(folder)}")
    return 0
