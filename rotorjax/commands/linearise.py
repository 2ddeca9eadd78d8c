"""`rotorjax linearise`: linear state-space models of the whole rotor about a trim, or of a rigid rotor's free wake."""

import argparse
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from rotorjax.commands.arguments import add_flight, add_place, add_rotor

if TYPE_CHECKING:
    from rotorjax.linearisation.found import Wanted
    from rotorjax.trim.run import Request
    from rotorjax.wake.search import Progress


def register(commands: argparse._SubParsersAction) -> None:
    """Add the command."""
    parser = commands.add_parser(
        "linearise",
        help="linear state-space models of the rotor about a trim, or of its free wake",
        description="With a thrust: trim the rotor, linearise blades and inflow about the trim and write periodic, "
        "full and reduced models (NetCDF and .mat, in seconds and SI), a README that says how to load them, modes "
        "by name, linearise.json, report.md and report.html; several speeds or heights make a scheduled model, "
        "written anew as each is done, beside a folder for each; given again, the same command goes on. "
        "With --inflow freewake: flap, lag and all states of the wake, over level ground or none; in flight "
        "periodic, condensed to a hundred states; in hover, seen from the hub, a time-invariant model whose wake "
        "grows, and the reduced model says for which horizon it is, in a folder of its own beside other flights. "
        "Without a thrust: the free wake of rigid blades at a collective, in hover. Exit code 1 where a trim or "
        "the wake did not converge.",
    )
    add = parser.add_argument
    add_rotor(parser)
    add_flight(parser, required=False)
    add_place(parser)
    add("--tilt", type=float, default=0.0, metavar="DEG", help="shaft forward (0)")
    add(
        "--inflow",
        metavar="MODEL",
        help="uniform, pitt-peters, vpbfsm, freewake (pitt-peters; without a thrust freewake)",
    )
    add("--inputs", metavar="NAMES", help="by commas (controls and hub motion; of a wake collective)")
    add("--outputs", metavar="NAMES", help="by commas (hub loads, blades and inflow; of a wake CT,lambda0)")
    add("--order", type=int, default=20, metavar="N", help="states of the reduced model (20)")
    add("--harmonics", type=int, default=0, metavar="K", help="harmonics in the time-invariant model up to K (0: mean)")
    add("--azimuths", type=int, metavar="N", help="of a revolution, at which a rotor is linearised (48)")
    add("--time", choices=("seconds", "azimuth"), default="seconds", help="seconds with SI units (default), or azimuth")
    add("--out", required=True, type=Path, metavar="DIR", help="folder for all results")
    add("--quick", action="store_true", help="coarser free wake")
    parser.set_defaults(run=run, free_wake=lambda chosen: chosen.thrust_coefficient is None and chosen.weight is None)


def run(chosen: argparse.Namespace) -> int:
    """Solve or trim, linearise and write; the exit code."""
    rigid = chosen.thrust_coefficient is None and chosen.weight is None
    return _wake(chosen) if rigid else _trimmed(chosen)


def _trimmed(chosen: argparse.Namespace) -> int:
    """Models of a trimmed rotor, at one place or several."""
    from rotorjax.commands.arguments import introduce_flights
    from rotorjax.io.atomic import make_folder
    from rotorjax.linearisation import flight, identify, schedule, trim_output
    from rotorjax.linearisation.kept import FlightShelf
    from rotorjax.trim.run import Result

    usual = {"collective": None} if chosen.inflow == "freewake" else {"quick": False, "collective": None}
    _refuse(chosen, usual, "a trim finds the collective, and --quick is for a free wake")
    wanted, requests = _wanted(chosen), _requests(chosen)
    for request in requests:
        flight.check(request, wanted)
    out = make_folder(chosen.out)
    introduce_flights(requests)
    lost, known, small = [], [], []
    with _progress_bar() as progress:
        shelf = FlightShelf(out, wanted, lambda line: print(line, file=sys.stderr)) if len(requests) > 1 else None
        for one in schedule.flights(requests, wanted, progress, shelf):
            if isinstance(one, Result):
                lost.append(one)
                continue
            known.append(one)
            if len(requests) == 1:
                trim_output.write(one, out, chosen.time)
            else:
                schedule.write(known, out, chosen.time)
            progress("identified inflow", 0.0)
            small += identify.of_flights([one])
            identify.write(small, out)
    for one in lost:
        where = "" if one.request.height is None else f", height {one.request.height:g}"
        print(f"advance ratio {one.request.advance:g}{where}: not converged: {one.trimmed.outcome.why}")
    print("\n".join([*map(trim_output.lines, known), *identify.lines(small), f"written: {out}"]))
    return 1 if lost else 0


def _wanted(chosen: argparse.Namespace) -> "Wanted":
    """What to linearise for."""
    from rotorjax.commands.arguments import names_of
    from rotorjax.linearisation.found import CONTROLS, OUTPUTS, Wanted

    inputs, outputs = (
        default if text is None else names_of(text)
        for text, default in ((chosen.inputs, CONTROLS), (chosen.outputs, OUTPUTS))
    )
    azimuths = {} if chosen.azimuths is None else {"azimuths": chosen.azimuths}
    return Wanted(inputs, outputs, order=chosen.order, harmonics=chosen.harmonics, **azimuths)


@contextmanager
def _progress_bar() -> "Iterator[Progress]":
    """A line that tells the stage, and how far it is."""
    from tqdm import tqdm

    with tqdm(bar_format="linearise: {elapsed} {postfix}", leave=False, file=sys.stderr) as bar:

        def progress(stage: str, residual: float) -> None:
            bar.set_postfix_str(f"{stage}, residual {residual:.1e}" if residual else stage)

        yield progress


def _requests(chosen: argparse.Namespace) -> "list[Request]":
    """One trim for every speed and height."""
    from dataclasses import replace

    from rotorjax.commands.arguments import flown
    from rotorjax.trim.run import FREE_WAKE, request
    from rotorjax.wake.settings import flight_settings, quick_settings

    base = request(
        chosen.rotor,
        1e-3,
        chosen.inflow or "pitt-peters",
        slope_deg=chosen.slope,
        climb=chosen.climb,
        tilt_deg=chosen.tilt,
    )
    base, speeds = flown(chosen, base)
    if chosen.quick and chosen.inflow == FREE_WAKE:
        still = quick_settings(azimuths=2 * base.rotor.blades)
        base = replace(base, wake=flight_settings(base.rotor.blades, panels=still.panels) if any(speeds) else still)
    return [replace(base, advance=mu, height=h) for h in chosen.height or [None] for mu in speeds]


def _refuse(chosen: argparse.Namespace, usual: dict, why: str) -> None:
    """Raise InputError for an argument that is not as usual."""
    from rotorjax.errors import InputError

    for name, value in usual.items():
        if getattr(chosen, name) != value:
            raise InputError(f"Argument `{name}` must be left out, but is given: {why}")


def _wake(chosen: argparse.Namespace) -> int:
    """Models of a rigid rotor's free wake in hover."""
    from rotorjax.bench.settings import study_settings
    from rotorjax.bench.single import check_case
    from rotorjax.bench.wake_file import model_of
    from rotorjax.commands.arguments import case_of, introduce, names_of
    from rotorjax.io.atomic import make_folder, write_json
    from rotorjax.linearisation import output
    from rotorjax.linearisation.run import Linearised, check, linearise_case
    from rotorjax.wake.settings import MARCHED

    _only_the_wake(chosen)
    case = case_of(chosen.height, chosen.slope)
    settings = study_settings(chosen.rotor, chosen.collective, chosen.climb, quick=chosen.quick, **MARCHED)
    check_case(case, settings)
    model = model_of(case, settings)
    inputs = names_of("collective" if chosen.inputs is None else chosen.inputs)
    outputs = names_of("CT,lambda0" if chosen.outputs is None else chosen.outputs)
    check(model, inputs, outputs, chosen.order, chosen.harmonics)
    out = make_folder(chosen.out)  # before the work, not after it
    introduce(settings.rotor, settings.operating)
    with _progress_bar() as progress:
        found = linearise_case(model, inputs, outputs, chosen.order, progress, harmonics=chosen.harmonics)
    if not isinstance(found, Linearised):
        write_json(out / "linearise.json", {"orbit": output.orbit(found)})
        print(f"{case.label}: not converged: {found.why}")
        return 1
    title = f"{settings.rotor.name}, collective {settings.collective_deg:g}°, {case.label}"
    content = output.write(found, title, out, chosen.time)
    print(output.lines(content))
    print(f"written: {out / 'report.html'}")
    return 0


def _only_the_wake(chosen: argparse.Namespace) -> None:
    """Raise InputError for what a wake of rigid blades does not have; one height is no list of them."""
    from rotorjax.errors import InputError

    usual = {"advance_ratio": None, "speed": None, "altitude": None, "density": None, "tilt": 0.0, "azimuths": None}
    _refuse(chosen, usual, "it needs a trim: give --thrust-coefficient or --weight")
    if chosen.inflow not in (None, "freewake"):
        raise InputError(
            f"Argument `thrust_coefficient` or `weight` must be given with inflow '{chosen.inflow}', but neither is: "
            "only the free wake of rigid blades is linearised at a collective"
        )
    if chosen.height is not None and len(chosen.height) > 1:
        raise InputError("Argument `height` must be one without a thrust, but there are several")
    chosen.height = None if chosen.height is None else chosen.height[0]
