"""A flight of the coupled rotor: case files in TOML.

    [flight]                   # where it starts, trimmed; the keys are those of `rotorjax trim`
    rotor = "uh60"
    inflow = "pitt-peters"
    thrust_coefficient = 0.00575
    advance_ratio = 0.1        # optional, as are height, slope_deg, tilt_deg and drag_area
    height = 2.0

    [time]
    duration = 3.0             # s
    steps_per_turn = 120       # optional: else 120, or 24 and more as a free wake needs
    precision = "double"       # optional, of a free wake: or "single", faster (double unless marched in real time)
    old_age = "stage"          # optional, of a free wake: or "step" or "two steps", in which what its closure and the
                               # ground induce is summed once (simulation/march.py; "step" if marched in real time)

    [history]                  # optional: what is added to the trim, smooth between the points
    t = [0.0, 0.5, 0.6, 3.0]   # s
    collective_deg = [0.0, 0.0, 1.0, 1.0]

With inflow = "freewake" a table [wake] may set what `rotorjax.wake.settings.wake_settings` takes: panels, age_step_deg,
near_wake_deg, free_turns, closure_turns, azimuths (of the trim), tip_core and so on.

Further columns: theta_1c_deg, theta_1s_deg; u, v, w: velocity of the hub in m/s, forward, to starboard and down along
the shaft's axes; p_deg, q_deg, r_deg: its angular rates in deg/s; rotor_speed: Ω in per cent of the nominal one. Their
rates, Ω̇ included, follow from them.

The hub's attitude follows from the angular rates, from the trim's on (nose down by the shaft's tilt), and turns gravity
and the ground as the hub sees them. u, v, w stay along the shaft's axes, so that a hub whose nose comes up climbs with
the speed that it has. Its height follows from that motion and the ground's slope, whose mountain side is aft as the hub
heads at the start. The path must keep the rim of the disk above the ground; uniform inflow and Pitt-Peters know the
height alone and take up to 15 degrees between disk and ground, the finite-state model takes 60, the free wake all.
"""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal, get_args

import numpy as np
from jaxtyping import Float
from scipy.interpolate import PPoly

from rotorjax.bench.settings import WAKE_KEYS
from rotorjax.checks import Range
from rotorjax.errors import InputError
from rotorjax.io.toml_file import Key, Schema, Tables, read_toml
from rotorjax.simulation.history import read_history, smooth
from rotorjax.trim.run import FREE_WAKE, INFLOWS, Request, request
from rotorjax.wake.settings import BoundFilter, wake_settings

Precision = Literal["single", "double"]
OldAge = Literal["two steps", "step", "stage"]
MOST_A_TURN = 1440
"""Steps of a revolution."""

COLUMNS = (
    *("theta_1c_deg", "theta_1s_deg", "collective_deg"),
    *("u", "v", "w", "p_deg", "q_deg", "r_deg", "rotor_speed"),
)
"""In the order of Eq. 11."""
_FLIGHT = {
    "rotor": Key("text"),
    "inflow": Key("text", choices=INFLOWS),
    "thrust_coefficient": Key("number", Range(0.0, 0.1, above=True), required=True),
    "advance_ratio": Key("number", Range(0.0, 0.5)),
    "height": Key("number", Range(0.0, 100.0, "R", above=True)),
    "slope_deg": Key("number", Range(0.0, 59.9, "deg")),
    "tilt_deg": Key("number", Range(-40.0, 40.0, "deg")),
    "drag_area": Key("number", Range(0.0, 1e4, "m2")),
}
_UNITS = {
    "deg": ("deg", 45.0),  # of angles
    "u": ("m/s", 200.0),
    "v": ("m/s", 200.0),
    "w": ("m/s", 200.0),
    "p_deg": ("deg/s", 1000.0),
    "q_deg": ("deg/s", 1000.0),
    "r_deg": ("deg/s", 1000.0),
}


def _column(name: str) -> Key:
    if name == "rotor_speed":
        return Key("numbers", Range(50.0, 150.0, "per cent"))
    unit, most = _UNITS.get(name, _UNITS["deg"])
    return Key("numbers", Range(-most, most, unit))


SCHEMA: Schema = {
    "flight": _FLIGHT,
    "time": {
        "duration": Key("number", Range(1e-3, 1e5, "s"), required=True),
        "steps_per_turn": Key("whole number", Range(24, MOST_A_TURN)),
        "precision": Key("text", choices=get_args(Precision)),
        "old_age": Key("text", choices=get_args(OldAge)),
    },
    "history": {"t": Key("numbers", Range(0.0, 1e6, "s")), **{name: _column(name) for name in COLUMNS}},
    "wake": {"bound_filter": Key("text", choices=get_args(BoundFilter)), **WAKE_KEYS},
}
_OF_A_WAKE = ("precision", "old_age")
_MOST_STEPS = 200_000


@dataclass(frozen=True)
class SimulationCase:
    """One flight. request: the trim that it starts from. duration (s). steps_per_turn. t (P,) in s, columns (P, 10):
    what is added to the trim, in the file's units and the order of COLUMNS; rotor_speed is what it is. wake: settings
    of the free wake other than the trim's own. precision, old_age: of a free wake's march, None for the usual.
    """

    request: Request
    duration: float
    steps_per_turn: int | None
    t: Float[np.ndarray, " P"]
    columns: Float[np.ndarray, "P C"]
    wake: dict[str, Any] = field(default_factory=dict)
    precision: Precision | None = None
    old_age: OldAge | None = None

    def polynomials(self) -> PPoly:
        """Smooth histories over time in s."""
        return smooth(self.t, self.columns)


def read_case(path: str | Path) -> SimulationCase:
    """Read a case file.

    Raises InputError, naming file and key, for a file that is not there or not TOML, an unknown or missing key, a value
    that is not allowed, or a history with a gap.
    """
    return read_toml(path, SCHEMA, _build, {"thrust": "[flight] thrust_coefficient", "tilt": "[flight] tilt_deg"})


def _build(data: Tables, folder: Path) -> SimulationCase:
    times, duration = data["time"], data["time"]["duration"]
    steps = times.get("steps_per_turn")
    if steps is not None and steps % 12:
        raise InputError(f"[time] steps_per_turn must be a multiple of 12 from 24 to {MOST_A_TURN}, but is {steps}")
    history = data.get("history", {})
    t, columns = read_history(history, COLUMNS, duration)
    if "rotor_speed" not in history:
        columns[:, -1] = 100.0
    wake, marched = dict(data.get("wake", {})), {name: times.get(name) for name in _OF_A_WAKE}
    case = SimulationCase(_request(data["flight"], folder), duration, steps, t, columns, wake, **marched)
    _check_model(case)
    return case


def _check_model(case: SimulationCase) -> None:
    """What the free wake cannot do, and settings of it that nothing would read."""
    request = case.request
    turned = [n for n in ("v", "p_deg", "r_deg") if np.any(case.columns[:, COLUMNS.index(n)])]
    if request.rotor.side < 0 and turned:
        raise InputError(
            f"[history] {turned[0]} must be 0 for a clockwise rotor, whose flight is computed as its mirror image: fly "
            "the counter-clockwise rotor with v, p_deg and r_deg of the opposite sign"
        )
    if request.inflow != FREE_WAKE:
        if case.wake:
            raise InputError(f'[wake] must come with inflow = "{FREE_WAKE}" in [flight], but it is "{request.inflow}"')
        if given := [name for name in _OF_A_WAKE if getattr(case, name) is not None]:
            raise InputError(
                f'[time] {given[0]} must come with inflow = "{FREE_WAKE}" in [flight], but it is "{request.inflow}"'
            )
        return
    wake_settings(**case.wake)
    if request.height is not None and request.slope_deg and request.advance:
        raise InputError(
            f"[flight] advance_ratio must be 0 over sloping ground in the free wake, but is {request.advance:g}: its "
            "trim needs a steady height; fly off with u in [history]"
        )


def _request(flight: dict[str, Any], folder: Path) -> Request:
    names = {"thrust_coefficient": "thrust", "advance_ratio": "advance"}
    values = {names.get(k, k): v for k, v in flight.items()}
    rotor = values.get("rotor", "uh60")
    values["rotor"] = str(folder / rotor) if rotor.endswith(".toml") else rotor
    return request(**values)


def steps_of(case: SimulationCase, omega: float, per_turn: int) -> int:
    """Number of steps of a march, its last and shorter twelfth of a turn included; per_turn: of a revolution.

    Raises InputError for too many.
    """
    twelfths = case.duration * omega / (2 * np.pi) * 12
    steps = per_turn // 12 * max(1, int(np.ceil(twelfths * (1 - 1e-12))))
    if steps > _MOST_STEPS:
        raise InputError(f"[time] duration must make at most {_MOST_STEPS} steps, but {case.duration:g} s make {steps}")
    return steps
