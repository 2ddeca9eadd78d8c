"""From a hover in the free wake to linear models of blades and wake: by wave number, whole, small; modes by name."""

from dataclasses import dataclass, replace

import numpy as np

from rotorjax.coupled_wake import coupled_wake
from rotorjax.errors import InputError
from rotorjax.linearisation import rotor
from rotorjax.linearisation.compact import check_order
from rotorjax.linearisation.drive import check_names, drive_of
from rotorjax.linearisation.flight import Wanted, flight_notes
from rotorjax.linearisation.hover import HoverModel, Wave, hover_model
from rotorjax.linearisation.hover_small import SmallHover, small_hover
from rotorjax.linearisation.modes import Mode, blade_modes, named, numbered
from rotorjax.linearisation.stages import Stages
from rotorjax.ode.hill import Exponents
from rotorjax.ode.threads import one_thread
from rotorjax.rotor import multiblade
from rotorjax.trim.problem import Controls, inputs_at
from rotorjax.trim.run import Progress, Request, Result, run
from rotorjax.trim.run import check as check_request
from rotorjax.wake.settings import wake_settings

WAKE = "wake"
"""First word of the name of a mode of the wake; those that grow are neighbouring turns that pair."""
LEADING = 20
"""Modes of the wake that are told, the least damped of all; those of the blades always are."""


@dataclass(frozen=True)
class LinearHover:
    """Everything found about one hover in the free wake. modes: of the blades, and the wake's `LEADING`. unstable:
    modes of the full model with Re λ ≥ 0, by coordinate. seconds: wall time by stage.
    """

    result: Result
    model: HoverModel
    small: SmallHover
    modes: tuple[Mode, ...]
    unstable: dict[str, int]
    seconds: dict[str, float]


def check(request: Request, wanted: Wanted) -> None:
    """Raise InputError for a flight that is no level hover, names or an order that cannot be, before any work."""
    check_request(request)
    for name, value in (("advance_ratio", request.advance), ("tilt", request.tilt_deg), ("slope", request.slope_deg)):
        if value:
            raise InputError(
                f"Argument `{name}` must be 0 for a time-invariant model in the free wake, but is {value:g}: "
                "linearisation.flight has level flight, pitt-peters and vpbfsm the rest"
            )
    blades = request.rotor.blades
    if blades < 3:
        raise InputError(
            "Argument `rotor` must have at least three blades, whose cyclic motion in the free wake looks the same "
            f"from every azimuth, but has {blades}: take an inflow model for fewer"
        )
    if wanted.harmonics:
        raise InputError(
            "Argument `harmonics` must be 0 in hover, which does not change with the azimuth, but is "
            f"{wanted.harmonics}"
        )
    p = coupled_wake(request.rotor, request.operating, wake_settings(), request.ground)
    tilt = request.flight.tilt
    still = inputs_at(Controls(0 * tilt, 0 * tilt, 0 * tilt, tilt), request.flight)
    check_names("inputs", wanted.inputs, rotor.drive_names(drive_of(still, p)), "a free wake")
    check_names("outputs", wanted.outputs, rotor.output_names(p, request.height is not None), "a free wake")
    check_order(wanted.order, 4 * len([name for name in multiblade.names(blades) if name != "D"]))


def linearise_hover(about: Request | Result, wanted: Wanted, progress: Progress | None = None) -> LinearHover | Result:
    """Trim where that is still to do, linearise, name the modes and reduce; a trim that did not converge is returned.

    progress(stage, residual) is called as things go on. Raises InputError as `check` and `trim.run.run`
    do.
    """
    request = about if isinstance(about, Request) else about.request
    check(request, wanted)
    clock = Stages(progress)
    result = run(about, None, progress) if isinstance(about, Request) else about
    clock.done("trim")
    if not result.converged:
        return result
    model = hover_model(rotor.base_of(result.trimmed), wanted.inputs, wanted.outputs, progress)
    model = replace(model, notes={**model.notes, **flight_notes(result)})
    clock.done("linearisation")
    found, unstable = hover_modes(model)
    clock.done("modes")
    small = small_hover(model, wanted.order)
    clock.done("reduction")
    return LinearHover(result, model, small, found, unstable, clock.seconds)


def hover_modes(model: HoverModel, leading: int = LEADING) -> tuple[tuple[Mode, ...], dict[str, int]]:
    """Modes of the blades and the `leading` ones of the wake, the least damped first; unstable ones by coordinate."""
    found, unstable = [], {}
    for wave in model.waves:
        parts = exponents_of(wave)
        unstable[" ".join(wave.coordinates)] = int(np.sum(np.real(parts.values) >= 0)) * len(wave.coordinates)
        states = tuple(name.format(wave.coordinates[0]) for name in model.names)
        found += [_of_wake(mode, wave) for mode in named(parts, states, blade_modes(parts, states))]
    found.sort(key=lambda mode: -mode.exponent.real)
    wakes = [mode for mode in found if mode.name.startswith(WAKE)][:leading]
    kept = [mode for mode in found if not mode.name.startswith(WAKE) or mode in wakes]
    return tuple(numbered(kept)), unstable


def _of_wake(mode: Mode, wave: Wave) -> Mode:
    """A mode of the wake by its wave number: what goes round as a whole, once … or from blade to blade."""
    kind = {"0": "collective", "D": "differential"}.get(wave.coordinates[0], f"cyclic {wave.coordinates[0][:-1]}")
    return replace(mode, name=f"{WAKE} {kind}") if mode.name.startswith("inflow") else mode


@one_thread
def exponents_of(wave: Wave) -> Exponents:
    """Exponents of one wave number; those of a complex system as its real one has them, with positive frequency."""
    values, right = np.linalg.eig(wave.a)
    weight = np.abs(right * np.linalg.inv(right).T)
    if not wave.real:
        values = np.real(values) + 1j * np.abs(np.imag(values))
    order = np.argsort(-np.real(values))
    return Exponents(values[order], right[:, order], (weight / weight.sum(axis=0))[:, order])
