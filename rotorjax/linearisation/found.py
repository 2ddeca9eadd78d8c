"""What is asked of a linear rotor, and what every linear rotor about a trim comes with, in hover and in flight."""

from dataclasses import dataclass

import numpy as np

from rotorjax.linearisation import rotor
from rotorjax.linearisation.compact import Compact
from rotorjax.linearisation.modes import RotorMode
from rotorjax.ode.models import LinearModel, PeriodicModel
from rotorjax.trim.run import Result

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
class LinearRotor:
    """A trim linearised. full: time-invariant, every state that the inputs reach. small: a controller's, with its
    errors. modes: by name, the least damped first. seconds: wall time by stage.
    """

    result: Result
    full: LinearModel
    small: Compact
    modes: tuple[RotorMode, ...]
    seconds: dict[str, float]

    @property
    def models(self) -> dict[str, LinearModel | PeriodicModel]:
        """What is handed over, by the name of its file."""
        return {"reduced": self.small.model, "full": self.full}


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
