"""A rotor over moving ground: rotor states, the wake between disk and ground, and blade loads, as one system.

    model = over_ground(rotor_model, ground_table(rotor_model, (0.6, 3.0)), blades=SectionBlades(rotor, operating),
                        tip_path=tip_path(rotor, operating))
    state = trim(model, controls)  # `march.simulate` goes on from it

The ground enters through its table (`rotorjax.potential.ground_table`); what it does to the disk is a matrix–vector
product a step. In axial flow, with the wake straight below the disk; a wind μ reaches the loads, the mass flow and a
sloping ground, but does not skew the wake here. With a `tip_path` the blades flap, else they are rigid; flapping tilts
the thrust, not the disk that the wake leaves (`rotorjax.deck.tip_path`).
"""

from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import optimistix as optx
from jaxtyping import Array, Float

from rotorjax.deck.blades import Blades, pressure_matrix, stations
from rotorjax.deck.tip_path import TipPath, blades_at
from rotorjax.errors import InputError
from rotorjax.inflow.balance import Stations
from rotorjax.potential.contraction import NODES
from rotorjax.potential.dynamics import InflowInputs, mass_flow, rate_table
from rotorjax.potential.field import disk_functions
from rotorjax.potential.ground_source import DiskQuadrature
from rotorjax.potential.ground_table import GroundTable, disk_modes
from rotorjax.potential.loading import thrust_coefficient
from rotorjax.potential.model import FiniteStateModel, rotor_flow, rotor_means
from rotorjax.potential.moving_ground import GroundMotion, Variant, plane_velocity, require_variant
from rotorjax.potential.wake_transport import WakeTransport


class DiskMatrices(eqx.Module):
    """What is linear on the disk, tabulated once.

    rotor_inflow (M, KR), ground_inflow (L, KR): inflow far from ground and upflow of unit states at the stations of the
    loads. pressure (M, KR): from dC_T/dr̄ there to τ. rotor_harmonics (3, M), ground_harmonics (3, L): λ₀, λ₁c, λ₁s of
    unit states.
    """

    rotor_inflow: Float[Array, "M KR"]
    ground_inflow: Float[Array, "L KR"]
    pressure: Float[Array, "M KR"]
    rotor_harmonics: Float[Array, "3 M"]
    ground_harmonics: Float[Array, "3 L"]


@eqx.filter_jit
def disk_matrices(rotor: FiniteStateModel, at: Stations) -> DiskMatrices:
    """Tabulate them for a rotor's modes and stations."""
    fine = DiskQuadrature(NODES, rotor.quadrature.nodes_psi)
    x, y, nu, weights = (jnp.asarray(v) for v in fine.rule())
    area, modes = 2 * nu * weights, disk_modes(rotor)
    harmonics = jnp.stack([area, 4 * area * x, 4 * area * y])  # λ₀, λ₁c, λ₁s by least squares over the disk's area
    inflow = rotor_flow(rotor, None, *at.xy).reshape(len(rotor.modes), -1)
    return DiskMatrices(
        inflow,
        disk_functions(modes, *at.xy).reshape(len(modes), -1),
        pressure_matrix(at, rotor.modes),
        harmonics @ rotor_flow(rotor, None, x, y).T,
        harmonics @ disk_functions(modes, x, y).T,
    )


class OverGround(eqx.Module):
    """The model. rotor: modes and mass flow. table: the ground's response. transport, variant (static): see
    `moving_ground`. blades: loads, or None where τ is given. tip_path: flapping, or None for rigid blades. at: stations
    of the loads. disk: what is linear there.
    """

    rotor: FiniteStateModel
    table: GroundTable
    transport: WakeTransport | None
    variant: Variant = eqx.field(static=True)
    blades: Blades | None
    tip_path: TipPath | None
    at: Stations
    disk: DiskMatrices


class DeckControls(eqx.Module):
    """Inputs at one instant, or over T instants with a leading axis T on every field.

    ground: the plane's motion. edge (): of a half-plane, over R (ignored elsewhere). collective (): rad. mu, climb ():
    over ΩR. climb_rate (): acceleration of the hub, over Ω²R; only flapping feels it. tau (M,): pressure coefficients,
    used where the model has no blades.
    """

    ground: GroundMotion
    edge: Float[Array, "*T"]
    collective: Float[Array, "*T"]
    mu: Float[Array, "*T"]
    climb: Float[Array, "*T"]
    climb_rate: Float[Array, "*T"]
    tau: Float[Array, "*T M"]


class DiskState(eqx.Module):
    """States. a (M,): rotor, over ΩR. wake (K, M): what the wake carries below the disk; K = 0 without transit time.
    flap, flap_rate (F,): β₀, β₁c, β₁s (rad) and their rates; F = 3, or 0 for rigid blades.
    """

    a: Float[Array, "*T M"]
    wake: Float[Array, "*T K M"]
    flap: Float[Array, "*T F"]
    flap_rate: Float[Array, "*T F"]


class Output(NamedTuple):
    """What the rotor does. uniform, cosine, sine (): λ₀, λ₁c, λ₁s of λ ≈ λ₀ + r(λ₁c cos ψ + λ₁s sin ψ), over ΩR and
    area-weighted, without climb. thrust (): C_T of the air's load. beta_0, beta_1c, beta_1s (): coning and tilt of the
    tip-path plane (rad), up positive; zero for rigid blades. tau (M,). ground (L,): its upward flow in
    `ground_table.disk_modes`.
    """

    uniform: Float[Array, "*T"]
    cosine: Float[Array, "*T"]
    sine: Float[Array, "*T"]
    thrust: Float[Array, "*T"]
    beta_0: Float[Array, "*T"]
    beta_1c: Float[Array, "*T"]
    beta_1s: Float[Array, "*T"]
    tau: Float[Array, "*T M"]
    ground: Float[Array, "*T L"]


def over_ground(
    rotor: FiniteStateModel,
    table: GroundTable,
    blades: Blades | None = None,
    variant: Variant = "quasi-steady",
    transport: WakeTransport | None = None,
    at: Stations | None = None,
    tip_path: TipPath | None = None,
) -> OverGround:
    """Make the model; blades flap where `tip_path` is given.

    Raises InputError where the variant is unknown, table, wake and modes do not belong together, or blades flap without
    loads or with stations at fewer than 4 azimuths.
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
    if tip_path is not None and (blades is None or at.psi.size < 4):
        raise InputError(
            "Argument `tip_path` needs `blades` and stations at 4 azimuths at least, but there are "
            f"{'no blades' if blades is None else at.psi.size}: leave it out for rigid blades"
        )
    return OverGround(rotor, table, transport, variant, blades, tip_path, at, disk_matrices(rotor, at))


def controls(
    ground: GroundMotion,
    model: FiniteStateModel,
    collective: Float[Array, "*T"] | float = 0.0,
    climb: Float[Array, "*T"] | float = 0.0,
    mu: Float[Array, "*T"] | float = 0.0,
    edge: Float[Array, "*T"] | float = 0.0,
    tau: Float[Array, "*T M"] | None = None,
    climb_rate: Float[Array, "*T"] | float = 0.0,
) -> DeckControls:
    """Make controls, numbers held over the motion's instants."""
    shape = ground.height.shape

    def held(value: Float[Array, "*T"] | float) -> Float[Array, "*T"]:
        return jnp.broadcast_to(jnp.asarray(value, float), shape)

    tau = jnp.broadcast_to(0.0 if tau is None else tau, (*shape, len(model.modes)))
    return DeckControls(ground, held(edge), held(collective), held(mu), held(climb), held(climb_rate), tau)


def ground_flow(state: DiskState, now: DeckControls, model: OverGround) -> Float[Array, " L"]:
    """Return the coefficients of the ground's upward flow on the disk."""
    w = jnp.zeros(2)
    if model.variant != "static":
        at_ends = plane_velocity(now.ground, now.mu, now.climb, jnp.array([0.0, 1.0]))
        w = jnp.stack([at_ends[0], at_ends[1] - at_ends[0]])
    carried = state.a if model.transport is None else model.transport.whole(state.a, state.wake).ravel()
    place = [jnp.sqrt(now.ground.height), now.ground.slope, now.edge][: len(model.table.low)]
    return model.table.apply(place, jnp.concatenate([carried, w]))


def _loads(
    state: DiskState, ground: Float[Array, " L"], now: DeckControls, model: OverGround
) -> tuple[Float[Array, " M"], Float[Array, " F"]]:
    """τ, and the acceleration of the flapping."""
    if model.blades is None:
        return now.tau, state.flap_rate
    at, disk, tip_path, pitch = model.at, model.disk, model.tip_path, now.collective
    down = state.a @ disk.rotor_inflow - ground @ disk.ground_inflow + now.climb
    down = down.reshape(at.psi.size, at.r.size)
    if tip_path is not None:
        angle, rate = blades_at(state.flap, state.flap_rate, at.psi)
        down = down + tip_path.downwash(angle, rate, now.mu, at)
        pitch = pitch + tip_path.pitch(angle)[:, None]
    loads = model.blades.loading(down, pitch, now.mu, at)
    tau = disk.pressure @ loads.ravel()
    if tip_path is None:
        return tau, state.flap_rate
    return tau, tip_path.acceleration(state.flap, state.flap_rate, loads, now.climb_rate, at)


def rhs(t: Float[Array, ""], state: DiskState, now: DeckControls, model: OverGround) -> DiskState:
    """Return d(state)/dψ; t does not enter."""
    del t
    ground = ground_flow(state, now, model)
    tau, flap = _loads(state, ground, now, model)
    inputs = InflowInputs(tau, now.mu, now.climb)
    v = mass_flow(state.a, _induced(state, ground, model), inputs, model.rotor)
    a = jnp.asarray(rate_table(model.rotor.modes), state.a.dtype) @ (tau - v * state.a)
    speed, transport = v[model.rotor.modes.index(0, 1)], model.transport
    wake = state.wake if transport is None else transport.rate(state.a, state.wake, speed)
    return DiskState(a, wake, state.flap_rate, flap)


def _induced(state: DiskState, ground: Float[Array, " L"], model: OverGround) -> Float[Array, ""]:
    """The mean flow through the disk that the mass flow is taken from."""
    if not model.rotor.ground_in_mass_flow:
        return rotor_means(model.rotor, None) @ state.a
    return model.disk.rotor_harmonics[0] @ state.a - model.disk.ground_harmonics[0] @ ground


def output(t: Float[Array, ""], state: DiskState, now: DeckControls, model: OverGround) -> Output:
    """Return what the rotor does in a state; t does not enter."""
    del t
    ground = ground_flow(state, now, model)
    tau = _loads(state, ground, now, model)[0]
    mean = model.disk.rotor_harmonics @ state.a - model.disk.ground_harmonics @ ground
    flap = jnp.zeros(3) if model.tip_path is None else state.flap
    thrust = thrust_coefficient(tau, model.rotor.modes)
    return Output(mean[0], mean[1], mean[2], thrust, flap[0], flap[1], flap[2], tau, ground)


@eqx.filter_jit
def trim(model: OverGround, now: DeckControls, guess: Float[Array, " M"] | None = None) -> DiskState:
    """Return the state that stays where it is under constant controls, wake and flapping settled; Newton's method.

    guess: a, by default that of C_T = 0.005. Raises an error at run time where Newton's method does not converge.
    """
    count = len(model.rotor.modes)
    if guess is None:
        guess = jnp.zeros(count).at[model.rotor.modes.index(0, 1)].set(np.sqrt(3) / 4 * 0.1)
    if model.tip_path is not None:
        guess = jnp.concatenate([guess, jnp.zeros(3)])

    def settled(x: Array) -> DiskState:
        a, flap = x[:count], x[count:]
        wake = jnp.zeros((0, count)) if model.transport is None else model.transport.settled(a)
        return DiskState(a, wake, flap, jnp.zeros_like(flap))

    def residual(x: Array, _: None) -> Array:
        rate = rhs(jnp.zeros(()), settled(x), now, model)
        return jnp.concatenate([rate.a, rate.flap_rate])

    return settled(optx.root_find(residual, optx.Newton(rtol=1e-11, atol=1e-14), guess, max_steps=60).value)
