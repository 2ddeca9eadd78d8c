"""Steps of a rotor's inputs marched with the nonlinear equations, and by its linear model: what one is worth."""

from collections.abc import Sequence

import equinox as eqx
import jax
import numpy as np
from jaxtyping import Float

from rotorjax.errors import InputError
from rotorjax.linearisation.drive import UNITS
from rotorjax.linearisation.rotor import Base, outputs, rates
from rotorjax.ode.labels import labels
from rotorjax.ode.models import PeriodicModel
from rotorjax.ode.runge_kutta import RK5, ButcherTableau
from rotorjax.ode.trajectory import march

SIZES = {"rad": float(np.deg2rad(0.05)), "ΩR": 3e-4, "Ω": 1e-4, "Ω²R": 3e-4, "Ω²": 1e-4, "R": 0.003}
"""Size of a step by the input's unit."""
SAMPLES, STEPS = 24, 10
"""Times of a revolution at which responses are compared, and steps of the march between two."""
FLOOR = 0.05
"""Share of an output's largest response, over all inputs, below which a response counts as that share: many are zero by
symmetry.
"""
ROUNDING = 1e-9
"""Response of which nothing is left but rounding."""


@eqx.filter_jit
def _read(times, states, u, p):
    return jax.lax.map(lambda at: outputs(at[0], at[1], u, p), (times, states))


def marched(
    base: Base,
    names: Sequence[str],
    chosen: Sequence[str],
    samples: int = SAMPLES,
    each: int = STEPS,
    tableau: ButcherTableau = RK5,
) -> Float[np.ndarray, "N q m"]:
    """Deviation of the chosen outputs over a revolution after a step of each input (SIZES) at ψ = 0, from the march
    without one; `each` steps from one of the samples to the next, by a method. Raises InputError where a march leaves
    the finite numbers.
    """
    start = jax.tree.map(lambda leaf: leaf[0], base.orbit.x)
    columns: list[int] = []

    def responses(u) -> np.ndarray:
        step = 2 * np.pi / (samples * each)
        path = march(
            rates, start, 0.0, step, samples * each, u, base.p, save_every=each, progress=False, tableau=tableau
        )
        if not path.finished:
            raise InputError(f"Argument `about` must be a trim that can be marched, but the march is {path.why}")
        read = _read(path.t, path.x, u, base.p)
        if not columns:
            every = labels(jax.tree.map(lambda leaf: leaf[0], read), "y")
            columns.extend(every.index(name) for name in chosen)
        flat = np.concatenate([np.asarray(leaf).reshape(path.t.size, -1) for leaf in jax.tree.leaves(read)], axis=1)
        return flat[:, columns]

    rest = responses(base.u)
    moved = [responses(base.u | {name: base.u[name] + size_of(name)}) for name in names]
    return np.stack([found - rest for found in moved], axis=-1)


def size_of(name: str) -> float:
    """Size of a step of an input."""
    return SIZES[UNITS[name]]


def modelled(model: PeriodicModel, sizes: Sequence[float]) -> Float[np.ndarray, "N q m"]:
    """The same by a periodic model."""
    fine = model.refined(2 * SAMPLES * 5)
    return np.stack([fine.step(size * np.eye(len(sizes))[m])[1][::5] for m, size in enumerate(sizes)], axis=-1)


def largest_gap(truth: Float[np.ndarray, "N q m"], other: Float[np.ndarray, "N q m"]) -> Float[np.ndarray, "q m"]:
    """Largest difference over the largest value of the true response, or FLOOR of the output's over all inputs."""
    top = np.abs(truth).max(axis=0)
    least = np.maximum(np.maximum(top, FLOOR * top.max(axis=1, keepdims=True)), ROUNDING)
    return np.abs(other - truth).max(axis=0) / least
