"""The periodic wake as a fixed point: positions that their own velocities reproduce.

Marching a hovering wake does not settle: the equilibrium exists but is unstable (vortex pairing). Solved for directly,
the residual has to be preconditioned with the transport operator: given the velocities at all nodes, the linear half of
Eq. 13 is solved exactly for the positions they produce (transport.py). On that fixed point GMRES needs a few tens of
products, with no further preconditioner.
"""

from functools import partial
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from rotorjax.ode.linear import Krylov
from rotorjax.ode.outcome import ravelled, traceable, unravelled
from rotorjax.rotor.blade_element import SectionLoads
from rotorjax.wake.dynamics import inputs_of, leading_lines, operators
from rotorjax.wake.field import Velocities, node_velocities
from rotorjax.wake.loads import blade_loads
from rotorjax.wake.model import FreeWake, WakeState
from rotorjax.wake.roll_up import Release, release
from rotorjax.wake.transport import lag, solve_nodes, solve_scalar


class Unknowns(NamedTuple):
    """What is solved for: near (K, R+1, A_N, 3), far (K, F, A_F, 3), gamma_bound (K, R). Strengths in the wake follow
    from the bound circulation by transport alone.
    """

    near: Float[Array, "K R1 AN 3"]
    far: Float[Array, "K F AF 3"]
    gamma_bound: Float[Array, "K R"]


class Evaluation(NamedTuple):
    """The wake of given unknowns: its full state, velocities, loads and release points."""

    state: WakeState
    velocities: Velocities
    loads: SectionLoads
    start: Release


def full_state(model: FreeWake, x: Unknowns) -> tuple[WakeState, Release]:
    """Periodic state with all strengths, and where the far filaments start."""
    near, far = operators(model)
    gamma_near = solve_scalar(near, jnp.zeros((*x.gamma_bound.shape, len(near.inlet))), x.gamma_bound)
    row = model.settings.release_ages - 1
    start = jax.vmap(lambda *at: release(model, *at))(x.near[:, :, row], gamma_near[:, :, row])
    gamma_far = solve_scalar(far, jnp.zeros((*start.strength.shape, len(far.inlet))), start.strength)
    return WakeState(x.near, x.far, gamma_near, gamma_far, x.gamma_bound), start


def evaluate(model: FreeWake, x: Unknowns) -> Evaluation:
    """Velocities and loads of a periodic wake."""
    state, start = full_state(model, x)
    velocities = node_velocities(model, state)
    loads = blade_loads(model, velocities.control, x.gamma_bound, inputs_of(model))
    return Evaluation(state, velocities, loads, start)


evaluated = eqx.filter_jit(evaluate)
"""`evaluate`, compiled."""


def transported(model: FreeWake, found: Evaluation) -> Unknowns:
    """The wake that given velocities and loads produce."""
    near, far = operators(model)
    velocities = found.velocities
    leading = leading_lines(model, velocities.near.shape[0])
    return Unknowns(
        near=solve_nodes(near, velocities.near, leading),
        far=solve_nodes(far, velocities.far, found.start.points),
        gamma_bound=lag(found.loads.circulation, model.settings.circulation_lag),
    )


def advance(model: FreeWake, x: Unknowns) -> Unknowns:
    """One pass of the fixed point: the wake that the velocities and loads of x produce."""
    return transported(model, evaluate(model, x))


def residual(x: Unknowns, model: FreeWake) -> Unknowns:
    """How far one pass moves the wake: advance(x) − x; zero at the periodic equilibrium."""
    return told(x, model)[0]


def told(x: Unknowns, model: FreeWake) -> tuple[Unknowns, Evaluation]:
    """The residual and the evaluation that it comes from, as `Krylov(tells=True)` wants them."""
    found = evaluate(model, x)
    return jax.tree.map(lambda new, old: new - old, transported(model, found), x), found


METHOD = Krylov(forcing=0.03, restart=120, restarts=1, tells=True)
"""How the search solves for Newton's direction, without a preconditioner."""


def look(model: FreeWake, x: Unknowns) -> tuple[Unknowns, Evaluation]:
    """`told` on the host, by the program that the search has compiled anyway."""
    flat, unravel = ravelled(x)
    value, place = METHOD.at(told, unravel, flat, traceable((model,)))
    return unravelled(unravel, np.asarray(value)), place.told


def displacement(moved: Unknowns) -> float:
    """Rms distance over R that nodes move in one pass, the measure of convergence."""
    nodes = np.concatenate([np.asarray(moved.near).reshape(-1, 3), np.asarray(moved.far).reshape(-1, 3)])
    return float(np.sqrt(np.mean(np.sum(nodes**2, axis=1))))


@partial(jax.jit, static_argnames="slices", inline=True)
def spread(x: Unknowns, slices: int) -> Unknowns:
    """Repeat an axisymmetric wake (K = 1) over K slices."""
    return jax.tree.map(lambda a: jnp.repeat(a, slices, axis=0) if a.shape[0] == 1 else a, x)
