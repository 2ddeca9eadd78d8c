"""Where the hub goes and how it stands: attitude and height from the histories of its velocities and angular rates.

Body axes turn by the kinematic equation of the unit quaternion e that takes body into level axes, e' = ½ e ⊗ (0, ω);
the hub moves by its body velocity turned into level axes. Those are the axes of flight dynamics, forward, to starboard
and down, as the hub heads at the start; the ground stands still in them and falls away ahead (its mountain side is
aft). A quaternion has no attitude in which roll and heading are one; angles are read off it (Stevens & Lewis, Aircraft
Control and Simulation, section 1.3).
"""

from dataclasses import dataclass

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicHermiteSpline, PPoly

from rotorjax.errors import InputError
from rotorjax.inflow.choice import LOWEST

STEEPEST = {"uniform": 15.0, "pitt-peters": 15.0, "vpbfsm": 60.0}
"""Most that the disk may tilt to the ground (deg). Momentum theory knows the hub's height and no tilt: at 15 degrees
that along the shaft differs from that straight down by 4 per cent. The finite-state model's plane ends at 60."""


@dataclass(frozen=True)
class Above:
    """Ground under a path. height (over R), straight down at the start; slope (rad). inflow: the model's name. omega:
    Ω_ref (rad/s).
    """

    height: float
    slope: float
    inflow: str
    omega: float


def angles(e: Float[Array, "4"]) -> tuple[Float[Array, ""], Float[Array, ""], Float[Array, ""]]:
    """Roll, pitch and heading (rad) of a quaternion, of any length."""
    w, x, y, z = e / jnp.sqrt(e @ e)
    roll = jnp.arctan2(2 * (y * z + w * x), 1 - 2 * (x * x + y * y))
    pitch = jnp.arcsin(jnp.clip(2 * (w * y - x * z), -1.0, 1.0))
    return roll, pitch, jnp.arctan2(2 * (x * y + w * z), 1 - 2 * (y * y + z * z))


def hub_path(
    motion: PPoly, velocity: Float[np.ndarray, "3"], pitch: float, end: float, ground: Above | None = None
) -> PPoly:
    """Quaternion (4 columns) and, over ground, height (straight down, over R) over Ω_ref t, from 0 to `end`.

    motion: u, v, w, p, q, r in rotor units, added to the velocity that the hub has at the start, in body axes. pitch:
    of the shaft at the start, nose up (rad). Raises InputError where the path takes the disk into the ground, or tilts
    it more than the inflow model knows of.
    """
    fall = 0.0 if ground is None else np.tan(ground.slope)

    def rate(t, y):
        now = motion(t)
        e, spin = y[:4], now[3:]
        turning = 0.5 * np.array([-e[1:] @ spin, *(e[0] * spin + np.cross(e[1:], spin))])
        forward, _, down = into_level(e, velocity + now[:3])
        return np.array([*turning, fall * forward - down])

    t = np.unique(np.concatenate([motion.x[motion.x <= end], np.linspace(0.0, end, max(2001, int(2 * end)))]))
    start = np.array([np.cos(pitch / 2), 0.0, np.sin(pitch / 2), 0.0, 0.0 if ground is None else ground.height])
    y = solve_ivp(rate, (0.0, end), start, "DOP853", t, rtol=1e-11, atol=1e-13, max_step=end / 50).y.T
    if ground is None:
        return _spline(t, y[:, :4], [rate(*row)[:4] for row in zip(t, y, strict=True)])
    _check(t, y, ground)
    return _spline(t, y, [rate(*row) for row in zip(t, y, strict=True)])


def into_level(e: Float[np.ndarray, "*n 4"], v: Float[np.ndarray, "*#n 3"]) -> Float[np.ndarray, "*n 3"]:
    """Turn vectors from body into level axes by unit quaternions; with e's last three negative, back."""
    w, x = e[..., :1], e[..., 1:]
    return v + 2 * np.cross(x, np.cross(x, v) + w * v)


def rim_clearance(
    e: Float[np.ndarray, "*n 4"], height: Float[np.ndarray, "*n"], slope: float
) -> tuple[Float[np.ndarray, "*n"], Float[np.ndarray, "*n"]]:
    """Least distance of the disk's rim from the ground (over R), negative where the disk cuts it; its tilt (deg)."""
    normal = into_level(e * [1, -1, -1, -1], np.array([np.sin(slope), 0.0, -np.cos(slope)]))
    clear = height * np.cos(slope) - np.hypot(normal[..., 0], normal[..., 1])
    return clear, np.rad2deg(np.arccos(np.clip(-normal[..., 2], -1, 1)))


def _spline(t, y, slopes) -> PPoly:
    found = CubicHermiteSpline(t, y, np.array(slopes), axis=0)
    return PPoly(found.c, found.x)


def _check(t: Float[np.ndarray, " T"], y: Float[np.ndarray, "T 5"], ground: Above) -> None:
    """Raise InputError where the path cannot be flown, with the time and how far it goes."""
    clear, tilt = rim_clearance(y[:, :4], y[:, 4], ground.slope)
    steepest = STEEPEST.get(ground.inflow, np.inf)

    def refuse(broken: np.ndarray, rule: str, words: str, worst: float) -> None:
        if np.any(broken):
            at = t[np.argmax(broken)] / ground.omega
            raise InputError(f"[history] the hub's path must {rule}, but {words} at {at:.2f} s, to {worst:.3g}")

    refuse(clear <= 0, "keep the disk above the ground (clearance of its rim over R)", "cuts it", clear.min())
    if ground.inflow != "freewake":
        known = f"keep the disk within {steepest:g} deg of the ground, all that {ground.inflow} knows (take freewake)"
        refuse(tilt >= steepest, known, "leaves that", tilt.max())
    if ground.inflow in ("uniform", "pitt-peters"):
        known = f"stay above {LOWEST} R, the lowest that Cheeseman and Bennett's source is good for (take vpbfsm)"
        refuse(y[:, 4] <= LOWEST, known, "goes below it", y[:, 4].min())
