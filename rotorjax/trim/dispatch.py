"""One request, any inflow: a trim with an inflow model's states, or in the free wake."""

from typing import Any

from rotorjax.checks import closest
from rotorjax.errors import InputError
from rotorjax.inflow.choice import NAMES
from rotorjax.trim import in_wake_run, run
from rotorjax.trim.in_wake import Progress
from rotorjax.trim.in_wake_run import WakeResult
from rotorjax.trim.problem import Trim
from rotorjax.trim.run import Request, Result

ALL = (*NAMES, in_wake_run.NAME)


def check_request(request: Request) -> None:
    """Raise InputError where something of a request is not allowed."""
    if request.inflow not in ALL:
        raise InputError(
            f"Argument `inflow` must be one of {', '.join(ALL)}, but is '{request.inflow}': "
            f"{closest(request.inflow, ALL)}"
        )
    if request.inflow == in_wake_run.NAME:
        in_wake_run.check_in_wake(request)
    else:
        run.prepare(request)


def trim_request(request: Request, start: Trim | None = None, progress: Progress | None = None) -> Result | WakeResult:
    """Trim. start: a trim nearby, of no use to the free wake. Raises InputError as `check_request` does."""
    check_request(request)
    if request.inflow == in_wake_run.NAME:
        return in_wake_run.run_in_wake(request, progress=progress)
    return run.run(request, start)


def numbers_of(result: Result | WakeResult) -> dict[str, Any]:
    """What --json writes."""
    return in_wake_run.wake_numbers(result) if isinstance(result, WakeResult) else run.numbers(result)
