"""Several rotors over ground: `python benchmarks/several.py [--parts …] [--default] [--json FILE] [--out DIR]`.

Parts: quadrotor (one periodic hover at h = 1, hubs 2.5 R apart: seconds from an empty process, residual, the air that
comes up in the middle), heights (thrust at one collective over height, of the single rotor, of two side by side and of
four), edge (two rotors, one over a deck, one beside it), march (the four marched from their periodic wake, for a
revolution as they are and then with diagonal pairs 3 % faster and slower: a yaw command), linear (the four linearised,
and steps of yaw and of all collectives beside the nonlinear march, over a revolution). Knight and Hefner's
two-bladed rotor at 8°, senses alternating; the wakes of `SETTINGS` keep all to minutes, `--default` takes those of
`rj.several_wakes`.

For cold times: `JAX_COMPILATION_CACHE_DIR=$(mktemp -d) python benchmarks/several.py --parts quadrotor --default`.
"""

import argparse
import time
from dataclasses import replace
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np

import rotorjax as rj
from rotorjax.bench.plotting import legend_below, new_figure, save_file, style
from rotorjax.io.atomic import json_text
from rotorjax.linearisation.several import PHASES, about

jax.config.update("jax_enable_x64", True)
BEGAN = time.perf_counter()

SETTINGS = {"panels": 10, "age_step_deg": 20.0, "near_wake_deg": 100.0, "free_turns": 3.0, "stretch": 1, "azimuths": 8}
SETTINGS |= {"tip_core": 0.05}
HALF = 1.25
SINGLE = [(0.0, 0.0, 0.0)]
PAIR = [(0.0, -HALF, 0.0), (0.0, HALF, 0.0)]
QUAD = [(-HALF, -HALF, 0.0), (-HALF, HALF, 0.0), (HALF, HALF, 0.0), (HALF, -HALF, 0.0)]
YAW = 0.03
STEPS = {
    "yaw: diagonal pairs 0.2 % faster and slower": {"omega": 0.002 * np.array([1, -1, 1, -1])},
    "all collectives up by 0.05°": {"theta_0": np.full(4, np.deg2rad(0.05))},
}
HEIGHTS = (3.0, 2.0, 1.5, 1.0, 0.75)


def rotors(places, height=None, settings=None, **more):
    ground = None if height is None else rj.plane(height)
    return rj.several_wakes(*rj.rotor("knight_hefner_2", 8.0), places, ground=ground, settings=settings, **more)


def single(height=None, settings=None):
    ground = None if height is None else rj.plane(height)
    return rj.free_wake(*rj.rotor("knight_hefner_2", 8.0), ground, settings)


def along(solved, points) -> np.ndarray:
    return np.asarray(solved.velocity(jnp.asarray(points)))


def quadrotor(settings, out: Path | None) -> dict:
    """Time, residual, thrust beside four rotors alone, and the flow up in the middle of the four."""
    solved = rj.solve(rotors(QUAD, 1.0, settings))
    row = {"seconds": time.perf_counter() - BEGAN, "processor": time.process_time()}
    row |= {"converged": solved.converged, "why": solved.why, "residual": solved.found.residual}
    row |= {"iterations": solved.found.iterations, "CT": solved.CT.tolist()}
    z = np.linspace(-0.98, 0.6, 80)
    up = along(solved, np.stack([0 * z, 0 * z, z], axis=1))[:, 2]
    row |= {"most_upflow": float(up.max()), "at_z": float(z[up.argmax()])}
    row["over_hover_inflow"] = row["most_upflow"] / float(np.sqrt(solved.CT.mean() / 2))
    print(json_text({"quadrotor": row}), flush=True)
    if out is not None:
        draw_fountain(solved, out / "quadrotor.png")
    return row


def draw_fountain(solved, path: Path) -> None:
    """Mean flow in two upright planes: between the rotors, and through two hubs."""
    s, z = np.meshgrid(np.linspace(-3.0, 3.0, 81), np.linspace(-0.99, 0.8, 50))
    with style():
        figure = new_figure(11.0, 3.9)
        for k, (x, title) in enumerate(((0.0, "between the rotors"), (HALF, "through two hubs"))):
            flow = along(solved, np.stack([0 * s + x, s, z], axis=-1).reshape(-1, 3)).reshape(*s.shape, 3)
            axes = figure.add_subplot(1, 2, k + 1)
            levels = np.linspace(-0.06, 0.06, 25)
            filled = axes.contourf(s, z, flow[..., 2], levels=levels, cmap="RdBu_r", extend="both")
            axes.streamplot(s[0], z[:, 0], flow[..., 1], flow[..., 2], color="#555555", linewidth=0.5, arrowsize=0.6)
            if x:
                for y in (-HALF, HALF):
                    axes.plot([y - 1, y + 1], [0, 0], color="black", linewidth=2.5)
            axes.axhline(-1.0, color="#7a5c3e", linewidth=3)
            axes.set(xlabel="to starboard, y/R", aspect="equal", title=title, xlim=(-3, 3), ylim=(-1.03, 0.8))
            axes.grid(visible=False)
        figure.axes[0].set_ylabel("z/R")
        figure.colorbar(filled, ax=figure.axes, label=r"mean flow upward over $\Omega R$", shrink=0.7)
    save_file(figure, path)


def heights(settings, out: Path | None) -> dict:
    """C_T over that of the single rotor in free air, at one collective; each height starts from the one before."""
    alone = rj.solve(single(None, settings))
    rows = {"single": [], "pair": [], "quad": []}
    last = {}
    for height in (None, *HEIGHTS):
        for name, places in (("single", SINGLE), ("pair", PAIR), ("quad", QUAD)):
            model = single(height, settings) if name == "single" else rotors(places, height, settings)
            start = last.get(name) if height not in (None, HEIGHTS[0]) else None
            found = rj.solve(model, start)
            last[name] = found
            row = {"height": height, "ratio": float(np.mean(found.CT) / alone.CT), "converged": bool(found.converged)}
            row |= {"why": found.why, "inflow": float(np.mean(found.mean_inflow))}
            print(json_text({name: row}), flush=True)
            rows[name].append(row)
    if out is not None:
        draw_heights(rows, out / "over_ground.png")
    return rows


def draw_heights(rows: dict, path: Path) -> None:
    labels = {"single": "single rotor", "pair": "two side by side", "quad": "four"}
    with style():
        figure = new_figure(6.0, 4.2)
        axes = figure.add_subplot()
        for name, label in labels.items():
            found = [(row["height"], row["ratio"]) for row in rows[name][1:] if row["converged"]]
            (line,) = axes.plot(*np.array(found).T, "o-", label=f"{label}, 2.5 R apart" if name != "single" else label)
            axes.axhline(rows[name][0]["ratio"], color=line.get_color(), linestyle=":", linewidth=0.8)
        axes.set(xlabel="height of the hubs, h/R", ylabel=r"$C_T$ over that of the single rotor in free air")
        legend_below(axes, 3)
    save_file(figure, path)


def edge(settings, out: Path | None) -> dict:
    """Port rotor over a deck a radius below, starboard rotor beside its edge, no ground."""
    deck = rj.slab((-2.5, -3.5), (2.5, 0.0), -1.0, thickness=0.5, panel=0.4)
    began = time.perf_counter()
    solved = rj.solve(rotors(PAIR, None, settings, surfaces=deck))
    row = {"seconds": time.perf_counter() - began, "converged": solved.converged, "why": solved.why}
    row |= {"panels": len(deck), "residual": solved.found.residual, "CT": solved.CT.tolist()}
    row |= {"inflow": solved.mean_inflow.tolist()}
    print(json_text({"edge": row}), flush=True)
    if out is not None:
        solved.plot(out / "deck_edge.png")
    return row


def march(settings, out: Path | None) -> dict:
    """How far the march leaves the periodic wake in a revolution, what a yaw command does in two, and a step's time."""
    solved = rj.solve(rotors(QUAD, 1.0, settings))
    began = time.perf_counter()
    marched = rj.march(solved)
    row = {"converged": solved.converged, "compile_seconds": time.perf_counter() - began}
    turn, state, rows = marched.steps_per_turn, marched.start, []
    began = time.perf_counter()
    for k in range(3 * turn):
        command = marched.inputs if k < turn else replace(marched.inputs, omega=1 + YAW * np.array([1, -1, 1, -1]))
        state = marched.step(state, command)
        rows.append(np.stack([state.y.thrust, state.y.power]))
    found = np.array(rows)  # (steps, thrust and power, rotors)
    row |= {"steps_per_turn": turn, "ms_a_step": 1e3 * (time.perf_counter() - began) / len(rows)}
    row["drift_in_a_turn"] = float(np.abs(found[:turn, 0].mean(axis=0) / solved.CT - 1).max())
    last = found[-turn:].mean(axis=0)
    row |= {"CT_after_yaw": last[0].tolist(), "CP_after_yaw": last[1].tolist()}
    row["ripple"] = float((np.ptp(found[:turn, 0], axis=0) / solved.CT).max())
    print(json_text({"march": row}), flush=True)
    if out is not None:
        draw_march(found, turn, solved, out / "yaw.png")
    return row


def draw_march(found, turn: int, solved, path: Path) -> None:
    """Thrust and power of each rotor over the revolutions."""
    turns = np.arange(len(found)) / turn
    with style():
        figure = new_figure(9.0, 3.6)
        for k, (name, rest) in enumerate((("C_T", solved.CT), ("C_P", solved.CP))):
            axes = figure.add_subplot(1, 2, k + 1)
            for i, (x, y, _) in enumerate(QUAD):
                where = f"{'aft' if x > 0 else 'fore'}, {'starboard' if y > 0 else 'port'}"
                axes.plot(turns, found[:, k, i] / rest[i], label=where, ls="-" if i < 2 else "--")
            axes.axvline(1, color="#555555", lw=0.8)
            axes.set(xlabel="revolutions", ylabel=f"${name}$ over that of the periodic wake")
        legend_below(figure.axes[0], 2)
    save_file(figure, path)


def linear(settings, out: Path | None) -> dict:
    """Thrust, torque and inflow after small steps: of the linear model and of the march, a mean over its phases."""
    solved = rj.solve(rotors(QUAD, 1.0, settings))
    began = time.perf_counter()
    model = rj.linearise(solved)
    row = {"converged": solved.converged, "linearise_seconds": time.perf_counter() - began, "order": model.order}
    row |= {"step_error": model.notes["step_error"], "largest_growth": float(model.poles().real.max())}
    marched = rj.march(solved, precision="double")
    rest = responses(marched, solved, {})
    times = 2 * np.pi / marched.steps_per_turn * np.arange(len(rest))
    found = {}
    for name, change in STEPS.items():
        truth = responses(marched, solved, change) - rest
        ours = model.step(times) @ np.concatenate([change.get(of, np.zeros(4)) for of in ("theta_0", "omega")])
        found[name] = truth, ours.reshape(truth.shape)
        gap = np.abs(truth - found[name][1]).max(axis=(0, 2)) / np.abs(truth).max(axis=(0, 2))
        row |= {name: dict(zip(("CT", "CQ", "inflow"), gap.tolist(), strict=True))}
    print(json_text({"linear": row}), flush=True)
    if out is not None:
        draw_linear(times, found, out / "linear.png")
    return row


def responses(marched, solved, change) -> np.ndarray:
    """Outputs (steps, kinds, rotors) over a revolution, a mean over starts half a blade's passage apart."""
    rows = []
    inputs = replace(marched.inputs, **{name: getattr(marched.inputs, name) + size for name, size in change.items()})
    for began in np.pi * np.arange(PHASES) / PHASES:  # two blades
        state = replace(marched.start, x=about(solved.found.model, solved.found.state, jnp.asarray(began)))
        row = []
        for _ in range(marched.steps_per_turn + 1):
            state = marched.step(state, inputs)
            row.append([state.y.thrust, state.y.power / inputs.omega, state.y.mean_inflow])
        rows.append(row)
    return np.mean(rows, axis=0)


def draw_linear(times, found, path: Path) -> None:
    """Of a rotor of each diagonal, C_T and C_Q after both commands: the march as lines, the linear model dashed."""
    with style():
        figure = new_figure(9.0, 5.4)
        for j, (name, (truth, ours)) in enumerate(found.items()):
            for k, of in enumerate(("C_T", "C_Q")):
                axes = figure.add_subplot(2, 2, 2 * j + k + 1)
                for i, (x, y, _) in enumerate(QUAD[:2]):
                    where = f"{'aft' if x > 0 else 'fore'}, {'starboard' if y > 0 else 'port'}"
                    axes.plot(times / 2 / np.pi, truth[:, k, i], label=f"{where}: march")
                    axes.plot(times / 2 / np.pi, ours[:, k, i], "k--", lw=1.2, label="linear model" if i else None)
                axes.set(xlabel="revolutions", ylabel=f"change of ${of}$", title=name)
        figure.legend(*figure.axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=3)
    save_file(figure, path)


PARTS = {"quadrotor": quadrotor, "heights": heights, "edge": edge, "march": march, "linear": linear}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--parts", nargs="+", choices=PARTS, default=list(PARTS))
    parser.add_argument("--default", action="store_true", help="the wakes that rj.several_wakes takes by default")
    parser.add_argument("--json", type=Path, help="file for all numbers")
    parser.add_argument("--out", type=Path, help="folder for pictures")
    chosen = parser.parse_args()
    if chosen.out is not None:
        chosen.out.mkdir(parents=True, exist_ok=True)
    settings = None if chosen.default else rj.hover_settings(**SETTINGS)
    found = {part: PARTS[part](settings, chosen.out) for part in chosen.parts}
    if chosen.json is not None:
        chosen.json.write_text(json_text(found, indent=1))


if __name__ == "__main__":
    main()
