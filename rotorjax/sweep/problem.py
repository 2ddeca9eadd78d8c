"""The ways to solve a point, by command and model: how a point is prepared, and who solves it."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from rotorjax.bench.settings import settings_of
from rotorjax.rotor import catalogue
from rotorjax.sweep import hover_batch, hover_wake, trims
from rotorjax.sweep.case import SweepCase
from rotorjax.sweep.design import DesignPoint
from rotorjax.sweep.found import PointSolver
from rotorjax.trim.run import FREE_WAKE


@dataclass(frozen=True)
class Problem:
    """prepare(case, point): raises InputError where a point is not allowed. batch: points that are solved at once, 1
    where each starts from another.
    """

    prepare: Callable[[SweepCase, DesignPoint], Any]
    solve: PointSolver
    batch: int = 1


def problem_of(case: SweepCase) -> Problem:
    """Who solves a case's points."""
    if case.command == "trim":
        return Problem(trims.prepare, trims.solve)
    if case.model == FREE_WAKE:
        return Problem(hover_wake.prepare, hover_wake.solve)
    return Problem(hover_batch.prepare, hover_batch.solve, hover_batch.SIZE)


def table_of(case: SweepCase) -> dict[str, Any]:
    """Everything that decides a point's result but the point itself, as plain values: for files and fingerprints."""
    rotor, operating = catalogue.load(case.rotor)
    made = settings_of(rotor, operating, quick=case.fixed.get("quick", False), **case.wake).table()
    if case.model != FREE_WAKE:
        made = {name: value for name, value in made.items() if not name.startswith("wake.")}
    fixed = {f"case.{name}": value for name, value in case.fixed.items() if name != "rotor"}
    given = {f"wake.{name} given": value for name, value in case.wake.items()}
    return {"command": case.command, **made, **fixed, **given}
