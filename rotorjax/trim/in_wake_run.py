"""A trim in the free wake from what a user asks for: controls and coning are first guessed with Pitt-Peters' inflow."""

import time
from dataclasses import dataclass, replace
from typing import Any

import jax.numpy as jnp
import numpy as np

from rotorjax.errors import InputError
from rotorjax.ground import plane
from rotorjax.rotor import catalogue
from rotorjax.rotor.geometry import solidity
from rotorjax.trim import run as trim_run
from rotorjax.trim.in_wake import Progress, TrimmedInWake, trim_in_wake, wake_trim
from rotorjax.trim.problem import inputs_at, outputs_at
from rotorjax.trim.wake_means import means
from rotorjax.wake.settings import WakeSettings

NAME = "freewake"


@dataclass(frozen=True)
class WakeResult:
    """A trim in the free wake and what it took. tilt: of the shaft (rad). wall_time_s: compilation included."""

    request: trim_run.Request
    trimmed: TrimmedInWake
    tilt: float
    wall_time_s: float


def check_in_wake(request: trim_run.Request) -> None:
    """Raise InputError where something of a request is not allowed."""
    trim_run.check(request)
    trim_run.prepare(replace(request, inflow="vpbfsm"))


def run_in_wake(
    request: trim_run.Request, settings: WakeSettings | None = None, progress: Progress | None = None
) -> WakeResult:
    """Trim in the free wake. A fuselage's drag is balanced by the tilt that the first guess needs.

    Raises InputError where something of the request is not allowed or the thrust is out of reach.
    """
    begun = time.perf_counter()
    check_in_wake(request)
    guess = trim_run.run(replace(request, inflow="pitt-peters", height=None, slope_deg=0.0))
    if not guess.trimmed.outcome.converged:
        raise InputError(
            f"Argument `thrust_coefficient` must be within the rotor's reach, but at {request.thrust:g} no trim is "
            f"found even with Pitt-Peters' inflow ({guess.trimmed.outcome.why}): lower it"
        )
    controls = guess.z.controls
    coning = float(jnp.mean(outputs_at(guess.z, guess.flight, guess.p).flap))
    rotor, operating = catalogue.load(request.rotor)
    ground = None if request.height is None else plane(request.height, request.slope_deg)
    inputs = inputs_at(controls, guess.flight)
    p = wake_trim(rotor, operating, inputs, request.thrust, ground, settings, request.aim)
    start = jnp.stack([controls.theta_0, controls.theta_1c, controls.theta_1s])
    found = trim_in_wake(p, start, coning, progress)
    return WakeResult(request, found, float(controls.tilt), time.perf_counter() - begun)


def wake_numbers(result: WakeResult) -> dict[str, Any]:
    """What --json writes: angles in degrees, coefficients over ρA(ΩR)² and, for power, ρA(ΩR)³."""
    request, found = result.request, result.trimmed
    flown = means(found)
    angles = zip(
        ("collective", "theta_1c", "theta_1s", "tilt", "beta_0", "beta_1c", "beta_1s", "lag_0"),
        np.rad2deg([*found.z.controls, result.tilt, *flown.flap, flown.lag[0]]),
        strict=True,
    )
    return {
        "rotor": found.p.model.rotor.name,
        "inflow": NAME,
        "converged": found.outcome.converged,
        "why": found.outcome.why,
        "residual": found.outcome.residual,
        "iterations": found.iterations,
        "advance_ratio": request.advance,
        "height": request.height,
        "slope_deg": request.slope_deg,
        **{f"{name}_deg": float(value) for name, value in angles},
        "CT": flown.CT,
        "CT_over_solidity": flown.CT / float(solidity(found.p.model.rotor)),
        "CP": flown.CQ,
        "CP_induced": flown.CP_induced,
        "CP_profile": flown.CP_profile,
        "CP_parasite": flown.CP_parasite,
        "CP_damper": flown.CP_damper,
        "hub_roll_moment": -float(flown.moment[0]),
        "hub_pitch_moment": float(flown.moment[1]),
        "figure_of_merit": trim_run.figure_of_merit(flown.CT, flown.CQ, request),
        "wall_time_s": result.wall_time_s,
    }
