"""Several rotors in one free wake as a first-order system: each turns at its own speed, all carried by the flow of all.

The wakes are those of `several.py`, of all blades at one instant (K = B); to them come the rotors' azimuths, which no
longer keep step where the speeds differ. Rotor units of the nominal speed Ω_ref: time as Ω_ref t (rad).
"""

from dataclasses import replace

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from rotorjax.errors import InputError
from rotorjax.wake.dynamics import carried_on, inputs_of
from rotorjax.wake.field import Velocities
from rotorjax.wake.lifting_line import bound_line
from rotorjax.wake.model import Flight, FreeWake, WakeState
from rotorjax.wake.performance import Coefficients, performance_in
from rotorjax.wake.several import SeveralWakes, velocities_in


class SeveralState(eqx.Module):
    """azimuth (N,): of each rotor's blade 0, in its own sense. wakes: K = B slices of each, leading axis N."""

    azimuth: Float[Array, " N"]
    wakes: WakeState


class SeveralInputs(eqx.Module):
    """theta_0 (N,): collectives (rad). omega (N,): speeds over the nominal one."""

    theta_0: Float[Array, " N"] = eqx.field(converter=jnp.asarray)
    omega: Float[Array, " N"] = eqx.field(converter=jnp.asarray)


def nominal(several: SeveralWakes) -> SeveralInputs:
    """The model's own inputs."""
    return SeveralInputs(several.wakes.operating.collective, jnp.ones_like(several.senses))


def at_one_instant(several: SeveralWakes, state: WakeState) -> SeveralState:
    """State to march from: the blades' slices of a periodic state, as slice 0 stands at its phase.

    Raises InputError for rotors of one blade, whose wake at one instant cannot be told from an axisymmetric one.
    """
    blades = several.wakes.rotor.blades
    if blades < 2:
        raise InputError("Several rotors must have two blades or more each to be marched")

    def instant(a: Array) -> Array:
        return jnp.repeat(a, blades, axis=1) if several.slices == 1 else a[:, :: several.slices // blades]

    return SeveralState(several.phases, jax.tree.map(instant, state))


def rhs(
    t: float | Float[Array, ""], x: SeveralState, inputs: SeveralInputs, several: SeveralWakes
) -> tuple[SeveralState, Coefficients]:
    """Rate of change of the state per radian of Ω_ref t, and thrust, power and mean inflow of each rotor (N,), over
    ρA(Ω_ref R)², ρA(Ω_ref R)³ and Ω_ref R; the equations do not hold t.
    """
    now = _turning(several, x, inputs)
    velocities = velocities_in(now, x.wakes)
    rate, loads = eqx.filter_vmap(_of_one)(now.wakes, x.wakes, velocities)
    power = {name: getattr(loads, name) * inputs.omega for name in ("power", "induced", "profile")}
    return SeveralState(inputs.omega, rate), loads._replace(**power)


def _turning(several: SeveralWakes, x: SeveralState, inputs: SeveralInputs) -> SeveralWakes:
    """The rotors as they stand and turn now."""
    count, blades = len(several), several.wakes.rotor.blades
    still = jnp.zeros((count, blades))
    flight = Flight(
        wind=jnp.zeros((count, 3)),
        hinge=jnp.zeros(count),
        flap=still,
        flap_rate=still,
        cyclic=still,
        speed=inputs.omega,
    )
    wakes = eqx.tree_at(lambda w: w.operating.collective, several.wakes, inputs.theta_0)
    return replace(several, wakes=replace(wakes, flight=flight), phases=x.azimuth, slices=blades)


def _of_one(model: FreeWake, state: WakeState, velocities: Velocities) -> tuple[WakeState, Coefficients]:
    line = bound_line(model, velocities.control, state, inputs_of(model))
    return carried_on(state, velocities, line.gamma, model), performance_in(model, line.control, line.loads)
