"""What each model is for: limits of validity by operating point, one place that every command asks.

`TABLE` holds what docs/limits.md prints. A value beyond a limit is refused with the limit and its reason; nothing is
answered by a model outside its own theory.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from rotorjax.checks import Range, check_range
from rotorjax.errors import InputError
from rotorjax.inflow.momentum import VORTEX_RING, FlightState, flight_state
from rotorjax.operating import OperatingPoint
from rotorjax.rotor.geometry import Rotor


class Limits(NamedTuple):
    """Limits of one model. height: least, hub over level ground, over R. clearance: least, of the disk's rim over R.
    slope: most, deg. advance: most. states: of flight that it knows, axially. why: where the limits come from.
    """

    height: float
    clearance: float
    slope: float
    advance: float
    states: tuple[FlightState, ...]
    why: str


def markdown() -> str:
    """`TABLE` as docs/limits.md holds it."""
    rows = [
        f"| {name} | {limits.height:g} | {limits.clearance:g} | {limits.slope:g} | {limits.advance:g} | "
        f"{', '.join(limits.states)} | {limits.why} |"
        for name, limits in TABLE.items()
    ]
    head = "| model | height over R, at least | rim over R | slope, deg, at most | μ, at most | axial flight | why |"
    return "\n".join([head, "|---" * 7 + "|", *rows])


_UPRIGHT: tuple[FlightState, ...] = ("hover", "climb", "slow descent")
_ALL: tuple[FlightState, ...] = (*_UPRIGHT, "windmill brake")
TABLE: dict[str, Limits] = {
    "uniform": Limits(0.5, 0.5, 0.0, 0.5, _ALL, "momentum theory; Cheeseman and Bennett's source over ground"),
    "pitt-peters": Limits(0.5, 0.5, 0.0, 0.5, _ALL, "momentum theory; Cheeseman and Bennett's source over ground"),
    "vpbfsm": Limits(0.3, 0.05, 59.9, 0.5, _ALL, "Hayden's measurements begin at 0.3"),
    "freewake": Limits(0.3, 0.05, 59.9, 0.5, _UPRIGHT, "wakes that leave the disk downward are what was verified"),
}
THRUST = Range(0.0, 0.1, above=True)  # C_T of a rotor that is to be trimmed
ADVANCE = Range(0.0, max(limits.advance for limits in TABLE.values()))
CLIMB = Range(-0.3, 0.5, "ΩR", hint="beyond, most of the blade is stalled or unloaded")


def check_place(model: str, height: float | None, slope_deg: float = 0.0) -> None:
    """Raise InputError where a hub at a height over R, over ground of a slope, is beyond a model."""
    if height is None:
        return
    check_range("height", height, Range(0.0, 1000.0, "R", above=True))
    check_range("slope_deg", slope_deg, Range(0.0, 60.0, "deg"))
    limits, slope = TABLE[model], np.deg2rad(slope_deg)
    if height < limits.height:
        raise InputError(
            f"Argument `height` must be at least {limits.height:g} for {model} ({limits.why}), but is {height:g}"
            + _instead(lambda other: height >= other.height and slope_deg <= other.slope)
        )
    if slope_deg > limits.slope:
        raise InputError(
            f"Argument `slope` must be at most {limits.slope:g} deg for {model}, but is {slope_deg:g}"
            + _instead(lambda other: slope_deg <= other.slope)
        )
    clearance = height * np.cos(slope) - np.sin(slope)
    if clearance < limits.clearance:
        raise InputError(
            f"Argument `height` must leave the rim {limits.clearance:g} R over the ground for {model}, but at "
            f"{height:g} over {slope_deg:g} deg it leaves {clearance:.3g} R"
        )


def _instead(serves: Callable[[Limits], bool]) -> str:
    """The models that serve where one does not, as the end of a message."""
    others = [name for name, limits in TABLE.items() if serves(limits)]
    return f": use {' or '.join(others)}" if others else ""


def check_flight(model: str, thrust: float, climb: float, advance: float = 0.0) -> FlightState:
    """Name the state of flight of a C_T at speeds over ΩR. Raises InputError where the model does not know it."""
    check_range("climb", climb, CLIMB)
    check_range("advance_ratio", advance, Range(0.0, TABLE[model].advance))
    state = flight_state(thrust, climb, advance)
    if state not in TABLE[model].states:
        raise InputError(_unknown(model, state, thrust, climb))
    return state


def of_the_instant(advance: float, slope_deg: float) -> str | None:
    """What to know of a level flight over a slope, which changes its height."""
    if not advance or not slope_deg:
        return None
    return f"over a slope of {slope_deg:g} deg a level flight changes its height: the trim is that of the instant"


def _unknown(model: str, state: FlightState, thrust: float, climb: float) -> str:
    hover = np.sqrt(abs(thrust) / 2)
    low, high = VORTEX_RING
    reason = (
        f"between {high:g} and {low:g} v_h there is no slipstream and no momentum theory"
        if state == "vortex ring"
        else f"{model} knows {', '.join(TABLE[model].states)} only"
    )
    return (
        f"Argument `climb` must keep the rotor out of the {state} state, but {climb:.4g} is "
        f"{climb * np.sign(thrust) / hover:.3g} v_h at C_T = {thrust:.4g} (v_h = {hover:.4g} ΩR): {reason}"
    )


def steady_thrusts(rotor: Rotor, operating: OperatingPoint) -> list[tuple[float, FlightState]]:
    """C_T at which blade elements in momentum theory's uniform inflow reproduce themselves, with their flight states.

    An estimate in numpy, good to some per cent: where a solver may start, and what to ask of a case before solving it.
    Collective and climb are the operating point's; out of ground effect.
    """
    climb = float(operating.climb) / (float(operating.omega) * float(rotor.radius))
    thrusts = np.linspace(-0.1, 0.1, 802)  # zero left out
    hover = np.sqrt(np.abs(thrusts) / 2)
    half, sign = np.sign(thrusts) * climb / 2, np.sign(thrusts)
    windmill = half <= -hover
    inner = np.sqrt(np.where(windmill, np.maximum(half**2 - hover**2, 0.0), half**2 + hover**2))
    through = climb + sign * (-half + np.where(windmill, -inner, inner))
    excess = _blade_thrust(rotor, operating, through) - thrusts
    found = []
    for i in np.flatnonzero((excess[1:] > 0) != (excess[:-1] > 0)):
        if windmill[i] == windmill[i + 1]:  # no jump between branches
            share = excess[i] / (excess[i] - excess[i + 1])
            thrust = float(thrusts[i] + share * (thrusts[i + 1] - thrusts[i]))
            found.append((thrust, flight_state(thrust, climb)))
    return found


def check_axial(model: str, rotor: Rotor, operating: OperatingPoint) -> float:
    """Estimated C_T of a rotor at its collective and climb, in a flight state that a model knows.

    A thrust down is one of a wind turbine, in the windmill brake state upside down. Raises InputError where there is
    none.
    """
    climb = float(operating.climb) / (float(operating.omega) * float(rotor.radius))
    collective = np.rad2deg(float(operating.collective))
    check_range("climb", climb, CLIMB)
    found = steady_thrusts(rotor, operating)
    if not found:
        raise InputError(
            f"Argument `climb` must leave a steady state, but at {climb:.4g} ΩR and a collective of {collective:g} deg "
            "blades and momentum theory agree on no thrust: between the vortex ring and the windmill brake state there "
            "is none"
        )
    for thrust, state in found:
        if state in TABLE[model].states and (thrust > 0 or state == "windmill brake"):
            return thrust
    thrust, state = found[0]
    if state not in TABLE[model].states:
        raise InputError(_unknown(model, state, thrust, climb))
    raise InputError(
        f"Argument `collective` must give a loading that thrusts upward for {model}, but at {collective:g} deg and a "
        f"climb of {climb:.4g} ΩR C_T is about {thrust:.4g}"
    )


def _blade_thrust(rotor: Rotor, operating: OperatingPoint, through: np.ndarray) -> np.ndarray:
    """C_T of blade elements in uniform flows through the disk [n]."""
    table, cutout = rotor.airfoil, float(rotor.root_cutout)
    edges = np.linspace(cutout, float(rotor.tip_loss), 31)
    r = 0.5 * (edges[1:] + edges[:-1])
    chord = np.interp(r, np.asarray(rotor.chord.stations), np.asarray(rotor.chord.values)) / float(rotor.radius)
    twist = np.interp(r, np.asarray(rotor.twist.stations), np.asarray(rotor.twist.values))
    tip_mach = float(operating.omega) * float(rotor.radius) / float(operating.sound_speed)
    angle = np.arctan2(through[:, None], r)
    alpha = float(operating.collective) + twist - angle
    alpha = alpha - 2 * np.pi * np.round(alpha / (2 * np.pi))
    nodes, machs = np.asarray(table.alpha), np.asarray(table.mach)
    total = np.zeros(through.size)
    for i, width in enumerate(np.diff(edges)):
        column = int(np.argmin(np.abs(machs - tip_mach * r[i])))
        cl, cd = (np.interp(alpha[:, i], nodes, np.asarray(c)[:, column]) for c in (table.cl, table.cd))
        if table.prandtl_glauert:
            cl = cl / np.sqrt(1 - min(tip_mach * r[i], 0.7) ** 2)
        force = cl * np.cos(angle[:, i]) - cd * np.sin(angle[:, i])
        total += width * 0.5 * chord[i] * (r[i] ** 2 + through**2) * force
    return rotor.blades / np.pi * total
