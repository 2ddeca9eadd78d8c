"""Time the finite-state model: `python benchmarks/finite_state.py [--json FILE]`. Medians; compilation apart."""

import argparse
import time
from collections.abc import Callable
from pathlib import Path

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from rotorjax.deck.blades import linear_blades, stations
from rotorjax.deck.march import simulate
from rotorjax.deck.over_ground import OverGround, controls, over_ground, trim
from rotorjax.deck.tip_path import tip_path
from rotorjax.ground import Plane, plane
from rotorjax.io.atomic import json_text
from rotorjax.potential.ground_source import DiskQuadrature
from rotorjax.potential.ground_table import ground_table
from rotorjax.potential.model import FiniteStateModel, finite_state_model, inflow, mean_inflow, steady_state
from rotorjax.potential.moving_ground import still
from rotorjax.potential.wake_transport import wake_transport
from rotorjax.rotor.catalogue import load

R, PSI = np.linspace(0.02, 0.99, 64), np.arange(72) * 2 * np.pi / 72


def measure(function: Callable, *arguments: object, repeats: int) -> dict[str, float]:
    """Compile, then time `repeats` calls."""
    start = time.perf_counter()
    compiled = jax.jit(function).lower(*arguments).compile()
    compile_s = time.perf_counter() - start
    jax.block_until_ready(compiled(*arguments))
    runs = []
    for _ in range(repeats):
        start = time.perf_counter()
        jax.block_until_ready(compiled(*arguments))
        runs.append(time.perf_counter() - start)
    return {"compile_s": compile_s, "median_s": float(np.median(runs)), "repeats": repeats}


def set_ground(model: FiniteStateModel, ground: jax.Array) -> FiniteStateModel:
    return eqx.tree_at(lambda m: m.ground, model, Plane(ground[0], ground[1]))


def moving(
    harmonics: int, terms: int, variant: str, slope: float = 0.0, loads: bool = True, flapping: bool = False
) -> OverGround:
    """A rotor over moving ground, heights 0.5 to 3, with rigid blades or with the UH-60's flapping."""
    rotor = finite_state_model(
        None, harmonics, terms, harmonics, 5, quadrature=DiskQuadrature(12, max(8, 4 * harmonics))
    )
    transport = wake_transport(3.3, 8) if variant == "dynamic" else None
    table = ground_table(rotor, (0.5, 3.0), (-slope, slope), transport=transport, tolerance=1e-6)
    at = stations(0.1, 10, max(6, 2 * harmonics + 2))
    flap = tip_path(*load("uh60")) if flapping else None
    return over_ground(rotor, table, linear_blades(0.08) if loads else None, variant, transport, at, flap)


def march(model: OverGround, seconds: float, steps_per_turn: int, save_every: int) -> tuple[Callable, tuple, int]:
    """A landing from 2 R to 0.7 R on a heaving deck at 27 rad/s; the function, its arguments and the steps."""
    steps = round(seconds * 27.0 / (2 * np.pi) * steps_per_turn) // save_every * save_every
    psi = jnp.linspace(0, steps * 2 * np.pi / steps_per_turn, steps + 1)
    tau = jnp.zeros(len(model.rotor.modes)).at[0].set(2.6e-3)

    def ground(psi: jax.Array) -> jax.Array:
        down = psi / psi[-1]
        return 2 - 1.3 * down**2 * (3 - 2 * down) - 0.06 * jnp.sin(0.03 * psi)

    height = ground(psi)
    climb = jnp.gradient(height + 0.06 * jnp.sin(0.03 * psi), psi)
    slope = 0 * psi
    motion = type(still(plane(1.0)))(height, slope, jnp.gradient(height, psi), slope)
    start = trim(model, controls(still(plane(2.0)), model.rotor, jnp.deg2rad(8.0), tau=tau))

    def run(collective: jax.Array) -> jax.Array:
        inputs = controls(motion, model.rotor, collective, climb, tau=tau)
        return simulate(model, start, psi, inputs, save_every).outputs.uniform

    return run, (jnp.deg2rad(8.0),), steps


def dynamic_cases() -> dict[str, dict[str, float]]:
    """Steps of the moving model, a thousand rotors at once, and a landing of 60 s."""
    results = {}
    for name, settings in {
        "quasi-steady_given_loads": (4, 6, "quasi-steady", 0.0, False),
        "quasi-steady_linear_blades": (4, 6, "quasi-steady", 0.0, True),
        "quasi-steady_flapping": (4, 6, "quasi-steady", 0.0, True, True),
        "quasi-steady_pitching": (4, 6, "quasi-steady", 8.0, True),
        "quasi-steady_pitching_flapping": (4, 6, "quasi-steady", 8.0, True, True),
        "dynamic_given_loads": (4, 6, "dynamic", 0.0, False),
        "dynamic_linear_blades": (4, 6, "dynamic", 0.0, True),
        "dynamic_flapping": (4, 6, "dynamic", 0.0, True, True),
    }.items():
        run, arguments, steps = march(moving(*settings), 15.0, 32, 16)
        found = measure(run, *arguments, repeats=9)
        results[f"step_m4_6_terms_{name}"] = {**found, "step_us": 1e6 * found["median_s"] / steps}
    for name, flapping in {"": False, "_flapping": True}.items():
        model = moving(1, 3, "quasi-steady", flapping=flapping)
        run, (collective,), steps = march(model, 1.0, 32, 1)
        many = measure(jax.vmap(run), collective + jnp.linspace(-0.02, 0.02, 1000), repeats=9)
        results[f"step_of_1000_rotors{name}"] = {**many, "step_us": 1e6 * many["median_s"] / steps}
    for name, settings in {
        "dynamic_m1_pitching": (1, 3, "dynamic", 5.0),
        "dynamic_m1_pitching_flapping": (1, 3, "dynamic", 5.0, True, True),
        "dynamic_m4": (4, 6, "dynamic", 0.0),
        "dynamic_m4_flapping": (4, 6, "dynamic", 0.0, True, True),
    }.items():
        run, arguments, steps = march(moving(*settings), 60.0, 32 if settings[0] == 4 else 16, 8)
        results[f"landing_60_s_{name}"] = {**measure(run, *arguments, repeats=3), "steps": steps}
    return results


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", type=Path, help="write the results to this file")
    options = parser.parse_args()
    jax.config.update("jax_enable_x64", True)
    model = finite_state_model(plane(1.0, 15.0), harmonics=1, radial_terms=3, ground_harmonics=1, ground_radial_terms=5)
    r, psi = jnp.array(R), jnp.array(PSI)
    tau = jnp.zeros(len(model.modes)).at[:3].set(jnp.array([2.3e-3, 5e-4, 2e-4]))
    heights, slopes = np.meshgrid(np.linspace(0.9, 3, 40), np.linspace(0, 0.6, 25), indexing="ij")
    grounds = jnp.array(np.stack([heights.ravel(), slopes.ravel()], axis=-1))

    def one(ground: jax.Array, tau: jax.Array) -> jax.Array:
        chosen = set_ground(model, ground)
        return inflow(steady_state(chosen, tau), r, psi, chosen)

    def batch(grounds: jax.Array, tau: jax.Array) -> jax.Array:
        def mean(ground: jax.Array) -> jax.Array:
            chosen = set_ground(model, ground)
            return mean_inflow(steady_state(chosen, tau), chosen)

        return jax.vmap(mean)(grounds)

    results = {
        "inflow_64x72": measure(one, grounds[500], tau, repeats=100),
        "inflow_64x72_jacobian_by_ground": measure(jax.jacfwd(one), grounds[500], tau, repeats=20),
        "mean_inflow_of_1000_grounds": measure(batch, grounds, tau, repeats=5),
    }
    results |= dynamic_cases()
    for name, result in results.items():
        print(
            f"{name:46s} median {1e3 * result['median_s']:9.3f} ms   compile {result['compile_s']:6.2f} s"
            + (f"   step {result['step_us']:8.1f} µs" if "step_us" in result else "")
        )
    if options.json:
        options.json.write_text(json_text(results, indent=2) + "\n")


if __name__ == "__main__":
    main()
