"""Small models for chosen inputs and outputs, and how far they are from the full one.

A hovering wake has some tens of unstable modes (vortex pairing). Where the order asked for holds them all, they are
kept and the rest is balanced: one small model, right in frequency and in time. A smaller order cannot hold them, and
what is then best at steady frequencies is not what is best in time: on the imaginary axis an unstable mode looks like a
response that came before its cause. So there are two small models: one balanced on iω, for Bode diagrams and loop
shapes; one balanced on σ + iω with σ right of all modes (disturbances that grow with e^{σψ} and faster than the wake's
own), for marching in time. Each is measured both ways.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from rotorjax.ode.models import LinearModel
from rotorjax.ode.reduction import Reduced, balance, balance_in_band, history_gap, magnitude_gap_db

HIGHEST = 2.0
"""Highest frequency (1/rev) at which a reduced model is asked to be right."""
TAILS = (0.1, 0.3, 0.03)
GOOD_DB, GOOD_STEP = 0.5, 0.03
"""Bode error and step error at which no better model is looked for."""
RIGHT = 1.07
"""σ over the growth of the fastest mode."""


@dataclass(frozen=True)
class Small:
    """A reduced model. method: "balanced" (the bound holds), "on iω" or "on σ + iω". unstable: modes with Re λ ≥ 0.

    bode_error_db, step_error (q, m): largest difference of magnitude up to HIGHEST; largest difference of a step over
    a revolution, over its largest value.
    """

    reduced: Reduced
    method: str
    unstable: int
    bode_error_db: Float[np.ndarray, "q m"]
    step_error: Float[np.ndarray, "q m"]

    @property
    def model(self) -> LinearModel:
        """The model itself."""
        return self.reduced.model


class Pair(NamedTuple):
    """Reduced models for frequency responses and for marching in time (the same one where the order holds both).

    unstable: modes of the full model with Re λ ≥ 0.
    """

    frequency: Small
    time: Small
    unstable: int


def frequencies() -> Float[np.ndarray, " W"]:
    """Where Bode errors are measured, 1/rev."""
    return np.geomspace(0.01, HIGHEST, 80)


def reduce(model: LinearModel, order: int) -> Pair:
    """Reduce a model to at most `order` states.

    Raises InputError where `order` is not between 1 and the model's.
    """
    truth = _Truth(model)
    growth = np.real(model.poles())
    unstable = int(np.sum(growth >= 0))
    found: list[Small] = []
    if order > model.order or order > unstable:
        found.append(truth.measure(balance(model, order), "balanced"))
        if found[0].bode_error_db.max() <= GOOD_DB and found[0].step_error.max() <= GOOD_STEP:
            return Pair(found[0], found[0], unstable)
    right = RIGHT * max(float(growth.max()), 0.0)
    for tail in TAILS:
        found.append(truth.measure(balance_in_band(model, order, HIGHEST, tail=tail), "on iω"))
        found.append(truth.measure(balance_in_band(model, order, HIGHEST, tail=tail, growth=right), "on σ + iω"))
        frequency = min(found, key=lambda small: small.bode_error_db.max())
        time = min(found, key=lambda small: small.step_error.max())
        if frequency.bode_error_db.max() <= GOOD_DB and time.step_error.max() <= GOOD_STEP:
            break
    return Pair(frequency, time, unstable)


class _Truth:
    """Responses of the full model, made once."""

    def __init__(self, full: LinearModel):
        self._times = np.linspace(0, 2 * np.pi, 49)
        self._response, self._step = full.response(frequencies()), full.step(self._times)

    def measure(self, reduced: Reduced, method: str) -> Small:
        """A reduced model with its errors."""
        model = reduced.model
        return Small(
            reduced,
            method,
            int(np.sum(np.real(model.poles()) >= 0)),
            magnitude_gap_db(self._response, model.response(frequencies())),
            history_gap(self._step, model.step(self._times)),
        )
