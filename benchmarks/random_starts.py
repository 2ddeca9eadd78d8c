"""Do periodic wakes depend on where the search for them starts?

Prescribed wakes with their contraction, pitch and strength varied at random by ±20 %, each sent through the solver's
own way (Anderson, then Newton-Krylov, over the ground from the first), for the
UH-60 in hover and over level ground. Two wakes are the same where their nodes lie within 1e-5 R (rms).

    python benchmarks/random_starts.py [--starts 20] [--cases hover 1] [--quick] [--json FILE]
"""

import argparse
import sys
import time

import jax
import jax.numpy as jnp
import numpy as np
from tqdm import tqdm

from rotorjax.ground import plane
from rotorjax.io.atomic import json_text
from rotorjax.rotor.catalogue import load
from rotorjax.wake.equilibrium import Unknowns, displacement, evaluated
from rotorjax.wake.model import FreeWake, free_wake
from rotorjax.wake.performance import performance
from rotorjax.wake.search import Search, level
from rotorjax.wake.settings import hover_settings, quick_settings
from rotorjax.wake.start import prescribed

TOL, SAME = 1e-9, 1e-5


def varied(model: FreeWake, contraction: float, pitch: float, strength: float) -> Unknowns:
    """The solver's prescribed wake with its final radius, its descent and its circulation multiplied."""
    x, s = prescribed(model), model.settings
    ages = s.age_step * np.arange(1, s.near_ages + s.far_ages + 1)
    narrowing = 1 + (contraction - 1) * (1 - np.exp(-0.3 * ages))
    scale = jnp.asarray(np.stack([narrowing, narrowing, np.full_like(ages, pitch)], axis=-1))
    near, far = x.near * scale[: s.near_ages], x.far * scale[s.near_ages :]
    return Unknowns(near, far, strength * x.gamma_bound)


def searched(model: FreeWake, factors: np.ndarray) -> tuple[Search, FreeWake, Unknowns]:
    """The way of `solution.solve` from another prescribed wake."""
    search = Search(TOL, None)
    here, x = search.from_nothing(level(model), varied(model, *factors))
    return search, here, x


def run_case(name: str, starts: int, quick: bool) -> dict:
    """All starts of one case; the first is unvaried and compiles."""
    settings = (quick_settings if quick else hover_settings)()
    model = free_wake(*load("uh60"), None if name == "hover" else plane(float(name)), settings)
    rng = np.random.default_rng(0)
    draws = np.concatenate([np.ones((1, 3)), rng.uniform(0.8, 1.2, size=(starts, 3))])
    searched(model, draws[0])  # compiles
    rows, first = [], None
    for factors in tqdm(draws, desc=name, file=sys.stderr):
        begin = time.perf_counter()
        search, here, x = searched(model, factors)
        seconds = time.perf_counter() - begin
        first = x if first is None else first
        found = performance(here, evaluated(here, x))
        rows.append(
            {
                "contraction": float(factors[0]),
                "pitch": float(factors[1]),
                "strength": float(factors[2]),
                "converged": search.ok,
                "why": search.why,
                "residual": search.residuals[-1],
                "iterations": search.iterations,
                "seconds": seconds,
                "CT": float(found.thrust),
                "distance": displacement(jax.tree.map(jnp.subtract, x, first)),
            }
        )
    return {"case": name, "same": sum(r["converged"] and r["distance"] < SAME for r in rows[1:]), "rows": rows}


def table(case: dict) -> str:
    """One case as Markdown."""
    lines = [
        "| contraction | pitch | strength | converged | iterations | seconds | C_T | distance from the first, R |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for r in case["rows"]:
        state = "yes" if r["converged"] else f"no: {r['why']}"
        lines.append(
            f"| {r['contraction']:.2f} | {r['pitch']:.2f} | {r['strength']:.2f} | {state} | {r['iterations']} | "
            f"{r['seconds']:.1f} | {r['CT']:.7f} | {r['distance']:.0e} |"
        )
    head = f"## {case['case']}: {case['same']} of {len(case['rows']) - 1} random starts reach the same wake\n"
    return "\n".join([head, *lines])


def main() -> None:
    """Run the cases, print tables, write JSON."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--starts", type=int, default=20)
    parser.add_argument("--cases", nargs="+", default=["hover", "1"], help="hover or heights over R")
    parser.add_argument("--quick", action="store_true", help="the coarser wake of `rotorjax study --quick`")
    parser.add_argument("--json", help="file to write")
    chosen = parser.parse_args()
    jax.config.update("jax_enable_x64", True)
    found = []
    for name in chosen.cases:
        found.append(run_case(name, chosen.starts, chosen.quick))
        print(table(found[-1]), flush=True)
        if chosen.json:
            with open(chosen.json, "w") as file:
                file.write(json_text(found, indent=1))


if __name__ == "__main__":
    main()
