"""A trim from what a user asks for, and the numbers that it comes to."""

import time
from dataclasses import dataclass
from typing import Any

import jax.numpy as jnp
import numpy as np

from rotorjax.checks import check_number
from rotorjax.coupled import CoupledRotor, coupled_rotor
from rotorjax.errors import InputError
from rotorjax.ground import plane
from rotorjax.inflow.choice import inflow_model
from rotorjax.limits import check_flight, check_place
from rotorjax.rotor import catalogue
from rotorjax.rotor.geometry import solidity
from rotorjax.trim.problem import Aim, Flight, Trim, TrimResidual, cyclic, outputs_at
from rotorjax.trim.solve import AZIMUTHS, Trimmed, flight, trim


@dataclass(frozen=True)
class Request:
    """What to trim. thrust: C_T. height over R; slope, tilt in degrees; climb over ΩR; drag_area: f of the fuselage in
    m², balanced by tilting the shaft, or None for a given tilt. aim: no cyclic flapping, or no hub moments.
    """

    rotor: str
    thrust: float
    inflow: str = "pitt-peters"
    advance: float = 0.0
    height: float | None = None
    slope_deg: float = 0.0
    climb: float = 0.0
    tilt_deg: float = 0.0
    drag_area: float | None = None
    aim: Aim = "flapping"
    azimuths: int = AZIMUTHS


@dataclass(frozen=True)
class Result:
    """A trim and what it took. wall_time_s: compilation included."""

    request: Request
    p: CoupledRotor
    flight: Flight
    trimmed: Trimmed
    wall_time_s: float

    @property
    def z(self) -> Trim:
        """States and controls."""
        return self.trimmed.z


def check(request: Request) -> None:
    """Raise InputError where something of a request is not allowed, whatever the inflow."""
    if request.slope_deg and request.height is None:
        raise InputError(
            f"Argument `height` must be given with a slope, but only `slope` is: {request.slope_deg:g} deg"
        )
    check_number("tilt_deg", request.tilt_deg, -40.0, 40.0)
    check_number("thrust_coefficient", request.thrust, 0.0, 0.1, open_=True)
    check_flight(request.inflow, request.thrust, request.climb, request.advance)
    check_place(request.inflow, request.height, request.slope_deg)
    if request.drag_area is not None:
        check_number("drag_area", request.drag_area, 0.0)
    if request.height is not None and request.climb:
        raise InputError(
            f"Argument `climb` must be 0 over ground (a steady state needs a fixed height), but is {request.climb:g}"
        )


def prepare(request: Request) -> tuple[CoupledRotor, Flight, TrimResidual]:
    """Rotor, flight and equations of a request. Raises InputError where something of it is not allowed."""
    check(request)
    rotor, operating = catalogue.load(request.rotor)
    if float(operating.climb):
        raise InputError(
            f"[operating] climb must be 0 in a rotor file that is trimmed, but is {float(operating.climb):g} m/s, "
            "which has no effect: give the climb to the trim"
        )
    ground = None if request.height is None else plane(request.height, request.slope_deg)
    p = coupled_rotor(rotor, operating, inflow_model(request.inflow, ground))
    area = np.pi * float(rotor.radius) ** 2
    condition = flight(
        request.thrust,
        request.advance,
        request.climb,
        float(np.deg2rad(request.tilt_deg)),
        0.0 if request.drag_area is None else request.drag_area / area,
        request.height,
    )
    return p, condition, TrimResidual(rotor.blades, request.aim, request.drag_area is not None)


def run(request: Request, start: Trim | None = None, progress: bool = False) -> Result:
    """Trim. Raises InputError where something of the request is not allowed or the thrust is out of reach."""
    begun = time.perf_counter()
    p, condition, residual = prepare(request)
    found = trim(p, condition, residual, start, request.azimuths, progress)
    return Result(request, p, condition, found, time.perf_counter() - begun)


def numbers(result: Result) -> dict[str, Any]:
    """What --json writes: angles in degrees, coefficients over ρA(ΩR)² and, for power, ρA(ΩR)³."""
    z, p = result.z, result.p
    out = outputs_at(z, result.flight, p)
    cosine, sine = cyclic(out.flap, p)
    controls = z.controls

    def mean(v: Any) -> float:
        return float(jnp.mean(v))

    def degrees(v: Any) -> float:
        return float(np.rad2deg(v))

    moment = np.asarray(jnp.mean(out.moment, axis=0))
    thrust, power = mean(out.CT), mean(out.CQ)
    return {
        "rotor": p.rotor.name,
        "inflow": result.request.inflow,
        "converged": result.trimmed.outcome.converged,
        "why": result.trimmed.outcome.why,
        "residual": result.trimmed.outcome.residual,
        "iterations": result.trimmed.outcome.iterations,
        "advance_ratio": float(result.flight.advance),
        "height": result.request.height,
        "slope_deg": result.request.slope_deg,
        "collective_deg": degrees(controls.theta_0),
        "theta_1c_deg": degrees(controls.theta_1c),
        "theta_1s_deg": degrees(controls.theta_1s),
        "tilt_deg": degrees(controls.tilt),
        "beta_0_deg": degrees(mean(out.flap)),
        "beta_1c_deg": degrees(cosine),
        "beta_1s_deg": degrees(sine),
        "lag_0_deg": degrees(mean(out.lag)),
        "CT": thrust,
        "CT_over_solidity": thrust / float(solidity(p.rotor)),
        "CP": power,
        "CP_induced": mean(out.CP_induced),
        "CP_profile": mean(out.CP_profile),
        "CP_parasite": mean(out.CP_parasite),
        "CP_damper": mean(out.CP_damper),
        "hub_roll_moment": -float(moment[0]),
        "hub_pitch_moment": float(moment[1]),
        "figure_of_merit": figure_of_merit(thrust, power, result.request),
        "wall_time_s": result.wall_time_s,
    }


def figure_of_merit(thrust: float, power: float, request: Request) -> float | None:
    """C_T^1.5/(√2 C_P), of a hover that takes power; it means nothing in flight, climb or descent."""
    hovers = request.advance == 0 and request.climb == 0 and thrust > 0 and power > 0
    return float(thrust**1.5 / np.sqrt(2) / power) if hovers else None


def table(found: dict[str, Any]) -> str:
    """The same for the screen."""
    place = "out of ground effect" if found["height"] is None else f"h = {found['height']:g} R"
    end = "converged" if found["converged"] else "NOT converged"
    rows = (
        "{rotor}, {inflow}: C_T = {CT:.6f} (C_T/σ = {CT_over_solidity:.4f}), advance ratio {advance_ratio:g}, " + place,
        "controls  θ₀ {collective_deg:.3f}°, θ₁c {theta_1c_deg:.3f}°, θ₁s {theta_1s_deg:.3f}°, "
        "shaft {tilt_deg:.3f}° forward",
        "blades    β₀ {beta_0_deg:.3f}°, β₁c {beta_1c_deg:.3f}°, β₁s {beta_1s_deg:.3f}°, lag {lag_0_deg:.3f}°",
        "power     C_P {CP:.4e}: induced {CP_induced:.4e}, profile {CP_profile:.4e}, parasite {CP_parasite:.4e}, "
        "lag dampers {CP_damper:.1e}",
        end + " in {iterations} steps, {wall_time_s:.1f} s: {why}",
    )
    return "\n".join(rows).format(**found)
