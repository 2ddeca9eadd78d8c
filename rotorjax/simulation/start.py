"""Where a flight starts: the trim that its case asks for, with any inflow."""

import math
import warnings
from collections.abc import Callable
from dataclasses import dataclass, replace

import equinox as eqx
import jax
import jax.numpy as jnp

from rotorjax.coupled import Coupled, CoupledState, RotorState
from rotorjax.coupled_wake import CoupledWake
from rotorjax.errors import InputError
from rotorjax.ground import pitched
from rotorjax.rotor import multiblade
from rotorjax.rotor.hub import RotorInputs
from rotorjax.simulation.case import SimulationCase
from rotorjax.trim.in_wake import TrimmedInWake
from rotorjax.trim.problem import inputs_at
from rotorjax.trim.run import FREE_WAKE, Result, run
from rotorjax.trim.solve import Trimmed
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

    def show(stage: str, residual: float) -> None:
        if progress is not None:
            progress(f"{stage}, residual {residual:.1e}")

    wake = settings_of(case) if case.request.inflow == FREE_WAKE else None
    return from_result(run(replace(case.request, wake=wake), progress=show))


def settings_of(case: SimulationCase) -> WakeSettings:
    """Settings of the free wake: those of its trim, with what the case has of its own. Raises InputError as they do."""
    blades = case.request.rotor.blades
    chosen = {"bound_filter": "solution", "pair_sums": "products", **case.wake}
    if case.request.advance:
        return flight_settings(blades, **chosen)
    return wake_settings(**{"azimuths": 2 * blades, **chosen})


def from_result(result: Result) -> Start:
    """Start from a trim. Raises InputError where it has not converged."""
    found = result.trimmed
    if not found.outcome.converged:
        raise InputError(f"[flight] must be a flight that can be trimmed, but: {found.outcome.why}")
    start = from_wake(found) if isinstance(found, TrimmedInWake) else from_trim(found)
    return replace(start, CT=result.means.CT, CQ=result.means.CQ)


def from_trim(trimmed: Trimmed) -> Start:
    """Start from a trim with an inflow model."""
    z = trimmed.z
    x = CoupledState(jnp.zeros(()), *jax.tree.map(lambda v: v[0], (z.rotor, z.inflow)))
    return Start(trimmed.p, x, inputs_at(z.controls, trimmed.flight), float(z.controls.tilt))


def from_wake(trimmed: TrimmedInWake) -> Start:
    """Start from a trim in the free wake. Warns where it is periodic with a damping that marches do not have."""
    model, p = trimmed.model, trimmed.p
    if model.settings.azimuth_damping:
        warnings.warn(
            f"The trim is periodic with its wake's highest harmonics damped (azimuth_damping = "
            f"{model.settings.azimuth_damping:g}); a march and a linear model have no such damping and drift from it. "
            "For a trim without, try thicker cores ([wake] tip_core) or another speed",
            stacklevel=3,
        )
    tilt = 0.0 if p.inputs.pitch is None else -float(p.inputs.pitch)
    ground = model.ground if model.ground is None else pitched(model.ground, jnp.asarray(tilt))
    height = None if ground is None else ground.height
    theta_0, theta_1c, theta_1s = trimmed.z.controls
    inputs = replace(p.inputs, theta_0=theta_0, theta_1c=theta_1c, theta_1s=theta_1s, height=height)
    surfaces = model.surfaces
    if surfaces is not None:  # the wind over them is that of the trim, however the hub then moves
        back = None if p.inputs.turn is None else p.inputs.turn.T
        surfaces = replace(surfaces, wind=-p.inputs.velocity).seen_from(None, back)
        inputs = replace(inputs, place=jnp.zeros(3))
    coupled = CoupledWake(model.rotor, model.operating, p.blade, ground, model.settings, surfaces)
    return Start(coupled, state_at(trimmed, 0), inputs, tilt)


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
