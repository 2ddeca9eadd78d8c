"""The operating point: what the rotor is doing and the air it does it in. SI throughout."""

import equinox as eqx
from jaxtyping import Array, Float

from rotorjax.checks import array, check_number


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
    m/s. Raises InputError where a value is not finite, omega, density, sound_speed or viscosity is not positive, or the
    collective exceeds ±π/2 (degrees given for radians).
    """
    for name, value in {"omega": omega, "density": density, "sound_speed": sound_speed, "viscosity": viscosity}.items():
        check_number(name, value, 0.0, open_=True)
    check_number("collective", collective, -1.5708, 1.5708)
    check_number("climb", climb)
    fields = (omega, density, sound_speed, viscosity, collective, climb)
    return OperatingPoint(*map(array, fields))
