"""`rotorjax validate`: the free wake against measurements and theory, row by row with verdicts."""

import argparse
from pathlib import Path


def register(commands: argparse._SubParsersAction) -> None:
    """Add the command."""
    parser = commands.add_parser(
        "validate",
        help="the free wake against measurements and theory",
        description="Solve hover and ground effect with one set of settings and compare with Caradonna and Tung, "
        "momentum theory, Landgrebe, Hayden, Cheeseman and Bennett and finer grids; write validation.json, "
        "validation.md and pictures. Exit code 1 where a row is out.",
    )
    parser.add_argument("--out", required=True, type=Path, metavar="DIR", help="folder for all results")
    parser.add_argument(
        "--case",
        nargs="+",
        metavar="NAME",
        help="only these cases (all that suit the rotor but `coaxial`, a pair that takes minutes)",
    )
    parser.add_argument("--quick", action="store_true", help="fewer cases, coarser free wake")
    parser.add_argument(
        "--rotor", metavar="NAME|FILE", help="another rotor, catalogue name or TOML file, in every case"
    )
    parser.add_argument("--collective", type=float, metavar="DEG", help="its collective pitch (the rotor file's)")
    parser.add_argument(
        "--measured",
        type=Path,
        metavar="FILE",
        help="with --case coaxial: your own CSV of measured points, columns rotors (single or pair), CT and CQ",
    )
    parser.set_defaults(run=run)


def run(chosen: argparse.Namespace) -> int:
    """Validate and write; the exit code."""
    from rotorjax.io.atomic import make_folder
    from rotorjax.validation.case import Subject
    from rotorjax.validation.cases import chosen_cases
    from rotorjax.validation.coaxial import read_measured
    from rotorjax.validation.output import write
    from rotorjax.validation.run import validate

    measured = None if chosen.measured is None else read_measured(chosen.measured)
    subject = Subject(chosen.rotor, chosen.collective, chosen.quick, measured)
    cases = chosen_cases(chosen.case, subject)
    for case in cases:
        for at in case.points(subject)[:1]:
            at.settings(subject.quick)  # what cannot be had is refused before the folder is made
    out = make_folder(chosen.out)
    found = validate(cases, subject)
    write(found, out)
    for row in found.out:
        print(f"out: {row.case}: {row.quantity}: {row.ours:.4g}, allowed {row.limits.low:.4g} to {row.limits.high:.4g}")
    print(
        f"{len(found.rows) - len(found.out)} of {len(found.rows)} rows met in {found.wall_time_s:.0f} s: "
        f"{out / 'validation.md'}"
    )
    return 1 if found.out else 0
