"""Induced power that a measured lift distribution stands for, by the blade's own sections."""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float
from scipy.interpolate import PchipInterpolator

from rotorjax.operating import OperatingPoint
from rotorjax.reference.published import Hover, induced_power_factor
from rotorjax.rotor.airfoil import lift_drag
from rotorjax.rotor.geometry import Rotor, twist
from rotorjax.wake.lifting_surface import chord_downwash
from rotorjax.wake.model import free_wake
from rotorjax.wake.settings import wake_settings


def measured_power_factor(rotor: Rotor, operating: OperatingPoint, measured: Hover, panels: int = 40) -> float:
    """C_Pi over C_T^1.5/√2 of a rotor in hover that carries the measured lift.

    No wake is in it. A section that lifts c_l has the angle of attack at which its table gives that lift; what this
    lacks of the pitch is the flow's angle, of which the wake's inflow is what is left after the blade's own part at
    three quarters of the chord (lifting_surface.py). c_l r/√(1 − r), which does not vanish at the tip, is interpolated
    between the stations; inboard of them c_l is constant, and 30 % more or less there is 0.01 of the factor.
    With 80 panels in place of 40 the factor is the same to 0.002.
    """
    fine = free_wake(rotor, operating, settings=wake_settings(panels=panels))
    r, widths, chords = (np.asarray(v) for v in (fine.stations, fine.widths, fine.chords))
    lift = _between(measured, r)
    mach = float(operating.tip_mach(rotor.radius)) * r
    own = np.asarray(chord_downwash(fine.stations, fine.edges, 0.5 * fine.chords)) @ (0.5 * chords * r * lift)
    attack = np.array([_attack(rotor, *section) for section in zip(lift, mach, strict=True)])
    pitch = float(operating.collective) + np.asarray(twist(rotor, fine.stations))
    inflow = r * np.tan(pitch - attack) - own
    loading = rotor.blades / np.pi * 0.5 * chords * r**2 * lift
    return induced_power_factor(float(loading @ widths), float((loading * inflow) @ widths))


def _between(measured: Hover, r: Float[np.ndarray, " N"]) -> Float[np.ndarray, " N"]:
    """Lift coefficient at r from that at the measured stations."""
    smooth = PchipInterpolator(measured.r, measured.lift * measured.r / np.sqrt(1 - measured.r))
    outboard = smooth(np.maximum(r, measured.r[0])) * np.sqrt(1 - r) / r
    return np.where(r < measured.r[0], measured.lift[0], outboard)


def _attack(rotor: Rotor, lift: float, mach: float) -> float:
    """Angle of attack (rad) at which the section has this lift, while the flow is attached."""
    alpha = np.deg2rad(np.linspace(-4.0, 8.0, 481))
    cl = np.asarray(lift_drag(rotor.airfoil, jnp.asarray(alpha), jnp.full(alpha.shape, mach))[0])
    return float(np.interp(lift, cl, alpha))
