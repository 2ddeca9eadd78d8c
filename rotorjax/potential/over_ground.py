"""A rotor over moving ground: rotor states, the wake between disk and ground, and blade loads, as one system.

    model = over_ground(rotor_model, ground_table(rotor_model, (0.6, 3.0)), blades=linear_blades(0.08))
    state = trim(model, controls)  # `march.simulate` goes on from it

The ground enters through its table (`rotorjax.potential.ground_table`); what it does to the disk is a matrix–vector
product a step. In axial flow, with the wake straight below the disk; a wind μ reaches the loads, the mass flow and a
sloping ground, but does not skew the wake here.
"""

from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import optimistix as optx
from jaxtyping import Array, Float

from rotorjax.errors import InputError
from rotorjax.potential.blades import Blades, Stations, stations
from rotorjax.potential.disk_matrices import DiskMatrices, disk_matrices
from rotorjax.potential.dynamics import RotorInputs, mass_flow, mean_induced_inflow, rate_table
from rotorjax.potential.ground_table import GroundTable, disk_modes
from rotorjax.potential.loading import thrust_coefficient
from rotorjax.potential.model import FiniteStateModel
from rotorjax.potential.moving_ground import GroundMotion, Variant, plane_velocity, require_variant
from rotorjax.potential.wake_transport import WakeTransport


class OverGround(eqx.Module):
    """The model. rotor: modes and mass flow. table: the ground's response. transport, variant (static): see
    `moving_ground`. blades: loads, or None where τ is given. at: stations of the loads. disk: what is linear there.
    """

    rotor: FiniteStateModel
    table: GroundTable
    transport: WakeTransport | None
    variant: Variant = eqx.field(static=True)
    blades: Blades | None
    at: Stations
    disk: DiskMatrices


class Controls(eqx.Module):
    """Inputs at one instant, or over T instants with a leading axis T on every field.

    ground: the plane's motion. edge (): of a half-plane, over R (ignored elsewhere). collective (): rad. mu, climb ():
    over ΩR. tau (M,): pressure coefficients, used where the model has no blades.
    """

    ground: GroundMotion
    edge: Float[Array, "*T"]
    collective: Float[Array, "*T"]
    mu: Float[Array, "*T"]
    climb: Float[Array, "*T"]
    tau: Float[Array, "*T M"]


class RotorState(eqx.Module):
    """States. a (M,): rotor, over ΩR. wake (K, M): what the wake carries below the disk; K = 0 without transit time."""

    a: Float[Array, "*T M"]
    wake: Float[Array, "*T K M"]


class Output(NamedTuple):
    """What the rotor does. uniform, cosine, sine (): λ₀, λ₁c, λ₁s of λ ≈ λ₀ + r(λ₁c cos ψ + λ₁s sin ψ), over ΩR and
    area-weighted, without climb. thrust (): C_T. tau (M,). ground (L,): its upward flow in `ground_table.disk_modes`.
    """

    uniform: Float[Array, "*T"]
    cosine: Float[Array, "*T"]
    sine: Float[Array, "*T"]
    thrust: Float[Array, "*T"]
    tau: Float[Array, "*T M"]
    ground: Float[Array, "*T L"]


def over_ground(
    rotor: FiniteStateModel,
    table: GroundTable,
    blades: Blades | None = None,
    variant: Variant = "quasi-steady",
    transport: WakeTransport | None = None,
    at: Stations | None = None,
) -> OverGround:
    """Make the model.

    Raises InputError where the variant is unknown, or table, wake and modes do not belong together.
    """
    require_variant(variant, transport)
    if variant != "dynamic":
        transport = None
    columns = len(rotor.modes) * (1 if transport is None else transport.nodes + 1) + 2
    if table.size != (len(disk_modes(rotor)), columns):
        raise InputError(
            f"Argument `table` must have {(len(disk_modes(rotor)), columns)} rows and columns for these modes and "
            f"variant {variant!r}, but has {table.size}: tabulate with the same model and transport"
        )
    at = stations(0.1, azimuths=max(8, 2 * int(rotor.modes.m.max()) + 2)) if at is None else at
    return OverGround(rotor, table, transport, variant, blades, at, disk_matrices(rotor, at))


def controls(
    ground: GroundMotion,
    model: FiniteStateModel,
    collective: Float[Array, "*T"] | float = 0.0,
    climb: Float[Array, "*T"] | float = 0.0,
    mu: Float[Array, "*T"] | float = 0.0,
    edge: Float[Array, "*T"] | float = 0.0,
    tau: Float[Array, "*T M"] | None = None,
) -> Controls:
    """Make controls, numbers held over the motion's instants."""
    shape = ground.height.shape

    def held(value: Float[Array, "*T"] | float) -> Float[Array, "*T"]:
        return jnp.broadcast_to(jnp.asarray(value, float), shape)

    tau = jnp.zeros(len(model.modes)) if tau is None else tau
    tau = jnp.broadcast_to(tau, (*shape, len(model.modes)))
    return Controls(ground, held(edge), held(collective), held(mu), held(climb), tau)


def ground_flow(state: RotorState, now: Controls, model: OverGround) -> Float[Array, " L"]:
    """Return the coefficients of the ground's upward flow on the disk."""
    w = jnp.zeros(2)
    if model.variant != "static":
        at_ends = plane_velocity(now.ground, now.mu, now.climb, jnp.array([0.0, 1.0]))
        w = jnp.stack([at_ends[0], at_ends[1] - at_ends[0]])
    carried = state.a if model.transport is None else model.transport.whole(state.a, state.wake).ravel()
    place = [jnp.sqrt(now.ground.height), now.ground.slope, now.edge][: len(model.table.low)]
    return model.table.apply(place, jnp.concatenate([carried, w]))


def _loads(state: RotorState, ground: Float[Array, " L"], now: Controls, model: OverGround) -> Float[Array, " M"]:
    if model.blades is None:
        return now.tau
    at, disk = model.at, model.disk
    down = state.a @ disk.rotor_inflow - ground @ disk.ground_inflow + now.climb
    loads = model.blades.loading(down.reshape(at.psi.size, at.r.size), now.collective, now.mu, at)
    return disk.pressure @ loads.ravel()


def _rate(state: RotorState, tau: Float[Array, " M"], now: Controls, model: OverGround) -> RotorState:
    inputs = RotorInputs(tau, now.mu, now.climb)
    v = mass_flow(state.a, mean_induced_inflow(state.a, model.rotor), inputs, model.rotor)
    a = jnp.asarray(rate_table(model.rotor.modes), state.a.dtype) @ (tau - v * state.a)
    if model.transport is None:
        return RotorState(a, state.wake)
    return RotorState(a, model.transport.rate(state.a, state.wake, v[model.rotor.modes.index(0, 1)]))


def rhs(t: Float[Array, ""], state: RotorState, now: Controls, model: OverGround) -> RotorState:
    """Return d(state)/dψ; t does not enter."""
    del t
    return _rate(state, _loads(state, ground_flow(state, now, model), now, model), now, model)


def output(t: Float[Array, ""], state: RotorState, now: Controls, model: OverGround) -> Output:
    """Return what the rotor does in a state; t does not enter."""
    del t
    ground = ground_flow(state, now, model)
    tau = _loads(state, ground, now, model)
    mean = model.disk.rotor_harmonics @ state.a - model.disk.ground_harmonics @ ground
    return Output(mean[0], mean[1], mean[2], thrust_coefficient(tau, model.rotor.modes), tau, ground)


@eqx.filter_jit
def trim(model: OverGround, now: Controls, guess: Float[Array, " M"] | None = None) -> RotorState:
    """Return the state that stays where it is under constant controls, its wake settled; Newton's method.

    guess: a, by default that of C_T = 0.005. Raises an error at run time where Newton's method does not converge.
    """
    if guess is None:
        guess = jnp.zeros(len(model.rotor.modes)).at[model.rotor.modes.index(0, 1)].set(np.sqrt(3) / 4 * 0.1)

    def residual(a: Array, _: None) -> Array:
        return rhs(jnp.zeros(()), _settled(a, model), now, model).a

    found = optx.root_find(residual, optx.Newton(rtol=1e-11, atol=1e-14), guess, max_steps=60)
    return _settled(found.value, model)


def _settled(a: Array, model: OverGround) -> RotorState:
    return RotorState(a, jnp.zeros((0, a.size)) if model.transport is None else model.transport.settled(a))
