"""What heave is made of: `python benchmarks/heave.py [--height 1] [--quick]`.

UH-60 over level ground. Prints the induced mean inflow after a sudden climb and after the hub has risen at once, in the
free wake's linear model and in the finite-state model, and how much of the free wake's response to heave comes from its
unstable modes.
"""

import argparse

import jax
import numpy as np
import scipy.linalg

from rotorjax.validation.heaving import SAMPLES, Heaving, instants, of_finite_states, of_free_wake
from rotorjax.validation.point import Point
from rotorjax.wake.solution import solve

TURNS = (0.0, 1 / SAMPLES, 0.25, 0.5, 0.75, 1.0, 1.5)


def unstable_part(model: Heaving, frequencies: np.ndarray) -> np.ndarray:
    """Response of the inflow to heave by the modes with Re λ > 0, the others split off."""
    linear = model.linear
    t, q, count = scipy.linalg.schur(linear.a, output="complex", sort=lambda x: x.real > 0)
    mixed = scipy.linalg.solve_sylvester(t[:count, :count], -t[count:, count:], -t[:count, count:])
    left = q.conj().T @ linear.b
    into, out = left[:count] - mixed @ left[count:], (linear.c @ q)[0, :count]
    return np.array(
        [out @ np.linalg.solve(1j * w * np.eye(count) - t[:count, :count], into @ [1j * w, 1.0]) for w in frequencies]
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--height", type=float, default=1.0, help="hub over ground, over R")
    parser.add_argument("--quick", action="store_true", help="coarser free wake")
    options = parser.parse_args()
    jax.config.update("jax_enable_x64", True)
    solution = solve(Point("uh60", 18.0, options.height).model(options.quick))
    models = {"free wake": of_free_wake(solution)}
    for variant in ("quasi-steady", "dynamic"):
        models[variant] = of_finite_states([solution.model], variant)[0]
    rows = [round(t * SAMPLES) for t in TURNS]
    print("revolutions    " + " ".join(f"{t:8.3f}" for t in TURNS) + "   at rest")
    for k, name in enumerate(("inflow over climb", "inflow over rise of the hub")):
        print(name)
        for label, model in models.items():
            found, rest = model.linear.step(instants())[rows, 0, k], model.linear.response(np.zeros(1))[0, 0, k].real
            print(f"  {label:12s} " + " ".join(f"{v:8.4f}" for v in found) + f"  {rest:8.4f}")
    frequencies = np.array([0.02, 0.05, 0.1, 0.2, 0.3, 0.5, 1.0, 2.0])
    free = models["free wake"]
    poles = free.linear.poles()
    print(f"{np.sum(poles.real > 0)} unstable modes, nearest to the axis {poles[np.argmin(np.abs(poles.real))]:.3f}")
    print("frequency, size of the free wake's response, share of the unstable modes")
    whole, part = free.response(frequencies)[:, 0], unstable_part(free, frequencies)
    for w, a, b in zip(frequencies, whole, part, strict=True):
        print(f"  {w:5.2f}  {abs(a):7.4f}  {abs(b) / abs(a):6.2f}")


if __name__ == "__main__":
    main()
