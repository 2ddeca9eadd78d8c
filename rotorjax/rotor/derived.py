"""What a rotor's numbers come to: the dimensionless figures by which a wrong unit shows."""

from typing import NamedTuple

import jax
import numpy as np

from rotorjax.checks import known
from rotorjax.errors import InputError
from rotorjax.operating import OperatingPoint
from rotorjax.rotor.geometry import Rotor, solidity

MOST_SOLIDITY, MOST_TIP_MACH, MOST_SLOPE = 0.5, 1.2, 30.0
_TABLE_END = 0.05  # by which the tip's Mach number may exceed the section's last one
_AT = 0.75  # r/R of the Reynolds number and the lift slope


class Derived(NamedTuple):
    """solidity: σ, blade area over disk area. tip_mach: ΩR/a. reynolds: at 0.75 R in hover. lock: ρ a c R⁴/I_β with the
    section's own lift slope at 0.75 R, None without hinge data.
    """

    solidity: float
    tip_mach: float
    reynolds: float
    lock: float | None


def derived(rotor: Rotor, operating: OperatingPoint) -> Derived:
    """The figures of a rotor whose numbers are known, in numpy.

    Lock number: Johnson, Helicopter Theory (1980), section 1-3.3.
    """
    radius, omega = float(rotor.radius), float(operating.omega)
    stations, chords = np.asarray(rotor.chord.stations), np.asarray(rotor.chord.values)
    chord = float(np.interp(_AT, stations, chords))
    tip_mach = omega * radius / float(operating.sound_speed)
    lock = None
    if rotor.hinge is not None:
        slope = lift_slope(rotor, _AT * tip_mach)
        lock = float(operating.density) * slope * chord * radius**4 / float(rotor.hinge.flap_inertia)
    reynolds = _AT * omega * radius * chord / float(operating.viscosity)
    return Derived(float(solidity(rotor)), tip_mach, reynolds, lock)


def lift_slope(rotor: Rotor, mach: float) -> float:
    """dc_l/dα per rad within ±2° of no lift, at the nearest Mach number of the table."""
    table = rotor.airfoil
    alpha = np.asarray(table.alpha)
    cl = np.asarray(table.cl)[:, int(np.argmin(np.abs(np.asarray(table.mach) - mach)))]
    ends = np.interp(np.deg2rad([-2.0, 2.0]), alpha, cl)
    slope = float(np.diff(ends)[0] / np.deg2rad(4.0))
    return slope / np.sqrt(1 - min(mach, 0.7) ** 2) if table.prandtl_glauert else slope


def describe(rotor: Rotor, operating: OperatingPoint) -> str:
    """One line for the top of a run."""
    found = derived(rotor, operating)
    parts = [
        f"{rotor.name}: {rotor.blades} blades, R = {float(rotor.radius):.4g} m",
        f"{float(operating.omega) * 30 / np.pi:.4g} rpm" + (" clockwise" if rotor.side < 0 else ""),
        f"solidity {found.solidity:.4f}",
        f"tip Mach {found.tip_mach:.3f}",
        f"Re(0.75R) {found.reynolds:.2e}",
    ]
    parts += [] if found.lock is None else [f"Lock {found.lock:.2f}"]
    return ", ".join(parts) + f"; section {rotor.airfoil.name or 'unnamed'}"


def doubts(rotor: Rotor, operating: OperatingPoint) -> list[str]:
    """Numbers that may be meant and are more often a wrong unit: each with its value, the usual ones and its keys."""
    found = derived(rotor, operating)
    slope = lift_slope(rotor, _AT * found.tip_mach)
    usual = [
        ("density", float(operating.density), 0.2, 2.0, " kg/m3", ""),
        ("sound_speed", float(operating.sound_speed), 200.0, 400.0, " m/s", ""),
        ("viscosity", float(operating.viscosity), 5e-6, 1e-4, " m2/s, kinematic", ""),
        ("the tip Mach number", found.tip_mach, 0.08, MOST_TIP_MACH, "", ": check rpm, radius and sound_speed"),
        ("the lift slope", slope, 2.0, MOST_SLOPE, " per rad", ": check that the airfoil's angles are in degrees"),
        ("the solidity", found.solidity, 0.01, MOST_SOLIDITY, "", ": check chord and radius"),
    ]
    if rotor.hinge is not None and found.lock is not None:
        centre = float(rotor.hinge.first_moment / rotor.hinge.blade_mass / rotor.radius)
        usual += [
            ("the Lock number", found.lock, 0.5, 30.0, "", ": check flap_inertia, density and chord"),
            ("first_moment/blade_mass/radius", centre, 0.05, 0.8, "", ": a blade's centre of mass behind the hinge"),
        ]
    return [
        f"{rotor.name}: {name} is {value:.4g}{unit}, where rotors in air have {low:g} to {high:g}{keys}"
        for name, value, low, high, unit, keys in usual
        if not low <= value <= high
    ]


def notes(rotor: Rotor) -> list[str]:
    """What a user should know about a rotor before trusting how its blades move."""
    hinge = rotor.hinge
    if hinge is None or hinge.damper_rate is not None:
        return []
    return [f"{rotor.name} has a lag hinge without a damper: its lag hardly decays; see lag_damper_file in [hinge]"]


def check_rotor(rotor: Rotor, operating: OperatingPoint) -> None:
    """Raise InputError where a rotor's derived numbers are beyond sense, by a wrong unit, or beyond its tables."""
    if not known(rotor, operating):
        return
    with jax.ensure_compile_time_eval():  # numbers, inside of jit too
        found = derived(rotor, operating)
        slope = lift_slope(rotor, _AT * found.tip_mach)
    if found.solidity > MOST_SOLIDITY:
        raise InputError(
            f"The solidity (blade area over disk area) must be at most {MOST_SOLIDITY:g}, but is {found.solidity:.3g}: "
            f"check chord (up to {np.asarray(rotor.chord.values).max():g} m) against radius ({float(rotor.radius):g} m)"
        )
    if found.tip_mach > MOST_TIP_MACH:
        rpm, radius = float(operating.omega) * 9.549297, float(rotor.radius)
        raise InputError(
            f"The tip Mach number must be at most {MOST_TIP_MACH:g}, but is {found.tip_mach:.3g}: check rpm ({rpm:g}) "
            f"and radius ({radius:g} m)"
        )
    if slope > MOST_SLOPE:
        raise InputError(
            f"The lift slope at {_AT:g} R must be at most {MOST_SLOPE:g} per rad, but is {slope:.3g}: check that the "
            "airfoil's angles are in degrees"
        )
    last = float(np.asarray(rotor.airfoil.mach)[-1])
    if found.tip_mach > last + _TABLE_END:
        raise InputError(
            f"The tip Mach number must lie within the airfoil's table, which ends at {last:g}, but is "
            f"{found.tip_mach:.3g}: add columns of higher Mach number"
        )
