"""The operating point: what the rotor is doing and the air it does it in. SI throughout."""

from typing import NamedTuple

import equinox as eqx
import numpy as np
from jaxtyping import Array, Float

from rotorjax.checks import Range, array, check_range, known
from rotorjax.errors import InputError

RANGES = {
    "omega": Range(0.0, 21_000.0, "rad/s", above=True, hint="a clockwise rotor has its sense in `rotation`"),
    "density": Range(1e-3, 2000.0, "kg/m3"),
    "sound_speed": Range(100.0, 3000.0, "m/s"),
    "viscosity": Range(1e-8, 0.1, "m2/s"),
    "collective": Range(-0.7854, 0.7854, "rad", hint="degrees go through np.deg2rad"),
    "climb": Range(-200.0, 200.0, "m/s"),
}
"""What each field may be, beyond which a rotor is another machine or the unit another one."""


class OperatingPoint(eqx.Module):
    """Rotor speed, air, collective pitch and climb; every field is a scalar array that may be differentiated.

    omega: Ω (rad/s). density: ρ (kg/m³). sound_speed (m/s). viscosity: kinematic (m²/s). collective: θ₀ (rad), the
    pitch where the rotor's twist table is zero. climb: axial climb velocity of the hub (m/s), positive up.
    """

    omega: Float[Array, ""]
    density: Float[Array, ""]
    sound_speed: Float[Array, ""]
    viscosity: Float[Array, ""]
    collective: Float[Array, ""]
    climb: Float[Array, ""]

    def tip_speed(self, radius: Float[Array, ""]) -> Float[Array, ""]:
        """ΩR in m/s, for a radius in m."""
        return self.omega * radius

    def force(self, radius: Float[Array, ""]) -> Float[Array, ""]:
        """ρA(ΩR)² in N, for a radius in m: what a force coefficient of 1 stands for."""
        return self.density * np.pi * radius**2 * self.tip_speed(radius) ** 2

    def tip_mach(self, radius: Float[Array, ""]) -> Float[Array, ""]:
        """Mach number of the tip in hover, ΩR/a, for a radius in m."""
        return self.omega * radius / self.sound_speed

    def climb_ratio(self, radius: Float[Array, ""]) -> Float[Array, ""]:
        """Climb velocity over ΩR: the uniform inflow (positive down) that climbing adds."""
        return self.climb / (self.omega * radius)


def operating_point(
    omega: float,
    density: float = 1.225,
    sound_speed: float = 340.294,
    viscosity: float = 1.4607e-5,
    collective: float = 0.0,
    climb: float = 0.0,
) -> OperatingPoint:
    """Make an operating point in SI units; the air defaults to the ISA at sea level (ISO 2533).

    omega in rad/s, density in kg/m³, sound_speed in m/s, viscosity (kinematic) in m²/s, collective in rad, climb in
    m/s; all may be traced. Raises InputError where a value is not finite or not one that a rotor can have: omega in
    (0, 21 000], density in [1e-3, 2000], sound_speed in [100, 3000], viscosity in [1e-8, 0.1], the collective within
    ±π/4, the climb within ±200 m/s.
    """
    fields = {
        "omega": omega,
        "density": density,
        "sound_speed": sound_speed,
        "viscosity": viscosity,
        "collective": collective,
        "climb": climb,
    }
    for name, value in fields.items():
        check_range(name, value, RANGES[name])
    return OperatingPoint(**{name: array(value) for name, value in fields.items()})


ALTITUDE = Range(-1000.0, 11_000.0, "m", hint="above, the standard atmosphere is another one: give the density")


class Air(NamedTuple):
    """density (kg/m³). sound_speed (m/s). viscosity: kinematic (m²/s)."""

    density: float
    sound_speed: float
    viscosity: float


def standard_air(altitude: float) -> Air:
    """The ISA (ISO 2533) at a geopotential altitude in m, up to the tropopause; viscosity by Sutherland's formula.

    Raises InputError beyond −1000 to 11 000 m.

    >>> f"{standard_air(2000.0).density:.4f}"
    '1.0065'
    """
    check_range("altitude", altitude, ALTITUDE)
    temperature = 288.15 - 0.0065 * altitude
    gas = 287.05287
    density = 101_325 / (gas * 288.15) * (temperature / 288.15) ** (9.80665 / (0.0065 * gas) - 1)
    dynamic = 1.458e-6 * temperature**1.5 / (temperature + 110.4)
    return Air(density, (1.4 * gas * temperature) ** 0.5, dynamic / density)


def check_still(operating: OperatingPoint) -> None:
    """Raise InputError where a rotor climbs, which over ground or past surfaces it cannot steadily."""
    if known(operating.climb) and float(operating.climb) != 0:
        raise InputError(
            "Argument `operating` must not climb over ground or surfaces (a steady state needs a fixed height), "
            f"but its climb is {float(operating.climb)} m/s: set climb = 0 or leave the ground and surfaces out"
        )
