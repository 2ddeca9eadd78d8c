"""From a trim to linear models of the whole rotor: periodic, time-invariant, small; modes by name; steps marched."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from rotorjax.coupled import Coupled
from rotorjax.coupled_wake import coupled_wake
from rotorjax.errors import InputError
from rotorjax.linearisation import rotor, steps
from rotorjax.linearisation.compact import Compact, check_order, compact, frequencies, gaps, kept_states
from rotorjax.linearisation.drive import check_names, drive_of
from rotorjax.linearisation.modes import Mode, modes
from rotorjax.linearisation.stages import Stages
from rotorjax.linearisation.wake_flight import InWake, all_modes, base_in_flight, linear_in_flight
from rotorjax.ode.harmonic import harmonic_model
from rotorjax.ode.hill import harmonic_transfer, present
from rotorjax.ode.models import LinearModel, PeriodicModel
from rotorjax.rotor import multiblade
from rotorjax.rotor.hub import RotorInputs
from rotorjax.trim.problem import Controls, inputs_at
from rotorjax.trim.run import FREE_WAKE, Progress, Request, Result, prepare, run
from rotorjax.trim.run import check as check_request
from rotorjax.wake.settings import flight_settings

CONTROLS = ("theta_0", "theta_1c", "theta_1s", "u", "v", "w", "p", "q", "r")
"""Inputs by default."""
OUTPUTS = (
    *("CT", "CQ", *"XYZLMN", "beta_0", "beta_1c", "beta_1s", "lag_0", "lag_1c", "lag_1s"),
    *("lambda_0", "lambda_1c", "lambda_1s"),
)
"""Outputs by default."""


@dataclass(frozen=True)
class Wanted:
    """What to linearise for. order: of the small model. harmonics: of the rotor's turn that the time-invariant model
    holds, up to this one. azimuths: of a revolution.
    """

    inputs: tuple[str, ...] = CONTROLS
    outputs: tuple[str, ...] = OUTPUTS
    order: int = 20
    harmonics: int = 0
    azimuths: int = rotor.AZIMUTHS


@dataclass(frozen=True)
class LinearFlight:
    """Everything found about one trim. full: time-invariant, of the harmonics held. full_gap_db, full_gap_deg (q, m):
    its largest differences from the periodic model's harmonic-0 transfer function up to 2/rev; small's are from that
    too. step_error (q, m): of the periodic model against the nonlinear march (steps.py). seconds: wall time by stage.
    """

    result: Result
    periodic: PeriodicModel
    held: tuple[int, ...]
    full: LinearModel
    full_gap_db: Float[np.ndarray, "q m"]
    full_gap_deg: Float[np.ndarray, "q m"]
    small: Compact
    modes: tuple[Mode, ...]
    step_error: Float[np.ndarray, "q m"]
    seconds: dict[str, float]
    wake: InWake | None = None


def check(request: Request, wanted: Wanted) -> None:
    """Raise InputError for names, an order, harmonics or azimuths that cannot be, before anything is solved."""
    p, hub, model = _before(request)
    blades = request.rotor.blades
    check_names("inputs", wanted.inputs, rotor.drive_names(drive_of(hub, p)), model)
    check_names("outputs", wanted.outputs, rotor.output_names(p, request.height is not None), model)
    motions = len(kept_states(tuple(f"beta_{name}" for name in multiblade.names(blades))))
    check_order(wanted.order, 4 * motions)
    if wanted.azimuths < 4 * blades:
        raise InputError(
            f"Argument `azimuths` must be at least {4 * blades} for {blades} blades, but is {wanted.azimuths}"
        )
    most = (wanted.azimuths - 1) // 4
    if not 0 <= wanted.harmonics <= most:
        raise InputError(
            f"Argument `harmonics` must lie in [0, {most}] for {wanted.azimuths} azimuths a revolution, but is "
            f"{wanted.harmonics}"
        )


def _before(request: Request) -> tuple[Coupled, RotorInputs, str]:
    """Rotor and inputs of a flight, its controls not yet known, and the inflow's name."""
    tilt = request.flight.tilt
    still = Controls(0 * tilt, 0 * tilt, 0 * tilt, tilt)
    if request.inflow != FREE_WAKE:
        return prepare(request)[0], inputs_at(still, request.flight), f"{request.inflow} inflow"
    check_request(request)
    if not request.advance or request.slope_deg:
        raise InputError(
            "Arguments must ask for a flight over level ground or none where the free wake's model is periodic "
            f"(`advance_ratio` not 0, `slope` 0), but are {request.advance:g} and {request.slope_deg:g}: "
            "linearisation.hover_flight has level hover"
        )
    settings = request.wake or flight_settings(request.rotor.blades)
    wake = coupled_wake(request.rotor, request.operating, settings, request.ground)
    return wake, inputs_at(still, request.flight), "a free wake"


def linearise_flight(
    about: Request | Result, wanted: Wanted, progress: Progress | None = None, start: Result | None = None
) -> LinearFlight | Result:
    """Trim where that is still to do, linearise and reduce; a trim that did not converge is returned as it is.

    start: a trim nearby. progress(stage, residual) is called as things go on. Raises InputError as `check` and
    `trim.run.run` do.
    """
    request = about if isinstance(about, Request) else about.request
    check(request, wanted)
    clock = Stages(progress)
    result = run(about, start, progress) if isinstance(about, Request) else about
    clock.done("trim")
    if not result.converged:
        return result
    base = rotor.base_of(result.trimmed, wanted.azimuths)
    if request.inflow == FREE_WAKE:
        base = base_in_flight(base, wanted.azimuths, progress)
        clock.done("periodic march")
        if not base.orbit.converged:
            return _lost(result, base.orbit.why)
        periodic, wake = linear_in_flight(base, wanted.inputs, wanted.outputs, clock.done, progress)
        error = wake.step_error
    else:
        periodic, wake = rotor.linear_rotor(base, wanted.inputs, wanted.outputs), None
        clock.done("linearisation")
        outs, ins = periodic.outputs, periodic.inputs
        truth = steps.marched(base, ins, outs)
        error = steps.largest_gap(truth, steps.modelled(periodic, [steps.size_of(name) for name in ins]))
        clock.done("marches")
    periodic = replace(periodic, notes={**periodic.notes, **flight_notes(result)})
    found = modes(periodic) if wake is None else all_modes(periodic, wake)
    truth = harmonic_transfer(periodic, frequencies())[:, 0]
    held = held_harmonics(periodic, wanted.harmonics)
    full = harmonic_model(periodic, held)
    clock.done("modes")
    small = compact(full, wanted.order, truth)
    clock.done("reduction")
    gap = gaps(truth, full.response(frequencies()))
    return LinearFlight(result, periodic, held, full, *gap, small, found, error, clock.seconds, wake)


def _lost(result: Result, why: str) -> Result:
    """The trim as one that did not come to a linear model."""
    trimmed = result.trimmed
    return replace(result, trimmed=replace(trimmed, outcome=replace(trimmed.outcome, converged=False, why=why)))


def held_harmonics(model: PeriodicModel, highest: int) -> tuple[int, ...]:
    """Harmonics up to the highest that motion in the model has at all. Raises InputError where it has none but 0."""
    step = present(model)
    if highest and (not step or highest < step):
        least = "it does not change with the azimuth" if not step else f"its lowest harmonic is {step}"
        raise InputError(f"Argument `harmonics` must suit the model, but is {highest} and {least}")
    return tuple(range(0, highest + 1, step)) if step else (0,)


def flight_notes(result: Result) -> dict[str, float]:
    """The flight in numbers, for whoever reads a model."""
    request, flown = result.request, result.means
    found = {
        "CT": flown.CT,
        "advance_ratio": request.advance,
        "climb": request.climb,
        "shaft_tilt_deg": float(np.rad2deg(flown.controls[3])),
    }
    return found if request.height is None else found | {"height": request.height, "slope_deg": request.slope_deg}
