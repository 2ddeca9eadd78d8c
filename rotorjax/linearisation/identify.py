"""The identified inflow of flights in the free wake, fitted beside Pitt and Peters' own, and left behind as a table."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from rotorjax.errors import InputError
from rotorjax.io import netcdf
from rotorjax.io.atomic import write_text
from rotorjax.linearisation import rotor
from rotorjax.linearisation.found import LinearRotor
from rotorjax.linearisation.hover_flight import LinearHover
from rotorjax.linearisation.identified import (
    INPUTS,
    OUTPUTS,
    Identified,
    Inflow,
    Stepped,
    identified,
    own,
    table,
    text,
)
from rotorjax.ode.harmonic import average
from rotorjax.ode.models import LinearModel, PeriodicModel
from rotorjax.trim.run import FREE_WAKE, Request, run
from rotorjax.trim.solve import Trimmed


class Beside(NamedTuple):
    """The same flight with Pitt and Peters' inflow: the rotor's mean model of all states, and that inflow's own."""

    rotor: LinearModel
    inflow: Inflow


def beside(request: Request) -> Beside:
    """Trim and linearise a flight with Pitt and Peters' inflow. Raises InputError where that has no trim."""
    found = run(replace(request, inflow="pitt-peters", wake=None))
    if not found.converged:
        raise InputError(
            "Argument `request` must have a trim with Pitt and Peters' inflow, which the identified one starts from, "
            f"but: {found.trimmed.outcome.why}"
        )
    assert isinstance(found.trimmed, Trimmed)
    return Beside(average(rotor.linear_rotor(rotor.base_of(found.trimmed))), own(found.trimmed))


def fitted(model: Stepped, request: Request) -> Identified:
    """The inflow that gives a rotor the steps of a model of the free wake at the same flight."""
    start = beside(request)
    height = np.inf if request.height is None else request.height
    return identified(model, start.rotor, start.inflow, request.advance, height)


def of_flights(found: Sequence[LinearRotor]) -> list[Identified]:
    """Of those in the free wake whose models have INPUTS and OUTPUTS; none of the others."""
    return [
        fitted(_mean(one), one.result.request)
        for one in found
        if one.result.request.inflow == FREE_WAKE
        and set(INPUTS) <= set(one.full.inputs)
        and set(OUTPUTS) <= set(one.full.outputs)
    ]


def _mean(found: LinearRotor) -> Stepped:
    """A hover's model by wave number, a flight's mean over a revolution."""
    if isinstance(found, LinearHover):
        return found.model
    periodic = found.models["periodic"]
    assert isinstance(periodic, PeriodicModel)
    return average(periodic)


def write(found: Sequence[Identified], folder: Path) -> None:
    """Write inflow.nc and inflow.txt, a flight a row, where there is any."""
    if found:
        data = table(found)
        netcdf.write(folder / "inflow.nc", data)
        write_text(folder / "inflow.txt", text(data))


def lines(found: Sequence[Identified]) -> list[str]:
    """What the command prints of each: the error of a step over a revolution, over its largest value."""
    return [
        f"identified inflow at advance ratio {one.advance:g}"
        + ("" if np.isinf(one.height) else f", height {one.height:g}")
        + f": {100 * one.error:.1f} % off over a revolution after a step, Pitt and Peters' own "
        f"{100 * one.pitt_peters_error:.1f} %"
        for one in found
    ]
