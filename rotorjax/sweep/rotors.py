"""Rotor and air of a point: the case's, with the rotor file's keys that vary in it."""

from functools import lru_cache
from typing import Any

from rotorjax.bench.as_flown import in_air, thrust_coefficient
from rotorjax.operating import OperatingPoint
from rotorjax.rotor import catalogue
from rotorjax.rotor.geometry import Rotor
from rotorjax.rotor.rotor_file import SCHEMA
from rotorjax.sweep.case import SweepCase
from rotorjax.sweep.design import DesignPoint


def values_of(case: SweepCase, point: DesignPoint) -> dict[str, Any]:
    """All keys of a point, those of rotor files too; no height where it is inf, and no slope there."""
    values = case.fixed | dict(point.values)
    if values.get("height") == float("inf"):
        values |= {"height": None, "slope_deg": 0.0}
    return values


def rotor_of(case: SweepCase, values: dict[str, Any]) -> tuple[Rotor, OperatingPoint]:
    """Rotor and operating point. Raises InputError where a key of the rotor file is not allowed, alone or together."""
    rotor, operating = _loaded(case.rotor, tuple((name, value) for name, value in values.items() if "." in name))
    return rotor, in_air(operating, values.get("altitude"), values.get("density"))


def wanted_thrust(values: dict[str, Any], rotor: Rotor, operating: OperatingPoint) -> float | None:
    """C_T that is asked for, by itself or as a weight; None for a given collective."""
    if "weight" in values:
        return thrust_coefficient(values["weight"], rotor, operating)
    return values.get("thrust_coefficient")


@lru_cache(maxsize=256)
def _loaded(rotor: str, changes: tuple[tuple[str, float], ...]) -> tuple[Rotor, OperatingPoint]:
    tables: dict[str, dict[str, Any]] = {}
    for name, value in changes:
        table, _, key = name.partition(".")
        whole = SCHEMA[table][key].kind == "whole number" and value == int(value)
        tables.setdefault(table, {})[key] = int(value) if whole else value
    return catalogue.load(rotor, tables)
