"""Trims in any inflow, one at a time, each from a trim nearby."""

from collections.abc import Sequence
from dataclasses import replace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from rotorjax.bench.as_flown import advance_ratio
from rotorjax.bench.disk_fit import disk_fit
from rotorjax.coupled import CoupledState
from rotorjax.errors import InputError
from rotorjax.linearisation.readings import readings
from rotorjax.sweep.case import SweepCase
from rotorjax.sweep.design import DesignPoint
from rotorjax.sweep.found import Found, Neighbour, dimensional, judged, refused
from rotorjax.sweep.rotors import rotor_of, values_of, wanted_thrust
from rotorjax.trim import run as trimming
from rotorjax.trim.in_wake import TrimmedInWake
from rotorjax.trim.means import evaluated
from rotorjax.trim.problem import inputs_at, node_azimuths, rates_and_outputs
from rotorjax.trim.run import Request, numbers, restored, unknowns
from rotorjax.trim.solve import Trimmed
from rotorjax.wake.search import Progress
from rotorjax.wake.settings import flight_settings, wake_settings

READ = ("CT", "CP", "CP_induced", "CP_profile", "CP_parasite", "CP_damper", "figure_of_merit", "collective_deg")
ANGLES = ("theta_1c_deg", "theta_1s_deg", "tilt_deg", "beta_0_deg", "beta_1c_deg", "beta_1s_deg")


def prepare(case: SweepCase, point: DesignPoint) -> Request:
    """The request of a point. Raises InputError where it is not allowed."""
    values = values_of(case, point)
    rotor, operating = rotor_of(case, values)
    thrust = wanted_thrust(values, rotor, operating)
    assert thrust is not None
    speed = values.get("speed")
    kept = ("height", "slope_deg", "climb", "tilt_deg", "drag_area", "aim")
    request = Request(
        rotor,
        operating,
        thrust,
        case.model,
        values.get("advance_ratio", 0.0) if speed is None else advance_ratio(speed, rotor, operating),
        **{name: values[name] for name in kept if name in values},
    )
    trimming.check(request)
    if case.wake:
        windy = request.advance != 0
        usual = flight_settings(rotor.blades, **case.wake) if windy else wake_settings(**_azimuths(case, rotor.blades))
        request = replace(request, wake=usual)
    return request


def _azimuths(case: SweepCase, blades: int) -> dict:
    return {"azimuths": 2 * blades, **case.wake}


def solve(prepared: Sequence[Request], start: Neighbour | None = None, progress: Progress | None = None) -> list[Found]:
    """Trim one after the other from the same start, and from nothing where that leads nowhere."""
    return [_solve(request, start, progress) for request in prepared]


def _solve(request: Request, near: Neighbour | None, progress: Progress | None) -> Found:
    try:
        result = trimming.run(request, None if near is None else restored(near.prepared, near.found.state), progress)
    except InputError as error:
        return refused(str(error))
    told, trimmed = numbers(result), result.trimmed
    fit = _in_wake(trimmed) if isinstance(trimmed, TrimmedInWake) else np.asarray(_in_model(trimmed))
    values = {name: np.nan if told[name] is None else float(told[name]) for name in (*READ, *ANGLES)}
    values |= dict(zip(("lambda_0", "lambda_1c", "lambda_1s"), map(float, fit), strict=True))
    values |= dimensional(told["CT"], told["CP"], request.rotor, request.operating)
    values |= {name: float(told[name]) for name in ("residual", "wall_time_s")}
    short = max(abs(told["CT"] / request.thrust - 1), told["load_change"])
    there = not isinstance(trimmed, TrimmedInWake) or result.verdict.word != "no solution"
    return judged(values, unknowns(trimmed), result.converged, there, short, told["why"])


@eqx.filter_jit
def _fit(z, flight, p) -> jax.Array:
    u, outputs = inputs_at(z.controls, flight), rates_and_outputs(z, flight, p)[1]

    def at(psi, rotor, inflow, out):
        found = readings(psi, CoupledState(psi, rotor, inflow), out, u, p)
        return jnp.stack([found[name] for name in ("lambda_0", "lambda_1c", "lambda_1s")])

    return jnp.mean(jax.vmap(at)(node_azimuths(z, p.rotor.blades), z.rotor, z.inflow, outputs), axis=0)


def _in_model(trimmed: Trimmed) -> jax.Array:
    return _fit(trimmed.z, trimmed.flight, trimmed.p)


def _in_wake(trimmed: TrimmedInWake) -> np.ndarray:
    model = trimmed.model
    down = -np.asarray(evaluated(trimmed.z, trimmed.p)[0].velocities.control[..., 2])
    psi = 2 * np.pi / len(down) * np.arange(len(down))
    through = float(trimmed.p.inputs.climb)  # what the hub's own motion brings
    return disk_fit(np.asarray(model.stations), np.asarray(model.widths), psi, down - through)
