"""The same programs on a GPU and on the CPU beside it: are the numbers the same, and what does the GPU gain?

    python benchmarks/gpu.py --make-start FILE
    python benchmarks/gpu.py --start FILE [--json FILE] [--scale 10] [--batch 16 256] [--parts marches sums …]

Trims are made once, on a CPU, and kept in FILE; without one they are made first. Without a GPU all figures are the
CPU's, and it says so. Both run in one process, one after the other, in single (f32) and double (f64) precision:

marches  `rj.march` of the UH-60 at C_T = 0.0058 (benchmarks/real_time.py: hover over h = 1 and advance ratio 0.15),
         stepped by the host. difference_…: largest of a revolution after 1 degree of collective, over the largest
         value of the CPU's, of C_T, thrust-weighted mean inflow C_Pi/C_T, flapping and wake nodes; …_single: of
         each in single precision from the CPU in double. real_time_factor_….
sums     The Biot-Savart sum alone: N points, N segments, as many pairs as the hover's and `scale`² times as many.
fine     One right-hand side of the hover with `scale` times the nodes: pairs a second.
batches  Marches side by side: revolutions a second, all together.
grids    Steady finite-state inflow at many heights and slopes: points a second.

Programs of a part are compiled side by side, and only then timed; a part that fails says so and the rest goes on.
"""

import argparse
import os
import pickle
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import biot_savart
import equinox as eqx
import finite_state
import jax
import jax.numpy as jnp
import numpy as np
from real_time import FLIGHTS, SHORT, case_of, pairs
from scipy.interpolate import interp1d

from rotorjax.coupled import rate_and_output
from rotorjax.ground import plane
from rotorjax.io.atomic import json_text
from rotorjax.potential.model import finite_state_model, steady_state
from rotorjax.simulation.march import March, MarchState, cast, compiled, march, marching, on_device, precision_of
from rotorjax.simulation.start import Start, start_of
from rotorjax.simulation.step import usual_steps
from rotorjax.wake.biot_savart import segment_velocity

jax.config.update("jax_enable_x64", True)
Figures = Iterator[tuple[str, Any]]
Places = dict[str, Any]
Programs = dict[tuple[str, ...], Any]
STEPS_OF_AGE = (15.0, 10.0, 9.0, 7.5, 6.0, 5.0, 4.5, 3.75, 3.0, 2.5, 2.25, 2.0, 1.875, 1.5, 1.25, 1.0)
"""Degrees that divide the 90 of the near wake."""

ROOM = {"cpu": 32, "gpu": 2000}
"""Points of a grid at once: what stays in caches, and what fills a GPU (2 GB)."""


def places() -> Places:
    """Where programs run: the CPU, and the GPU if jax has one."""
    found = {"cpu": jax.devices("cpu")[0]}
    return found if jax.default_backend() == "cpu" else found | {"gpu": jax.devices()[0]}


def kept(starts: dict[str, Start], file: Path) -> None:
    """Write trims, as numpy arrays in the package's own classes."""

    def bare(leaf: Any) -> Any:
        return np.asarray(leaf) if isinstance(leaf, jax.Array) else leaf

    fields = {name: jax.tree.map(bare, vars(start)) for name, start in starts.items()}
    file.write_bytes(pickle.dumps(fields))


def starts_of(file: Path | None) -> dict[str, Start]:
    """Trims from a file (of one's own: it is unpickled), or made here and now on the CPU."""
    if file is not None:
        return {name: Start(**fields) for name, fields in pickle.loads(file.read_bytes()).items()}
    with jax.default_device(jax.devices("cpu")[0]):
        return {name: start_of(case_of(flight), print) for name, flight in FLIGHTS.items()}


def together(tasks: dict[tuple[str, ...], Callable[[], Any]]) -> tuple[Programs, list[tuple[str, Any]]]:
    """What the tasks make, side by side, each on its place (the key's last word), and figures of how that went."""

    def one(key: tuple[str, ...]) -> tuple[Any, float]:
        begun = time.perf_counter()
        with jax.default_device(places()[key[-1]]):
            return tasks[key](), time.perf_counter() - begun

    made, told = {}, []
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        running = {key: pool.submit(one, key) for key in tasks}
        for key, future in running.items():
            label = "_".join(key)
            try:
                made[key], seconds = future.result()
                told.append((f"compile_s_{label}", seconds))
            except Exception as problem:
                told.append((f"failed_{label}", repr(problem)[:300]))
    return made, told


def median_s(run: Callable[[], Any], least: int = 5, most_s: float = 3.0) -> float:
    """Median seconds of a call, after one that warms up."""
    jax.block_until_ready(run())
    taken, begun = [], time.perf_counter()
    while len(taken) < least or (len(taken) < 100 and time.perf_counter() - begun < most_s):
        at = time.perf_counter()
        jax.block_until_ready(run())
        taken.append(time.perf_counter() - at)
        if time.perf_counter() - begun > 4 * most_s:
            break
    return float(np.median(taken))


def turn(marched: March, controls: Any = None) -> list[MarchState]:
    """The states of one revolution, from the start."""
    states = [marched.start]
    for _ in range(marched.steps_per_turn):
        states.append(marched.step(states[-1], controls))
    return states[1:]


def told(marched: March) -> dict[str, np.ndarray]:
    """A revolution after 1 degree of collective, as double-precision numbers."""
    controls = replace(marched.inputs, theta_0=marched.inputs.theta_0 + np.deg2rad(1.0))
    states = jax.device_get(turn(marched, controls))
    rows = {
        "CT": [s.y.CT for s in states],
        "inflow": [s.y.CP_induced / s.y.CT for s in states],
        "flap": [s.x.rotor.flap for s in states],
        "nodes": [s.x.inflow.far for s in states],
    }
    return {key: np.asarray(value, float) for key, value in rows.items()}


def marches(starts: dict[str, Start], at: Places, chosen: argparse.Namespace) -> Figures:
    """Single marches: factors, and differences between places and precisions."""
    _, said = together({("decay", name, "cpu"): partial(usual_steps, starts[name]) for name in starts})
    yield from said
    keys = [(name, short, place) for name in starts for short in SHORT.values() for place in at]
    long = {short: precision for precision, short in SHORT.items()}
    made, said = together({key: partial(march, starts[key[0]], precision=long[key[1]]) for key in keys})
    yield from said
    for key, marched in made.items():
        seconds = median_s(partial(turn, marched), 3)
        yield f"real_time_factor_{'_'.join(key)}", marched.steps_per_turn * marched.seconds / seconds
        yield f"step_ms_{'_'.join(key)}", 1e3 * seconds / marched.steps_per_turn
    flown = {key: told(marched) for key, marched in made.items()}
    for name in starts:
        for kind, of, against in (
            ("f64", ("f64", "gpu"), ("f64", "cpu")),
            ("f32", ("f32", "gpu"), ("f32", "cpu")),
            ("single_gpu", ("f32", "gpu"), ("f64", "cpu")),
            ("single_cpu", ("f32", "cpu"), ("f64", "cpu")),
        ):
            if (name, *of) in flown and (name, *against) in flown:
                for what, reference in flown[name, *against].items():
                    error = np.abs(flown[name, *of][what] - reference).max() / np.abs(reference).max()
                    yield f"difference_{name}_{kind}_{what}", float(error)


def sums(starts: dict[str, Start], at: Places, chosen: argparse.Namespace) -> Figures:
    """The sum alone."""
    usual = round(np.sqrt(pairs(starts["hover"].p)))
    sizes = {"": usual, f"_x{chosen.scale:g}": round(chosen.scale * usual)}

    def one(count: int, short: str) -> Callable[[], Any]:
        dtype = np.float32 if short == "f32" else np.float64
        args = biot_savart.as_segments(biot_savart.problem(count, dtype))
        program = jax.jit(partial(segment_velocity, products=True)).lower(*args).compile()
        return lambda: program(*args)

    keys = [(size, short, place) for size in sizes for short in SHORT.values() for place in at]
    made, said = together(
        {(f"sum{size}", short, place): partial(one, sizes[size], short) for size, short, place in keys}
    )
    yield from said
    results = {}
    for key, run in made.items():
        count = sizes[key[0].removeprefix("sum")]
        yield f"pairs_per_s_{'_'.join(key)}", count**2 / median_s(run)
        results[key] = np.asarray(run(), float)
    for size in sizes:
        for key in (key for key in results if key[0] == f"sum{size}" and (key[0], "f64", "cpu") in results):
            reference = results[key[0], "f64", "cpu"]
            yield f"error_{'_'.join(key)}", float(np.abs(results[key] - reference).max() / np.abs(reference).max())


def finer(start: Start, scale: float) -> Start:
    """The same flight with about `scale` times the nodes, its wake read off between the nodes."""
    p, old = marching(start.p), start.x.inflow
    panels = round(p.settings.panels * np.sqrt(scale))

    def nodes(settings) -> int:
        return settings.panels + (settings.panels + 1) * settings.near_ages + settings.filaments * settings.far_ages

    tried = [replace(p.settings, panels=panels, age_step_deg=step) for step in STEPS_OF_AGE]
    settings = min(tried, key=lambda s: abs(nodes(s) - scale * nodes(p.settings)))
    blades, near, far = p.rotor.blades, settings.near_ages, settings.far_ages
    shapes = {
        "near": (blades, panels + 1, near, 3),
        "far": (blades, settings.filaments, far, 3),
        "gamma_near": (blades, panels, near),
        "gamma_far": (blades, settings.filaments, far),
        "gamma_bound": (blades, panels),
    }
    inflow = replace(old, **{name: resampled(np.asarray(getattr(old, name)), shapes[name]) for name in shapes})
    return replace(start, p=replace(p, settings=settings), x=eqx.tree_at(lambda x: x.inflow, start.x, inflow))


def resampled(a: np.ndarray, shape: tuple[int, ...]) -> np.ndarray:
    """An array at other places between its first and last, along every axis."""
    for axis, count in enumerate(shape):
        if count != a.shape[axis]:
            a = interp1d(np.linspace(0, 1, a.shape[axis]), a, axis=axis)(np.linspace(0, 1, count))
    return a


def fine(starts: dict[str, Start], at: Places, chosen: argparse.Namespace) -> Figures:
    """One right-hand side of a wake with many nodes."""
    start = finer(starts["hover"], chosen.scale)
    yield "pairs_fine", pairs(start.p)
    yield "panels_fine", start.p.settings.panels
    yield "age_step_deg_fine", start.p.settings.age_step_deg

    def one(precision) -> Callable[[], Any]:
        with precision_of(precision):
            args = on_device(cast((start.x, start.inputs, start.p), precision))
            program = compiled(lambda *args: rate_and_output(jnp.zeros(()), *args), *args)
        return lambda: program(*args)

    tasks = {("fine", short, place): partial(one, precision) for precision, short in SHORT.items() for place in at}
    made, said = together(tasks)
    yield from said
    thrust = {}
    for key, run in made.items():
        seconds = median_s(run)
        yield f"rhs_ms_{'_'.join(key)}", 1e3 * seconds
        yield f"pairs_per_s_{'_'.join(key)}", pairs(start.p) / seconds
        thrust[key] = np.concatenate([np.ravel(np.asarray(v, float)) for v in jax.tree.leaves(run()[0].inflow)])
    for key in (key for key in thrust if ("fine", "f64", "cpu") in thrust):
        reference = thrust["fine", "f64", "cpu"]
        yield f"error_{'_'.join(key)}", float(np.linalg.norm(thrust[key] - reference) / np.linalg.norm(reference))


def batches(starts: dict[str, Start], at: Places, chosen: argparse.Namespace) -> Figures:
    """Marches side by side in single precision; on a CPU they go one after the other, so that a few tell all."""
    keys = [(name, str(count), place) for name in starts for count in chosen.batch for place in at]
    keys = [key for key in keys if key[2] != "cpu" or int(key[1]) == min(chosen.batch)]
    made, said = together({key: partial(march, starts[key[0]], batch=int(key[1])) for key in keys})
    yield from said
    for key, marched in made.items():
        seconds = median_s(partial(marched.step, marched.start))
        label, count = f"{key[0]}_batch{key[1]}_f32_{key[2]}", int(key[1])
        yield f"steps_per_s_{label}", count / seconds
        yield f"flown_s_per_s_{label}", count * marched.seconds / seconds


def grids(starts: dict[str, Start], at: Places, chosen: argparse.Namespace) -> Figures:
    """Steady finite states at many heights and slopes."""
    counts = {place: min(chosen.points, 100 * ROOM[place]) for place in at}

    def one(precision, place: str) -> Callable[[], Any]:
        grounds = np.random.default_rng(0).uniform([0.7, 0.0], [3.0, 0.35], (counts[place], 2))
        with precision_of(precision):
            model = finite_state_model(plane(1.0, 15.0), harmonics=1, ground_harmonics=1, ground_radial_terms=5)
            model, grounds = on_device(cast((model, grounds), precision))
            tau = jnp.zeros(len(model.modes)).at[:3].set(jnp.array([2.3e-3, 5e-4, 2e-4]))

            def states(model, grounds):
                def of(ground):
                    return steady_state(finite_state.set_ground(model, ground), tau).a

                return jax.lax.map(of, grounds, batch_size=ROOM[place])

            program = compiled(states, model, grounds)
        return lambda: program(model, grounds)

    tasks = {("grid", short, k): partial(one, precision, k) for precision, short in SHORT.items() for k in at}
    made, said = together(tasks)
    yield from said
    found = {}
    for key, run in made.items():
        yield f"points_per_s_{'_'.join(key)}", counts[key[2]] / median_s(run, 2)
        found[key] = np.asarray(run(), float)[: min(counts.values())]
    for key in (key for key in found if ("grid", "f64", "cpu") in found):
        reference = found["grid", "f64", "cpu"][: len(found[key])]
        yield f"error_{'_'.join(key)}", float(np.abs(found[key] - reference).max() / np.abs(reference).max())


PARTS = {"marches": marches, "sums": sums, "fine": fine, "batches": batches, "grids": grids}


def header(at: Places) -> dict[str, Any]:
    """What it ran on."""
    if "gpu" not in at:
        print("no GPU here: figures are of the CPU", flush=True)
    named = {f"device_{place}": device.device_kind for place, device in at.items()}
    return named | {"cores": os.cpu_count(), "load_average": os.getloadavg()[0], "jax": jax.__version__}


def main() -> None:
    """Measure, and keep what is known so far."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", type=Path, help="where to write the figures")
    parser.add_argument("--start", type=Path, metavar="FILE", help="trims that --make-start wrote")
    parser.add_argument("--make-start", type=Path, metavar="FILE", help="trim, write and end")
    parser.add_argument("--scale", type=float, default=10.0, help="nodes of the fine wake over the usual")
    parser.add_argument("--batch", type=int, nargs="+", default=[16, 256], help="marches side by side")
    parser.add_argument("--points", type=int, default=10_000, help="of a grid; a CPU takes fewer")
    parser.add_argument("--parts", nargs="+", choices=PARTS, default=list(PARTS))
    parser.add_argument("--until", type=float, default=np.inf, metavar="SECONDS", help="begin no part after these")
    chosen = parser.parse_args()
    if chosen.make_start:
        kept(starts_of(None), chosen.make_start)
        return
    begun = time.perf_counter()
    starts, at = starts_of(chosen.start), places()
    figures = header(at)
    for part in chosen.parts:
        if time.perf_counter() - begun > chosen.until:
            figures[f"left_out_{part}"] = "no time left"
            continue
        for key, value in chain(PARTS[part](starts, at, chosen), part):
            figures[key] = value
            shown = value if isinstance(value, str) else f"{value:.4g}"
            print(f"{time.perf_counter() - begun:6.1f} s  {key:52s} {shown}", flush=True)
            if chosen.json:
                chosen.json.write_text(json_text(figures, indent=1) + "\n")


def chain(found: Figures, part: str) -> Figures:
    """A part's figures, and in place of an error that it ends in, a figure that says so."""
    try:
        yield from found
    except Exception as problem:
        yield f"failed_{part}", repr(problem)[:300]


if __name__ == "__main__":
    main()
