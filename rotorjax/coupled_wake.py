"""Blades in their own free wake: the wake's part of the coupled rotor (coupled.py), and their loads in it.

The wake knows where the blades are by `wake.model.Flight`, made from the rotor's state and inputs at each instant; the
loads are those of the wake's lifting line, at its own stations, which flaps and lags with the blade.
"""

from dataclasses import replace
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from rotorjax.frames import to_ellipsoidal
from rotorjax.ground import Plane, TurnedPlane
from rotorjax.operating import OperatingPoint
from rotorjax.panels.surface import Solid
from rotorjax.rotor.blade_element import SectionLoads
from rotorjax.rotor.flap_lag import Blade, blade_of
from rotorjax.rotor.geometry import Rotor
from rotorjax.rotor.hub import RotorInputs
from rotorjax.rotor.moving_blade import AirLoads
from rotorjax.wake.dynamics import carried_on, driven
from rotorjax.wake.field import Velocities, node_velocities, old_velocities, undisturbed, velocity_now
from rotorjax.wake.lifting_line import bound_line
from rotorjax.wake.loads import WakeInputs
from rotorjax.wake.model import Flight, FreeWake, WakeState
from rotorjax.wake.settings import WakeSettings


class CoupledWake(eqx.Module):
    """Parameters p of a rotor in its free wake, all leaves differentiable. ground: in level axes, or None for none.
    surfaces: in level axes about the place from which the hub's `RotorInputs.place` counts. gust (2,): of
    `wake.model.Flight`, or None.

    The state's inflow is a `WakeState` of K = B slices, blade 0 first. Climb comes from the hub's motion, not from the
    operating point.
    """

    rotor: Rotor
    operating: OperatingPoint
    blade: Blade
    ground: Plane | None
    settings: WakeSettings
    surfaces: Solid | None = None
    gust: Float[Array, "2"] | None = None

    @property
    def edges(self) -> Float[Array, " R+1"]:
        """Panel edges of the lifting line, over R."""
        return self._rigid.edges

    @property
    def stations(self) -> Float[Array, " R"]:
        """Control points of the lifting line, over R."""
        return self._rigid.stations

    @property
    def _rigid(self) -> FreeWake:
        """The free wake's model without hub and blade motion; any climb belongs to the hub's motion."""
        still = eqx.tree_at(lambda o: o.climb, self.operating, jnp.zeros_like(self.operating.climb))
        return FreeWake(self.rotor, still, self.ground, self.settings, jnp.zeros(()))


class BladesAt(NamedTuple):
    """The blades at one instant. psi (B,): azimuths. flap, flap_rate, lag, lag_rate (B,): rad, per rad. theta (B,):
    pitch without twist (rad).
    """

    psi: Float[Array, " B"]
    flap: Float[Array, " B"]
    flap_rate: Float[Array, " B"]
    lag: Float[Array, " B"]
    lag_rate: Float[Array, " B"]
    theta: Float[Array, " B"]


def coupled_wake(
    rotor: Rotor, operating: OperatingPoint, settings: WakeSettings, ground: Plane | None = None
) -> CoupledWake:
    """Couple a rotor with its free wake. Raises InputError where the rotor has no hinge data."""
    return CoupledWake(rotor, operating, blade_of(rotor, operating), ground, settings)


def model_of(u: RotorInputs, blades: BladesAt, p: CoupledWake) -> FreeWake:
    """The free wake's model at one instant: wind, turning and ground from the hub's motion, flap, lag and pitch of
    the blades.
    """
    flight = Flight(
        wind=-u.velocity,
        hinge=p.blade.offset,
        flap=blades.flap,
        flap_rate=blades.flap_rate,
        cyclic=blades.theta - u.theta_0,
        turn=to_ellipsoidal(jnp.stack([u.p, u.q, u.r])),
        speed=u.omega,
        lag=blades.lag,
        lag_rate=blades.lag_rate,
        gust=p.gust,
    )
    model = eqx.tree_at(lambda m: m.flight, p._rigid, flight, is_leaf=lambda v: v is None)
    if p.ground is not None and u.turn is not None:
        model = replace(model, ground=TurnedPlane(p.ground.height, p.ground.slope, u.turn))
    if p.surfaces is not None:
        model = replace(model, surfaces=p.surfaces.seen_from(u.place, u.turn))
    return driven(model, _inputs(u))


def in_wake(
    state: WakeState,
    u: RotorInputs,
    blades: BladesAt,
    p: CoupledWake,
    old: Float[Array, "B N 3"] | None = None,
    velocities: Velocities | None = None,
) -> tuple[AirLoads, WakeState]:
    """Air loads of all blades, leading axis B, and the rate of the wake, per radian of Ω_ref t.

    old: what closure and ground induce at all nodes (`wake.field.old_velocities`), None to sum it up here. velocities:
    of the air at control points and nodes where they are known, and no pair is summed.
    """
    model = model_of(u, blades, p)
    if velocities is None:
        velocities = node_velocities(model, state, blades.psi[0], old)
    line = bound_line(model, velocities.control, state, _inputs(u))
    air = wake_air_loads(model, line.control, line.loads, blades.psi)
    return air, carried_on(state, velocities, line.gamma, model)


def old_in(state: WakeState, u: RotorInputs, blades: BladesAt, p: CoupledWake) -> Float[Array, "B N 3"]:
    """What closure and ground induce at all nodes, for `in_wake`."""
    return old_velocities(model_of(u, blades, p), state, blades.psi[0])


def velocity_in(
    state: WakeState, points: Float[Array, "N 3"], u: RotorInputs, blades: BladesAt, p: CoupledWake
) -> Float[Array, "N 3"]:
    """Velocity that wake and bound vortices induce at hub-frame points over R, over Ω_ref R."""
    return velocity_now(state, blades.psi[0], points, model_of(u, blades, p))


def wake_air_loads(
    model: FreeWake, control: Float[Array, "K R 3"], loads: SectionLoads, psi: Float[Array, " K"]
) -> AirLoads:
    """Sum up section loads along the lifting lines of K slices at azimuths psi; every field gets a leading axis K.

    control: velocity of the air at the control points, in the blades' frames, over ΩR. Moments are about the hinge.
    """
    flight = model.flight
    assert flight is not None
    _, ahead, up = (v[:, None] for v in flight.axes)
    sine, cosine = jnp.sin(loads.inflow_angle)[..., None], jnp.cos(loads.inflow_angle)[..., None]
    lift, drag = loads.dlift[..., None], loads.ddrag[..., None]
    force = (lift * cosine - drag * sine) * up - (lift * sine + drag * cosine) * ahead
    arm = model.stations - flight.hinge
    passing = jax.vmap(lambda k, angle: undisturbed(model, model.of_slice(k).control, angle))
    own = control - passing(jnp.arange(flight.flap.shape[0]), psi)
    speed = loads.mach / model.operating.tip_mach(model.rotor.radius)
    return AirLoads(
        force,
        jnp.einsum("r,krc->kc", model.widths, force),
        jnp.einsum("r,krc->kc", model.widths * arm, force),
        -jnp.einsum("r,krc,krc->k", model.widths, force, own),
        jnp.einsum("r,kr,kr->k", model.widths, loads.ddrag, speed),
        loads,
    )


def _inputs(u: RotorInputs) -> WakeInputs:
    return WakeInputs(u.theta_0, jnp.zeros_like(u.theta_0), u.height)
