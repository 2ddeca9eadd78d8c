"""The wake as a first-order system: Eqs. 12–13 and 15 in the blades' frames."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from rotorjax.wake.field import Velocities, node_velocities
from rotorjax.wake.lifting_line import bound_line
from rotorjax.wake.loads import WakeInputs
from rotorjax.wake.model import FreeWake, WakeState
from rotorjax.wake.segments import releases
from rotorjax.wake.transport import AgeOperator, age_operator


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
    grid = settings.far_grid if settings.stretch > 1 else None
    step, damping = settings.age_step, settings.azimuth_damping
    near = age_operator(settings.near_ages, step, damping=damping)
    return near, age_operator(settings.far_ages, step, grid, damping)


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
    return carried_on(state, velocities, bound_line(model, velocities.control, state, inputs).gamma, model)


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
    turned, through = (np.stack([np.real(v), np.imag(v)]) for v in (operator.turned, operator.turned_inlet))
    x, y = (
        jnp.einsum("pij,kfj->pkfi", jnp.asarray(turned), nodes[..., i]) + through[:, None, None] * inlet[..., i, None]
        for i in (0, 1)
    )
    return jnp.stack([x[0] - y[1], x[1] + y[0], _age_slope(operator, nodes[..., 2], inlet[..., 2])], axis=-1)


def _age_slope(operator: AgeOperator, gamma: Float[Array, "K F A"], inlet: Float[Array, "K F"]):
    return jnp.einsum("ij,kfj->kfi", jnp.asarray(operator.matrix), gamma) + operator.inlet * inlet[..., None]
