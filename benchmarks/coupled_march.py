"""The rotor in its own free wake, marched: time a revolution, real-time factor, share of the Biot-Savart sum.

    python benchmarks/coupled_march.py [--advance-ratio 0.15] [--height H] [--revolutions 20] [--steps N] [--json FILE]

UH-60, C_T = 0.0058, shaft 3 degrees forward in flight, the settings that its trim has by default. The flight is steady:
whatever changes from one revolution to the next is the march leaving the periodic wake. Compilation is not counted.
"""

import argparse
import time
from pathlib import Path

import equinox as eqx
import jax
import numpy as np

from rotorjax.coupled import blades_at, rhs
from rotorjax.coupled_wake import model_of
from rotorjax.io.atomic import json_text
from rotorjax.simulation.case import COLUMNS, SimulationCase
from rotorjax.simulation.history import read_history
from rotorjax.simulation.run import SAVES, fly_from
from rotorjax.simulation.start import start_of
from rotorjax.simulation.wake_output import change
from rotorjax.trim.run import request
from rotorjax.wake.field import node_velocities

jax.config.update("jax_enable_x64", True)
OMEGA = 27.0


def steady(advance, height, revolutions, steps):
    """A case without histories."""
    start = request("uh60", 0.0058, "freewake", advance, height, tilt_deg=3.0 if advance and height is None else 0.0)
    t, columns = read_history({}, COLUMNS, duration := revolutions * 2 * np.pi / OMEGA)
    columns[:, -1] = 100.0
    return SimulationCase(start, duration, steps, t, columns)


def in_turn(programs, *args, rounds=60):
    """Times (rounds, P) of compiled programs that run in turn, so that other jobs disturb them alike."""
    spent = np.zeros((rounds + 1, len(programs)))
    for row in spent:
        for k, program in enumerate(programs):
            begun = time.perf_counter()
            jax.block_until_ready(program(*args))
            row[k] = time.perf_counter() - begun
    return spent[1:]


@eqx.filter_jit
def sums(x, u, p):
    """The velocities of all nodes and control points, and nothing else."""
    return node_velocities(model_of(u, blades_at(x, u, p), p), x.inflow, x.psi)


@eqx.filter_jit
def rate(x, u, p):
    return rhs(0.0, x, u, p)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--advance-ratio", type=float, default=0.15)
    parser.add_argument("--height", type=float)
    parser.add_argument("--revolutions", type=int, default=20)
    parser.add_argument("--steps", type=int, help="of a revolution; else what the wake needs")
    parser.add_argument("--json", type=Path, help="where to write the figures")
    chosen = parser.parse_args()
    case = steady(chosen.advance_ratio, chosen.height, chosen.revolutions, chosen.steps)
    start = start_of(case, print)
    found = fly_from(case, start, print)
    x, u = start.x, start.inputs
    spent = in_turn((rate, sums), x, u, start.p)
    whole, part = np.median(spent, axis=0)
    turns = (found.flown.t.size - 1) / SAVES
    moved, thrust = change(found.flown.x), np.asarray(found.flown.y.CT)
    figures = {
        "states": sum(leaf.size for leaf in jax.tree.leaves(x)),
        "steps_per_revolution": round(found.steps / chosen.revolutions),
        "finished": found.finished,
        "revolutions": turns,
        "seconds_per_revolution": found.march_s / turns,
        "real_time_factor": float(found.flown.t[-1]) / OMEGA / found.march_s,
        "rhs_ms": 1e3 * whole,
        "node_velocities_ms": 1e3 * part,
        "share_of_biot_savart": float(np.median(spent[:, 1] / spent[:, 0])),
        "wake_change_by_revolution": [float(v) for v in moved[SAVES::SAVES]],
        "CT_by_revolution": [float(thrust[k : k + SAVES].mean()) for k in range(0, thrust.size - SAVES, SAVES)],
    }
    for name, value in figures.items():
        if isinstance(value, list):
            value = " ".join(f"{v:.3g}" if name != "CT_by_revolution" else f"{v:.6f}" for v in value)
        print(f"{name:28s} {value if isinstance(value, (str, bool, int)) else format(value, '.4g')}")
    if chosen.json:
        chosen.json.write_text(json_text(figures, indent=1))


if __name__ == "__main__":
    main()
