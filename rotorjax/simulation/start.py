"""Where a flight starts: the trim that its case asks for, with any inflow."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import equinox as eqx
import jax
import jax.numpy as jnp

from rotorjax.coupled import Coupled, CoupledState, RotorState
from rotorjax.coupled_wake import CoupledWake
from rotorjax.errors import InputError
from rotorjax.ground import pitched
from rotorjax.rotor import catalogue, multiblade
from rotorjax.rotor.hub import RotorInputs
from rotorjax.simulation.case import SimulationCase
from rotorjax.trim import in_wake_run
from rotorjax.trim.dispatch import check_request, numbers_of
from rotorjax.trim.in_wake import TrimmedInWake
from rotorjax.trim.in_wake_run import WakeResult
from rotorjax.trim.problem import inputs_at
from rotorjax.trim.run import Result
from rotorjax.trim.run import run as run_trim
from rotorjax.wake.equilibrium import full_state
from rotorjax.wake.settings import WakeSettings, flight_settings, wake_settings


@dataclass(frozen=True)
class Start:
    """A trim as a flight needs it. x: state with blade 0 at ψ = 0. tilt: of the shaft, forward (rad).

    CT, CQ: the trim's means over a revolution; NaN where they are not known.
    """

    p: Coupled
    x: CoupledState
    inputs: RotorInputs
    tilt: float
    CT: float = math.nan
    CQ: float = math.nan


def start_of(case: SimulationCase, progress: Callable[[str], None] | None = None) -> Start:
    """Trim. Raises InputError where the flight is not allowed or does not trim."""
    check_request(case.request)
    if case.request.inflow == in_wake_run.NAME:

        def show(stage: str, residual: float) -> None:
            if progress is not None:
                progress(f"{stage}, residual {residual:.1e}")

        result = in_wake_run.run_in_wake(case.request, settings_of(case), show)
        found = from_wake(result)
    else:
        result = run_trim(case.request)
        found = from_trim(result)
    if not result.trimmed.outcome.converged:
        raise InputError(f"[flight] must be a flight that can be trimmed, but: {result.trimmed.outcome.why}")
    means = numbers_of(result)
    return replace(found, CT=means["CT"], CQ=means["CP"])  # C_Q = C_P


def settings_of(case: SimulationCase) -> WakeSettings:
    """Settings of the free wake: those of its trim, with what the case has of its own. Raises InputError as they do."""
    blades = catalogue.load(case.request.rotor)[0].blades
    if case.request.advance:
        return flight_settings(blades, **case.wake)
    return wake_settings(**{"azimuths": 2 * blades, **case.wake})


def from_trim(result: Result) -> Start:
    """Start from a trim with an inflow model."""
    z = result.z
    x = CoupledState(jnp.zeros(()), *jax.tree.map(lambda v: v[0], (z.rotor, z.inflow)))
    return Start(result.p, x, inputs_at(z.controls, result.flight), float(z.controls.tilt))


def from_wake(result: WakeResult) -> Start:
    """Start from a trim in the free wake."""
    trimmed = result.trimmed
    model, p = trimmed.model, trimmed.p
    ground = model.ground if model.ground is None else pitched(model.ground, jnp.asarray(result.tilt))
    height = None if ground is None else ground.height
    theta_0, theta_1c, theta_1s = trimmed.z.controls
    inputs = replace(p.inputs, theta_0=theta_0, theta_1c=theta_1c, theta_1s=theta_1s, height=height)
    coupled = CoupledWake(model.rotor, model.operating, p.blade, ground, model.settings)
    return Start(coupled, state_at(trimmed, 0), inputs, result.tilt)


def state_at(trimmed: TrimmedInWake, slice_: int) -> CoupledState:
    """The coupled state that a trim has with blade 0 at its slice `slice_`, from 0 to K/B − 1."""
    model, z = trimmed.model, trimmed.z
    blades, count = model.rotor.blades, z.flap.shape[0]
    flight = model.flight
    assert flight is not None
    assert flight.lag is not None
    assert flight.lag_rate is not None

    def of_blades(v):
        return jnp.repeat(v, blades, axis=0) if count == 1 else v[slice_ :: count // blades]

    psi = jnp.asarray(2 * jnp.pi * slice_ / count, float)

    def motion(angle, rate):
        return multiblade.from_blades(of_blades(angle), of_blades(rate), psi, jnp.ones(()))

    rotor = RotorState(*motion(flight.flap, flight.flap_rate), *motion(flight.lag, flight.lag_rate))
    return CoupledState(psi, rotor, jax.tree.map(of_blades, _full_state(model, z.wake)[0]))


_full_state = eqx.filter_jit(full_state)
