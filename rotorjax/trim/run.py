"""A trim from what a user asks for, with any inflow, and the numbers that it comes to."""

import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, PyTree

from rotorjax.checks import check_number, check_range, refuse_choice
from rotorjax.coupled import CoupledRotor, coupled_rotor
from rotorjax.errors import InputError
from rotorjax.ground import Plane, plane
from rotorjax.inflow.choice import NAMES, inflow_model
from rotorjax.limits import THRUST, check_flight, check_place
from rotorjax.ode.outcome import Outcome
from rotorjax.operating import OperatingPoint
from rotorjax.panels.surface import Panels
from rotorjax.rotor import catalogue
from rotorjax.rotor.flap_lag import blade_of
from rotorjax.rotor.geometry import Rotor, solidity
from rotorjax.trim import problem
from rotorjax.trim.free_wake import WakeTrim, first_guess
from rotorjax.trim.in_wake import TrimmedInWake, alike, trim_in_wake, wake_trim
from rotorjax.trim.means import Means, means
from rotorjax.trim.problem import Aim, TrimResidual, inputs_at, outputs_at
from rotorjax.trim.solve import AZIMUTHS, Trimmed, flight, guess, trim
from rotorjax.trim.verdict import Verdict, verdict
from rotorjax.wake.search import Progress
from rotorjax.wake.settings import WakeSettings

FREE_WAKE = "freewake"
INFLOWS = (*NAMES, FREE_WAKE)


@dataclass(frozen=True)
class Request:
    """What to trim. thrust: C_T. height over R; slope, tilt in degrees; climb over ΩR; drag_area: f of the fuselage in
    m², balanced by tilting the shaft, or None for a given tilt. aim: no cyclic flapping, or no hub moments. wake:
    settings of the free wake, None for those that suit the flight. surfaces: beside and under the hub, in level axes,
    which stand still under it, so that speed is wind over them; for the free wake.
    """

    rotor: Rotor
    operating: OperatingPoint
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
    wake: WakeSettings | None = None
    surfaces: Panels | None = None

    @property
    def ground(self) -> Plane | None:
        """The ground, in level axes."""
        return None if self.height is None else plane(self.height, self.slope_deg)

    @property
    def flight(self) -> problem.SteadyFlight:
        """The flight condition in rotor units. Raises InputError where something of it is not allowed."""
        area = np.pi * float(self.rotor.radius) ** 2
        share = 0.0 if self.drag_area is None else self.drag_area / area
        return flight(self.thrust, self.advance, self.climb, np.deg2rad(self.tilt_deg), share, self.height)


@dataclass(frozen=True)
class Result:
    """A trim and what it took. trimmed: with the states of an inflow model, or in the free wake. verdict: what it is
    worth. wall_time_s: compilation included.
    """

    request: Request
    trimmed: Trimmed | TrimmedInWake
    means: Means
    verdict: Verdict
    wall_time_s: float

    @property
    def converged(self) -> bool:
        """Whether it is a trim."""
        return self.trimmed.outcome.converged


def request(rotor: str | Path, thrust: float, *arguments: Any, **more: Any) -> Request:
    """A request for a rotor of the catalogue or a file; other arguments as `Request` takes them after the thrust."""
    return Request(*catalogue.load(rotor), thrust, *arguments, **more)


def check(request: Request) -> None:
    """Raise InputError where something of a request is not allowed, before any work."""
    if not isinstance(request.inflow, str) or request.inflow not in INFLOWS:
        raise refuse_choice("inflow", request.inflow, INFLOWS)
    if request.slope_deg and request.height is None:
        raise InputError(
            f"Argument `height` must be given with a slope, but only `slope` is: {request.slope_deg:g} deg"
        )
    if request.surfaces is not None and request.inflow != FREE_WAKE:
        raise InputError(
            f"Argument `surfaces` must be left out with the inflow '{request.inflow}': only '{FREE_WAKE}' has them"
        )
    check_number("tilt_deg", request.tilt_deg, -40.0, 40.0)
    check_range("thrust_coefficient", request.thrust, THRUST)
    check_flight(request.inflow, request.thrust, request.climb, request.advance)
    check_place(request.inflow, request.height, request.slope_deg)
    if request.drag_area is not None:
        check_number("drag_area", request.drag_area, 0.0)
        if request.tilt_deg:
            raise InputError(
                f"Argument `tilt_deg` must be left out with a drag_area, which the tilt balances, but is "
                f"{request.tilt_deg:g}"
            )
    if request.height is not None and request.climb:
        raise InputError(
            f"Argument `climb` must be 0 over ground (a steady state needs a fixed height), but is {request.climb:g}"
        )
    if float(request.operating.climb):
        raise InputError(
            f"[operating] climb must be 0 in a rotor file that is trimmed, but is {float(request.operating.climb):g} "
            "m/s, which has no effect: give the climb to the trim"
        )
    blade_of(request.rotor, request.operating)
    _ = request.flight, request.ground
    if request.inflow != FREE_WAKE:
        inflow_model(request.inflow, request.ground)


def run(request: Request, start: Trimmed | TrimmedInWake | None = None, progress: Progress | None = None) -> Result:
    """Trim. start: a trim nearby, of use where it has the same unknowns; where it leads nowhere the trim starts from
    nothing. progress(stage, residual): called now and then.

    Raises InputError where something of the request is not allowed or the thrust is out of reach.
    """
    begun = time.perf_counter()
    check(request)
    found = _in_wake(request, start, progress) if request.inflow == FREE_WAKE else _in_model(request, start)
    return Result(request, found, means(found), verdict(found), time.perf_counter() - begun)


def prepare(request: Request) -> tuple[CoupledRotor, problem.SteadyFlight, TrimResidual]:
    """Rotor, flight and equations of a request with an inflow model."""
    check(request)
    p = coupled_rotor(request.rotor, request.operating, inflow_model(request.inflow, request.ground))
    return p, request.flight, TrimResidual(request.rotor.blades, request.aim, request.drag_area is not None)


def _in_model(request: Request, start: Trimmed | TrimmedInWake | None = None) -> Trimmed:
    p, condition, residual = prepare(request)
    unknowns = guess(p, condition, request.azimuths)
    if isinstance(start, Trimmed) and alike((start.z, start.flight), (unknowns, condition)):
        found = trim(p, condition, residual, start.z, request.azimuths)
        if found.outcome.converged:
            return found
    return trim(p, condition, residual, None, request.azimuths)


def _in_wake(
    request: Request, start: Trimmed | TrimmedInWake | None = None, progress: Progress | None = None
) -> TrimmedInWake:
    near = start if isinstance(start, TrimmedInWake) else None
    return trim_in_wake(*before_wake(request), progress, near)


def before_wake(request: Request) -> tuple[WakeTrim, Float[Array, "3"], float]:
    """A trim in the free wake set up, its controls (rad) and its coning (rad) guessed with Pitt-Peters' inflow; a
    fuselage's drag is balanced by the tilt that this has. Raises InputError where even that finds none.
    """
    first = _in_model(replace(request, inflow="pitt-peters", height=None, slope_deg=0.0, surfaces=None))
    if not first.outcome.converged:
        raise InputError(
            f"Argument `thrust_coefficient` must be within the rotor's reach, but at {request.thrust:g} no trim is "
            f"found even with Pitt-Peters' inflow ({first.outcome.why}): lower it"
        )
    controls = first.z.controls
    coning = float(jnp.mean(outputs_at(first.z, first.flight, first.p).flap))
    inputs = inputs_at(controls, first.flight)
    where = {"ground": request.ground, "surfaces": request.surfaces}
    own = {"settings": request.wake, "aim": request.aim}
    p = wake_trim(request.rotor, request.operating, inputs, request.thrust, **where, **own)
    return p, jnp.stack([controls.theta_0, controls.theta_1c, controls.theta_1s]), coning


def unknowns(trimmed: Trimmed | TrimmedInWake) -> dict[str, np.ndarray]:
    """Unknowns of a converged trim by name, to be kept; none of another."""
    if not trimmed.outcome.converged:
        return {}
    return {f"{k:02d}": np.asarray(leaf) for k, leaf in enumerate(jax.tree.leaves(trimmed.z))}


KEPT = Outcome(None, 0.0, (), 0, True, "kept", 0.0)
"""How a trim ended that was kept, where nobody asks."""


def restored(
    request: Request, state: dict[str, np.ndarray], outcome: Outcome = KEPT, damping: float = 0.0
) -> Trimmed | TrimmedInWake:
    """The trim of a request whose unknowns were kept. damping: `azimuth_damping` that its wake needed, if any."""
    leaves = [jnp.asarray(state[name]) for name in sorted(state)]
    if request.inflow == FREE_WAKE:
        p, controls, coning = before_wake(request)
        if damping:
            settings = replace(p.model.settings, azimuth_damping=damping)
            p = replace(p, model=replace(p.model, settings=settings))
        like = first_guess(p, controls, coning, 1, 0.0)
        return TrimmedInWake(_like(like, leaves), p, outcome, outcome.iterations)
    p, condition, residual = prepare(request)
    like = guess(p, condition, request.azimuths)
    return Trimmed(_like(like, leaves), outcome, residual, condition, p)


def _like(tree: PyTree, leaves: list) -> PyTree:
    return jax.tree.unflatten(jax.tree.structure(tree), leaves)


def numbers(result: Result) -> dict[str, Any]:
    """What --json writes: angles in degrees, coefficients over ρA(ΩR)² and, for power, ρA(ΩR)³."""
    request, outcome, flown = result.request, result.trimmed.outcome, result.means
    names = ("collective", "theta_1c", "theta_1s", "tilt", "beta_0", "beta_1c", "beta_1s", "lag_0")
    angles = np.rad2deg([*flown.controls, *flown.flap, flown.lag[0]])
    tip, force = (
        float(scale(request.rotor.radius)) for scale in (request.operating.tip_speed, request.operating.force)
    )
    return {
        "rotor": request.rotor.name,
        "inflow": request.inflow,
        "converged": outcome.converged,
        "verdict": result.verdict.word,
        "verdict_text": str(result.verdict),
        "why": outcome.why,
        "residual": outcome.residual,
        "load_change": result.verdict.load_change,
        "node_movement": result.verdict.node_movement,
        "iterations": result.trimmed.iterations,
        "advance_ratio": request.advance,
        "speed_m_s": request.advance * tip,
        "height": request.height,
        "slope_deg": request.slope_deg,
        **{f"{name}_deg": float(value) for name, value in zip(names, angles, strict=True)},
        "CT": flown.CT,
        "CT_over_solidity": flown.CT / float(solidity(request.rotor)),
        "CP": flown.CQ,
        "thrust_newton": flown.CT * force,
        "power_watt": flown.CQ * force * tip,
        "CP_induced": flown.CP_induced,
        "CP_profile": flown.CP_profile,
        "CP_parasite": flown.CP_parasite,
        "CP_damper": flown.CP_damper,
        "hub_roll_moment": -request.rotor.side * float(flown.moment[0]),
        "hub_pitch_moment": float(flown.moment[1]),
        "figure_of_merit": figure_of_merit(flown.CT, flown.CQ, request),
        "wall_time_s": result.wall_time_s,
    }


def figure_of_merit(thrust: float, power: float, request: Request) -> float | None:
    """C_T^1.5/(√2 C_P), of a hover that takes power; it means nothing in flight, climb or descent."""
    hovers = request.advance == 0 and request.climb == 0 and thrust > 0 and power > 0
    return float(thrust**1.5 / np.sqrt(2) / power) if hovers else None


def table(found: dict[str, Any]) -> str:
    """The same for the screen."""
    place = "out of ground effect" if found["height"] is None else f"h = {found['height']:g} R"
    rows = (
        "{rotor}, {inflow}: {thrust_newton:.0f} N, C_T = {CT:.6f} (C_T/σ = {CT_over_solidity:.4f}), advance ratio "
        "{advance_ratio:.4g} ({speed_m_s:.4g} m/s), " + place,
        "controls  θ₀ {collective_deg:.3f}°, θ₁c {theta_1c_deg:.3f}°, θ₁s {theta_1s_deg:.3f}°, "
        "shaft {tilt_deg:.3f}° forward",
        "blades    β₀ {beta_0_deg:.3f}°, β₁c {beta_1c_deg:.3f}°, β₁s {beta_1s_deg:.3f}°, lag {lag_0_deg:.3f}°",
        "power     {power_kw:.1f} kW, C_P {CP:.4e}: induced {CP_induced:.4e}, profile {CP_profile:.4e}, parasite "
        "{CP_parasite:.4e}, lag dampers {CP_damper:.1e}",
        "in {iterations} steps, {wall_time_s:.1f} s, {verdict_text}",
    )
    return "\n".join(rows).format(**found, power_kw=found["power_watt"] / 1e3)
