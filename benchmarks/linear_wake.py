"""What derivatives of the periodic wake cost: the linear model of all states, and sensitivities through the orbit.

Prints two tables for the UH-60 over level ground at the study's resolution, after compilation:
1. The linear model of a blade's states, put together from its parts and by forward mode 64 columns at a time, against
   1.5 × (states/64) evaluations of the right-hand side in batches of 64; with the process's peak memory.
2. Derivatives of C_T and of the mean inflow through the periodic wake, forward mode against central differences of
   wakes solved anew, with their cost in Newton iterations of the solve; reverse mode for all parameters at once, in
   solves.

    python benchmarks/linear_wake.py [--height 1] [--quick] [--forward-mode] [--json FILE]
"""

import argparse
import resource
import time

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from rotorjax.ground import plane
from rotorjax.io.atomic import json_text
from rotorjax.linearisation.assembly import assemble
from rotorjax.linearisation.outputs import outputs
from rotorjax.linearisation.system import orbit_of
from rotorjax.ode.linearise import linearise
from rotorjax.rotor.catalogue import load
from rotorjax.wake.dynamics import inputs_of, rhs
from rotorjax.wake.equilibrium import evaluate
from rotorjax.wake.model import free_wake
from rotorjax.wake.performance import performance
from rotorjax.wake.preconditioner import harmonic_inverse
from rotorjax.wake.sensitivity import periodic_wake
from rotorjax.wake.settings import quick_settings, wake_settings
from rotorjax.wake.solution import solve

BATCH = 64
PARAMETERS = {
    "collective (rad)": lambda m: m.operating.collective,
    "height (R)": lambda m: m.ground.height,
    "tip core (R)": lambda m: m.settings.tip_core,
    "twist, outboard half (rad)": lambda m: m.rotor.twist.values,
}


def seconds(call, rounds=3):
    """Median wall time of a call, after one that compiles."""
    call()
    times = []
    for _ in range(rounds):
        begin = time.perf_counter()
        call()
        times.append(time.perf_counter() - begin)
    return float(np.median(times))


def memory_gb():
    """Peak memory of this process so far."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20


def cost_of_the_model(wake, forward_mode):
    """Times and memory of the linear model of all states of a blade."""
    model, u = wake.model, inputs_of(wake.model)
    state = jax.tree.map(jnp.asarray, wake.state)
    many = jax.tree.map(lambda a: jnp.repeat(a[None], BATCH, axis=0), state)
    batch = eqx.filter_jit(lambda x: jax.vmap(lambda one: rhs(0.0, one, u, model))(x))
    begin = memory_gb()

    def whole():
        parts = assemble(wake)
        return parts, parts.jacobian()

    row = {"put_together_s": seconds(whole), "peak_gb_put_together": memory_gb()}
    states = whole()[0].order
    row |= {"states": states, "batch_of_64_s": seconds(lambda: jax.block_until_ready(batch(many)))}
    row |= {"allowed_s": 1.5 * states / BATCH * row["batch_of_64_s"], "peak_gb_before": begin}
    if forward_mode:
        orbit = orbit_of(wake)
        row["forward_mode_s"] = seconds(lambda: linearise(rhs, outputs, orbit, u, model, chunk=BATCH), 1)
        row["peak_gb_forward_mode"] = memory_gb()
    return row


def moved(model, where, step):
    """The model with one parameter moved; a table of twist at its outboard half."""
    value = where(model)
    change = step if value.ndim == 0 else step * (jnp.arange(value.size) >= value.size // 2)
    return eqx.tree_at(where, model, value + change)


def sensitivities(wake, iteration_s, solve_s, step=1e-5):
    """Rows of the second table."""
    model = wake.model

    def read(m):
        found = performance(m, evaluate(m, periodic_wake(wake, m)))
        return jnp.stack([found.thrust, found.mean_inflow])

    # the inverse Jacobian is a constant of these programs: made once, and timed by itself
    inverse_s = seconds(lambda: jax.block_until_ready(harmonic_inverse(model, wake.unknowns, 1)))
    forward = eqx.filter_jit(lambda m, along: eqx.filter_jvp(read, (m,), (along,))[1])
    reverse = eqx.filter_jit(lambda m, weights: eqx.filter_vjp(read, m)[1](weights)[0])
    numbers = eqx.filter(model, eqx.is_inexact_array)
    rows = []
    for name, where in PARAMETERS.items():
        along = jax.tree.map(jnp.subtract, eqx.filter(moved(model, where, 1.0), eqx.is_inexact_array), numbers)
        ours = np.asarray(forward(model, along))
        ends = [solve(moved(model, where, s), start=wake, tol=1e-11) for s in (step, -step)]
        assert all(end.converged for end in ends), name
        far = (np.array([ends[0].CT, ends[0].mean_inflow]) - [ends[1].CT, ends[1].mean_inflow]) / (2 * step)
        cost = seconds(lambda along=along: jax.block_until_ready(forward(model, along)))
        rows.append(
            {
                "parameter": name,
                "dCT": float(ours[0]),
                "dCT_differences": float(far[0]),
                "dlambda0": float(ours[1]),
                "dlambda0_differences": float(far[1]),
                "largest_relative_gap": float(np.max(np.abs(ours / far - 1))),
                "forward_s": cost,
                "newton_iterations_worth": cost / iteration_s,
            }
        )
    reverse_s = seconds(lambda: jax.block_until_ready(reverse(model, jnp.array([1.0, 0.0]))))
    return {
        "rows": rows,
        "inverse_s": inverse_s,
        "inverse_in_newton_iterations": inverse_s / iteration_s,
        "reverse_s": reverse_s,
        "reverse_with_inverse_in_solves": (reverse_s + inverse_s) / solve_s,
    }


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--height", type=float, default=1.0)
    parser.add_argument("--quick", action="store_true", help="the coarser wake of `rotorjax study --quick`")
    parser.add_argument("--forward-mode", action="store_true", help="time forward mode column by column too")
    parser.add_argument("--json", help="file to write")
    chosen = parser.parse_args()
    jax.config.update("jax_enable_x64", True)
    model = free_wake(*load("uh60"), plane(chosen.height), (quick_settings if chosen.quick else wake_settings)())
    solve(model, tol=1e-11)  # compiles
    wake = solve(model, tol=1e-11)
    iteration = wake.wall_time_s / wake.iterations
    print(f"solve: {wake.iterations} iterations, {wake.wall_time_s:.1f} s, residual {wake.residual:.0e} R")
    found = {"solve_s": wake.wall_time_s, "iterations": wake.iterations}
    cost = found["model"] = cost_of_the_model(wake, chosen.forward_mode)
    print(
        f"{cost['states']} states: put together in {cost['put_together_s']:.2f} s; allowed {cost['allowed_s']:.1f} s "
        f"(64 right-hand sides: {cost['batch_of_64_s']:.2f} s); peak {cost['peak_gb_put_together']:.2f} GB "
        f"({cost['peak_gb_before']:.2f} before)"
    )
    if chosen.forward_mode:
        print(f"forward mode: {cost['forward_mode_s']:.1f} s, peak {cost['peak_gb_forward_mode']:.2f} GB")
    table = found["sensitivities"] = sensitivities(wake, iteration, wake.wall_time_s)
    print("| parameter | dC_T | differences | dλ₀ | differences | largest gap | forward, Newton iterations |")
    print("|---|---|---|---|---|---|---|")
    for r in table["rows"]:
        print(
            f"| {r['parameter']} | {r['dCT']:.6g} | {r['dCT_differences']:.6g} | {r['dlambda0']:.6g} | "
            f"{r['dlambda0_differences']:.6g} | {r['largest_relative_gap']:.0e} | {r['newton_iterations_worth']:.2f} |"
        )
    print(
        f"inverse Jacobian, once for all: {table['inverse_s']:.2f} s, {table['inverse_in_newton_iterations']:.1f} "
        f"iterations; reverse mode for all parameters with it: {table['reverse_with_inverse_in_solves']:.2f} solves"
    )
    if chosen.json:
        with open(chosen.json, "w") as file:
            file.write(json_text(found, indent=1))


if __name__ == "__main__":
    main()
