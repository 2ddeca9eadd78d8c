"""A solver that makes up every point in closed form, in no time: for tests of what surrounds a solver."""

import os
import time

import numpy as np

from rotorjax.sweep import run, table
from rotorjax.sweep.case import sweep_case
from rotorjax.sweep.found import Found, judged

SPEEDS = {"from": 0.0, "to": 0.3, "points": 7}
CASE = sweep_case("trim", {"advance_ratio": SPEEDS, "thrust_coefficient": [0.004, 0.006]}, inflow="uniform")


def numbers(prepared) -> dict[str, float]:
    """Of a trim's request."""
    thrust, speed = prepared.thrust, prepared.advance
    names = ("CT", "CP", "figure_of_merit", "lambda_0", "lambda_1c", "lambda_1s", "power")
    values = (thrust, thrust**1.5 * (1 + speed**2), 0.7, np.sqrt(thrust / 2) / (1 + 9 * speed), 0.1 * speed, 0.0, 1e5)
    return dict(zip(names, map(float, values), strict=True))


def made_up(prepared, start=None, progress=None) -> list[Found]:
    """A tenth of the power's last digits comes from the start, so that another start is seen."""
    found = []
    for one in prepared:
        trace = 0.0 if start is None else start.found.values["CP"]
        values = numbers(one) | {"residual": 1e-9 * (1 + trace)}
        found.append(judged(values, {"00": np.array([values["CP"]])}, True, True, 0.0, ""))
    return found


def slow(prepared, start=None, progress=None) -> list[Found]:
    time.sleep(0.03)
    return made_up(prepared, start, progress)


def deadly(prepared, start=None, progress=None) -> list[Found]:
    """The first worker that meets the third speed dies of it."""
    flag = os.environ["MADE_UP_DEATH"]
    if abs(prepared[0].advance - 0.1) < 1e-9 and not os.path.exists(flag):
        with open(flag, "w"):
            os._exit(9)
    return made_up(prepared, start, progress)


def picky(prepared, start=None, progress=None) -> list[Found]:
    """No solution at the third speed, and stalled at the fourth."""
    speed = prepared[0].advance
    if abs(speed - 0.1) < 1e-9:
        return [judged({}, {}, False, False, np.nan, "made up to fail")]
    found = made_up(prepared, start, progress)[0]
    return [found if abs(speed - 0.15) > 1e-9 else judged(found.values, {}, False, True, 3e-4, "made up to stall")]


def swept(folder, solver=made_up, case=CASE, **more):
    """The table of a sweep that a made-up solver solves."""
    return table.dataset(run.sweep(case, folder, solver=solver, **more))
