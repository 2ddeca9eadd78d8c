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
from rotorjax.simulation.case import COLUMNS, SimulationCase
from rotorjax.simulation.start import Start, settings_of
from rotorjax.trim.run import FREE_WAKE
from rotorjax.wake.settings import WakeSettings

USUAL = 120
"""Steps of a revolution without a free wake."""
STABLE = 2.75
"""|λ|Δψ of the fastest decay; the classical Runge-Kutta method holds 2.785 on the negative real axis."""
AGES = 1.04
"""Age steps that the transport may go in a step; 5PBU4 with that method holds 1.044."""


@eqx.filter_jit
def instant(x: CoupledState, u: RotorInputs, p: Coupled) -> tuple[CoupledState, Outputs]:
    """Rate and outputs at one instant, compiled."""
    return rate_and_output(jnp.zeros(()), x, u, p)


def steps_per_turn(case: SimulationCase, start: Start) -> int:
    """Steps of a revolution: the case's, or what the model needs.

    Raises InputError where the case's are too few for its free wake, whose march would leave the finite numbers.
    """
    if case.steps_per_turn is None:
        return usual_steps(start, _fastest(case))
    _check(case, least_steps(start, _fastest(case)))
    return case.steps_per_turn


def check_steps(case: SimulationCase) -> None:
    """Raise InputError, before the trim's work, where a case's steps are too few for the ages of its free wake."""
    if case.steps_per_turn is not None and case.request.inflow == FREE_WAKE:
        _check(case, twelfths(steps_of_ages(settings_of(case)) * _fastest(case)))


def _fastest(case: SimulationCase) -> float:
    """Highest rotor speed of a case over the nominal one; a lower one never asks for fewer steps."""
    return max(1.0, float(case.columns[:, COLUMNS.index("rotor_speed")].max()) / 100)


def _check(case: SimulationCase, least: int) -> None:
    wanted = case.steps_per_turn
    if wanted is not None and wanted < least:
        at = "" if (speed := _fastest(case)) == 1 else f" at {100 * speed:g} per cent of the rotor speed"
        raise InputError(
            f"[time] steps_per_turn must be at least {least} for this wake{at}, but is {wanted}: leave it out"
        )


def usual_steps(start: Start, speed: float = 1.0) -> int:
    """Steps of a revolution where nobody asks for a number: a multiple of twelve. speed: as in `least_steps`."""
    return max(24, least_steps(start, speed)) if isinstance(start.p, CoupledWake) else USUAL


def least_steps(start: Start, speed: float = 1.0) -> int:
    """Least steps of a revolution with which a free wake can be marched, a multiple of twelve; 1 without one.

    speed: the highest of the rotor over the nominal one, of whose revolution the steps are.
    """
    return max(1, twelfths(stable_steps(start) * speed))


def stable_steps(start: Start) -> float:
    """Steps of a revolution with which the march of a free wake is just stable; 0 without one.

    Its transport along age allows AGES, a bound circulation that follows passes STABLE over its fastest decay; that of
    the solution's filter is taken exactly.
    """
    if not isinstance(start.p, CoupledWake):
        return 0.0
    of_ages = steps_of_ages(start.p.settings)
    if start.p.settings.bound_filter == "solution":
        return of_ages
    return max(of_ages, 2 * np.pi * fastest_decay(start.x, start.inputs, start.p) / STABLE)


def steps_of_ages(settings: WakeSettings) -> float:
    """Steps of a revolution with which the transport along wake age is just stable."""
    return settings.steps_per_turn / AGES


def twelfths(steps: float) -> int:
    """The multiple of twelve that is enough."""
    return 12 * int(np.ceil(steps / 12 - 1e-9))


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
