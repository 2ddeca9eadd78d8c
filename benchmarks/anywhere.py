"""Does it converge anywhere? Random flight trims and hovers in the free wake, at the settings that users get.

    python benchmarks/anywhere.py --n 200 --seed 1 [--parts known flights hovers] [--only 3 17] [--quick] [--json FILE]
                                  [--jobs N] [--until SECONDS]

Flights: the UH-60 and Elliott and Althoff's rotor, advance ratio 0 … 0.35, height ∞ or 0.6 … 2 R, C_T/σ 0.05 … 0.10,
shaft −2° … 6° forward. Hovers, with rigid blades: every rotor of the catalogue, height 0.4 … 3 R, slope to 40° or to a
clearance of 0.05 R, collective for 3 % … 120 % of the design thrust C_T/σ = 0.08. Known: flights that once stalled.
Case i of a seed is the same whatever n is. --jobs shares the cases among processes with cores of their own, which give
each other compiled programs where JAX_COMPILATION_CACHE_DIR is set; the file is written anew after every case, a run
that is ended (SIGTERM, Ctrl-C, --until) sums up what it has, and the same command goes on where the file ends. Prints
the share that converged, median and 95 % of the seconds after compilation (tracing counts as solving), those of the
processor, and each failure: where it ended, with what residual, and how good its loads are all the same.
"""

import argparse
import json
import os
import signal
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

os.environ.setdefault("TF_CPP_MIN_LOG_LEVEL", "3")  # as the command line: XLA's own hints are no errors

import jax
import numpy as np
from tqdm import tqdm

from rotorjax.ground import plane
from rotorjax.io.atomic import json_text
from rotorjax.rotor import catalogue
from rotorjax.rotor.geometry import solidity, twist
from rotorjax.sweep.pools import Here, Job, Pool, Processes, as_seen_by_workers
from rotorjax.trim.run import numbers, request, run
from rotorjax.wake.clock import Clock
from rotorjax.wake.model import free_wake
from rotorjax.wake.settings import flight_settings, quick_settings
from rotorjax.wake.solution import solve

FLOWN = ("uh60", "elliott_althoff")
DESIGN = 0.08
"""C_T/σ of the design thrust."""

CLEAR = 0.05
"""Least distance of the rim from a slope, over R."""

SLOPE = 5.73
"""Lift slope per rad, for the collective of a thrust."""

COARSE = {"panels": 8, "age_step_deg": 20.0, "near_wake_deg": 100.0}


KNOWN = ((0.00578, 0.15, None), (0.0058, 0.15, 1.2), (0.0058, 0.06, 1.5), (0.0058, 0.06, 1.6))
"""C_T, advance ratio and height of UH-60s with an upright shaft that stalled at 5e-6, 4e-7, 3e-3 and 6e-3."""


def known(number: int, rng: np.random.Generator) -> dict[str, Any]:
    """A flight that once stalled."""
    thrust, advance, height = KNOWN[number]
    return {"rotor": "uh60", "thrust": thrust, "advance": advance, "height": height, "tilt_deg": 0.0}


def flight(number: int, rng: np.random.Generator) -> dict[str, Any]:
    """A random flight."""
    rotor = str(rng.choice(FLOWN))
    loading, far = rng.uniform(0.05, 0.10), rng.random() < 1 / 3
    height = rng.uniform(0.6, 2.0)
    return {
        "rotor": rotor,
        "thrust": loading * float(solidity(catalogue.load(rotor)[0])),
        "advance": rng.uniform(0.0, 0.35),
        "height": None if far else height,
        "tilt_deg": rng.uniform(-2.0, 6.0),
    }


def hover(number: int, rng: np.random.Generator) -> dict[str, Any]:
    """A random hover over ground."""
    name, height = str(rng.choice(catalogue.names())), rng.uniform(0.4, 3.0)
    slopes = np.arange(40.0, -0.1, -0.25)
    clear = height * np.cos(np.deg2rad(slopes)) - np.sin(np.deg2rad(slopes)) >= CLEAR
    steepest = slopes[clear][0]
    return {"rotor": name, "height": height, "slope_deg": rng.uniform(0.0, steepest), "share": rng.uniform(0.03, 1.2)}


def flown(case: dict[str, Any], quick: bool) -> dict[str, Any]:
    """What a trim comes to."""
    asked = request(inflow="freewake", **case)
    found = run(replace(asked, wake=flight_settings(asked.rotor.blades, **COARSE)) if quick else asked)
    told = numbers(found)
    keys = ("converged", "verdict_text", "residual", "load_change", "node_movement", "iterations", "CT", "CP")
    return {key: told[key] for key in keys}


def hovered(case: dict[str, Any], quick: bool) -> dict[str, Any]:
    """What a hover comes to."""
    rotor, operating = catalogue.load(case["rotor"])
    thrust = case["share"] * DESIGN * float(solidity(rotor))
    at_three_quarters = 6 * thrust / (SLOPE * float(solidity(rotor))) + 1.5 * np.sqrt(thrust / 2)
    collective = at_three_quarters - float(twist(rotor, np.asarray(0.75)))
    operating = replace(operating, collective=np.asarray(collective))
    ground = plane(case["height"], case["slope_deg"])
    found = solve(free_wake(rotor, operating, ground, quick_settings(**COARSE) if quick else None))
    keys = ("converged", "residual", "load_change", "iterations", "CT", "clearance")
    return {"verdict_text": found.why} | {key: getattr(found, key) for key in keys}


PARTS: dict[str, tuple[Callable, Callable]] = {
    "known": (known, flown),
    "flights": (flight, flown),
    "hovers": (hover, hovered),
}


class Pinned(Processes):
    """Processes that each have cores to themselves: XLA makes as many threads as it sees cores."""

    def __init__(self, size: int) -> None:
        """Start them."""
        cores = sorted(os.sched_getaffinity(0))
        share = max(1, len(cores) // size)
        self._shares = [set(cores[i : i + share]) for i in range(0, share * (len(cores) // share), share)]
        super().__init__(size, print)

    def _started(self) -> Any:
        """One more, on the next cores; it inherits them."""
        mine = os.sched_getaffinity(0)
        self._shares.append(self._shares.pop(0))
        os.sched_setaffinity(0, self._shares[-1])
        try:
            return super()._started()
        finally:
            os.sched_setaffinity(0, mine)


def cases_of(chosen: argparse.Namespace) -> list[tuple[str, int]]:
    """Parts and numbers of the cases, the first of each part first, so that a run that is ended has some of each."""
    most = {part: len(KNOWN) if part == "known" else chosen.n for part in chosen.parts}
    wanted = range(max(most.values())) if chosen.only is None else chosen.only
    return [(part, i) for i in wanted for part in chosen.parts if i < most[part]]


def row_of(part: str, i: int, seed: int, quick: bool, progress: Any = None) -> dict[str, Any]:
    """A case, solved."""
    draw, solved = PARTS[part]
    case = draw(i, np.random.default_rng([seed, list(PARTS).index(part), i]))
    clock, busy = Clock(), time.process_time()
    try:
        found = solved(case, quick)
    except Exception as problem:  # one case must not end the others
        nothing = dict.fromkeys(("residual", "load_change", "CT"))
        found = {"converged": False, "verdict_text": repr(problem), "iterations": 0} | nothing
    wall, compiling = clock.read()
    row = {"part": part, "case": i, **case, **found, "solve_s": wall - compiling, "compile_s": compiling}
    return row | {"busy_s": time.process_time() - busy, "load_average": os.getloadavg()[0]}


def solved_cases(pool: Pool, chosen: argparse.Namespace, done: set) -> Iterator[dict[str, Any]]:
    """Rows of the cases that are not `done` (part, number) as they come; none is begun after `until` seconds."""
    begun, running = time.perf_counter(), 0
    waiting = [case for case in cases_of(chosen) if case not in done]
    with tqdm(total=len(waiting), file=sys.stderr, disable=not sys.stderr.isatty()) as bar:
        while True:
            while waiting and running < pool.size and time.perf_counter() - begun < chosen.until:
                pool.submit(waiting[0], Job(row_of, (*waiting.pop(0), chosen.seed, chosen.quick)))
                running += 1
            if not running:
                return
            for _, row in pool.finished():
                running -= 1
                bar.update()
                yield row


def kept_before(chosen: argparse.Namespace) -> list[dict[str, Any]]:
    """Rows of the file, where there is one of the same seed and settings."""
    file = Path(chosen.json) if chosen.json else None
    if file is None or not file.exists():
        return []
    found = json.loads(file.read_text())
    return found["rows"] if (found["seed"], found["quick"]) == (chosen.seed, chosen.quick) else []


def keep(rows: list[dict[str, Any]], chosen: argparse.Namespace) -> None:
    """Write what there is, all or nothing."""
    file = Path(chosen.json)
    written = file.with_name(f"{file.name}.new")
    written.write_text(json_text({"seed": chosen.seed, "quick": chosen.quick, "rows": rows}, indent=1))
    written.replace(file)


def line(row: dict[str, Any]) -> str:
    """One case on one line."""
    where = "h = ∞" if row["height"] is None else f"h = {row['height']:.3f}"
    if row["part"] != "hovers":
        where = f"μ = {row['advance']:.3f}, {where}, tilt {row['tilt_deg']:.2f}°, C_T {row['thrust']:.6f}"
    else:
        where = f"{where}, slope {row['slope_deg']:.2f}°, {100 * row['share']:.0f} % thrust"
    end = "converged" if row["converged"] else f"NOT converged: {row['verdict_text']}"
    took = (
        f"{row['solve_s']:.1f} s and {row['compile_s']:.1f} s compiling ({row['busy_s']:.1f} s of the processor), "
        f"{row['iterations']} iterations"
    )
    residual = "none" if row["residual"] is None else f"{row['residual']:.1e}"
    return f"{row['part']} {row['case']}: {row['rotor']}, {where}: residual {residual}, {took}, {end}"


def summary(part: str, rows: list[dict[str, Any]]) -> str:
    """Share that converged, seconds, and the failures."""
    here = [row for row in rows if row["part"] == part]
    if not here:
        return f"{part}: none"
    good = [row for row in here if row["converged"]]
    seconds, busy = ([row[key] for row in here] for key in ("solve_s", "busy_s"))
    said = (
        f"{part}: {len(good)} of {len(here)} converged ({100 * len(good) / len(here):.1f} %); "
        f"median {np.median(seconds):.1f} s, 95 % {np.percentile(seconds, 95):.1f} s, most {max(seconds):.1f} s; "
        f"of the processor, compiling included, median {np.median(busy):.1f} s, 95 % {np.percentile(busy, 95):.1f} s; "
        f"mean load {np.mean([row['load_average'] for row in here]):.1f} on {os.cpu_count()} cores"
    )
    return "\n".join([said, *(f"  {line(row)}" for row in here if not row["converged"])])


def main() -> None:
    """Solve and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--n", type=int, default=200, help="cases of each part")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--parts", nargs="+", choices=PARTS, default=list(PARTS))
    parser.add_argument("--only", nargs="+", type=int, metavar="I", help="these cases of the seed alone")
    parser.add_argument("--quick", action="store_true", help="coarser wakes")
    parser.add_argument("--json", help="file to write")
    parser.add_argument("--jobs", type=int, default=1, help="processes that share the cases")
    parser.add_argument("--until", type=float, default=np.inf, metavar="SECONDS", help="begin no case after these")
    chosen = parser.parse_args()
    jax.config.update("jax_enable_x64", True)
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    as_seen_by_workers()
    pool = Here() if chosen.jobs == 1 else Pinned(chosen.jobs)
    rows = kept_before(chosen)
    try:
        for row in solved_cases(pool, chosen, {(row["part"], row["case"]) for row in rows}):
            rows.append(row)
            print(line(row), flush=True)
            if chosen.json:
                keep(rows, chosen)
    except KeyboardInterrupt:
        print("ended before the last case was solved")
    finally:
        pool.close()
    print("\n" + "\n".join(summary(part, rows) for part in chosen.parts))


if __name__ == "__main__":
    main()
