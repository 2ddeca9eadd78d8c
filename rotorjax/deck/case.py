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
    collective_deg = [17.0, 16.6, 16.5, 16.0]      # optional: what the pilot does, in place of the one of [rotor]

    [deck]                     # all optional
    heave = 0.06               # amplitude over R
    heave_period = 8.0         # s
    pitch_deg = 2.0            # amplitude; positive slopes rise aft
    pitch_period = 10.0        # s
    edge_azimuth_deg = 0.0     # direction off the deck: 0 aft, 90 to starboard

Height is counted under the hub, the pitch turns the deck about that point.
"""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, get_args

import numpy as np
from jaxtyping import Float
from scipy.interpolate import PchipInterpolator

from rotorjax.checks import Range
from rotorjax.errors import ArgumentError, InputError
from rotorjax.io.toml_file import Key, Schema, Tables, read_toml
from rotorjax.limits import check_axial, check_place
from rotorjax.operating import OperatingPoint
from rotorjax.potential.moving_ground import Variant, require_clear, require_increasing
from rotorjax.rotor.catalogue import load
from rotorjax.rotor.geometry import Rotor

_PERIOD = Range(0.05, 1e4, "s")
SCHEMA: Schema = {
    "rotor": {
        "name": Key("text"),
        "collective_deg": Key("number", Range(-45.0, 45.0, "deg")),
        "rigid": Key("true or false"),
    },
    "model": {
        "variant": Key("text", choices=get_args(Variant)),
        "harmonics": Key("whole number", Range(1, 4)),
        "radial_terms": Key("whole number", Range(1, 5)),
    },
    "time": {
        "duration": Key("number", Range(1e-3, 1e5, "s"), required=True),
        "steps_per_turn": Key("whole number", Range(12, 720)),
    },
    "path": {
        "t": Key("numbers", Range(-1e5, 1e6, "s"), required=True),
        "height": Key("numbers", Range(-10.0, 100.0, "R"), required=True),
        "edge": Key("numbers", Range(-1000.0, 1000.0, "R")),
        "collective_deg": Key("numbers", Range(-45.0, 45.0, "deg")),
    },
    "deck": {
        "heave": Key("number", Range(0.0, 2.0, "R")),
        "heave_period": Key("number", _PERIOD),
        "pitch_deg": Key("number", Range(0.0, 30.0, "deg")),
        "pitch_period": Key("number", _PERIOD),
        "edge_azimuth_deg": Key("number", Range(-360.0, 360.0, "deg")),
    },
}
_MOST_STEPS = 500_000


@dataclass(frozen=True)
class DeckCase:
    """One case. rigid: blades do not flap. t, height, edge, collective (P,): points of the path (s, over R, rad), edge
    None for a deck without one. duration (s). heave (over R), pitch (rad): amplitudes, with periods in s; edge_azimuth
    (rad).
    """

    rotor: Rotor
    operating: OperatingPoint
    rigid: bool
    variant: Variant
    harmonics: int
    radial_terms: int
    duration: float
    steps_per_turn: int
    t: Float[np.ndarray, " P"]
    height: Float[np.ndarray, " P"]
    edge: Float[np.ndarray, " P"] | None
    collective: Float[np.ndarray, " P"]
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
        """Return height, slope, edge, rates, the hub's climb and its rate, collective at azimuths, in rotor units."""
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
            "collective": PchipInterpolator(self.t, self.collective)(t),
        }


def read_case(path: str | Path) -> DeckCase:
    """Read a case file.

    Raises InputError, naming file, key and value, for a file that is not there or not TOML, keys that are missing or
    misspelt, values out of range, times that do not increase or do not cover the duration, and a deck that would cut
    the disk.
    """
    return read_toml(path, SCHEMA, _build)


def _build(data: Tables, folder: Path) -> DeckCase:
    body, model, time, path, deck = (data.get(name, {}) for name in SCHEMA)
    name = body.get("name", "uh60")
    rotor, operating = load(folder / name if name.endswith(".toml") else name)
    case = DeckCase(
        rotor=rotor,
        operating=operating,
        rigid=_rigid(body.get("rigid"), rotor),
        variant=model.get("variant", "dynamic"),
        harmonics=model.get("harmonics", 1),
        radial_terms=model.get("radial_terms", 3),
        steps_per_turn=time.get("steps_per_turn", 16),
        duration=time["duration"],
        t=np.array(path["t"]),
        height=np.array(path["height"]),
        edge=np.array(path["edge"]) if "edge" in path else None,
        collective=_collective(body, path, float(operating.collective)),
        heave=deck.get("heave", 0.0),
        heave_period=deck.get("heave_period", 8.0),
        pitch=np.deg2rad(deck.get("pitch_deg", 0.0)),
        pitch_period=deck.get("pitch_period", 10.0),
        edge_azimuth=rotor.side * np.deg2rad(deck.get("edge_azimuth_deg", 0.0)),  # starboard of a mirrored rotor
    )
    _check_effect(path, deck)
    _check(case)
    return case


def _collective(body: dict[str, Any], path: dict[str, Any], usual: float) -> Float[np.ndarray, " P"]:
    """Collective (rad) at the path's points: its own, or the rotor's all the way."""
    if "collective_deg" not in path:
        return np.full(len(path["t"]), np.deg2rad(body["collective_deg"]) if "collective_deg" in body else usual)
    if "collective_deg" in body:
        raise InputError("[rotor] collective_deg must be absent where [path] has it, without which it has no effect")
    return np.deg2rad(path["collective_deg"])


def _check_effect(path: dict[str, Any], deck: dict[str, Any]) -> None:
    """Refuse keys that would have no effect."""
    needed = {"heave_period": ("heave", deck), "pitch_period": ("pitch_deg", deck), "edge_azimuth_deg": ("edge", path)}
    for key, (other, table) in needed.items():
        if key in deck and not table.get(other):
            where = "[path]" if table is path else "[deck]"
            raise InputError(f"[deck] {key} must come with {other} in {where}, without which it has no effect")


def _check(case: DeckCase) -> None:
    require_increasing("path.t", case.t)  # type: ignore[arg-type]
    for name, values in {"height": case.height, "edge": case.edge, "collective_deg": case.collective}.items():
        if values is not None and values.shape != case.t.shape:
            raise ArgumentError(f"path.{name}", f"hold {case.t.size} values as t", f"of {values.size}")
    if case.t[0] > 0 or case.t[-1] < case.duration:
        raise ArgumentError("path.t", f"cover 0 to {case.duration:g} s", f"{case.t[0]:g} to {case.t[-1]:g} s")
    psi = case.instants()
    if psi.size > _MOST_STEPS:
        raise ArgumentError("time.duration", f"need at most {_MOST_STEPS} steps", f"{case.duration:g} s: {psi.size}")
    motion = case.motion(psi)
    require_clear(motion["height"], motion["slope"])  # type: ignore[arg-type]
    _check_theory(case, psi / case.omega, motion)


def _check_theory(case: DeckCase, t: Float[np.ndarray, " T"], motion: dict[str, Float[np.ndarray, " T"]]) -> None:
    """Refuse what the finite states do not know: a hub or a rim too low, a descent into the vortex ring state."""
    height, slope, climb = motion["height"], np.abs(motion["slope"]), motion["climb"]
    rim = height * np.cos(slope) - np.sin(slope)
    tip_speed = case.omega * float(case.rotor.radius)
    collective = motion["collective"]
    for i in {int(np.argmin(v)) for v in (height, rim, climb, collective)} | {int(np.argmax(climb))}:
        flown = replace(case.operating, collective=np.float64(collective[i]), climb=climb[i] * tip_speed)
        try:
            check_place("vpbfsm", float(height[i]), float(np.rad2deg(slope[i])))
            check_axial("vpbfsm", case.rotor, flown)
        except InputError as error:
            raise InputError(f"[path] and [deck], at {t[i]:.4g} s: {error}") from None


def _rigid(value: object, rotor: Rotor) -> bool:
    if value is None:
        return rotor.hinge is None
    if not isinstance(value, bool) or not (value or rotor.hinge is not None):
        raise InputError(f"[rotor] rigid must be true, or false for a rotor with hinge data, but is {value!r}")
    return value
