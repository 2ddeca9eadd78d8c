"""The flow below the rotor over a time window: costates and velocities in one call, and the causal form with a delay.

Costates look ahead: Δ(t) depends on loads after t, and forgets them at the rate of the slowest state. Whoever may wait
has Δ(t − delay) at time t from what is known by then; what is missing decays as e^{−rate · delay}
(`forgetting_rate`). Who may not takes `rotorjax.potential.wake_transport`, which needs no costates.
"""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer
from jaxtyping import Array, Float

from rotorjax.errors import InputError
from rotorjax.potential.dynamics import InflowInputs, costates, flow_matrices, passage, rate_table, rows_at
from rotorjax.potential.field import velocity_functions
from rotorjax.potential.model import FiniteStateModel
from rotorjax.potential.moving_ground import require_increasing


def require_window(psi: Float[Array, " T"], depth: float, speed: float) -> None:
    """Raise InputError where the instants do not increase or span less than the wake's transit time depth/speed."""
    if isinstance(psi, Tracer) or isinstance(depth, Tracer) or isinstance(speed, Tracer):
        return
    require_increasing("psi", psi)
    if not speed > 0:
        raise InputError(f"Argument `speed` must be positive (convection speed of the wake, over ΩR), but is {speed}")
    length, transit = float(psi[-1] - psi[0]), float(depth / speed)
    if length < transit:
        raise InputError(
            f"Argument `psi` must span the wake's transit time {transit:.4g} rad (depth {float(depth):.3g} at speed "
            f"{float(speed):.3g}), but spans {length:.4g}: give more of the past and the future"
        )


@eqx.filter_jit
def velocity_at(
    time: Float[Array, ""],
    points: Float[Array, "N 3"],
    psi: Float[Array, " T"],
    a: Float[Array, "T M"],
    delta: Float[Array, "T M"],
    speed: Float[Array, ""],
    model: FiniteStateModel,
    chi: Float[Array, ""] | float = 0.0,
) -> Float[Array, "N 3"]:
    """Return the rotor's velocity (hub frame, over ΩR) at hub-frame points and one time; see `dynamics.axial_velocity`.

    Below the disk v_A(t) = v_B(t₀) ± (v_C†(t₀) − v_D†(t)), plus for the axial, minus for the in-plane components: the
    acceleration of a pressure mode is even along the axis and odd across it.
    """
    foot, mirror, passed = passage(time, points, speed, chi)
    at_foot, at_mirror = velocity_functions(model.modes, foot), velocity_functions(model.modes, mirror)
    flow = jnp.einsum("cmn,mn->nc", at_foot, rows_at(passed, psi, a))
    adjoint = jnp.einsum("cmn,mn->nc", at_foot, rows_at(passed, psi, delta))
    adjoint = adjoint - jnp.einsum("cmn,m->nc", at_mirror, rows_at(time, psi, delta))
    return flow + jnp.where(points[:, 2:] < 0, adjoint * jnp.array([-1.0, -1.0, 1.0], points.dtype), 0.0)


def flow_over_window(
    psi: Float[Array, " T"],
    a: Float[Array, "T M"],
    inputs: InflowInputs,
    times: Float[Array, " S"],
    points: Float[Array, "N 3"],
    speed: float,
    model: FiniteStateModel,
    chi: float = 0.0,
) -> Float[Array, "S N 3"]:
    """Return the rotor's velocity (hub frame, over ΩR) at hub-frame points and times of a window, by costates.

    psi, a, inputs: the window's instants, states and inputs; times: inside it, a transit time after its start and
    rather before its end. speed: convection speed of the wake, over ΩR; chi: its skew (rad). Raises InputError where
    the instants do not increase, or a time lies outside or less than the transit time after the start.
    """
    low = float(jnp.min(points[:, 2]))
    depth = max(0.0, -low) / np.cos(chi)
    require_window(psi, depth, speed)
    first, last = float(psi[0]) + depth / speed, float(psi[-1])
    if not bool(jnp.all((times >= first - 1e-12) & (times <= last))):
        raise InputError(
            f"Argument `times` must lie in [{first:.6g}, {last:.6g}], the window less the wake's transit time, but "
            f"spans [{float(times.min()):.6g}, {float(times.max()):.6g}]"
        )
    delta = costates(psi, a, inputs, model, chi != 0.0)
    one = eqx.filter_jit(lambda t: velocity_at(t, points, psi, a, delta, jnp.asarray(speed), model, chi))
    return jax.lax.map(one, times)


@eqx.filter_jit
def delayed_costates(
    psi: Float[Array, " T"],
    a: Float[Array, "T M"],
    inputs: InflowInputs,
    model: FiniteStateModel,
    steps: int,
    skewed: bool = False,
) -> Float[Array, "T-steps M"]:
    """Return Δ at psi[k] from states and inputs up to psi[k + steps] only, for k = 0 … T − 1 − steps.

    Against `costates` of the whole window the error decays as e^{−rate · delay} (`forgetting_rate`). Raises InputError
    where steps is not in [1, T − 1].
    """
    count = psi.size
    if not 1 <= steps < count:
        raise InputError(f"Argument `steps` must lie in [1, {count - 1}] for {count} instants, but is {steps}")

    def one(start: Array) -> Array:
        times, states, given = jax.tree.map(
            lambda v: jax.lax.dynamic_slice_in_dim(v, start, steps + 1), (psi, a, inputs)
        )
        return costates(times, states, given, model, skewed)[0]

    return jax.lax.map(one, jnp.arange(count - steps))


def forgetting_rate(a: Float[Array, " M"], inputs: InflowInputs, model: FiniteStateModel) -> float:
    """Return the slowest decay rate (per rad) of states and costates about a state, in axial flow."""
    v, _ = flow_matrices(a, inputs, model, skewed=False)
    return float(np.linalg.eigvals(rate_table(model.modes) * np.asarray(v)).real.min())
