"""A rotor over a ship's deck: case files in TOML.

    [rotor]
    name = "uh60"              # of the catalogue, or a rotor file beside this one
    collective_deg = 17.0      # the rotor file's by default
    rigid = false              # by default blades flap where the rotor has hinge data

    [model]                    # all optional
    variant = "dynamic"        # static, quasi-steady or dynamic
    harmonics = 1
    radial_terms = 3

    [time]
    duration = 40.0            # s
    steps_per_turn = 16

    [path]                     # of the hub, through these points, smooth between
    t = [0.0, 10.0, 30.0, 40.0]
    height = [2.0, 2.0, 0.8, 0.8]      # over the deck's mean place, over R
    edge = [-1.5, -1.5, 1.5, 1.5]      # optional: the deck's edge in the hub frame (positive aft), deck before it

    [deck]                     # all optional
    heave = 0.06               # amplitude over R
    heave_period = 8.0         # s
    pitch_deg = 2.0            # amplitude; positive slopes rise aft
    pitch_period = 10.0        # s
    edge_azimuth_deg = 0.0     # direction off the deck: 0 aft, 90 to starboard

Height is counted under the hub, the pitch turns the deck about that point.
"""

import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Any, get_args

import numpy as np
from jaxtyping import Float
from scipy.interpolate import PchipInterpolator

from rotorjax.checks import check_number, closest
from rotorjax.errors import InputError
from rotorjax.operating import OperatingPoint
from rotorjax.potential.moving_ground import Variant, require_clear, require_increasing
from rotorjax.rotor.catalogue import load
from rotorjax.rotor.geometry import Rotor

_KEYS = {
    "rotor": {"name": "uh60", "collective_deg": None, "rigid": None},
    "model": {"variant": "dynamic", "harmonics": 1, "radial_terms": 3},
    "time": {"duration": None, "steps_per_turn": 16},
    "path": {"t": None, "height": None, "edge": None},
    "deck": {"heave": 0.0, "heave_period": 8.0, "pitch_deg": 0.0, "pitch_period": 10.0, "edge_azimuth_deg": 0.0},
}
_MOST_STEPS = 500_000


@dataclass(frozen=True)
class DeckCase:
    """One case. rigid: blades do not flap. t, height, edge (P,): points of the path (s, over R), edge None for a deck
    without one. duration (s). heave (over R), pitch (rad): amplitudes, with periods in s; edge_azimuth (rad).
    """

    rotor: Rotor
    operating: OperatingPoint
    collective: float
    rigid: bool
    variant: Variant
    harmonics: int
    radial_terms: int
    duration: float
    steps_per_turn: int
    t: Float[np.ndarray, " P"]
    height: Float[np.ndarray, " P"]
    edge: Float[np.ndarray, " P"] | None
    heave: float
    heave_period: float
    pitch: float
    pitch_period: float
    edge_azimuth: float

    @property
    def omega(self) -> float:
        """Ω in rad/s."""
        return float(self.operating.omega)

    def instants(self) -> Float[np.ndarray, " T"]:
        """Azimuths of the march (rad), from 0, equally spaced."""
        steps = max(2, round(self.duration * self.omega / (2 * np.pi) * self.steps_per_turn))
        return np.linspace(0.0, self.duration * self.omega, steps + 1)

    def motion(self, psi: Float[np.ndarray, " T"]) -> dict[str, Float[np.ndarray, " T"]]:
        """Return height, slope, edge, their rates, the hub's climb and its rate at azimuths, in rotor units."""
        t, omega = psi / self.omega, self.omega
        path = PchipInterpolator(self.t, self.height)
        turn, rock = 2 * np.pi / self.heave_period, 2 * np.pi / self.pitch_period
        climb = path(t, 1) / omega
        edge = np.zeros_like(t) if self.edge is None else PchipInterpolator(self.t, self.edge)(t)
        return {
            "height": path(t) - self.heave * np.sin(turn * t),
            "slope": self.pitch * np.sin(rock * t),
            "height_rate": climb - self.heave * turn / omega * np.cos(turn * t),
            "slope_rate": self.pitch * rock / omega * np.cos(rock * t),
            "climb": climb,
            "climb_rate": path(t, 2) / omega**2,
            "edge": edge,
        }


def read_case(path: str | Path) -> DeckCase:
    """Read a case file.

    Raises InputError, naming file, key and value, for a file that is not there or not TOML, keys that are missing or
    misspelt, values out of range, times that do not increase or do not cover the duration, and a deck that would cut
    the disk.
    """
    path = Path(path)
    try:
        data = tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        reason = getattr(error, "strerror", None) or str(error).splitlines()[0]
        raise InputError(f"{path}: the file must be TOML, but cannot be read: {reason}") from None
    try:
        return _build(_filled(data), path.parent)
    except InputError as error:
        raise InputError(f"{path}: {error}") from None


def _filled(data: dict[str, Any]) -> dict[str, dict[str, Any]]:
    """All keys with their defaults; unknown ones are refused."""
    for table, content in data.items():
        if table not in _KEYS:
            raise InputError(f"the table [{table}] is unknown: {closest(table, _KEYS)}")
        if not isinstance(content, dict):
            raise InputError(f"`{table}` must be a table [{table}], but is {content!r}")
        for key in content:
            if key not in _KEYS[table]:
                raise InputError(f"[{table}] {key} is unknown: {closest(key, _KEYS[table])}")
    filled = {table: {**keys, **data.get(table, {})} for table, keys in _KEYS.items()}
    for table, key in (("time", "duration"), ("path", "t"), ("path", "height")):
        if filled[table][key] is None:
            raise InputError(f"[{table}] {key} must be given, but is missing")
    return filled


def _build(data: dict[str, dict[str, Any]], folder: Path) -> DeckCase:
    name = str(data["rotor"]["name"])
    rotor, operating = load(folder / name if name.endswith(".toml") else name)
    model, time, deck = data["model"], data["time"], data["deck"]
    if model["variant"] not in get_args(Variant):
        raise InputError(f"[model] variant must be one of {get_args(Variant)}, but is {model['variant']!r}")
    given = data["rotor"]["collective_deg"]
    collective = np.rad2deg(float(operating.collective)) if given is None else _number("collective_deg", given, -90, 90)
    t, height = _points("t", data["path"]["t"]), _points("height", data["path"]["height"])
    edge = None if data["path"]["edge"] is None else _points("edge", data["path"]["edge"])
    case = DeckCase(
        rotor=rotor,
        operating=operating,
        collective=float(np.deg2rad(collective)),
        rigid=_rigid(data["rotor"]["rigid"], rotor),
        variant=model["variant"],
        harmonics=_whole("harmonics", model["harmonics"], 1, 4),
        radial_terms=_whole("radial_terms", model["radial_terms"], 1, 5),
        steps_per_turn=_whole("steps_per_turn", time["steps_per_turn"], 12, 720),
        duration=_number("duration", time["duration"], 0, np.inf, open_=True),
        t=t,
        height=height,
        edge=edge,
        heave=_number("heave", deck["heave"], 0, 2),
        heave_period=_number("heave_period", deck["heave_period"], 0, np.inf, open_=True),
        pitch=float(np.deg2rad(_number("pitch_deg", deck["pitch_deg"], 0, 30))),
        pitch_period=_number("pitch_period", deck["pitch_period"], 0, np.inf, open_=True),
        edge_azimuth=float(np.deg2rad(_number("edge_azimuth_deg", deck["edge_azimuth_deg"], -360, 360))),
    )
    _check(case)
    return case


def _check(case: DeckCase) -> None:
    require_increasing("path.t", case.t)  # type: ignore[arg-type]
    for name, values in {"height": case.height, "edge": case.edge}.items():
        if values is not None and values.shape != case.t.shape:
            raise InputError(f"Argument `path.{name}` must hold {case.t.size} values as `t`, but holds {values.size}")
    if case.t[0] > 0 or case.t[-1] < case.duration:
        raise InputError(
            f"Argument `path.t` must cover 0 to {case.duration:g} s, but covers {case.t[0]:g} to {case.t[-1]:g}"
        )
    psi = case.instants()
    if psi.size > _MOST_STEPS:
        raise InputError(f"Argument `duration` must need at most {_MOST_STEPS} steps, but needs {psi.size}")
    motion = case.motion(psi)
    require_clear(motion["height"], motion["slope"])  # type: ignore[arg-type]


def _number(name: str, value: object, low: float, high: float, open_: bool = False) -> float:
    return float(check_number(name, value, low, high, open_=open_))  # type: ignore[arg-type]


def _whole(name: str, value: object, low: int, high: int) -> int:
    if isinstance(value, bool) or not isinstance(value, int) or not low <= value <= high:
        raise InputError(f"Argument `{name}` must be a whole number from {low} to {high}, but is {value!r}")
    return value


def _rigid(value: object, rotor: Rotor) -> bool:
    if value is None:
        return rotor.hinge is None
    if not isinstance(value, bool) or not (value or rotor.hinge is not None):
        raise InputError(f"[rotor] rigid must be true, or false for a rotor with hinge data, but is {value!r}")
    return value


def _points(name: str, values: object) -> np.ndarray:
    try:
        array = np.array(values, float)
    except (TypeError, ValueError):
        array = np.zeros(0)
    if array.ndim != 1 or array.size < 2 or not np.all(np.isfinite(array)):
        raise InputError(f"Argument `path.{name}` must be a list of two or more finite numbers, but is {values!r}")
    return array
