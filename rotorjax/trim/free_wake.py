"""Trim of a rotor in its free wake: wake, flap, lag and controls as one periodic problem.

Unknowns are the periodic wake (K slices, wake/equilibrium.py), the flap and lag angles of the blade at each slice and
the three controls. Their residual joins that of the wake with the defects of the flap and lag equations, taken through
damped linear ones so that they are angles again, and with the trim equations. K = 1 is the axisymmetric hover, where
cyclic pitch has nothing to do.
"""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from rotorjax.coupled_wake import wake_air_loads
from rotorjax.frames import rotate_about_shaft
from rotorjax.ode.fourier import fourier_coefficients, fourier_values
from rotorjax.rotor import flap_lag
from rotorjax.rotor.flap_lag import Blade
from rotorjax.rotor.hub import RotorInputs, turning_frame
from rotorjax.rotor.moving_blade import AirLoads
from rotorjax.trim.problem import Aim
from rotorjax.wake.equilibrium import Evaluation, Unknowns, evaluate, spread, transported
from rotorjax.wake.model import Flight, FreeWake, azimuths
from rotorjax.wake.start import prescribed
from rotorjax.wake.transport import harmonics

DAMPING = np.array([1.0, 0.1])
"""Of the linear flap and lag equations (per rad): about γ/8, and a lag damper's."""

THRUST_STEP = 0.1
"""Collective (rad) that a thrust equation is worth, wanted thrust against none: makes the residual an angle."""


class InWake(NamedTuple):
    """Unknowns. wake: K slices. flap, lag (K,) rad. controls (3,): θ₀, θ₁c, θ₁s (rad)."""

    wake: Unknowns
    flap: Float[Array, " K"]
    lag: Float[Array, " K"]
    controls: Float[Array, "3"]


class WakeTrim(eqx.Module):
    """Parameters: the free wake (its collective and flight are replaced), the blade's inertia, hub motion and C_T.

    aim: what cyclic pitch is for (static).
    """

    model: FreeWake
    blade: Blade
    inputs: RotorInputs
    thrust: Float[Array, ""]
    aim: Aim = eqx.field(static=True, default="flapping")


def flown(z: InWake, p: WakeTrim) -> FreeWake:
    """The free wake's model with the motion and controls of z."""
    psi = _azimuths(z.flap)
    theta_0, theta_1c, theta_1s = z.controls
    cyclic = theta_1c * jnp.cos(psi) + theta_1s * jnp.sin(psi) - p.blade.coupling * (z.flap - p.blade.precone)
    flight = Flight(
        wind=-p.inputs.velocity,
        hinge=p.blade.offset,
        flap=z.flap,
        flap_rate=_rate(z.flap),
        cyclic=cyclic,
        lag=z.lag,
        lag_rate=_rate(z.lag),
    )
    model = eqx.tree_at(lambda m: m.operating.collective, p.model, theta_0)
    return eqx.tree_at(lambda m: m.flight, model, flight, is_leaf=lambda v: v is None)


def residual(z: InWake, p: WakeTrim) -> InWake:
    """How far one pass moves wake, blades and controls; zero in trim."""
    model = flown(z, p)
    found = evaluate(model, z.wake)
    wake = jax.tree.map(lambda new, old: new - old, transported(model, found), z.wake)
    loads = loads_of(model, found)
    flap, lag = blade_defect(z.flap, z.lag, loads, p).T
    return InWake(wake, flap, lag, _trim_defect(z, loads, p))


def passed(z: InWake, p: WakeTrim) -> InWake:
    """Wake, blades and controls after one pass: z and its residual."""
    return jax.tree.map(jnp.add, z, residual(z, p))


def loads_of(model: FreeWake, found: Evaluation) -> AirLoads:
    """Air loads of the blades in a wake, leading axis K."""
    return wake_air_loads(model, found.velocities.control, found.loads, azimuths(found.state))


def thrust_of(loads: AirLoads, p: WakeTrim) -> Float[Array, ""]:
    """C_T along the shaft."""
    return p.model.rotor.blades / jnp.pi * jnp.mean(loads.force[:, 2])


def harmonic(angle: Float[Array, " K"]) -> Float[Array, "3"]:
    """β₀, β₁c, β₁s of a flap angle, or ζ₀, ζ₁c, ζ₁s of a lag; one slice alone stands for an axisymmetric motion."""
    if angle.shape[0] == 1:
        return jnp.concatenate([angle, jnp.zeros(2)])
    psi = _azimuths(angle)
    return jnp.stack([jnp.mean(angle), 2 * jnp.mean(angle * jnp.cos(psi)), 2 * jnp.mean(angle * jnp.sin(psi))])


def _trim_defect(z: InWake, loads: AirLoads, p: WakeTrim) -> Float[Array, "3"]:
    """Thrust wanted less thrust, as an angle; cyclic flapping, which cyclic pitch answers a quarter turn later, or hub
    moments over the wanted thrust.
    """
    short = THRUST_STEP * (1 - thrust_of(loads, p) / p.thrust)
    if z.flap.shape[0] == 1:
        return jnp.stack([short, -z.controls[1], -z.controls[2]])
    if p.aim == "moments":
        cosine, sine = hub_moment(z.flap, z.lag, loads, p)[1::-1] / p.thrust
    else:
        _, cosine, sine = harmonic(z.flap)
    return jnp.stack([short, -sine, cosine])


def blade_defect(
    flap: Float[Array, " K"], lag: Float[Array, " K"], loads: AirLoads, p: WakeTrim
) -> Float[Array, "K 2"]:
    """Periodic answer of δ'' + DAMPING δ' + ν² δ to what is left of the flap and lag equations."""
    _, (angles, _), wanted = _motion(flap, lag, loads, p)
    number = jnp.asarray(harmonics(flap.shape[0]))[:, None]
    left = fourier_coefficients(wanted) + number**2 * fourier_coefficients(angles)
    frequency = jnp.stack([flap_lag.flap_frequency(p.blade), flap_lag.lag_frequency(p.blade)])
    return fourier_values(left / (frequency**2 - number**2 + 1j * DAMPING * number)).real


def hub_moment(flap: Float[Array, " K"], lag: Float[Array, " K"], loads: AirLoads, p: WakeTrim) -> Float[Array, "3"]:
    """Mean moment of air and inertia on the hub, in its frame, over ρA(ΩR)²R; one slice alone has no cyclic part."""
    frames, (angles, rates), wanted = _motion(flap, lag, loads, p)
    found = jax.vmap(lambda *a: flap_lag.hub_loads(p.blade, *a))(
        frames, angles, rates, wanted, loads.force, loads.moment
    )
    turned = rotate_about_shaft(found.moment, _azimuths(flap))
    mean = p.model.rotor.blades / jnp.pi * jnp.mean(turned, axis=0)
    return mean * jnp.array([0.0, 0.0, 1.0]) if flap.shape[0] == 1 else mean


def weight_torque(flap: Float[Array, " K"], lag: Float[Array, " K"], p: WakeTrim) -> Float[Array, " K"]:
    """Torque of the weight of each blade about a tilted shaft, over ρΩ²R⁵: no mean where they lag alike."""
    angles = jnp.stack([flap, lag], axis=-1)
    along = p.blade.mass * p.blade.offset * jnp.array([1.0, 0.0, 0.0])
    arm = along + p.blade.first_moment * jax.vmap(flap_lag.direction)(angles)
    up = jax.vmap(lambda a: turning_frame(p.inputs, a, p.blade.gravity).acceleration)(_azimuths(flap))
    return -jnp.cross(arm, up)[:, 2] / p.blade.air


def _motion(flap: Float[Array, " K"], lag: Float[Array, " K"], loads: AirLoads, p: WakeTrim):
    """Turning frames, angles and rates (flap, lag), and the accelerations that the blades' equations want."""
    frames = jax.vmap(lambda a: turning_frame(p.inputs, a, p.blade.gravity))(_azimuths(flap))
    angles, rates = jnp.stack([flap, lag], axis=-1), jnp.stack([_rate(flap), _rate(lag)], axis=-1)
    wanted = jax.vmap(lambda *a: flap_lag.accelerations(p.blade, *a))(frames, angles, rates, loads.moment)
    return frames, (angles, rates), wanted


def _azimuths(flap: Float[Array, " K"]) -> Float[Array, " K"]:
    return 2 * jnp.pi / flap.shape[0] * jnp.arange(flap.shape[0])


def _rate(angle: Float[Array, " K"]) -> Float[Array, " K"]:
    """∂/∂ψ, exact for every harmonic that K slices hold."""
    return fourier_values(1j * jnp.asarray(harmonics(angle.shape[0])) * fourier_coefficients(angle)).real


def first_guess(p: WakeTrim, controls: Float[Array, "3"], coning: float, slices: int, inflow: float) -> InWake:
    """A prescribed wake carried by the wind, blades that cone and do not lag."""
    wake = carried(spread(prescribed(p.model, inflow), slices), p.model, -p.inputs.velocity)
    return InWake(wake, jnp.full(slices, float(coning)), jnp.zeros(slices), controls)


def carried(wake: Unknowns, model: FreeWake, wind: Float[Array, "3"]) -> Unknowns:
    """A wake that a wind (hub frame, over ΩR) carries since its release, K slices in their blades' frames."""
    slices = wake.near.shape[0]
    settings = model.settings
    psi = 2 * np.pi / slices * np.arange(slices)
    turned = rotate_about_shaft(jnp.broadcast_to(wind, (slices, 3)), -jnp.asarray(psi))

    def carry(nodes, age):
        return nodes + age[:, None] * turned[:, None, None, :]

    near, far = carry(wake.near, settings.lattice_ages[1:]), carry(wake.far, settings.filament_ages[1:])
    return wake._replace(near=near, far=far)
