"""How long a step of the march may be."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from rotorjax.coupled import Coupled, CoupledState, Outputs, rate_and_output
from rotorjax.coupled_wake import CoupledWake
from rotorjax.device import cpu
from rotorjax.errors import InputError
from rotorjax.rotor.hub import RotorInputs
from rotorjax.simulation.case import SimulationCase
from rotorjax.simulation.start import Start

USUAL = 120
"""Steps of a revolution without a free wake."""
STABLE = 2.75
"""|λ|Δψ of the fastest decay; the classical Runge-Kutta method holds 2.785 on the negative real axis."""


@eqx.filter_jit
def instant(x: CoupledState, u: RotorInputs, p: Coupled) -> tuple[CoupledState, Outputs]:
    """Rate and outputs at one instant, compiled."""
    return rate_and_output(jnp.zeros(()), x, u, p)


def steps_per_turn(case: SimulationCase, start: Start) -> int:
    """Steps of a revolution: the case's, or what the model needs.

    Raises InputError where the case's are too few for its free wake, whose march would leave the finite numbers.
    """
    wanted = case.steps_per_turn
    if wanted is None:
        return usual_steps(start)
    if wanted < (least := least_steps(start)):
        raise InputError(f"[time] steps_per_turn must be at least {least} for this wake, but is {wanted}: leave it out")
    return wanted


def usual_steps(start: Start) -> int:
    """Steps of a revolution where nobody asks for a number: a multiple of twelve."""
    return max(24, least_steps(start)) if isinstance(start.p, CoupledWake) else USUAL


def least_steps(start: Start) -> int:
    """Least steps of a revolution with which a free wake can be marched, a multiple of twelve; 1 without one.

    Its transport along age allows one age step (5PBU4 with the classical Runge-Kutta method: 1.044), a bound
    circulation that follows passes STABLE over its fastest decay; that of the solution's filter is taken exactly.
    """
    if not isinstance(start.p, CoupledWake):
        return 1
    decay = fastest_decay(start.x, start.inputs, start.p) if start.p.settings.bound_filter == "pass" else 0.0
    return 12 * int(np.ceil(max(2 * np.pi * decay / STABLE, start.p.settings.steps_per_turn) / 12 - 1e-9))


def fastest_decay(x: CoupledState, u: RotorInputs, p: CoupledWake, rounds: int = 24) -> float:
    """Largest |λ| of the bound circulation's rate (per radian), by power iteration on its differences.

    It may be the stiff part of the system: on narrow panels at the tip the paper's filter follows its own downwash,
    many times faster than its time constant (wake/lifting_line.py).
    """

    x, u, p = jax.device_get((x, u, p))

    def rate(gamma: Float[Array, "B R"]) -> np.ndarray:
        with cpu():
            found = instant(eqx.tree_at(lambda x: x.inflow.gamma_bound, x, gamma), u, p)[0]
        return np.asarray(found.inflow.gamma_bound)

    gamma = x.inflow.gamma_bound
    here, size = rate(gamma), 1e-6 * float(np.abs(gamma).max())
    way, found = np.random.default_rng(0).normal(size=gamma.shape), 0.0
    for _ in range(rounds):
        way *= size / np.linalg.norm(way)
        way = rate(gamma + way) - here
        found = float(np.linalg.norm(way)) / size
    return found
