"""All cases of the validation, in the order of the report."""

from collections.abc import Sequence

from rotorjax.checks import check_number, closest
from rotorjax.errors import InputError
from rotorjax.validation import (
    caradonna_tung,
    coaxial,
    finite_state,
    grid,
    ground,
    heave,
    inflow_map,
    landgrebe,
    march,
    momentum,
    polars,
    step,
)
from rotorjax.validation.case import Subject, ValidationCase

_ALL = (
    caradonna_tung,
    polars,
    momentum,
    landgrebe,
    ground,
    finite_state,
    step,
    march,
    heave,
    inflow_map,
    grid,
    coaxial,
)
CASES = {module.CASE.name: module.CASE for module in _ALL}
MEASURED = (caradonna_tung.NAME, polars.NAME, inflow_map.NAME, coaxial.NAME)
ASKED_FOR = (coaxial.NAME,)
"""Solved only where they are named: minutes of several rotors' wakes."""
QUICK = (caradonna_tung.NAME, momentum.NAME, ground.NAME)


def chosen_cases(names: Sequence[str] | None, subject: Subject) -> tuple[ValidationCase, ...]:
    """The cases of these names, or those that suit the subject.

    Raises InputError for an unknown name, a collective without a rotor, the measured rotor's case with another one, or
    measured points that no case would be compared with.
    """
    if subject.rotor is None and subject.collective_deg is not None:
        raise InputError("Argument `collective` must come with a rotor, but `rotor` is not given")
    if subject.collective_deg is not None:
        check_number("collective", subject.collective_deg, -45.0, 45.0)
    for name in names or ():
        if name not in CASES:
            raise InputError(f"Argument `case` must name a case, but is '{name}': {closest(name, CASES)}")
    for name in MEASURED:
        if subject.rotor is not None and name in (names or ()):
            raise InputError(
                f"Argument `case` must not hold '{name}' with a rotor of one's own: it was measured on its own rotor"
            )
    if subject.measured is not None and coaxial.NAME not in (names or ()):
        raise InputError(f"Argument `measured` must come with the case '{coaxial.NAME}', whose rotors' points it holds")
    usual = [n for n in (QUICK if subject.quick else CASES) if n not in ASKED_FOR]
    wanted = names or [n for n in usual if n not in MEASURED or not subject.rotor]
    return tuple(case for name, case in CASES.items() if name in wanted)
