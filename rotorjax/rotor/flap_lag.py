"""A rigid blade that flaps and lags about coincident hinges: nonlinear, on a hub in any motion.

The blade's mass lies on the line r = e x̂ + s n, n(β, ζ) = (cos β cos ζ, −cos β sin ζ, sin β), in the turning frame of
its hinge (outboard, in rotation, up): flap β up, lag ζ back. With W the frame's angular velocity and A the acceleration
of the hinge, less gravity, an element accelerates by A + s (Ẇ×n + W×(W×n) + 2W×ṅ + n̈). D'Alembert's principle along
∂r/∂q = s ∂n/∂q, q = (β, ζ), then needs only the mass, the first moment S and the inertia I about the hinge:

    I diag(1, cos²β) q̈ = Q − N·[S A + I (Ẇ×n + W×(W×n) + 2W×ṅ + N'q̇)],   N = ∂n/∂q

Centrifugal, Coriolis and gyroscopic moments are all in it. Rotor units: divided by IΩ²; forces over ρΩ²R⁴, moments over
ρΩ²R⁵.
"""

from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from rotorjax.checks import array, known
from rotorjax.errors import InputError
from rotorjax.operating import OperatingPoint
from rotorjax.rotor.geometry import Hinge, Rotor
from rotorjax.rotor.hub import TurningFrame
from rotorjax.rotor.monotone import read, with_slopes

GRAVITY = 9.80665  # m/s², standard


class Blade(eqx.Module):
    """Blade and hinge in rotor units; all leaves are scalar arrays but the damper table.

    offset: e/R. mass: mR²/I. first_moment: SR/I. air: ρR⁵/I, what turns aerodynamic moments into accelerations.
    flap_spring, lag_spring: over IΩ². precone: rad, where the flap spring rests. coupling: tan δ₃, pitch down for flap
    up. gravity: g/(Ω²R). damper_arm (m), damper_rate (2D − 1,): axial rate over Ω (m), damper_force
    (2D − 1, 2): over IΩ² (1/m), and its slope: the lag damper, odd; None without one.
    """

    offset: Float[Array, ""]
    mass: Float[Array, ""]
    first_moment: Float[Array, ""]
    air: Float[Array, ""]
    flap_spring: Float[Array, ""]
    lag_spring: Float[Array, ""]
    precone: Float[Array, ""]
    coupling: Float[Array, ""]
    gravity: Float[Array, ""]
    damper_arm: Float[Array, ""]
    damper_rate: Float[Array, " N"] | None
    damper_force: Float[Array, "N 2"] | None


class Motion(NamedTuple):
    """A blade's line and how it moves.

    n, n_dot (3,): direction and rate. slope (3, 2): N = ∂n/∂(β, ζ). bend (3,): N'q̇.
    """

    n: Float[Array, "3"]
    n_dot: Float[Array, "3"]
    slope: Float[Array, "3 2"]
    bend: Float[Array, "3"]


class HubLoads(NamedTuple):
    """What a blade does to the hub, in its own axes: force over ρΩ²R⁴ and moment over ρΩ²R⁵, both (3,)."""

    force: Float[Array, "3"]
    moment: Float[Array, "3"]


def blade_of(rotor: Rotor, operating: OperatingPoint, gravity: float = GRAVITY) -> Blade:
    """Inertia and hinge of a rotor's blade at an operating point; gravity in m/s².

    Raises InputError where the rotor has no hinge data.
    """
    hinge = rotor.hinge
    if hinge is None:
        raise InputError(
            f"Argument `rotor` must have hinge data to flap and lag, but {rotor.name} has none: "
            "add a [hinge] table to its file"
        )
    radius, inertia, omega = rotor.radius, hinge.flap_inertia, operating.omega
    stiffness = inertia * omega**2
    rate = force = None
    if hinge.damper_rate is not None and hinge.damper_force is not None:
        rate, force = _damper(hinge, omega, stiffness)
    return Blade(
        offset=hinge.offset / radius,
        mass=hinge.blade_mass * radius**2 / inertia,
        first_moment=hinge.first_moment * radius / inertia,
        air=operating.density * radius**5 / inertia,
        flap_spring=hinge.flap_spring / stiffness,
        lag_spring=hinge.lag_spring / stiffness,
        precone=hinge.precone,
        coupling=jnp.tan(hinge.delta3),
        gravity=gravity / (omega**2 * radius),
        damper_arm=hinge.damper_arm,
        damper_rate=rate,
        damper_force=force,
    )


def _damper(hinge: Hinge, omega: Any, stiffness: Any) -> tuple[Array, Array]:
    """Rates over Ω, both ways, and forces over IΩ² with their slopes; of numbers without anything compiled."""
    values = hinge.damper_rate, hinge.damper_force, omega, stiffness
    xp = np if known(values) else jnp
    half_rate, half_force, omega, stiffness = map(xp.asarray, values)
    rate, force = (xp.concatenate([-half[:0:-1], half]) for half in (half_rate, half_force))
    rate = rate / omega
    return array(rate), array(with_slopes(rate, force / stiffness, xp))


def damper_moment(blade: Blade, lag_rate: Float[Array, ""]) -> Float[Array, ""]:
    """Moment of the lag damper against a lag rate (over Ω), over IΩ²: monotone cubics through the table, for straight
    pieces could not be linearised at their kinks; beyond it as its last piece goes on.
    """
    if blade.damper_rate is None or blade.damper_force is None:
        return jnp.zeros_like(lag_rate)
    axial = blade.damper_arm * jnp.stack([lag_rate, -lag_rate])  # half of a difference is odd to the last bit
    there, back = read(axial, blade.damper_rate, blade.damper_force)
    return blade.damper_arm * 0.5 * (there - back)


def direction(q: Float[Array, "2"]) -> Float[Array, "3"]:
    """n(β, ζ)."""
    flap, lag = q
    return jnp.stack([jnp.cos(flap) * jnp.cos(lag), -jnp.cos(flap) * jnp.sin(lag), jnp.sin(flap)])


def motion_of(q: Float[Array, "2"], q_dot: Float[Array, "2"]) -> Motion:
    """Direction of the blade and its derivatives at angles q = (β, ζ) and rates q_dot."""

    def moving(q):
        return jax.jvp(direction, (q,), (q_dot,))

    (n, n_dot), (_, bend) = jax.jvp(moving, (q,), (q_dot,))
    return Motion(n, n_dot, jax.jacfwd(direction)(q), bend)


def hinge_velocity(blade: Blade, frame: TurningFrame) -> Float[Array, "3"]:
    """Velocity of the hinge, over Ω_ref R."""
    return frame.velocity + jnp.cross(frame.spin, _hinge(blade))


def accelerations(
    blade: Blade,
    frame: TurningFrame,
    q: Float[Array, "2"],
    q_dot: Float[Array, "2"],
    air_moment: Float[Array, "3"],
) -> Float[Array, "2"]:
    """q̈ = (β̈, ζ̈) per rad². air_moment: ∫ s f ds of the air's force f per length, over ρΩ²R⁵, in the frame's axes."""
    motion = motion_of(q, q_dot)
    held = jnp.stack(
        [
            blade.flap_spring * (q[0] - blade.precone),
            blade.lag_spring * q[1] + damper_moment(blade, q_dot[1]),
        ]
    )
    along = blade.air * air_moment - blade.first_moment * _hinge_acceleration(blade, frame) - _carried(motion, frame)
    return (along @ motion.slope - held) / jnp.stack([jnp.ones_like(q[0]), jnp.cos(q[0]) ** 2])


def hub_loads(
    blade: Blade,
    frame: TurningFrame,
    q: Float[Array, "2"],
    q_dot: Float[Array, "2"],
    q_dot_dot: Float[Array, "2"],
    air_force: Float[Array, "3"],
    air_moment: Float[Array, "3"],
) -> HubLoads:
    """Force and moment about the hub's centre, the air's and the blade's inertia together.

    air_force: ∫ f ds over ρΩ²R⁴; air_moment: ∫ s f ds over ρΩ²R⁵.
    """
    motion = motion_of(q, q_dot)
    hinge = _hinge_acceleration(blade, frame)
    along = _carried(motion, frame) + motion.slope @ q_dot_dot
    force = air_force - (blade.mass * hinge + blade.first_moment * along) / blade.air
    about_hinge = air_moment - (blade.first_moment * hinge + along) / blade.air
    return HubLoads(force, jnp.cross(_hinge(blade), force) + jnp.cross(motion.n, about_hinge))


def energy(blade: Blade, q: Float[Array, "2"], q_dot: Float[Array, "2"]) -> Float[Array, ""]:
    """Jacobi's integral over IΩ² on a hub that only turns, at Ω_ref: constant without air and damper.

    Kinetic energy seen from the turning hub, less that of turning along, plus gravity and springs.
    """
    motion = motion_of(q, q_dot)
    out = motion.n[:2]
    turning = out @ out / 2 + blade.first_moment * blade.offset * out[0]
    springs = blade.flap_spring * (q[0] - blade.precone) ** 2 / 2 + blade.lag_spring * q[1] ** 2 / 2
    return motion.n_dot @ motion.n_dot / 2 - turning + blade.first_moment * blade.gravity * motion.n[2] + springs


def flap_frequency(blade: Blade) -> Float[Array, ""]:
    """Small flapping without air, per rev: √(1 + eS/I + k_β/IΩ²)."""
    return jnp.sqrt(1 + blade.offset * blade.first_moment + blade.flap_spring)


def lag_frequency(blade: Blade) -> Float[Array, ""]:
    """Small lagging without air and damper, per rev: √(eS/I + k_ζ/IΩ²)."""
    return jnp.sqrt(blade.offset * blade.first_moment + blade.lag_spring)


def _hinge(blade: Blade) -> Float[Array, "3"]:
    return jnp.stack([blade.offset, jnp.zeros_like(blade.offset), jnp.zeros_like(blade.offset)])


def _hinge_acceleration(blade: Blade, frame: TurningFrame) -> Float[Array, "3"]:
    hinge = _hinge(blade)
    return frame.acceleration + jnp.cross(frame.spin_rate, hinge) + jnp.cross(frame.spin, jnp.cross(frame.spin, hinge))


def _carried(motion: Motion, frame: TurningFrame) -> Float[Array, "3"]:
    """Ẇ×n + W×(W×n) + 2W×ṅ + N'q̇."""
    turned = jnp.cross(frame.spin, jnp.cross(frame.spin, motion.n) + 2 * motion.n_dot)
    return jnp.cross(frame.spin_rate, motion.n) + turned + motion.bend
