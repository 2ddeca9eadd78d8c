"""The wake over ever steeper ground, and what ends it: `python benchmarks/steep_slope.py [--quick] [--picture FILE]`.

UH-60 at h = 1. Follows the periodic wake in the slope by pseudo-arclength, through folds, and prints slope, C_T and
mean inflow of each point, and which nodes move most from point to point.
"""

import argparse
from pathlib import Path

import equinox as eqx
import jax
import jax.numpy as jnp
import matplotlib.pyplot as plt
import numpy as np

from rotorjax.bench.cases import Case
from rotorjax.bench.settings import study_settings
from rotorjax.bench.wake_file import model_of
from rotorjax.io.atomic import whole_file
from rotorjax.ode.continuation import Branch, follow
from rotorjax.ode.linear import Krylov
from rotorjax.wake.equilibrium import Unknowns, evaluated, residual
from rotorjax.wake.model import FreeWake
from rotorjax.wake.performance import performance
from rotorjax.wake.preconditioner import HarmonicInverse
from rotorjax.wake.search import Search
from rotorjax.wake.solution import solve

APPROACH_DEG = (15.0, 25.0, 30.0, 31.0)
"""Slopes solved in turn; the branch is followed on from the last two."""


class Inverse(eqx.Module):
    """The wake's preconditioner, for unknowns (wake, slope)."""

    wake: HarmonicInverse

    def __call__(self, v, z, anchor, tangent, length, args):
        return self.wake(v[0], z[0], args[0]), v[1]


def over(x: Unknowns, slope, model: FreeWake) -> Unknowns:
    return residual(x, tilted(model, slope))


def tilted(model: FreeWake, slope) -> FreeWake:
    return eqx.tree_at(lambda m: m.ground.slope, model, jnp.asarray(slope, float))


def branch(quick: bool, points: int) -> tuple[FreeWake, Branch]:
    settings = study_settings(quick=quick)
    found = solve(model_of(Case(1.0), settings))
    ends = []
    for slope in APPROACH_DEG:
        found = solve(model_of(Case(1.0, slope), settings), found)
        print(f"{slope:5.1f}°: {found.why}", flush=True)
        ends.append((found.unknowns, float(np.deg2rad(slope))))
    search = Search(1e-7, None)
    search.prepare(found.model, found.unknowns)
    assert search.inverse is not None
    linear = Krylov(forcing=0.03, precondition=Inverse(search.inverse), restart=200, restarts=1)
    model = found.model
    followed = follow(over, *ends[-2:], model, points=points, linear=linear, tol=1e-6, max_iterations=10, progress=True)
    return model, followed


def moving_most(before: Unknowns, after: Unknowns, model: FreeWake) -> str:
    """The node of the tip vortex that goes furthest from one point to the next."""
    gone = np.linalg.norm(np.asarray(after.far - before.far)[:, 0], axis=-1)
    k, age = np.unravel_index(np.argmax(gone), gone.shape)
    settings = model.settings
    degrees = settings.age_step_deg * (settings.near_ages + 1 + age)
    share = float(np.sum(gone[k] ** 2) / np.sum(gone**2))
    return f"{360 * k / len(gone):5.0f} {degrees:6.0f} {gone.max():7.4f} {share:5.2f}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="coarser free wake")
    parser.add_argument("--points", type=int, default=20)
    parser.add_argument("--picture", type=Path, help="PNG of the branch")
    options = parser.parse_args()
    jax.config.update("jax_enable_x64", True)
    model, followed = branch(options.quick, options.points)
    rows = []
    print("slope/°   C_T      inflow   tip vortex: blade at ψ/°, age/°, moved/R, its blade's share")
    for k, (slope, outcome) in enumerate(zip(followed.parameters, followed.outcomes, strict=True)):
        here = tilted(model, slope)
        numbers = performance(here, evaluated(here, outcome.x[0]))
        rows.append((np.rad2deg(slope), float(numbers.thrust), float(numbers.mean_inflow)))
        moved = moving_most(followed.outcomes[k - 1].x[0], outcome.x[0], model) if k else ""
        print("{:8.4f} {:8.6f} {:8.6f}".format(*rows[-1]), moved)
    print(followed.why, "; folds at", [round(rows[k][0], 3) for k in followed.folds if k < len(rows)])
    if options.picture:
        figure, axes = plt.subplots(1, 2, figsize=(8, 3.2), layout="constrained")
        for ax, column, name in ((axes[0], 1, "$C_T$"), (axes[1], 2, "mean inflow over $\\Omega R$")):
            ax.plot([r[0] for r in rows], [r[column] for r in rows], ".-")
            ax.set(xlabel="slope of the ground, degrees", ylabel=name)
        with whole_file(options.picture) as path:
            figure.savefig(path, dpi=150, format="png")


if __name__ == "__main__":
    main()
