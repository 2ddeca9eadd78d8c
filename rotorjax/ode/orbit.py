"""A periodic orbit: states at equally spaced times of one period, and how well it was found."""

from functools import partial

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.flatten_util import ravel_pytree
from jax.typing import ArrayLike
from jaxtyping import Array, Float, PyTree

from rotorjax.errors import InputError
from rotorjax.ode.fourier import fourier_interpolation
from rotorjax.ode.outcome import Outcome, relative_rms
from rotorjax.ode.runge_kutta import Rhs
from rotorjax.ode.trajectory import Trajectory


class Orbit(eqx.Module):
    """States over one period.

    t: times (K,), equally spaced from t[0], the end of the period left out. x: states, every leaf with a leading axis
    of K. period: (). residual: relative rms of what the solver left over. residuals: its history (I + 1,). converged,
    why, iterations, wall_time (s): how the solver ended.
    """

    t: Float[Array, " K"]
    x: PyTree
    period: Float[Array, ""]
    residual: Float[Array, ""]
    residuals: Float[Array, " I+1"]
    converged: bool = eqx.field(static=True)
    why: str = eqx.field(static=True)
    iterations: int = eqx.field(static=True)
    wall_time: float = eqx.field(static=True)

    @property
    def nodes(self) -> int:
        """Number of times K."""
        return self.t.size

    @property
    def start(self) -> PyTree:
        """State at t[0]."""
        return _first(self.x)

    def at(self, times: ArrayLike) -> PyTree:
        """States at any concrete times (N,), by trigonometric interpolation; every leaf gets a leading axis of N."""
        angle = 2 * np.pi * (np.atleast_1d(np.asarray(times, float)) - float(self.t[0])) / float(self.period)
        table = fourier_interpolation(self.nodes, angle)
        return _combined(self.x, table)


@partial(jax.jit, inline=True)
def _first(x: PyTree) -> PyTree:
    return jax.tree.map(lambda leaf: leaf[0], x)


@partial(jax.jit, inline=True)
def _combined(x: PyTree, table: Float[Array, "N K"]) -> PyTree:
    return jax.tree.map(lambda leaf: jnp.tensordot(table.astype(leaf.dtype), leaf, axes=1), x)


def make_orbit(t0: ArrayLike, x: PyTree, period: ArrayLike, outcome: Outcome) -> Orbit:
    """Pack states (leaves with a leading axis of K) from t0 on, and how a solver found them, into an Orbit."""
    nodes = jnp.shape(jax.tree.leaves(x)[0])[0]
    period = jnp.asarray(period, float)
    return Orbit(
        t=jnp.asarray(t0, float) + period * jnp.arange(nodes, dtype=period.dtype) / nodes,
        x=x,
        period=period,
        residual=jnp.asarray(outcome.residual),
        residuals=jnp.asarray(outcome.residuals),
        converged=outcome.converged,
        why=outcome.why,
        iterations=outcome.iterations,
        wall_time=outcome.wall_time,
    )


def orbit_from_march(trajectory: Trajectory, tol: float = 1e-6) -> Orbit:
    """Take a march over exactly one period, its end included, for an orbit.

    Raises InputError where the state at the end differs from the start by more than `tol` (relative rms): such a start
    is not periodic.
    """
    first, last = (np.asarray(ravel_pytree(jax.tree.map(lambda v, i=i: v[i], trajectory.x))[0]) for i in (0, -1))
    gap = relative_rms(last - first, first)
    if not gap <= tol:
        raise InputError(
            f"Argument `trajectory` must end where it began, but the states differ by {gap:.2e} (relative rms) "
            f"and not at most {tol:.1e}: march on until it settles, or solve with `shoot` or `collocate`"
        )
    x = jax.tree.map(lambda v: v[:-1], trajectory.x)
    found = Outcome(None, gap, (gap,), 0, True, f"closes to {gap:.2e}", 0.0)
    return make_orbit(trajectory.t[0], x, trajectory.t[-1] - trajectory.t[0], found)


def require_converged(orbit: Orbit) -> None:
    """Raise InputError for an orbit that has not converged."""
    if not orbit.converged:
        raise InputError(
            f"Argument `orbit` must have converged, but has not: {orbit.why}. Loosen `tol` knowingly or solve it better"
        )


def require_periodic(rhs: Rhs, t0: ArrayLike, x: PyTree, period: ArrayLike, *args: PyTree, tol: float = 1e-6) -> None:
    """Raise InputError where rhs at (t0, x) differs from that one period later by more than tol (relative rms)."""
    rate = eqx.filter_jit(rhs)
    now, later = (np.asarray(ravel_pytree(rate(t, x, *args))[0]) for t in (t0, jnp.asarray(t0) + period))
    gap = relative_rms(later - now, now)
    if gap > tol:
        length = float(jnp.asarray(period))
        raise InputError(f"Argument `rhs` must repeat after the period {length:.6g}, but changes by {gap:.2e} (rms)")
