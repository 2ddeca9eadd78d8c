"""The inflow models by name, for commands and case files."""

from typing import Literal, get_args

from rotorjax.checks import refuse_choice
from rotorjax.errors import InputError
from rotorjax.ground import Plane
from rotorjax.inflow.finite_state import finite_state
from rotorjax.inflow.interface import InflowModel
from rotorjax.inflow.momentum import uniform
from rotorjax.inflow.pitt_peters import pitt_peters

Inflow = Literal["uniform", "pitt-peters", "vpbfsm"]
NAMES = get_args(Inflow)
LOWEST = (
    0.5  # of momentum theory over ground: Cheeseman and Bennett's source leaves no flow below a quarter of a radius
)


def inflow_model(name: str, ground: Plane | None = None) -> InflowModel:
    """Make an inflow model, over ground or not.

    Raises InputError for an unknown name, and over ground where momentum theory is no guide: a slope or a height below
    half a radius.
    """
    if name not in NAMES:
        raise refuse_choice("inflow", name, NAMES)
    if name == "vpbfsm":
        return finite_state(ground)
    if ground is not None:
        if float(ground.slope) != 0:
            raise InputError(
                f"Argument `slope` must be 0 with inflow '{name}', which knows level ground only: use vpbfsm"
            )
        if float(ground.height) < LOWEST:
            raise InputError(
                f"Argument `height` must be at least {LOWEST} with inflow '{name}' (Cheeseman and Bennett's source), "
                f"but is {float(ground.height):g}: use vpbfsm"
            )
    return uniform() if name == "uniform" else pitt_peters()
