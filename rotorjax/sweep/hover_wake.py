"""Hovers with the free wake of rigid blades, one at a time, each from a solved neighbour."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rotorjax.bench.cases import Case
from rotorjax.bench.disk_fit import disk_fit
from rotorjax.bench.settings import StudySettings, settings_of
from rotorjax.bench.single import Solver as WakeSolver
from rotorjax.bench.single import check_case
from rotorjax.bench.wake_file import lost_at, model_of, start_of, state_arrays, to_dataset
from rotorjax.sweep.case import SweepCase
from rotorjax.sweep.design import DesignPoint
from rotorjax.sweep.found import Found, Neighbour, judged, of_hover
from rotorjax.sweep.rotors import rotor_of, values_of
from rotorjax.wake.search import Progress
from rotorjax.wake.solution import solve as solve_wake


@dataclass(frozen=True)
class WakeHover:
    """A hover or climb: where, and of what."""

    case: Case
    settings: StudySettings


def prepare(case: SweepCase, point: DesignPoint) -> WakeHover:
    """Rotor and wake of a point. Raises InputError where it is not allowed."""
    values = values_of(case, point)
    rotor, operating = rotor_of(case, values)
    settings = settings_of(
        rotor,
        operating,
        values.get("collective_deg"),
        values.get("climb", 0.0),
        quick=values.get("quick", False),
        **case.wake,
    )
    place = Case(values.get("height"), values.get("slope_deg", 0.0))
    check_case(place, settings, "freewake")
    return WakeHover(place, settings)


def solve(
    prepared: Sequence[WakeHover],
    start: Neighbour | None = None,
    progress: Progress | None = None,
    solver: WakeSolver = solve_wake,
) -> list[Found]:
    """Solve hovers one after the other from the same start."""
    return [_solve(wanted, start, progress, solver) for wanted in prepared]


def _solve(wanted: WakeHover, near: Neighbour | None, progress: Progress | None, solver: WakeSolver) -> Found:
    begin = None if near is None else start_of(near.prepared.case, near.prepared.settings, near.found.state)
    found = solver(model_of(wanted.case, wanted.settings), begin, progress)
    lost = None if found.converged else lost_at(to_dataset(wanted.case, found, wanted.settings))
    climb = wanted.settings.climb_ratio
    fit = disk_fit(found.r, found.widths, found.psi, np.asarray(found.inflow) - climb)
    values = {
        **of_hover(found, fit, climb, wanted.settings.rotor, wanted.settings.operating),
        "collective_deg": wanted.settings.collective_deg,
        "load_change": float(found.load_change),
        "residual": float(found.residual),
        "wall_time_s": float(found.wall_time_s),
    }
    why = found.why if lost is None else f"lost at {lost}: {found.why}"
    state = state_arrays(found) if found.converged else {}
    return judged(values, state, found.converged, lost is None, float(found.load_change), why)
