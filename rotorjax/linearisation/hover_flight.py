"""From a hover in the free wake to linear models of blades and wake: by wave number, whole, small; modes by name."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from rotorjax.linearisation import rotor
from rotorjax.linearisation.found import LinearRotor, Wanted, flight_notes
from rotorjax.linearisation.hover import HoverModel, Wave, hover_model
from rotorjax.linearisation.hover_small import SmallHover, small_hover
from rotorjax.linearisation.modes import RotorMode, blade_modes, named, numbered
from rotorjax.linearisation.stages import Stages
from rotorjax.ode.hill import Exponents
from rotorjax.ode.models import LinearModel
from rotorjax.ode.threads import one_thread
from rotorjax.trim.run import Result
from rotorjax.wake.search import Progress

WAKE = "wake"
"""First word of the name of a mode of the wake; those that grow are neighbouring turns that pair."""
LEADING = 20
"""Modes of the wake that are told, the least damped of all; those of the blades always are."""


@dataclass(frozen=True)
class LinearHover(LinearRotor):
    """A hover in the free wake. model: by wave number. unstable: modes of the full model with Re λ ≥ 0, by coordinate.
    modes: of the blades, and the wake's `LEADING`.
    """

    small: SmallHover
    model: HoverModel
    unstable: dict[str, int]


def hovering(result: Result, wanted: Wanted, clock: Stages, progress: Progress | None = None) -> LinearHover:
    """Linearise a hover trimmed in the free wake, name the modes and reduce. Raises InputError as `hover_model` does.

    clock: stages are told to it.
    """
    model = hover_model(rotor.base_of(result.trimmed), wanted.inputs, wanted.outputs, progress)
    model = replace(model, notes={**model.notes, **flight_notes(result)})
    clock.done("linearisation")
    found, unstable = hover_modes(model)
    clock.done("modes")
    small = small_hover(model, wanted.order)
    clock.done("reduction")
    return LinearHover(result, model.linear(), small, found, clock.seconds, model, unstable)


def hover_in_wake(
    found: Result, inputs: Sequence[str] | None = None, outputs: Sequence[str] | None = None, order: int | None = None
) -> LinearModel:
    """The time-invariant model of a trim alone; names as in `rotor.linear_rotor`; order: of the small one, for a
    revolution (hover_small.py). Raises InputError as `hover_model` and `small_hover` do.
    """
    model = hover_model(rotor.base_of(found.trimmed), inputs, outputs)
    model = replace(model, notes={**model.notes, **flight_notes(found)})
    return model.linear() if order is None else small_hover(model, order).model


def hover_modes(model: HoverModel, leading: int = LEADING) -> tuple[tuple[RotorMode, ...], dict[str, int]]:
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


def _of_wake(mode: RotorMode, wave: Wave) -> RotorMode:
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
