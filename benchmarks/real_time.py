"""The free wake marched in real time: real-time factors, steps, one right-hand side beside C, error of a step response.

    python benchmarks/real_time.py [--json FILE] [--turns 3] [--no-accuracy] [--no-batch] [--hour MINUTES]

UH-60 at C_T = 0.0058: hovering over level ground at h = 1 and at an advance ratio of 0.15 with the shaft 4 degrees
forward, with the settings that its trims have by default. "single" is the march as `rj.march` has it: single precision,
what closure and ground induce taken once a step; "double" the same in double precision. A right-hand
side is timed as a march has it, in a loop inside its program: eight at a time, each at another state; rhs_call_ms is
one alone, called from Python. C is the loop of benchmarks/biot_savart.py, timed in turn with the right-hand sides, so
that other work disturbs them alike. "quick": the coarser wake of `quick_settings`, trimmed and marched in single.
step_error: three revolutions after a collective and after a cyclic step of 1 degree, largest error of C_T and mean
inflow (means over a revolution) and of flapping (over the largest angle), against double precision with the paper's
filter and the steps that it needs. Compilation is not counted but in compile_s.
"""

import argparse
import resource
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import biot_savart
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from rotorjax.coupled import inflow_velocity, rate_and_output
from rotorjax.coupled_wake import CoupledWake
from rotorjax.io.atomic import json_text
from rotorjax.simulation.case import COLUMNS, SimulationCase
from rotorjax.simulation.march import cast, compiled, march, marching, on_device, precision_of
from rotorjax.simulation.pace import Pace
from rotorjax.simulation.run import SAVES, fly_from
from rotorjax.simulation.start import Start, start_of
from rotorjax.trim.run import request
from rotorjax.wake.far_wake import segment_ages
from rotorjax.wake.model import FreeWake
from rotorjax.wake.segments import lattice_segments
from rotorjax.wake.settings import QUICK

jax.config.update("jax_enable_x64", True)
OMEGA, COUNT, IN_A_ROW = 27.0, 4000, 8
SHORT = {"single": "f32", "double": "f64"}
TURN_S = 2 * np.pi / OMEGA


def case_of(flight, column=None, **options):
    """Three revolutions from a trim, with a step of 1 degree in a column after a twentieth of a second."""
    advance, height, tilt = flight
    start = request("uh60", 0.0058, "freewake", advance, height, tilt_deg=tilt)
    t = np.array([0.0, 0.01, 0.06, 3 * TURN_S])
    columns = np.zeros((4, len(COLUMNS)))
    columns[:, -1] = 100.0
    if column is not None:
        columns[2:, COLUMNS.index(column)] = 1.0
    return SimulationCase(start, 3 * TURN_S, None, t, columns, **options)


FLIGHTS = {"hover": (0.0, 1.0, 0.0), "mu015": (0.15, None, 4.0)}
COARSER = {"hover": QUICK, "mu015": {key: QUICK[key] for key in ("panels", "near_wake_deg")}}


def pairs(p: CoupledWake) -> int:
    """Pairs of one right-hand side: points, times segments, times two over ground."""
    settings, blades = p.settings, p.rotor.blades
    model = FreeWake(p.rotor, p.operating, p.ground, settings, jnp.zeros(()))
    points = settings.panels + (settings.panels + 1) * settings.near_ages + settings.filaments * settings.far_ages
    segments = lattice_segments(model) + settings.filaments * len(segment_ages(model)) + settings.panels
    return blades**2 * points * segments * (1 if p.ground is None else 2)


def steps_per_second(start: Start, turns: int, **options) -> tuple[float, float, int]:
    """Real-time factor, seconds of making the march, steps a revolution."""
    begun = time.perf_counter()
    marched = march(start, **options)
    made = time.perf_counter() - begun
    state = marched.step(marched.start)
    begun = time.perf_counter()
    for _ in range(count := turns * marched.steps_per_turn):
        state = marched.step(state)
    per_step = (time.perf_counter() - begun) / count
    return (options.get("batch") or 1) * marched.seconds / per_step, made, marched.steps_per_turn


def against_c(library, start: Start, precision, rounds=25) -> tuple[float, float, float]:
    """Milliseconds of one right-hand side in a loop and alone, and the first over its pairs at C's rate: medians."""

    def rate(x, u, p):
        return rate_and_output(jnp.zeros(()), x, u, p)[0]

    def row(x, u, p):
        def one(x, _):
            return jax.tree.map(lambda v, slope: v + 1e-6 * slope, x, rate(x, u, p)), None

        return jax.lax.scan(one, x, length=IN_A_ROW)[0]

    with precision_of(precision):
        x, u, p = on_device(cast((start.x, start.inputs, marching(start.p)), precision))
        alone, many = (compiled(function, x, bound=(u, p)) for function in (rate, row))
    runs = {"call": lambda: jax.block_until_ready(alone(x)), "row": lambda: jax.block_until_ready(many(x))}
    if library is not None:
        dtype = np.float32 if precision == "single" else np.float64
        runs["c"] = biot_savart.c_kernel(library, biot_savart.problem(COUNT, dtype))
    found = biot_savart.measure(runs, rounds)
    each = found["row"] / IN_A_ROW
    over = float("nan") if library is None else np.median(each / found["c"]) * COUNT**2 / pairs(start.p)
    return 1e3 * float(np.median(each)), 1e3 * float(np.median(found["call"])), float(over)


_R, _PSI = np.linspace(0.3, 0.95, 6), np.pi / 6 * np.arange(12)
POINTS = np.stack([_R * np.cos(_PSI)[:, None], _R * np.sin(_PSI)[:, None], 0 * _R * _PSI[:, None]], -1).reshape(-1, 3)


@eqx.filter_jit
def mean_inflow(x, u, p):
    """Area mean over the disk, of states with a leading axis."""
    weights = np.tile(_R, 12) / np.sum(np.tile(_R, 12))
    return jax.lax.map(lambda row: -weights @ inflow_velocity(row[0], jnp.asarray(POINTS), row[1], p)[:, 2], (x, u))


def response(case, start: Start) -> dict[str, np.ndarray]:
    """C_T and mean inflow, means over a revolution, and flap angles."""
    flown = (found := fly_from(case, start)).flown
    if not found.finished:
        raise SystemExit(found.why)
    inflow = np.asarray(mean_inflow(flown.x, flown.u, start.p))

    def mean(v):
        return np.array([v[k - SAVES : k].mean() for k in range(SAVES, len(v) + 1)])

    return {"CT": mean(np.asarray(flown.y.CT)), "inflow": mean(inflow), "flap": np.asarray(flown.x.rotor.flap)}


def step_errors(start: Start, flight, name: str) -> dict[str, float]:
    """Largest relative errors of the march in single precision."""
    fine = replace(start, p=marching(start.p, bound_filter="pass"))
    fast = replace(start, p=marching(start.p))
    figures = {}
    for label, column in (("collective", "collective_deg"), ("cyclic", "theta_1s_deg")):
        reference = response(case_of(flight, column), fine)
        found = response(case_of(flight, column, precision="single", old_age="step"), fast)
        for key, value in found.items():
            error = np.abs(value - reference[key]).max() / np.abs(reference[key]).max()
            figures[f"step_error_{name}_{label}_{key}"] = float(error)
    return figures


def long_march(start: Start, minutes: float) -> dict[str, float]:
    """Steps by the clock at fixed inputs, each a frame: late ones, seconds of a step, how the resident set grows."""
    marched = march(start)
    state = marched.start
    for _ in range(marched.steps_per_turn):
        state = marched.step(state)
    seconds = np.ones(int(60 * minutes / marched.seconds))
    before, pace = resident_mb(), Pace(show=lambda line: None)
    pace.start()
    for k in range(len(seconds)):
        begun = time.perf_counter()
        state = marched.step(state)
        seconds[k] = time.perf_counter() - begun
        pace.frame((k + 1) * marched.seconds, "")
    after = resident_mb()
    figures = {"minutes": minutes, "frames": pace.frames, "late_frames": pace.late, "worst_late_s": pace.worst}
    figures |= {"late_share": pace.late / pace.frames, "frame_ms": 1e3 * marched.seconds, "CT": float(state.y.CT)}
    figures |= {f"step_ms_{q:g}": 1e3 * float(np.percentile(seconds, q)) for q in (50, 90, 99, 99.9, 100)}
    figures |= {"over_frame_share": float(np.mean(seconds > marched.seconds))}
    figures |= {"memory_start_mb": before, "memory_end_mb": after, "memory_growth_mb": after - before}
    return {f"long_march_{key}": value for key, value in figures.items()}


def resident_mb() -> float:
    """What the process keeps in memory now (Linux)."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * resource.getpagesize() / 2**20


def measured(name: str, library, chosen) -> dict[str, float]:
    """Everything of one flight."""
    start = start_of(case_of(FLIGHTS[name]), print)
    figures: dict[str, float] = {"pairs": pairs(start.p)}
    for precision, short in SHORT.items():
        factor, made, steps = steps_per_second(start, chosen.turns, precision=precision)
        figures |= {f"real_time_factor_{name}_{short}": factor, f"compile_s_{name}_{short}": made}
        figures["steps_per_turn"] = steps
        ms, call, over = against_c(library, start, precision)
        figures |= {f"rhs_ms_{name}_{short}": ms, f"rhs_call_ms_{name}_{short}": call}
        figures[f"rhs_over_c_{name}_{short}"] = over
    quick = start_of(case_of(FLIGHTS[name], wake=COARSER[name]), print)
    for key, at in (("", start), ("_quick", quick)):
        figures[f"real_time_factor_{name}_f32{key}_two_steps"] = steps_per_second(
            at, chosen.turns, old_age="two steps"
        )[0]
    figures[f"real_time_factor_{name}_f32_quick"] = steps_per_second(quick, chosen.turns)[0]
    if chosen.batch:
        figures[f"throughput_16_{name}_f32"] = steps_per_second(start, 1, batch=16)[0]
    if chosen.accuracy:
        figures |= step_errors(start, FLIGHTS[name], name)
    if chosen.hour and name == "mu015":
        figures |= long_march(start, chosen.hour)
    return figures


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", type=Path, help="where to write the figures")
    parser.add_argument("--turns", type=int, default=3, help="revolutions that are timed")
    parser.add_argument("--no-accuracy", dest="accuracy", action="store_false")
    parser.add_argument("--no-batch", dest="batch", action="store_false")
    parser.add_argument("--hour", type=float, metavar="MINUTES", help="march by the clock for so long")
    chosen = parser.parse_args()
    figures: dict[str, float] = {}
    with tempfile.TemporaryDirectory() as folder:
        library = biot_savart.compile_c(Path(folder))
        for name in FLIGHTS:
            figures |= (found := measured(name, library, chosen))
            print("\n".join(f"{key:44s} {value:.4g}" for key, value in found.items()), flush=True)
    figures |= {"rhs_ms": figures["rhs_ms_hover_f64"], "rhs_over_c": figures["rhs_over_c_hover_f64"]}
    if chosen.accuracy:
        figures["step_error"] = max(v for k, v in figures.items() if k.startswith("step_error"))
    if chosen.json:
        chosen.json.write_text(json_text(figures, indent=1) + "\n")


if __name__ == "__main__":
    main()
