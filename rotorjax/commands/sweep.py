"""`rotorjax sweep`: one command's case over a grid or a random design."""

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable

    from rotorjax.bench.progress import ProgressLine
    from rotorjax.sweep.pools import Pool


def register(commands: argparse._SubParsersAction) -> None:
    """Add the command."""
    parser = commands.add_parser(
        "sweep",
        help="a case over a grid or a random design",
        description="Solve the inflow of a hover or a trim over axes (height, slope, collective or thrust, speed, keys "
        "of the rotor's file …), each point from its best solved neighbour, and write sweep.nc, pictures and "
        "report.html. Finished points are kept: the same command continues where it stopped. Exit code 1 where a point "
        "did not converge. `rotorjax.sweep.case` shows a case file.",
    )
    parser.add_argument("--case", required=True, type=Path, metavar="FILE", help="case in TOML")
    parser.add_argument("--out", required=True, type=Path, metavar="DIR", help="folder for all results")
    parser.add_argument(
        "--table", type=Path, metavar="FILE.txt", help="inflow table for simulators too: λ₀, λ₁c, λ₁s, C_T, C_Q"
    )
    workers = parser.add_mutually_exclusive_group()
    workers.add_argument("--jobs", type=int, default=1, metavar="N", help="processes of this machine (1)")
    workers.add_argument(
        "--scheduler", metavar="ADDRESS", help="of a Dask cluster, or `local` for one that is started (extra `cluster`)"
    )
    parser.set_defaults(
        run=run, free_wake=_names_a_wake, kept="; finished points are kept, and the same command continues"
    )


def run(chosen: argparse.Namespace) -> int:
    """Sweep and write; the exit code."""
    from rotorjax.commands.arguments import introduce
    from rotorjax.io.atomic import check_output, make_folder
    from rotorjax.rotor import catalogue
    from rotorjax.sweep.case import read_case
    from rotorjax.sweep.inflow_table import check_axes, write_table
    from rotorjax.sweep.output import failed_lines, write_all
    from rotorjax.sweep.run import sweep
    from rotorjax.sweep.table import text

    case, pool = read_case(chosen.case), pool_of(chosen)
    if chosen.table is not None:
        check_axes({axis.name: axis.values for axis in case.axes}, case.design.kind)
        check_output(chosen.table)
    make_folder(chosen.out)
    introduce(*catalogue.load(case.rotor), moves=case.command == "trim")
    swept = sweep(case, chosen.out, pool=pool)
    data = write_all(swept, chosen.out)
    print(text(data))
    lost = len(swept.failures)
    print(f"{len(swept.points) - lost} of {len(swept.points)} points converged: {chosen.out / 'report.html'}")
    for line in failed_lines(swept):
        print(f"not converged: {line}", file=sys.stderr)
    if chosen.table is not None:
        write_table(chosen.table, data)
        print(f"written: {chosen.table}")
    return 1 if lost else 0


def pool_of(chosen: argparse.Namespace) -> "Callable[[ProgressLine], Pool] | None":
    """Who works; None for this process. Raises InputError where a cluster is asked for and there is none."""
    from rotorjax.checks import check_whole
    from rotorjax.sweep import pools

    check_whole("jobs", chosen.jobs, 1, 1024)
    if chosen.scheduler is not None:
        pools.require_distributed()
        return lambda progress: _with_programs(pools.Cluster, chosen.scheduler)
    if chosen.jobs > 1:
        return lambda progress: _with_programs(pools.Processes, chosen.jobs, progress.say)
    return None


def _with_programs(make: Any, *arguments: Any) -> Any:
    from rotorjax.sweep.pools import as_seen_by_workers

    as_seen_by_workers()
    return make(*arguments)


def _names_a_wake(chosen: argparse.Namespace) -> bool:
    """Whether a case speaks of the free wake, as its text says before anything is loaded."""
    try:
        return "freewake" in chosen.case.read_text(encoding="utf-8", errors="replace")
    except (OSError, ValueError):
        return True
