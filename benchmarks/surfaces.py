"""Solid surfaces: `python benchmarks/surfaces.py [--parts …] [--models …] [--quick] [--json FILE] [--out DIR]`.

Parts: limits (a large flat patch against the image), derivative (of C_T by the distance of a wall, implicit function
theorem against differences; what goes through panels), cost (time over panels × targets), roof (a rotor that crosses
the edge of a roof a radius below it) and hangar (one beside a wall, over its distance), both by the finite states too,
wind (a UH-60 trimmed in a wind of 0.1 ΩR over the edge of a roof), passing (one that flies over a roof at that speed,
marched). The last two have small wakes (`TINY`), the others Knight and Hefner's two-bladed rotor at 8° with a wake that
keeps all of it to minutes: three free turns, 8 azimuths, cores of 0.05 R (`SETTINGS`). --quick: fewer.
"""

import argparse
import time
from dataclasses import replace
from functools import partial
from pathlib import Path

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

import rotorjax as rj
from rotorjax.bench.plotting import FREE_WAKE, VPBFSM, legend_below, new_figure, save_file, style
from rotorjax.frames import disk_points, rotate_about_shaft
from rotorjax.io.atomic import json_text
from rotorjax.panels.kernel import panel_velocity
from rotorjax.panels.surface import Panels, normal_flow, solid
from rotorjax.wake.biot_savart import segment_velocity
from rotorjax.wake.equilibrium import evaluate
from rotorjax.wake.field import at_instants, velocity, wake_segments
from rotorjax.wake.model import azimuths
from rotorjax.wake.sensitivity import periodic_wake
from rotorjax.wake.settings import flight_settings
from rotorjax.wake.solution import readings

jax.config.update("jax_enable_x64", True)

SETTINGS = {"panels": 10, "age_step_deg": 20.0, "near_wake_deg": 100.0, "free_turns": 3.0, "stretch": 1, "azimuths": 8}
SETTINGS |= {"tip_core": 0.05}
COARSE = SETTINGS | {"panels": 8, "free_turns": 2.0, "closure_turns": 1, "closure_bundles": 2}
PLACES = np.linspace(-1.5, 1.5, 13)
MODELS = ("states", "wake")
LOOKS = {"wake": ("free wake", FREE_WAKE), "states": ("finite states", VPBFSM)}
DISTANCES = (1.2, 1.4, 1.7, 2.2, 3.0)
HEIGHT = 1.0
PATCHES = (
    *(("ring", 8.0, panel) for panel in (0.25, 0.125)),
    *(("wake", 8.0, panel) for panel in (0.25, 0.125)),
    *((name, half, 0.125) for name in ("wake", "wake without cores") for half in (16.0, 32.0)),
)
"""Of the part limits: what flow, half of the patch's side and its panels near the shaft, over R."""


def wake(surfaces=None, ground=None, quick=False):
    settings = rj.hover_settings(**(COARSE if quick else SETTINGS))
    return rj.free_wake(*rj.rotor("knight_hefner_2", 8.0), ground, settings, surfaces)


def through(model, state, middles, normals):
    """Normal velocity (I, P) of the wake alone at panels, at every instant of the blades' passage."""
    segments, angles = wake_segments(model, state), azimuths(state)
    instants = len(angles) // model.rotor.blades
    bare = eqx.tree_at(lambda m: m.surfaces, model, None, is_leaf=lambda x: x is None)
    flow = at_instants(bare, segments, jnp.broadcast_to(middles, (instants, *middles.shape)), angles)
    return jnp.sum(flow * normals, axis=-1)


def moments(solved):
    """Hub moments of rigid blades over ρA(ΩR)²R: (C_l, C_m), load to starboard and load ahead positive."""
    load = np.asarray(solved.dct_dr) * np.asarray(solved.found.widths) * np.asarray(solved.r)
    psi = np.asarray(solved.psi)[:, None]
    if psi.size == 1:
        return 0.0, 0.0
    return float((load * np.sin(psi)).sum(axis=1).mean()), float(-(load * np.cos(psi)).sum(axis=1).mean())


def limits(quick: bool) -> dict:
    """A flat patch of panels against the image: of a vortex ring, and of the wake over a plane as it is and with thin
    cores. The wake runs out along the plane: what of it lies beyond a patch is answered by the image alone, and where
    cores are thicker than turns are high, wake and image are no potential flow.
    """
    solved = rj.solve(wake(ground=rj.plane(HEIGHT), quick=quick))
    model, state = solved.found.model, jax.tree.map(jnp.asarray, solved.found.state)
    bare = eqx.tree_at(lambda m: m.ground, model, None)
    segments, angles = wake_segments(model, state), azimuths(state)
    thin = segments._replace(core=jnp.full_like(segments.core, 1e-3))
    corners = disk_points(jnp.full(145, 0.8), jnp.linspace(0, 2 * jnp.pi, 145)) - jnp.array([0, 0, 0.5])
    ring = corners[:-1], corners[1:], jnp.ones(144), jnp.full(144, 0.01)

    def of_wake(vortices, points, plane):
        return at_instants(bare if plane is None else model, vortices, points[None], angles)[0]

    def of_ring(points, plane):
        return segment_velocity(points, *ring, plane=plane)

    flows = {"ring": of_ring, "wake": partial(of_wake, segments), "wake without cores": partial(of_wake, thin)}
    rows = []
    for name, half, panel in PATCHES[::2] if quick else PATCHES:
        row = {"of": name, "half": half, "panel": panel} | against_image(jax.jit(flows[name]), panel, half)
        rows.append(row)
        print(json_text({"flat patch against image": row}), flush=True)
    return {"patch": rows}


def against_image(flow, panel: float, half: float) -> dict:
    """Upflow on the disk of a patch 2 `half` square against the image's: how far off in the mean, and at worst."""
    r, psi = np.meshgrid(np.sqrt((np.arange(6) + 0.5) / 6), 2 * np.pi / 16 * np.arange(16))
    disk = disk_points(jnp.asarray(r.ravel()), jnp.asarray(psi.ravel()))
    image = (flow(disk, rj.plane(HEIGHT)) - flow(disk, None))[:, 2]
    flat = rj.slab((-half, -half), (half, half), -HEIGHT, 0.5, panel)
    top = Panels(flat.corners[np.asarray(flat.normals)[:, 2] > 0.5])
    normal = jnp.sum(flow(top.middles, None) * top.normals, axis=1)
    found = panel_velocity(disk, top.corners, -2 * normal)[:, 2]  # panels of one plane leave each other alone
    mean = float(jnp.mean(found) / jnp.mean(image) - 1)
    most = float(jnp.max(jnp.abs(found - image)) / jnp.max(jnp.abs(image)))
    return {"panels": len(top), "mean_off": mean, "worst_off": most}


def no_flow(solved) -> float:
    """Most of the normal velocity that is left at a panel's middle, its own share the limit from the air."""
    model, state = solved.found.model, jax.tree.map(jnp.asarray, solved.found.state)
    panels = model.surfaces.panels
    blown = through(model, state, panels.middles, panels.normals)
    density = jax.vmap(lambda b: model.surfaces.densities(b, model.ground))(blown)
    left = jax.vmap(lambda d: normal_flow(panels, model.ground, d))(density) + blown
    return float(jnp.max(jnp.abs(left)))


def derivative(quick: bool) -> dict:
    """d C_T by the distance of a wall: periodic wake and all, and of the wake held as it is."""
    wall = rj.wall(1.3, -1.0, 1.0, length=3.0, thickness=0.5, panel=0.5)

    def beside(farther):
        return wake(wall.moved((farther, 0.0, 0.0)), quick=quick)

    here = rj.solve(beside(0.0), tol=1e-10)
    print(json_text({"beside": float(here.CT), "why": here.why, "left_through_panels": no_flow(here)}), flush=True)
    step = 1e-4
    there = [float(rj.solve(beside(s), here, tol=1e-10).CT) for s in (step, -step)]
    row = {"differences": (there[0] - there[1]) / (2 * step)}

    @jax.jit
    def thrust(farther):
        model = beside(farther)
        return readings(model, periodic_wake(here.found, model)).CT

    @jax.jit
    def frozen(farther):
        return jnp.mean(evaluate(beside(farther), here.found.unknowns).velocities.control[..., 2])

    row["frozen_forward"] = float(jax.jvp(frozen, (0.0,), (1.0,))[1])
    row["frozen_differences"] = float(frozen(1e-4) - frozen(-1e-4)) / 2e-4
    print(json_text({"derivative": row}), flush=True)
    row["implicit_forward"] = float(jax.jvp(thrust, (0.0,), (1.0,))[1])
    print(json_text({"derivative": row}), flush=True)
    return row


def cost(quick: bool) -> dict:
    """Seconds of a sum over panels × targets, least of three."""
    rows, device = [], jax.devices()[0].device_kind
    most = 2e8 if jax.default_backend() == "cpu" else 2e10
    rng = np.random.default_rng(0)
    for targets in (1000, 10_000) if quick else (1000, 10_000, 100_000):
        for panel in (0.8, 0.4, 0.2, 0.025):
            corners = rj.box((-2, -2, -1), (2, 2, 1), panel).corners
            points = jnp.asarray(rng.uniform(-3, 3, (targets, 3)))
            density = jnp.asarray(rng.normal(size=len(corners)))
            if len(corners) * targets > most:
                continue
            panel_velocity(points, corners, density).block_until_ready()
            spent = []
            for _ in range(3):
                began = time.perf_counter()
                panel_velocity(points, corners, density).block_until_ready()
                spent.append(time.perf_counter() - began)
            pairs = len(corners) * targets
            rows.append(
                {"panels": len(corners), "targets": targets, "seconds": min(spent), "ns": min(spent) / pairs * 1e9}
            )
            print(json_text({"cost": rows[-1]}), flush=True)
    began = time.perf_counter()
    body = rj.box((-2, -2, -1), (2, 2, 1), 0.25 if quick else 0.14)
    solid(body).inverse.block_until_ready()
    print(json_text({"matrix and inverse, cold": time.perf_counter() - began, "panels": len(body)}), flush=True)
    return {"device": device, "pairs": rows}


def states(surfaces=None, ground=None):
    """The same rotor by the finite states, which take the same surfaces."""
    return rj.solve(rj.finite_state(*rj.rotor("knight_hefner_2", 8.0), ground, surfaces=surfaces))


def row_of(solved) -> dict:
    """Thrust, mean inflow over √C_T, its slopes along x and y over its mean, and hub moments over C_T."""
    r, psi = np.asarray(solved.r), np.asarray(solved.psi)[:, None]
    area = r**2 * np.asarray(solved.found.widths)
    slopes = [
        8 * float((np.asarray(solved.inflow) * wave * area).sum(axis=1).mean()) for wave in (np.cos(psi), np.sin(psi))
    ]
    thrust, mean = float(solved.CT), float(solved.mean_inflow)
    c_l, c_m = moments(solved)
    row = {"CT": thrust, "inflow": mean / np.sqrt(thrust), "C_l": c_l / thrust, "C_m": c_m / thrust}
    row |= {"lambda_1c": slopes[0] / mean, "lambda_1s": slopes[1] / mean} if psi.size > 1 else {}
    return row | {"converged": bool(solved.converged), "why": solved.why}


def solved_by(models, surfaces, ground, quick, last=None) -> dict:
    """The rotor solved by each model; last: a neighbour that the free wake starts from."""
    ways = {
        "states": lambda: states(surfaces, ground),
        "wake": lambda: rj.solve(wake(surfaces, ground, quick), last),
    }
    return {name: ways[name]() for name in models}


def told(name: str, place: dict, solved: dict, panels: int = 0) -> dict:
    """A row of a place, printed: each model's numbers, what goes through the panels, what the search took."""
    row = place | {model: row_of(one) for model, one in solved.items()}
    if "wake" in solved:
        row |= {"iterations": solved["wake"].found.iterations, "seconds": solved["wake"].found.wall_time_s}
        row |= {"left": no_flow(solved["wake"]), "panels": panels} if panels else {}
    print(json_text({name: row}), flush=True)
    return row


def neighbour(solved: dict, surfaces):
    """What a free wake among as many panels may start from."""
    found = solved.get("wake")
    return found if found is not None and surfaces is not None and found.converged else None


def roof(quick: bool, models=MODELS) -> list[dict]:
    """A rotor a radius above a roof whose edge lies at x = edge aft of the hub; over it where that is positive. The
    first two rows are free air and the whole ground.
    """
    rows = [
        told("roof", {"edge": edge}, solved_by(models, None, ground, quick))
        for edge, ground in ((-np.inf, None), (np.inf, rj.plane(HEIGHT)))
    ]
    house_at_hub, last = rj.slab((-6, -3), (0, 3), -HEIGHT, 1.0, 0.3 if quick else 0.25), None
    for edge in PLACES[::-3] if quick else (3.0, *PLACES[::-1]):
        house = house_at_hub.moved((float(edge), 0, 0))
        solved = solved_by(models, house, None, quick, last)
        rows.append(told("roof", {"edge": float(edge)}, solved, len(house)))
        last = neighbour(solved, house)
    return rows


def hangar(quick: bool, models=MODELS) -> tuple[list[dict], dict]:
    """A rotor over ground beside a wall to starboard at each of DISTANCES; the first row is without. And, for the
    picture, the models solved with it at the least distance.
    """
    near = rj.wall(DISTANCES[0], -HEIGHT, 1.0, length=4.0, azimuth_deg=90.0, panel=0.25 if quick else 0.15)
    rows, last, pictured = [], None, {}
    for distance in (np.inf, *(DISTANCES[::2] if quick else DISTANCES)):
        wall = None if np.isinf(distance) else near.moved((0.0, distance - DISTANCES[0], 0.0))
        solved = solved_by(models, wall, rj.plane(HEIGHT), quick, last)
        place = {"distance": float(distance)}
        if distance == DISTANCES[0]:
            pictured = solved
            place |= at_the_wall(solved["wake"]) if "wake" in solved else {}
        rows.append(told("hangar", place, solved, 0 if wall is None else len(wall)))
        last = neighbour(solved, wall)
    return rows, pictured


def at_the_wall(solved) -> dict:
    """Share of the wake's free nodes that have come into the wall, and the flow through its face between the middles of
    panels, rms over that of the wake without it, 0.02 R before it.
    """
    model, state = solved.found.model, jax.tree.map(jnp.asarray, solved.found.state)
    x, y, z = np.moveaxis(np.asarray(rotate_about_shaft(state.far, azimuths(state)[:, None, None])), -1, 0)
    inside = (y > 1.2) & (y < 1.7) & (np.abs(x) < 2) & (z < 1)
    x, z = np.meshgrid(np.linspace(-1.9, 1.9, 39), np.linspace(-0.95, 0.95, 20))
    face = jnp.asarray(np.stack([x, 1.18 + 0 * x, z], axis=-1).reshape(-1, 3))
    bare = eqx.tree_at(lambda m: m.surfaces, model, None)
    left, wanted = (jnp.sqrt(jnp.mean(velocity(state, face, m)[..., 1] ** 2)) for m in (model, bare))
    return {"nodes_inside": float(inside.mean()), "through_face": float(left / wanted)}


def draw_over(rows: list[dict], alone: dict, place: str, label: str, moment: str) -> tuple:
    """Inflow over that of the row `alone`, and a hub moment, over the place of a surface, by each model."""
    figure = new_figure(9.5, 4.2)
    first, second = figure.subplots(1, 2)
    for model in alone.keys() & LOOKS.keys():
        found = [row for row in rows if row[model]["converged"]]
        where, (name, colour) = [row[place] for row in found], LOOKS[model]
        ratio = [row[model]["inflow"] / alone[model]["inflow"] for row in found]
        first.plot(where, ratio, "o-", color=colour, label=name)
        second.plot(where, [row[model][moment] for row in found], "o-", color=colour, label=name)
    first.set(xlabel=label, ylabel=r"$\lambda/\sqrt{C_T}$ over that without")
    side = {"C_m": "load ahead", "C_l": "load to starboard"}[moment]
    second.set(xlabel=label, ylabel=f"hub moment over $C_T R$, {side}")
    return figure, first, second


def draw_roof(rows: list[dict], path: Path) -> None:
    """Inflow and the pitching moment over the place of the edge, and the inflow over the whole ground."""
    air, whole, *places = rows
    with style():
        figure, first, second = draw_over(places, air, "edge", "edge of the roof aft of the hub, x/R", "C_m")
        for model in air.keys() & LOOKS.keys():
            name, colour = LOOKS[model]
            ratio = whole[model]["inflow"] / air[model]["inflow"]
            first.axhline(ratio, color=colour, linestyle=":", label=f"{name}, whole ground")
        legend_below(first, 2)
        legend_below(second, 2)
    save_file(figure, path)


def draw_distance(rows: list[dict], path: Path) -> None:
    """Inflow and the rolling moment over the distance of the wall."""
    with style():
        figure, first, second = draw_over(rows[1:], rows[0], "distance", "distance of the wall, y/R", "C_l")
        legend_below(first, 2)
        legend_below(second, 2)
    save_file(figure, path)


def draw_hangar(pictured: dict, path: Path) -> None:
    """Mean flow of both models in the upright plane through shaft and wall."""
    s, z = np.meshgrid(np.linspace(-2.5, 1.195, 75), np.linspace(-HEIGHT + 0.01, 1.2, 45))
    points = jnp.asarray(np.stack([0 * s, s, z], axis=-1).reshape(-1, 3))
    with style():
        figure = new_figure(7.5, 3.9 * len(pictured))
        for axes, (name, solved) in zip(
            figure.subplots(len(pictured), 1, squeeze=False)[:, 0], pictured.items(), strict=True
        ):
            flow = np.asarray(rj.velocity(solved, points)).reshape(*s.shape, 3)
            speed, along = np.hypot(flow[..., 1], flow[..., 2]), (flow[..., 1], flow[..., 2])
            filled = axes.contourf(s, z, speed, levels=np.linspace(0, 0.09, 13), cmap="viridis", extend="max")
            axes.streamplot(s[0], z[:, 0], *along, color="white", linewidth=0.5, arrowsize=0.6, density=1.4)
            axes.plot([-1, 1], [0, 0], color="black", linewidth=2.5)
            axes.fill_between([1.2, 1.7], -HEIGHT, 1.0, color="#7a5c3e")
            axes.axhline(-HEIGHT, color="#7a5c3e", linewidth=3)
            bounds = {"xlim": (-2.5, 1.7), "ylim": (-HEIGHT - 0.03, 1.2)}
            axes.set(title=LOOKS[name][0], xlabel="to starboard, y/R", ylabel="z/R", aspect="equal", **bounds)
            axes.grid(visible=False)
            figure.colorbar(filled, ax=axes, label=r"mean speed in the plane over $\Omega R$", shrink=0.8)
    save_file(figure, path)


TINY = {"panels": 6, "age_step_deg": 30.0, "near_wake_deg": 120.0, "closure_turns": 1, "closure_bundles": 0}
SPEED, STEPS = 0.1, 24


def flown(**more):
    settings = flight_settings(4, **TINY, azimuths=8)
    return rj.trim(*rj.rotor("uh60"), 0.0058, inflow="freewake", advance=SPEED, wake=settings, **more)


def wind(quick: bool) -> list[dict]:
    """Controls with the hub still in a wind along x, without a roof and over the edge of one, which it blows around."""
    rows = []
    roof = rj.slab((-3.0, -2.0), (0.5, 2.0), -HEIGHT, thickness=0.6, panel=0.7)
    for name, surfaces in (("open", None), ("roof", roof)):
        began, busy = time.perf_counter(), time.process_time()
        found = flown(surfaces=surfaces)
        row = {"of": name, "converged": found.converged, "why": found.trimmed.outcome.why, "CT": float(found.means.CT)}
        row |= {"controls_deg": np.rad2deg(found.trimmed.z.controls).tolist()}
        row |= {"seconds": time.perf_counter() - began, "processor": time.process_time() - busy}
        print(json_text({"wind": row}), flush=True)
        rows.append(row)
    return rows


def passing(quick: bool) -> dict:
    """C_T and hub moments over the place of the hub, controls held, as it flies in still air over a roof 4 R long."""
    roof = rj.slab((-6.0, -2.0), (-2.0, 2.0), -0.6, thickness=0.6, panel=0.7)
    trimmed = flown()
    rows = {}
    for name, surfaces in (("open", None), ("roof", roof)):
        march = rj.march(trimmed, STEPS, surfaces=surfaces)
        state, controls, found = march.start, march.inputs, []
        began, busy = time.perf_counter(), time.process_time()
        for k in range((5 if quick else 12) * STEPS):
            x = -SPEED * 2 * np.pi / STEPS * k
            if surfaces is not None:
                controls = replace(controls, place=np.array([x, 0.0, 0.0]))
            state = march.step(state, controls)
            found.append((x, float(state.y.CT), float(state.y.moment[0]), float(state.y.moment[1])))
        rows[name] = found
        spent = {"seconds": time.perf_counter() - began, "processor": time.process_time() - busy, "steps": len(found)}
        print(json_text({"passing": name, "mean_CT": float(np.mean([row[1] for row in found])), **spent}), flush=True)
    return rows


def draw_passing(rows: dict, path: Path) -> None:
    """Means over a revolution, with and without the roof."""
    with style():
        figure = new_figure(10.0, 3.8)
        for k, (column, label) in enumerate(
            ((1, "$C_T$"), (2, "hub moment about x, aft"), (3, "hub moment about y, to starboard"))
        ):
            axes = figure.add_subplot(1, 3, k + 1)
            for name, colour in (("roof", FREE_WAKE), ("open", "#888888")):
                found = np.array(rows[name])
                mean = np.convolve(found[:, column], np.full(STEPS, 1 / STEPS), mode="valid")
                axes.plot(-found[STEPS // 2 : STEPS // 2 + len(mean), 0], mean, color=colour, label=name)
            axes.axvspan(2.0, 6.0, color="#7a5c3e", alpha=0.15)
            axes.set(xlabel="way flown, over R", ylabel=label)
            legend_below(axes, 2)
    save_file(figure, path)


PARTS = ("limits", "derivative", "cost", "roof", "hangar", "wind", "passing")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--parts", nargs="+", choices=PARTS, default=PARTS)
    parser.add_argument("--models", nargs="+", choices=MODELS, default=MODELS, help="of roof and hangar")
    parser.add_argument("--quick", action="store_true", help="coarser wake, larger panels, fewer places")
    parser.add_argument("--json", type=Path, help="file for all numbers")
    parser.add_argument("--out", type=Path, help="folder for the pictures")
    chosen = parser.parse_args()
    if chosen.out is not None:
        chosen.out.mkdir(parents=True, exist_ok=True)
    found = {}
    for part in chosen.parts:
        more = (chosen.models,) if part in ("roof", "hangar") else ()
        found[part] = globals()[part](chosen.quick, *more)
        pictured = {}
        if part == "hangar":
            found[part], pictured = found[part]
        if chosen.json is not None:
            chosen.json.write_text(json_text(found, indent=1))
        if chosen.out is not None:
            draw(part, found[part], pictured, chosen.out)


def draw(part: str, rows, pictured: dict, out: Path) -> None:
    """The pictures of a part, if it has some."""
    if part == "passing":
        draw_passing(rows, out / "passing.png")
    if part == "roof":
        draw_roof(rows, out / "roof.png")
    if part == "hangar":
        draw_distance(rows, out / "hangar_distance.png")
        draw_hangar(pictured, out / "hangar.png")


if __name__ == "__main__":
    main()
