"""Trims of the UH-60 at C_T/σ = 0.07: time and residual, power against height beside Hayden, power against speed.

    python benchmarks/trims.py [--quick] [--inflows freewake …] [--parts targets heights speeds] [--json FILE]

In flight the shaft tilts to balance the drag of a fuselage, in hover it is upright. Compilation is what XLA reports;
tracing counts as solving. A trim in a model's inflow starts from the one before it, one in the free wake from nothing.
"""

import argparse
import sys
import time
from dataclasses import replace

import jax
from tqdm import tqdm

from rotorjax.io.atomic import json_text
from rotorjax.reference.published import hayden
from rotorjax.rotor.catalogue import load
from rotorjax.rotor.geometry import solidity
from rotorjax.trim.run import Request, numbers, request, run
from rotorjax.wake.clock import Clock
from rotorjax.wake.settings import flight_settings, quick_settings

ROTOR, LOADING, DRAG_AREA = "uh60", 0.07, 3.3  # C_T/σ; f in m², assumed
TARGETS = ((None, 0.0), (0.75, 0.0), (None, 0.15), (None, 0.3))
HEIGHTS = (None, 3.0, 2.0, 1.5, 1.0, 0.75, 0.5)
SPEEDS = (0.0, 0.05, 0.1, 0.15, 0.2, 0.25, 0.3)
INFLOWS = ("freewake", "vpbfsm", "uniform", "pitt-peters")


class Trims:
    """Trims made so far by inflow, height and advance ratio, so that no one is made twice."""

    def __init__(self, quick: bool) -> None:
        self.quick, self.rows, self.last = quick, {}, {}
        self.thrust = LOADING * float(solidity(load(ROTOR)[0]))

    def __call__(self, inflow: str, height: float | None, advance: float) -> dict:
        """One trim's numbers, with `compile_s` and `solve_s`."""
        key = inflow, height, advance
        if key not in self.rows:
            area = DRAG_AREA if advance else None
            self.rows[key] = self._made(request(ROTOR, self.thrust, inflow, advance, height, drag_area=area))
        return self.rows[key]

    def _made(self, request: Request) -> dict:
        clock, cpu = Clock(), time.process_time()
        kind = request.inflow, request.height is None
        found = run(replace(request, wake=self._settings(request)), self.last.get(kind))
        if found.converged:
            self.last[kind] = found
        wall, compiling = clock.read()
        return numbers(found) | {
            "compile_s": compiling,
            "solve_s": wall - compiling,
            "cpu_s": time.process_time() - cpu,
        }

    def _settings(self, request: Request):
        """The trim's own (None), or coarser ones."""
        if not self.quick:
            return None
        coarse = {"panels": 8, "age_step_deg": 20.0, "near_wake_deg": 100.0}
        return flight_settings(4, **coarse) if request.advance else quick_settings(**coarse)


def targets(trims: Trims, inflows: list[str], show) -> str:
    """What the four trims asked for take."""
    lines = [
        "| case | residual | converged | iterations | compile s | solve s | θ₀ | θ₁c | θ₁s (deg) | C_P | C_P induced |",
        "|" + "---|" * 11,
    ]
    for height, advance in TARGETS:
        show(f"{height} {advance}")
        row = trims("freewake", height, advance)
        where = f"μ = {advance:g}" if advance else "hover" if height is None else f"hover, h = {height:g}"
        lines.append(
            f"| {where} | {row['residual']:.1e} | {_said(row)} | {row['iterations']} | {row['compile_s']:.1f} | "
            f"{row['solve_s']:.1f} | {row['collective_deg']:.3f} | {row['theta_1c_deg']:.3f} | "
            f"{row['theta_1s_deg']:.3f} | {row['CP']:.4e} | {row['CP_induced']:.4e} |"
        )
    return "\n".join(lines)


def heights(trims: Trims, inflows: list[str], show) -> str:
    """Power over height at constant thrust, over that out of ground effect."""
    found = {(i, h): (show(f"{i} {h}"), trims(i, h, 0.0))[1] for i in inflows for h in HEIGHTS}
    lines = ["| h | Hayden, induced | " + " | ".join(f"{i}, induced | total" for i in inflows) + " |"]
    lines.append("|" + "---|" * (2 + 2 * len(inflows)))
    for h in reversed(HEIGHTS[1:]):
        cells = [f"{h:g}", f"{hayden(h):.3f}"]
        for i in inflows:
            row, free = found[i, h], found[i, None]
            both = row["converged"] and free["converged"]
            cells += [f"{row[k] / free[k]:.3f}" if both else "not converged" for k in ("CP_induced", "CP")]
        lines.append("| " + " | ".join(cells) + " |")
    alone = [f"{found[i, None][k]:.4e}" for i in inflows for k in ("CP_induced", "CP")]
    return "\n".join([*lines, "| OGE, C_P | | " + " | ".join(alone) + " |"])


def speeds(trims: Trims, inflows: list[str], show) -> str:
    """Power over speed."""
    inflows = [i for i in inflows if i != "vpbfsm"]
    found = {(i, mu): (show(f"{i} {mu}"), trims(i, None, mu))[1] for i in inflows for mu in SPEEDS}
    lines = ["| μ | tilt (deg) | " + " | ".join(f"C_P {i} | induced" for i in inflows) + " |"]
    lines.append("|" + "---|" * (2 + 2 * len(inflows)))
    for mu in SPEEDS:
        rows = [found[i, mu] for i in inflows]
        parts = [f"{r['CP']:.3e} | {r['CP_induced']:.3e}" if r["converged"] else f"{_said(r)} |" for r in rows]
        lines.append(f"| {mu:g} | {rows[0]['tilt_deg']:.2f} | " + " | ".join(parts) + " |")
    least = {i: min((r["CP"], mu) for (j, mu), r in found.items() if j == i and r["converged"])[1] for i in inflows}
    return "\n".join([*lines, "", "Least power at " + ", ".join(f"μ = {mu:g} ({i})" for i, mu in least.items())])


def _said(row: dict) -> str:
    return "yes" if row["converged"] else f"no ({row['residual']:.0e}): {row['why']}"


def main() -> None:
    """Trim, print tables, write JSON."""
    parts = {"targets": targets, "heights": heights, "speeds": speeds}
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="coarser free wakes")
    parser.add_argument("--parts", nargs="+", choices=parts, default=list(parts))
    parser.add_argument("--inflows", nargs="+", choices=INFLOWS, default=list(INFLOWS), help="of the curves")
    parser.add_argument("--json", help="file to write")
    chosen = parser.parse_args()
    jax.config.update("jax_enable_x64", True)
    trims = Trims(chosen.quick)
    print(f"{ROTOR}, C_T = {trims.thrust:.6f}, f = {DRAG_AREA} m²", flush=True)
    with tqdm(file=sys.stderr, desc="trims", unit="") as bar:

        def show(what: str) -> None:
            bar.set_postfix_str(what)
            bar.update()
            if chosen.json:
                with open(chosen.json, "w") as file:
                    file.write(json_text(list(trims.rows.values()), indent=1))

        for name in chosen.parts:
            print("\n" + parts[name](trims, chosen.inflows, show), flush=True)
            show("done")


if __name__ == "__main__":
    main()
