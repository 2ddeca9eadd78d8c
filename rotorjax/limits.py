"""What each model is for: the limits of operating points, one place that every command asks (docs/limits.md)."""

from rotorjax.checks import known
from rotorjax.errors import InputError
from rotorjax.operating import OperatingPoint
from rotorjax.rotor.derived import derived
from rotorjax.rotor.geometry import Rotor

MOST_SOLIDITY, MOST_TIP_MACH = 0.5, 1.2
_TABLE_END = 0.05  # by which the tip's Mach number may exceed the section's last one


def check_rotor(rotor: Rotor, operating: OperatingPoint) -> None:
    """Raise InputError where a rotor's derived numbers are beyond sense, by a wrong unit, or beyond its tables."""
    if not known(rotor, operating):
        return
    found = derived(rotor, operating)
    if found.solidity > MOST_SOLIDITY:
        raise InputError(
            f"The solidity (blade area over disk area) must be at most {MOST_SOLIDITY:g}, but is {found.solidity:.3g}: "
            f"check chord (up to {float(rotor.chord.values.max()):g} m) against radius ({float(rotor.radius):g} m)"
        )
    if found.tip_mach > MOST_TIP_MACH:
        rpm, radius = float(operating.omega) * 9.549297, float(rotor.radius)
        raise InputError(
            f"The tip Mach number must be at most {MOST_TIP_MACH:g}, but is {found.tip_mach:.3g}: check rpm ({rpm:g}) "
            f"and radius ({radius:g} m)"
        )
    last = float(rotor.airfoil.mach[-1])
    if found.tip_mach > last + _TABLE_END:
        raise InputError(
            f"The tip Mach number must lie within the airfoil's table, which ends at {last:g}, but is "
            f"{found.tip_mach:.3g}: add columns of higher Mach number"
        )
