"""Eight free turns over level ground, by three ways: `python benchmarks/free_turns.py [--quick] [--release R]`.

UH-60 at 18°. From nothing as the search goes, by half the turns where the prescribed wake is lost; the same without
that way, as it was; from the wake of four turns (`start=`), which is not counted. Prints Newton's iterations, seconds
without compiling and with it (what ways share is compiled in the first) and C_T, or where a way was lost.
"""

import argparse
from unittest import mock

import jax

import rotorjax as rj
from rotorjax.ground import plane
from rotorjax.wake.model import FreeWake, free_wake
from rotorjax.wake.settings import hover_settings
from rotorjax.wake.solution import Solution, solve

HEIGHTS = (None, 2.0, 1.5, 1.0, 0.75, 0.5)
COLLECTIVE_DEG = 18.0


def model_of(height: float | None, turns: float, changes: dict) -> FreeWake:
    """The UH-60's wake with so many free turns."""
    ground = None if height is None else plane(height)
    return free_wake(*rj.rotor("uh60", COLLECTIVE_DEG), ground, hover_settings(free_turns=turns, **changes))


def without(model: FreeWake) -> Solution:
    """Solved without the way by fewer turns."""
    with mock.patch("rotorjax.wake.search.shorter", return_value=None):
        return solve(model)


def told(found: Solution) -> str:
    """One cell of the table."""
    if not found.converged:
        return f"lost after {found.wall_time_s:.0f} s: {found.why[:40]}"
    after = found.wall_time_s - found.compile_time_s
    return f"{found.iterations:3d} {after:6.1f} {found.wall_time_s:6.1f} {found.CT:.6f}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="two heights")
    parser.add_argument("--release", type=float, help="where the tip vortex is released, over R")
    options = parser.parse_args()
    jax.config.update("jax_enable_x64", True)
    changes = {} if options.release is None else {"release": options.release}
    print(f"{'height':>6} | {'from nothing':^27} | {'without fewer turns':^27} | from four turns")
    for height in HEIGHTS[-2:] if options.quick else HEIGHTS:
        long = model_of(height, 8.0, changes)
        ways = solve(long), without(long), solve(long, solve(model_of(height, 4.0, changes)))
        print(f"{'OGE' if height is None else height:>6} | " + " | ".join(map(told, ways)), flush=True)


if __name__ == "__main__":
    main()
