"""What a rotor is driven by (Eq. 11), and the turning frame of a blade on a moving hub.

Rotor units: velocities over Ω_ref R, rates over Ω_ref, time as Ω_ref t (rad), where Ω_ref is the operating point's
rotor speed. Hub motion is given as flight dynamics does, along and about body axes: x forward, y to starboard, z down.
Its attitude turns level axes into body axes: heading about z, then pitch about y, then roll about x.
"""

from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from rotorjax.checks import check_number
from rotorjax.frames import rotate_about_shaft, to_ellipsoidal


class RotorInputs(eqx.Module):
    """Inputs u_R of Eq. 11, the height over ground and the attitude; every field but the last is a scalar array.

    theta_1c, theta_1s, theta_0: pitch θ₀ + θ₁c cos ψ + θ₁s sin ψ (rad). u, v, w: velocity of the hub over Ω_ref R,
    forward, to starboard and down, along the shaft's axes. p, q, r: its angular velocity over Ω_ref, roll to starboard,
    nose up, nose to starboard. u_rate … r_rate: their rates per radian. omega: Ω/Ω_ref. omega_rate: its rate. height:
    hub above ground over R, straight down, None without ground. roll to starboard, pitch nose up, heading to starboard
    (rad): attitude of the shaft's axes; all None for a shaft that stands upright, and with it the ground. place (3,):
    of the hub over R among solid surfaces (level axes, aft, to starboard, up), from where they are given; None without.
    """

    theta_1c: Float[Array, ""]
    theta_1s: Float[Array, ""]
    theta_0: Float[Array, ""]
    u: Float[Array, ""]
    v: Float[Array, ""]
    w: Float[Array, ""]
    p: Float[Array, ""]
    q: Float[Array, ""]
    r: Float[Array, ""]
    u_rate: Float[Array, ""]
    v_rate: Float[Array, ""]
    w_rate: Float[Array, ""]
    p_rate: Float[Array, ""]
    q_rate: Float[Array, ""]
    r_rate: Float[Array, ""]
    omega: Float[Array, ""]
    omega_rate: Float[Array, ""]
    height: Float[Array, ""] | None = None
    roll: Float[Array, ""] | None = None
    pitch: Float[Array, ""] | None = None
    heading: Float[Array, ""] | None = None
    place: Float[Array, "3"] | None = None

    @property
    def velocity(self) -> Float[Array, "3"]:
        """Velocity of the hub in the hub frame (x aft, z up), over Ω_ref R."""
        return to_ellipsoidal(jnp.stack([self.u, self.v, self.w]))

    @property
    def climb(self) -> Float[Array, ""]:
        """Velocity of the hub along the shaft, over Ω_ref R: the inflow that the motion alone brings."""
        return -self.w

    @property
    def turn(self) -> Float[Array, "3 3"] | None:
        """Matrix that takes vectors from level axes (aft, to starboard, up, as the hub stands at heading 0) into the
        hub frame; None where no attitude is given.
        """
        if self.roll is None or self.pitch is None or self.heading is None:
            return None
        (cr, sr), (cp, sp), (ch, sh) = ((jnp.cos(v), jnp.sin(v)) for v in (self.roll, self.pitch, self.heading))
        body = jnp.stack(
            [
                jnp.stack([cp * ch, cp * sh, -sp]),
                jnp.stack([sr * sp * ch - cr * sh, sr * sp * sh + cr * ch, sr * cp]),
                jnp.stack([cr * sp * ch + sr * sh, cr * sp * sh - sr * ch, cr * cp]),
            ]
        )
        return to_ellipsoidal(to_ellipsoidal(body).T).T


ATTITUDE = ("roll", "pitch", "heading")


def rotor_inputs(**values: float) -> RotorInputs:
    """Make inputs; those that are not given are zero, omega is 1, height and attitude are None.

    Raises InputError where a value is not a finite number, or height is not positive.
    """
    names = [name for name in RotorInputs.__dataclass_fields__ if name not in ("height", "place", *ATTITUDE)]
    height = values.pop("height", None)
    if height is not None:
        check_number("height", height, 0.0, open_=True)
    for name, value in values.items():
        check_number(name, value)
    turned = {name: values.pop(name, 0.0) for name in ATTITUDE} if set(values) & set(ATTITUDE) else {}
    given = {"omega": 1.0, **values}
    unknown = set(given) - set(names)
    if unknown:
        raise TypeError(f"rotor_inputs() has no input {sorted(unknown)[0]!r}")
    scalars = {name: jnp.asarray(given.get(name, 0.0), float) for name in names}
    attitude = {name: jnp.asarray(value, float) for name, value in turned.items()}
    return RotorInputs(**scalars, height=None if height is None else jnp.asarray(height, float), **attitude)


def pitch(inputs: RotorInputs, psi: Float[Array, "*n"]) -> Float[Array, "*n"]:
    """Pitch (rad) that the controls give a blade at azimuth psi, without twist and pitch-flap coupling."""
    return inputs.theta_0 + inputs.theta_1c * jnp.cos(psi) + inputs.theta_1s * jnp.sin(psi)


class TurningFrame(NamedTuple):
    """The frame of a blade's hinge at one instant, all (3,) in its own axes: outboard, in rotation, up.

    velocity: of the hub. acceleration: of the hub, gravity's reaction included. spin, spin_rate: angular velocity and
    its rate.
    """

    velocity: Float[Array, "3"]
    acceleration: Float[Array, "3"]
    spin: Float[Array, "3"]
    spin_rate: Float[Array, "3"]


def turning_frame(inputs: RotorInputs, psi: Float[Array, ""], gravity: Float[Array, ""]) -> TurningFrame:
    """Frame of a blade at azimuth psi. gravity: g/(Ω²R), straight down, or along the shaft without an attitude."""
    velocity, spin, velocity_rate, spin_rate = (
        to_ellipsoidal(jnp.stack([getattr(inputs, name) for name in names]))
        for names in (
            ("u", "v", "w"),
            ("p", "q", "r"),
            ("u_rate", "v_rate", "w_rate"),
            ("p_rate", "q_rate", "r_rate"),
        )
    )
    up = jnp.array([0.0, 0.0, 1.0], spin.dtype)
    vertical = up if inputs.turn is None else inputs.turn @ up
    acceleration = velocity_rate + jnp.cross(spin, velocity) + gravity * vertical
    turned = rotate_about_shaft(jnp.stack([velocity, acceleration, spin, spin_rate]), -psi)
    # d/dt of the hub's spin seen from the turning blade
    carried = turned[3] - inputs.omega * jnp.cross(up, turned[2])
    return TurningFrame(turned[0], turned[1], turned[2] + inputs.omega * up, carried + inputs.omega_rate * up)
