"""Hovers with the finite-state model, many at once: one compiled function for a whole sweep."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from rotorjax.bench.cases import Case
from rotorjax.bench.disk_fit import disk_fit
from rotorjax.bench.finite_state import model_of
from rotorjax.bench.settings import settings_of
from rotorjax.bench.single import check_case
from rotorjax.errors import InputError
from rotorjax.inflow.balance import Balance, StationFlow, Stations, attempt, flow_of, stations_of
from rotorjax.limits import check_axial, check_flight
from rotorjax.operating import OperatingPoint
from rotorjax.potential.model import FiniteStateModel
from rotorjax.rotor.geometry import Rotor, solidity, twist
from rotorjax.sweep.case import SweepCase
from rotorjax.sweep.design import DesignPoint
from rotorjax.sweep.found import Found, Neighbour, judged, of_hover, refused
from rotorjax.sweep.rotors import rotor_of, values_of, wanted_thrust
from rotorjax.wake.search import Progress

SIZE = 32
"""Points that are solved at once; a sweep that is stopped loses so many at most."""
THRUST_TOL, MOST_SECANTS = 1e-11, 20


@dataclass(frozen=True)
class HoverCase:
    """A hover or climb. guess: C_T that the search starts from. wanted: C_T that the collective is to give, or None."""

    model: FiniteStateModel
    rotor: Rotor
    operating: OperatingPoint
    guess: float
    wanted: float | None

    @property
    def arrays(self) -> tuple[FiniteStateModel, Rotor, OperatingPoint]:
        """What is stacked with other points'."""
        return self.model, self.rotor, self.operating


def prepare(case: SweepCase, point: DesignPoint) -> HoverCase:
    """Rotor and model of a point. Raises InputError where it is not allowed."""
    values = values_of(case, point)
    rotor, operating = rotor_of(case, values)
    wanted = wanted_thrust(values, rotor, operating)
    place = Case(values.get("height"), values.get("slope_deg", 0.0))
    pitch = values.get("collective_deg") if wanted is None else _first_pitch(rotor, wanted)
    settings = settings_of(rotor, operating, pitch, values.get("climb", 0.0), values.get("harmonics", 1))
    check_case(place, settings, "vpbfsm")
    guess = check_axial("vpbfsm", rotor, settings.operating) if wanted is None else wanted
    if wanted is not None:
        check_flight("vpbfsm", wanted, settings.climb_ratio)
    return HoverCase(model_of(place, settings), rotor, settings.operating, guess, wanted)


def solve(
    prepared: Sequence[HoverCase], start: Neighbour | None = None, progress: Progress | None = None
) -> list[Found]:
    """Solve hovers whose models and rotors have the same shapes; as many lanes as SIZE, so that one program does."""
    del start  # nothing is gained: Newton's method on a few pressure terms
    lanes = [*prepared, *[prepared[-1]] * (-len(prepared) % SIZE)]
    collective = np.array([float(one.operating.collective) for one in lanes])
    if prepared[0].wanted is not None:
        collective = _pitch_for_thrust(lanes, collective)
    balances, found = _solved(lanes, collective)
    if progress is not None:
        progress("finite state", 0.0)
    return [
        _read(one, jax.tree.map(lambda a, k=k: a[k], balances), bool(found[k]), collective[k])
        for k, one in enumerate(prepared)
    ]


def _solved(lanes: Sequence[HoverCase], collective: np.ndarray) -> tuple[Balance, np.ndarray]:
    """Balances with a leading axis of lanes, as numpy's, and whether each was found."""
    stations = [stations_of(one.rotor) for one in lanes]
    flows = [_flow(one.model, at) for one, at in zip(lanes, stations, strict=True)]
    parts = zip(flows, (one.model for one in lanes), (one.rotor for one in lanes), stations, strict=True)
    flow, model, rotor, at = jax.tree.map(lambda *leaves: np.stack([np.asarray(v) for v in leaves]), *parts)
    operating = jax.tree.map(lambda *leaves: np.stack(leaves), *(one.operating for one in lanes))
    operating = eqx.tree_at(lambda o: o.collective, operating, collective)
    guess = np.array([one.guess for one in lanes])
    found = _search_all(*jax.tree.map(jnp.asarray, (flow, model, rotor, operating, at, guess)))
    return jax.tree.map(np.asarray, found)


_search_all = eqx.filter_jit(eqx.filter_vmap(attempt))
_flows: dict[bytes, StationFlow] = {}
_MOST_FLOWS = 512


def _flow(model: FiniteStateModel, at: Stations) -> StationFlow:
    """The costly part of a model, which points that differ in pitch, twist or chord alone share."""
    leaves, structure = jax.tree.flatten((model, at))
    key = repr(structure).encode() + b"".join(np.asarray(leaf).tobytes() for leaf in leaves)
    if key not in _flows:
        if len(_flows) >= _MOST_FLOWS:
            _flows.clear()
        _flows[key] = flow_of(model, at)
    return _flows[key]


def _read(one: HoverCase, found: Balance, is_found: bool, collective: float) -> Found:
    CT = float(found.CT)
    climb = float(one.operating.climb_ratio(one.rotor.radius))
    try:
        if is_found:
            check_flight("vpbfsm", CT, climb)
    except InputError as error:
        return refused(str(error))
    reached = one.wanted is None or abs(CT / one.wanted - 1) < 1e-9
    fit = disk_fit(*(np.asarray(v) for v in (found.r, found.widths, found.psi, found.inflow)))
    values = {
        **of_hover(found, fit, climb, one.rotor, one.operating),
        "collective_deg": float(np.rad2deg(collective)),
    }
    why = "loads and inflow reproduce each other at no thrust" if reached else "no collective gives this thrust"
    return judged(values, {}, is_found and reached, False, np.nan, why)


def _first_pitch(rotor: Rotor, thrust: float) -> float:
    """Collective in degrees for a thrust with linear lift and uniform inflow: θ at 0.75 R = 6 C_T/(σa) + 1.5 λ."""
    at_three_quarters = 6 * thrust / (5.73 * float(solidity(rotor))) + 1.5 * np.sqrt(thrust / 2)
    return float(np.clip(np.rad2deg(at_three_quarters - float(twist(rotor, jnp.asarray(0.75)))), -44.0, 44.0))


def _pitch_for_thrust(lanes: Sequence[HoverCase], first: np.ndarray) -> np.ndarray:
    """Collectives (rad) that give the wanted thrusts, by the secant method on all lanes together."""
    wanted = np.array([one.wanted for one in lanes], float)

    def excess(collective: np.ndarray) -> np.ndarray:
        balances, found = _solved(lanes, collective)
        return np.where(found, np.asarray(balances.CT) / wanted - 1, np.nan)

    return secant(excess, first, first + np.deg2rad(0.5))


def secant(excess: Callable[[np.ndarray], np.ndarray], x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Zeros of increasing functions by the secant method, lane by lane; NaN holds a lane where it is."""
    at_x, at_y = excess(x), excess(y)
    for _ in range(MOST_SECANTS):
        going = np.abs(at_y) > THRUST_TOL
        if not going.any():
            break
        with np.errstate(divide="ignore", invalid="ignore"):
            step = np.clip(at_y * (y - x) / (at_y - at_x), -0.1, 0.1)
        step = np.where(going & np.isfinite(step), step, 0.0)
        x, at_x, y = y, at_y, np.clip(y - step, -0.78, 0.78)
        at_y = excess(y)
    return y
