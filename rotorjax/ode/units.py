"""Linear models in other units: of time, of states, inputs and outputs."""

from collections.abc import Mapping
from dataclasses import replace
from typing import TypeVar

import numpy as np

from rotorjax.ode.models import LinearModel, PeriodicModel

Model = TypeVar("Model", bound=LinearModel | PeriodicModel)
Units = Mapping[str, tuple[float, str]]


def converted(model: Model, units: Units, rate: float = 1.0, time: str | None = None) -> Model:
    """The same model with other numbers. units: by unit, what one of it comes to and in which new unit; others stay.
    rate: units of the old time in one of the new, which is called `time`.

    A radian of azimuth is 1/Ω seconds: `rate` = Ω.
    """

    def scales(names: tuple[str, ...]) -> tuple[np.ndarray, tuple[str, ...]]:
        found = [units.get(name, (1.0, name)) for name in names]
        return np.array([scale for scale, _ in found]), tuple(name for _, name in found)

    (x, x_units), (u, u_units), (y, y_units) = map(scales, (model.state_units, model.input_units, model.output_units))
    held = {
        "a": model.a * rate * x[:, None] / x,
        "b": model.b * rate * x[:, None] / u,
        "c": model.c * y[:, None] / x,
        "d": model.d * y[:, None] / u,
        "x": model.x * x,
        "u": model.u * u,
        "y": model.y * y,
        "state_units": x_units,
        "input_units": u_units,
        "output_units": y_units,
        "time": model.time if time is None else time,
    }
    if isinstance(model, PeriodicModel):
        held |= {"t": model.t / rate, "period": model.period / rate}
    return replace(model, **held)
