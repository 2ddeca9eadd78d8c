"""Weight, speed and air as users have them, beside C_T and μ: one place for trims, linear models and sweeps."""

import equinox as eqx
import jax.numpy as jnp

from rotorjax.checks import Range, check_range
from rotorjax.errors import InputError
from rotorjax.limits import ADVANCE, THRUST
from rotorjax.operating import RANGES, OperatingPoint, standard_air
from rotorjax.rotor.geometry import Rotor

WEIGHT = Range(0.0, 1e7, "N", above=True)
SPEED = Range(0.0, 400.0, "m/s")


def in_air(operating: OperatingPoint, altitude: float | None = None, density: float | None = None) -> OperatingPoint:
    """The operating point in the standard atmosphere at an altitude (m), or in air of a density (kg/m³).

    With neither it stays as it is. Raises InputError where both are given or one is out of range.
    """
    if altitude is not None and density is not None:
        raise InputError(f"Argument `density` must be left out with an altitude, but is {density:g}")
    if altitude is not None:
        return eqx.tree_at(
            lambda o: (o.density, o.sound_speed, o.viscosity), operating, _arrays(standard_air(altitude))
        )
    if density is None:
        return operating
    check_range("density", density, RANGES["density"])
    return eqx.tree_at(lambda o: o.density, operating, *_arrays((density,)))


def thrust_coefficient(weight: float, rotor: Rotor, operating: OperatingPoint) -> float:
    """C_T of a thrust in N along the shaft. Raises InputError where it is not positive, or more than any rotor's."""
    check_range("weight", weight, WEIGHT)
    return _comes_to("weight", weight, WEIGHT, "C_T", weight / float(operating.force(rotor.radius)), THRUST)


def advance_ratio(speed: float, rotor: Rotor, operating: OperatingPoint) -> float:
    """Return μ of a horizontal speed in m/s. Raises InputError where it is negative or beyond every model."""
    check_range("speed", speed, SPEED)
    return _comes_to("speed", speed, SPEED, "μ", speed / float(operating.tip_speed(rotor.radius)), ADVANCE)


def _comes_to(name: str, given: float, kind: Range, symbol: str, found: float, allowed: Range) -> float:
    """A coefficient, checked where the user's own key and unit are still known."""
    if found not in allowed:
        comes = f"{given:g} {kind.unit} comes to {found:.4g}"
        raise InputError(f"Argument `{name}` must come to a {symbol} that is {allowed}, but {comes}")
    return found


def _arrays(values: tuple[float, ...]) -> tuple:
    return tuple(jnp.asarray(value, float) for value in values)
