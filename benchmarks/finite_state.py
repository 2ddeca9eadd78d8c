"""Time the finite-state model: `python benchmarks/finite_state.py [--json FILE]`. Medians; compilation apart."""

import argparse
import json
import time
from collections.abc import Callable
from pathlib import Path

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from rotorjax.ground import Plane, plane
from rotorjax.potential.model import FiniteStateModel, finite_state_model, inflow, mean_inflow, steady_state

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
    for name, result in results.items():
        print(f"{name:34s} median {1e3 * result['median_s']:9.3f} ms   compile {result['compile_s']:6.2f} s")
    if options.json:
        options.json.write_text(json.dumps(results, indent=2) + "\n")


if __name__ == "__main__":
    main()
