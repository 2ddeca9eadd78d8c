"""`rotorjax linearise`: state-space models of the free wake about its periodic state."""

import argparse
import sys
from pathlib import Path

from rotorjax.commands.arguments import add_place, add_rotor


def register(commands: argparse._SubParsersAction) -> None:
    """Add the command."""
    parser = commands.add_parser(
        "linearise",
        help="linear state-space models of the free wake",
        description="Solve one periodic wake, linearise it and write full and reduced models (NetCDF and .mat), "
        "stability, Bode and step pictures, linearise.json and report.md. Exit code 1 where the wake did not converge.",
    )
    add_rotor(parser)
    add_place(parser)
    parser.add_argument(
        "--inputs", metavar="NAMES", default="collective", help="by commas: collective, climb, height (collective)"
    )
    parser.add_argument(
        "--outputs", metavar="NAMES", default="CT,lambda0", help="by commas: CT, CQ, lambda0, inflow (CT,lambda0)"
    )
    parser.add_argument("--order", type=int, default=20, metavar="N", help="states of the reduced model (20)")
    parser.add_argument(
        "--harmonics",
        type=int,
        default=0,
        metavar="K",
        help="over a slope: harmonics of a blade's passage in the time-invariant model (0: averaging)",
    )
    parser.add_argument("--out", required=True, type=Path, metavar="DIR", help="folder for all results")
    parser.add_argument("--quick", action="store_true", help="coarser free wake")
    parser.set_defaults(run=run)


def run(chosen: argparse.Namespace) -> int:
    """Solve, linearise and write; the exit code."""
    from tqdm import tqdm

    from rotorjax.bench.settings import study_settings
    from rotorjax.bench.single import check_case
    from rotorjax.commands.arguments import case_of, introduce, names_of
    from rotorjax.io.atomic import make_folder, write_json
    from rotorjax.linearisation import output
    from rotorjax.linearisation.run import Linearised, check, linearise_case, model_of

    case = case_of(chosen)
    settings = study_settings(chosen.rotor, chosen.collective, chosen.climb, quick=chosen.quick)
    check_case(case, settings)
    model = model_of(case, settings)
    names = names_of(chosen.inputs), names_of(chosen.outputs)
    check(model, *names, chosen.order, chosen.harmonics)
    out = make_folder(chosen.out)  # before the work, not after it
    introduce(settings.rotor, settings.operating)
    with tqdm(desc=case.label, bar_format="{desc}: {elapsed} {postfix}", leave=False, file=sys.stderr) as bar:

        def progress(stage: str, residual: float) -> None:
            bar.set_postfix_str(f"{stage}, residual {residual:.1e}" if residual else stage)

        found = linearise_case(model, *names, chosen.order, progress, harmonics=chosen.harmonics)
    if not isinstance(found, Linearised):
        write_json(out / "linearise.json", {"orbit": output.orbit(found)})
        print(f"{case.label}: not converged: {found.why}")
        return 1
    title = f"{settings.rotor.name}, collective {settings.collective_deg:g}°, {case.label}"
    content = output.write(found, title, out)
    print(output.lines(content))
    print(f"written: {out / 'report.md'}")
    return 0
