"""How long a step of the march may be."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from rotorjax.coupled import Coupled, CoupledState, Outputs, rate_and_output
from rotorjax.coupled_wake import CoupledWake
from rotorjax.errors import InputError
from rotorjax.rotor.hub import RotorInputs
from rotorjax.simulation.case import SimulationCase
from rotorjax.simulation.start import Start

USUAL = 120
"""Steps of a revolution without a free wake."""
STABLE = 3.0
"""|λ|Δψ of the fastest decay; the method holds 3.3 on the negative real axis."""


@eqx.filter_jit
def instant(x: CoupledState, u: RotorInputs, p: Coupled) -> tuple[CoupledState, Outputs]:
    """Rate and outputs at one instant, compiled."""
    return rate_and_output(jnp.zeros(()), x, u, p)


def steps_per_turn(case: SimulationCase, start: Start) -> int:
    """Steps of a revolution: the case's, or what the model needs.

    Raises InputError where the case's are too few for its free wake, whose march would leave the finite numbers.
    """
    wanted = case.steps_per_turn
    if not isinstance(start.p, CoupledWake):
        return wanted or USUAL
    decay = fastest_decay(start.x, start.inputs, start.p)
    least = 12 * int(np.ceil(2 * np.pi * decay / STABLE / 12))
    if wanted is None:
        return least
    if wanted < least:
        raise InputError(
            f"[time] steps_per_turn must be at least {least} for this wake, whose bound circulation decays by "
            f"{decay:.0f} per radian, but is {wanted}: leave it out, or raise circulation_lag in [wake]"
        )
    return wanted


def fastest_decay(x: CoupledState, u: RotorInputs, p: CoupledWake, rounds: int = 24) -> float:
    """Largest |λ| of the bound circulation's rate (per radian), by power iteration on its differences.

    It is the stiff part of the system: on narrow panels at the tip the circulation follows its own downwash, many times
    faster than the filter's time constant.
    """

    def rate(gamma: Float[Array, "B R"]) -> np.ndarray:
        return np.asarray(instant(eqx.tree_at(lambda x: x.inflow.gamma_bound, x, gamma), u, p)[0].inflow.gamma_bound)

    gamma = jax.device_get(x.inflow.gamma_bound)
    here, size = rate(x.inflow.gamma_bound), 1e-6 * float(np.abs(gamma).max())
    way, found = np.random.default_rng(0).normal(size=gamma.shape), 0.0
    for _ in range(rounds):
        way *= size / np.linalg.norm(way)
        way = rate(jnp.asarray(gamma + way)) - here
        found = float(np.linalg.norm(way)) / size
    return found
