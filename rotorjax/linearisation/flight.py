"""From a trim to linear models of the whole rotor: periodic, time-invariant, small; modes by name; steps marched."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from rotorjax.coupled import Coupled
from rotorjax.coupled_wake import coupled_wake
from rotorjax.errors import InputError
from rotorjax.linearisation import rotor, steps
from rotorjax.linearisation.compact import check_order, compact, frequencies, gaps, kept_states, motion_of
from rotorjax.linearisation.drive import check_names, drive_of, lasting
from rotorjax.linearisation.found import LinearRotor, Wanted, flight_notes
from rotorjax.linearisation.hover_flight import LinearHover, hovering
from rotorjax.linearisation.modes import RotorMode, modes
from rotorjax.linearisation.stages import Stages
from rotorjax.linearisation.wake_flight import WakeFindings, all_modes, base_in_flight, linear_in_flight
from rotorjax.ode.harmonic import harmonic_model
from rotorjax.ode.hill import harmonic_transfer, present
from rotorjax.ode.models import LinearModel, PeriodicModel
from rotorjax.rotor import multiblade
from rotorjax.rotor.hub import RotorInputs
from rotorjax.trim.problem import Controls, inputs_at
from rotorjax.trim.run import FREE_WAKE, Request, Result, prepare, run
from rotorjax.trim.run import check as check_request
from rotorjax.wake.search import Progress
from rotorjax.wake.settings import flight_settings


@dataclass(frozen=True)
class LinearFlight(LinearRotor):
    """A trim with an inflow model, or a flight in the free wake. full holds the harmonics of `held`. full_gap_db,
    full_gap_deg (q, m): its largest differences from the periodic model's harmonic-0 transfer function up to 2/rev;
    small's are from that too. step_error (q, m): of the periodic model against the nonlinear march (steps.py).
    """

    periodic: PeriodicModel
    held: tuple[int, ...]
    full_gap_db: Float[np.ndarray, "q m"]
    full_gap_deg: Float[np.ndarray, "q m"]
    step_error: Float[np.ndarray, "q m"]
    wake: WakeFindings | None = None

    @property
    def models(self) -> dict[str, LinearModel | PeriodicModel]:
        """The periodic one too."""
        return super().models | {"periodic": self.periodic}


@dataclass(frozen=True)
class Dear:
    """What takes long to find of a flight: `completed` makes the rest of it in seconds. Fields as in LinearFlight."""

    periodic: PeriodicModel
    modes: tuple[RotorMode, ...]
    step_error: Float[np.ndarray, "q m"]
    wake: WakeFindings | None = None


def hovers_in_wake(request: Request) -> bool:
    """Whether the model is one of a hover in the free wake, that looks the same from every azimuth."""
    return request.inflow == FREE_WAKE and not request.advance


def check(request: Request, wanted: Wanted) -> None:
    """Raise InputError for a flight, names, an order, harmonics or azimuths that cannot be, before any work."""
    p, hub, model = _before(request)
    blades = request.rotor.blades
    u = drive_of(hub, p)
    u = lasting(u) if hovers_in_wake(request) else u
    check_names("inputs", wanted.inputs, rotor.drive_names(u), model)
    check_names("outputs", wanted.outputs, rotor.output_names(p, request.height is not None), model)
    motions = len(kept_states(tuple(f"beta_{name}" for name in multiblade.names(blades))))
    check_order(wanted.order, 4 * motions)
    if hovers_in_wake(request):
        return _check_hover(request, wanted)
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
    return None


def _check_hover(request: Request, wanted: Wanted) -> None:
    """What a time-invariant model does not have."""
    if wanted.harmonics:
        raise InputError(
            "Argument `harmonics` must be 0 in hover, which does not change with the azimuth, but is "
            f"{wanted.harmonics}"
        )
    if wanted.azimuths != rotor.AZIMUTHS:
        raise InputError(
            "Argument `azimuths` must be left out in hover, which does not change with the azimuth, but is "
            f"{wanted.azimuths}"
        )


def _before(request: Request) -> tuple[Coupled, RotorInputs, str]:
    """Rotor and inputs of a flight, its controls not yet known, and the inflow's name."""
    tilt = request.flight.tilt
    still = inputs_at(Controls(0 * tilt, 0 * tilt, 0 * tilt, tilt), request.flight)
    if request.inflow != FREE_WAKE:
        return prepare(request)[0], still, f"{request.inflow} inflow"
    check_request(request)
    _check_in_wake(request)
    settings = request.wake or flight_settings(request.rotor.blades)
    return coupled_wake(request.rotor, request.operating, settings, request.ground), still, "a free wake"


def _check_in_wake(request: Request) -> None:
    """Raise InputError for a flight whose free wake has no linear model here."""
    if request.slope_deg:
        way = (
            "a level flight over it comes nearer the ground, and a wake keeps what it met at other heights, so that "
            "nothing repeats to be linear about; take inflow 'vpbfsm', which knows the height of the instant alone"
            if request.advance
            else "take inflow 'vpbfsm', or leave the thrust out for the free wake of rigid blades"
        )
        raise InputError(
            f"Argument `slope` must be 0 for a linear model in the free wake, but is {request.slope_deg:g}: {way}"
        )
    if request.advance:
        return
    if request.tilt_deg:
        raise InputError(
            "Argument `tilt` must be 0 in hover for a time-invariant model in the free wake, but is "
            f"{request.tilt_deg:g}: take an advance ratio, or inflow 'pitt-peters' or 'vpbfsm'"
        )
    blades = request.rotor.blades
    if blades < 3:
        raise InputError(
            "Argument `rotor` must have at least three blades, whose cyclic motion in the hovering free wake looks the "
            f"same from every azimuth, but has {blades}: take an inflow model for fewer"
        )


def linearise_trim(
    about: Request | Result, wanted: Wanted, progress: Progress | None = None, near: LinearRotor | None = None
) -> LinearFlight | LinearHover | Result:
    """Trim where that is still to do, linearise and reduce; a trim that did not converge is returned as it is.

    near: of a trim nearby, from which this one starts; its wake is condensed to as many states. progress(stage,
    residual) is called as things go on. Raises InputError as `check` and `trim.run.run` do.
    """
    request = about if isinstance(about, Request) else about.request
    check(request, wanted)
    clock = Stages(progress)
    result = (
        run(about, None if near is None else near.result.trimmed, progress) if isinstance(about, Request) else about
    )
    clock.done("trim")
    if not result.converged:
        return result
    if hovers_in_wake(request):
        return hovering(result, wanted, clock, progress)
    other = near.periodic if isinstance(near, LinearFlight) and near.wake is not None else None
    return _flying(result, wanted, clock, progress, other)


def _flying(
    result: Result, wanted: Wanted, clock: Stages, progress: Progress | None, near: PeriodicModel | None
) -> LinearFlight | Result:
    """Linearise what may change with the azimuth. near: a condensed model of a flight nearby."""
    base = rotor.base_of(result.trimmed, wanted.azimuths)
    if result.request.inflow == FREE_WAKE:
        base = base_in_flight(base, wanted.azimuths, progress)
        clock.done("periodic march")
        if not base.orbit.converged:
            return _lost(result, base.orbit.why)
        periodic, wake = linear_in_flight(base, wanted.inputs, wanted.outputs, clock.done, progress, near)
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
    clock.done("modes")
    return completed(result, Dear(periodic, found, error, wake), wanted, clock)


def completed(result: Result, dear: Dear, wanted: Wanted, clock: Stages) -> LinearFlight:
    """A flight with its time-invariant models. Raises InputError for harmonics that the model does not have."""
    periodic = dear.periodic
    truth = harmonic_transfer(periodic, frequencies())[:, 0]
    held = held_harmonics(periodic, wanted.harmonics)
    full = harmonic_model(periodic, held)
    small = compact(full, wanted.order, truth, motion_of(periodic))
    clock.done("reduction")
    gap = gaps(truth, full.response(frequencies()))
    return LinearFlight(
        result, full, small, dear.modes, clock.seconds, periodic, held, *gap, dear.step_error, dear.wake
    )


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
