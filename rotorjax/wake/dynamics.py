"""The wake as a first-order system: Eqs. 12–13 and 15 in the blades' frames."""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from rotorjax.rotor.blade_element import SectionLoads, section_loads, span_averages
from rotorjax.wake.field import Velocities, node_velocities
from rotorjax.wake.lifting_surface import chord_downwash
from rotorjax.wake.model import FreeWake, WakeState
from rotorjax.wake.segments import releases
from rotorjax.wake.transport import AgeOperator, age_operator

REVERSAL = 0.02
"""Speed over ΩR within which the flow over a blade turns round; far below that of any station of a hovering rotor."""


class WakeInputs(NamedTuple):
    """What drives the wake. collective: θ₀ (rad). climb: velocity over ΩR, positive up. height: over R, None for none.

    A rotor that moves over fixed ground has dheight/dψ = climb; the velocity of ground that moves itself is left out.
    """

    collective: Float[Array, ""]
    climb: Float[Array, ""]
    height: Float[Array, ""] | None


def inputs_of(model: FreeWake) -> WakeInputs:
    """The model's own inputs."""
    return WakeInputs(model.operating.collective, model.climb, None if model.ground is None else model.ground.height)


def driven(model: FreeWake, inputs: WakeInputs) -> FreeWake:
    """The model under other inputs. With the model's own it is the model."""
    climb = inputs.climb * model.operating.tip_speed(model.rotor.radius)
    model = eqx.tree_at(lambda m: (m.operating.collective, m.operating.climb), model, (inputs.collective, climb))
    return model if inputs.height is None else eqx.tree_at(lambda m: m.ground.height, model, inputs.height)


def operators(model: FreeWake) -> tuple[AgeOperator, AgeOperator]:
    """Age differences of the near wake and of the far filaments."""
    settings = model.settings
    return age_operator(settings.near_ages, settings.age_step), age_operator(settings.far_ages, settings.age_step)


def blade_loads(
    model: FreeWake, control: Float[Array, "K R 3"], gamma_bound: Float[Array, "K R"], inputs: WakeInputs
) -> SectionLoads:
    """Section loads (K, R) from the air's velocity at the lifting line, in the blades' frames, and its circulation."""
    behind = model.settings.control_chords * model.chords
    tangential, perpendicular, pitch = model.stations - control[..., 1], -control[..., 2], inputs.collective
    downwash = gamma_bound @ chord_downwash(model.stations, model.edges, behind).T
    if model.flight is not None:
        tangential, perpendicular = across_blades(model, control)
        pitch = pitch + model.flight.cyclic[:, None]
        # where the flow over the blade is reversed the wake lies ahead of it, and the sign turns with it; in hover only
        # a wake far from the solution could do so, and then the way to it is lost
        downwash = downwash * jax.scipy.special.erf(tangential / REVERSAL)
    return section_loads(
        model.rotor,
        model.operating,
        model.stations,
        tangential,
        perpendicular,
        collective=pitch,
        chord_downwash=downwash,
        span_mean=span_averages(model.stations, model.widths, model.settings.stall_chords * model.chords),
    )


def across_blades(model: FreeWake, control: Float[Array, "K R 3"]) -> tuple[Float[Array, "K R"], Float[Array, "K R"]]:
    """Velocities u_T and u_P (blade_element.py) of the air over blades that flap and lag."""
    flight = model.flight
    assert flight is not None
    outboard, ahead, up = (v[:, None] for v in flight.axes)
    arm = (model.stations - flight.hinge)[:, None]
    place = arm * outboard + flight.hinge * jnp.array([1.0, 0.0, 0.0])
    carried = model.speed * jnp.stack([-place[..., 1], place[..., 0], jnp.zeros_like(place[..., 0])], axis=-1)
    through = carried - control
    tangential, perpendicular = jnp.sum(through * ahead, axis=-1), jnp.sum(through * up, axis=-1)
    if flight.lag_rate is not None:
        tangential = tangential - arm[:, 0] * (jnp.cos(flight.flap) * flight.lag_rate)[:, None]
    return tangential, perpendicular + arm[:, 0] * flight.flap_rate[:, None]


def leading_lines(model: FreeWake, count: int) -> Float[Array, "K R1 3"]:
    """Lifting lines of K slices."""
    return jax.vmap(lambda k: model.of_slice(k).leading)(jnp.arange(count))


def rhs(psi: float | Float[Array, ""], state: WakeState, inputs: WakeInputs, model: FreeWake) -> WakeState:
    """Rate of change of the state per radian of azimuth, with slice 0 at azimuth psi.

    state: K = B slices (all blades at this instant), or K = 1 where the wake is axisymmetric.
    """
    model = driven(model, inputs)
    return rates(state, node_velocities(model, state, psi), inputs, model)


def rates(state: WakeState, velocities: Velocities, inputs: WakeInputs, model: FreeWake) -> WakeState:
    """Rate of change of the state in given velocities."""
    wanted = blade_loads(model, velocities.control, state.gamma_bound, inputs).circulation
    return carried_on(state, velocities, wanted, model)


def carried_on(state: WakeState, velocities: Velocities, wanted: Float[Array, "K R"], model: FreeWake) -> WakeState:
    """Rate of change of the state in given velocities, its bound circulation on the way to `wanted`.

    Wake age and the filter count in azimuth, so that they go with the rotor's speed.
    """
    near, far = operators(model)
    speed = model.speed
    start = jax.vmap(lambda s: releases(model, s))(state)
    leading = leading_lines(model, state.near.shape[0])
    return WakeState(
        near=velocities.near - speed * _drift(near, state.near, leading),
        far=velocities.far - speed * _drift(far, state.far, start.points),
        gamma_near=-speed * _age_slope(near, state.gamma_near, state.gamma_bound),
        gamma_far=-speed * _age_slope(far, state.gamma_far, start.strength),
        gamma_bound=speed * (wanted - state.gamma_bound) / model.settings.circulation_lag,
    )


def _drift(operator: AgeOperator, nodes: Float[Array, "K F A 3"], inlet: Float[Array, "K F 3"]):
    """∂ρ/∂ζ + ẑ × ρ: transport towards greater age, seen from the turning blade."""
    along = (
        jnp.einsum("ij,kfjc->kfic", jnp.asarray(operator.matrix), nodes) + operator.inlet[:, None] * inlet[:, :, None]
    )
    turning = jnp.stack([-nodes[..., 1], nodes[..., 0], jnp.zeros_like(nodes[..., 0])], axis=-1)
    return along + turning


def _age_slope(operator: AgeOperator, gamma: Float[Array, "K F A"], inlet: Float[Array, "K F"]):
    return jnp.einsum("ij,kfj->kfi", jnp.asarray(operator.matrix), gamma) + operator.inlet * inlet[..., None]
