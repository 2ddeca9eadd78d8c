"""The rotor and its inflow as one first-order system x' = rhs(t, x, u, p), x = (ψ, flap, lag, inflow).

Time is Ω_ref t (rad) and everything is in rotor units (rotor/hub.py). Flap and lag are kept in multi-blade coordinates,
as in Eq. 10, so that a steady flight is a steady state but for vibration, and repeats B times a revolution. The inflow
is a model over the disk (inflow/) or the free wake itself (coupled_wake.py); p says which.
"""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, PyTree

from rotorjax.coupled_wake import BladesAt, CoupledWake, in_wake, old_in, velocity_in
from rotorjax.frames import rotate_about_shaft
from rotorjax.inflow.interface import DiskLoads, InflowModel
from rotorjax.operating import OperatingPoint
from rotorjax.rotor import flap_lag, multiblade
from rotorjax.rotor.derived import check_rotor
from rotorjax.rotor.flap_lag import Blade, blade_of
from rotorjax.rotor.geometry import Rotor
from rotorjax.rotor.hub import RotorInputs, TurningFrame, pitch, turning_frame
from rotorjax.rotor.moving_blade import AirLoads, Sections, air_loads, blade_sections, places
from rotorjax.wake.field import Velocities


class RotorState(eqx.Module):
    """Flap and lag (rad) and their rates in multi-blade coordinates, each (B,): collective, cyclic, differential."""

    flap: Float[Array, " B"]
    flap_rate: Float[Array, " B"]
    lag: Float[Array, " B"]
    lag_rate: Float[Array, " B"]


class CoupledState(eqx.Module):
    """The state of Eq. 14. psi (): azimuth of blade 0 (rad). rotor: flap and lag. inflow: the inflow model's own."""

    psi: Float[Array, ""]
    rotor: RotorState
    inflow: PyTree


class CoupledRotor(eqx.Module):
    """Parameters p: rotor, operating point, blade inertia and inflow model, all leaves differentiable.

    panels: of a blade (static).
    """

    rotor: Rotor
    operating: OperatingPoint
    blade: Blade
    inflow: InflowModel
    panels: int = eqx.field(static=True, default=24)


Coupled = CoupledRotor | CoupledWake


class Outputs(NamedTuple):
    """What the rotor does at one instant; over ρA(ΩR)², its product with R for moments and with ΩR for power.

    force, moment (3,): on the hub, hub frame (x aft, z up), inertia included. CT (): thrust of the air along the
    shaft. CQ (): torque that turns the hub. CP_induced, CP_profile, CP_parasite, CP_damper (): power into the induced
    velocity, into drag of the blades, into moving the hub through the air (a fuselage's drag, a climb) and into the lag
    dampers; in periodic motion of a hub that does not turn their means add up to that of CQ. flap, lag (B,): of the
    blades (rad). alpha (B, R): angles of attack. lift (B, R): along the shaft per length over ρΩ²R³.
    """

    force: Float[Array, "3"]
    moment: Float[Array, "3"]
    CT: Float[Array, ""]
    CQ: Float[Array, ""]
    CP_induced: Float[Array, ""]
    CP_profile: Float[Array, ""]
    CP_parasite: Float[Array, ""]
    CP_damper: Float[Array, ""]
    flap: Float[Array, " B"]
    lag: Float[Array, " B"]
    alpha: Float[Array, "B R"]
    lift: Float[Array, "B R"]


class _Evaluation(NamedTuple):
    """Everything that rhs and output share; leading axis B but for inflow, the rate of the inflow's state."""

    psi: Float[Array, " B"]
    frames: TurningFrame
    q: Float[Array, "B 2"]
    q_dot: Float[Array, "B 2"]
    q_dot_dot: Float[Array, "B 2"]
    air: AirLoads
    inflow: PyTree


def coupled_rotor(rotor: Rotor, operating: OperatingPoint, inflow: InflowModel, panels: int = 24) -> CoupledRotor:
    """Couple a rotor with an inflow model.

    Raises InputError where the rotor has no hinge data, or its solidity or tip Mach number is beyond sense.
    """
    check_rotor(rotor, operating)
    return CoupledRotor(rotor, operating, blade_of(rotor, operating), inflow, panels)


def still_state(p: CoupledRotor, u: RotorInputs, thrust: float) -> CoupledState:
    """A state to start from: blades at the precone, the inflow that suits a thrust coefficient."""
    still = jnp.zeros(p.rotor.blades)
    rotor = RotorState(still.at[0].set(p.blade.precone), still, still, still)
    return CoupledState(jnp.zeros(()), rotor, p.inflow.start(jnp.asarray(thrust), u))


def rhs(t: Float[Array, ""], x: CoupledState, u: RotorInputs, p: Coupled) -> CoupledState:
    """Rate of the state per radian of Ω_ref t; t itself does not enter."""
    return rate_and_output(t, x, u, p)[0]


def output(t: Float[Array, ""], x: CoupledState, u: RotorInputs, p: Coupled) -> Outputs:
    """Loads, power and blade motion at one instant."""
    return rate_and_output(t, x, u, p)[1]


def rate_and_output(
    t: Float[Array, ""], x: CoupledState, u: RotorInputs, p: Coupled, old: Float[Array, "B N 3"] | None = None
) -> tuple[CoupledState, Outputs]:
    """Both from one evaluation of the blades; old: `old_induced` of a free wake, if it is known."""
    del t
    found = _evaluate(x, u, p, old)
    return _rate(found, x, u), _output(found, u, p)


def rate_in(x: CoupledState, u: RotorInputs, p: CoupledWake, velocities: Velocities) -> CoupledState:
    """`rhs` in given velocities of the air at control points and wake nodes: what is left of it without the pairs."""
    return _rate(_evaluate(x, u, p, velocities=velocities), x, u)


def old_induced(x: CoupledState, u: RotorInputs, p: CoupledWake) -> Float[Array, "B N 3"]:
    """What closure and ground of a free wake induce at its nodes, seen from the blades: it changes slowly."""
    return old_in(x.inflow, u, blades_at(x, u, p), p)


def _rate(found: _Evaluation, x: CoupledState, u: RotorInputs) -> CoupledState:
    flap, lag = (
        multiblade.accelerations(found.q_dot_dot[:, i], q, q_dot, x.psi, u.omega, u.omega_rate)
        for i, (q, q_dot) in enumerate([(x.rotor.flap, x.rotor.flap_rate), (x.rotor.lag, x.rotor.lag_rate)])
    )
    rotor = RotorState(x.rotor.flap_rate, flap, x.rotor.lag_rate, lag)
    return CoupledState(u.omega, rotor, found.inflow)


def _output(found: _Evaluation, u: RotorInputs, p: Coupled) -> Outputs:
    on_hub = jax.vmap(lambda *a: flap_lag.hub_loads(p.blade, *a))(
        found.frames, found.q, found.q_dot, found.q_dot_dot, found.air.force, found.air.moment
    )
    force, moment, air_force = (
        jnp.sum(rotate_about_shaft(v, found.psi), axis=0) / jnp.pi for v in (*on_hub, found.air.force)
    )
    lag_rate = found.q_dot[:, 1]
    return Outputs(
        force=force,
        moment=moment,
        CT=air_force[2],
        CQ=-moment[2],
        CP_induced=jnp.sum(found.air.induced) / jnp.pi,
        CP_profile=jnp.sum(found.air.profile) / jnp.pi,
        CP_parasite=air_force @ u.velocity,
        CP_damper=jnp.sum(flap_lag.damper_moment(p.blade, lag_rate) * lag_rate) / (jnp.pi * p.blade.air),
        flap=found.q[:, 0],
        lag=found.q[:, 1],
        alpha=found.air.loads.alpha,
        lift=found.air.per_length[..., 2],
    )


def sections_of(p: CoupledRotor) -> Sections:
    """The blade's sections."""
    return blade_sections(p.rotor, p.panels)


def stations(p: Coupled) -> Float[Array, " R"]:
    """Where the blade's loads are known, over R."""
    return p.stations if isinstance(p, CoupledWake) else sections_of(p).r


def inflow_velocity(x: CoupledState, points: Float[Array, "N 3"], u: RotorInputs, p: Coupled) -> Float[Array, "N 3"]:
    """Induced velocity at points near the disk, hub frame, over Ω_ref R."""
    if isinstance(p, CoupledWake):
        return velocity_in(x.inflow, points, u, blades_at(x, u, p), p)
    return p.inflow.velocity(x.inflow, points, u)


def blades_at(x: CoupledState, u: RotorInputs, p: Coupled) -> BladesAt:
    """Azimuth, flap, lag and pitch of the blades."""
    psi, q, q_dot = _angles(x, u, p)
    return BladesAt(psi, q[:, 0], q_dot[:, 0], q[:, 1], q_dot[:, 1], _pitch(psi, q, u, p))


def _angles(x: CoupledState, u: RotorInputs, p: Coupled):
    psi = multiblade.azimuths(x.psi, p.rotor.blades)
    angles = [
        multiblade.to_blades(q, q_dot, x.psi, u.omega)
        for q, q_dot in ((x.rotor.flap, x.rotor.flap_rate), (x.rotor.lag, x.rotor.lag_rate))
    ]
    q, q_dot = (jnp.stack(pair, axis=-1) for pair in zip(*angles, strict=True))
    return psi, q, q_dot


def _pitch(psi: Float[Array, " B"], q: Float[Array, "B 2"], u: RotorInputs, p: Coupled) -> Float[Array, " B"]:
    return pitch(u, psi) - p.blade.coupling * (q[:, 0] - p.blade.precone)


def _evaluate(
    x: CoupledState,
    u: RotorInputs,
    p: Coupled,
    old: Float[Array, "B N 3"] | None = None,
    velocities: Velocities | None = None,
) -> _Evaluation:
    psi, q, q_dot = _angles(x, u, p)
    frames = jax.vmap(lambda psi: turning_frame(u, psi, p.blade.gravity))(psi)
    theta = _pitch(psi, q, u, p)
    if isinstance(p, CoupledWake):
        air, inflow = in_wake(x.inflow, u, blades_at(x, u, p), p, old, velocities)
    else:
        air, inflow = _in_inflow(x.inflow, u, p, psi, frames, q, q_dot, theta)
    q_dot_dot = jax.vmap(lambda *a: flap_lag.accelerations(p.blade, *a))(frames, q, q_dot, air.moment)
    return _Evaluation(psi, frames, q, q_dot, q_dot_dot, air, inflow)


def _in_inflow(state: PyTree, u: RotorInputs, p: CoupledRotor, psi, frames, q, q_dot, theta) -> tuple[AirLoads, PyTree]:
    """Air loads of all blades in a model's inflow, and the rate of its state."""
    sections = sections_of(p)
    motion = jax.vmap(flap_lag.motion_of)(q, q_dot)
    in_frame = jax.vmap(lambda m: places(p.blade, m, sections.r))(motion)
    points = rotate_about_shaft(in_frame, psi[:, None])
    induced = rotate_about_shaft(p.inflow.velocity(state, points, u), -psi[:, None])

    def loads_of(frame, motion, theta, induced):
        return air_loads(p.rotor, p.operating, p.blade, sections, frame, motion, theta, induced)

    air = jax.vmap(loads_of)(frames, motion, theta, induced)
    lift = air.per_length[..., 2]
    loads = DiskLoads(lift, points, sections.widths, psi, sections.r, jnp.sum(air.force[:, 2]) / jnp.pi)
    return air, p.inflow.rate(state, loads, u)
