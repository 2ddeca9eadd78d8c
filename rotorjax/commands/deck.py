"""`rotorjax deck`: a rotor over a heaving, pitching deck, with or without an edge."""

import argparse
import sys
from pathlib import Path


def register(commands: argparse._SubParsersAction) -> None:
    """Add the command."""
    parser = commands.add_parser(
        "deck",
        help="a rotor over a moving deck",
        description="Simulate a rotor over a heaving, pitching deck with the dynamic finite-state model and write "
        "history.nc, report.html, report.json, histories and disk as PNG and PDF, and on request animation.gif. "
        "`rotorjax.deck.case` shows a case file.",
    )
    parser.add_argument("--case", required=True, type=Path, metavar="FILE", help="case in TOML")
    parser.add_argument("--out", required=True, type=Path, metavar="DIR", help="folder for all results")
    parser.add_argument("--gif", action="store_true", help="write the animation too")
    parser.set_defaults(run=run)


def run(chosen: argparse.Namespace) -> int:
    """Simulate and write; the exit code."""
    from tqdm import tqdm

    from rotorjax.commands.arguments import introduce
    from rotorjax.deck import output as deck_output
    from rotorjax.deck.case import read_case
    from rotorjax.deck.run import run_case
    from rotorjax.io.atomic import make_folder

    case = read_case(chosen.case)
    out = make_folder(chosen.out)
    introduce(case.rotor, case.operating, moves=not case.rigid)
    with tqdm(desc="deck", bar_format="{desc}: {elapsed} {postfix}", leave=False, file=sys.stderr) as bar:
        bar.set_postfix_str("tables and march")
        data, figures = run_case(case)
        bar.set_postfix_str("files")
        found = deck_output.write_all(data, figures, out, animated=chosen.gif)
    for name in ("height", "uniform", "cosine", "thrust", *deck_output.FLAPPING):
        if name in data:  # rigid blades do not flap
            row = "  ".join(f"{key} {value:9.5f}" for key, value in found["histories"][name].items())
            print(f"{name:8s} {row}  {data[name].attrs['units']}")
    most = found["largest_difference_from_static"]
    print(
        f"{found['simulated_s']:.1f} s in {found['steps']} steps of {found['step_us']:.0f} µs; the mean inflow differs "
        f"from the steady one by up to {100 * most['relative']:.1f} % (at {most['time_s']:.1f} s); "
        f"{100 * found['ground_residual_max']:.1f} % is left on the deck at most: {out / 'report.json'}"
    )
    return 0
