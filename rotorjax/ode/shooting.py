"""Periodic orbits by shooting: the state that a march over one period brings back to itself."""

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jax.flatten_util import ravel_pytree
from jax.typing import ArrayLike
from jaxtyping import Array, PyTree

from rotorjax.ode.collocation import Symmetry, require_symmetry, unfold
from rotorjax.ode.newton import newton
from rotorjax.ode.orbit import Orbit, make_orbit, require_periodic
from rotorjax.ode.outcome import traceable
from rotorjax.ode.runge_kutta import RK5, ButcherTableau, Rhs
from rotorjax.ode.structure import require_like
from rotorjax.ode.trajectory import integrate


class Shooting(eqx.Module):
    """Residual x(t0 + T/copies) − symmetry(x0) of a march of `steps` steps from x0 at t0."""

    rhs: Rhs
    steps: int = eqx.field(static=True)
    symmetry: Symmetry | None = None
    copies: int = eqx.field(static=True, default=1)
    tableau: ButcherTableau = eqx.field(static=True, default=RK5)

    def march(self, x: PyTree, t0: Array, period: Array, *args: Any, save_every: int = 1) -> PyTree:
        """States of the march, leaves (steps / save_every + 1, ...)."""
        dt = period / (self.copies * self.steps)
        return integrate(self.rhs, x, t0, dt, self.steps, *args, save_every=save_every, tableau=self.tableau).x

    def flow(self, x: PyTree, t0: Array, period: Array, *args: Any) -> PyTree:
        """State at the end of the march."""
        return jax.tree.map(lambda leaf: leaf[-1], self.march(x, t0, period, *args, save_every=self.steps))

    def __call__(self, x: PyTree, t0: Array, period: Array, *args: Any) -> PyTree:
        """Residual, shaped like x."""
        image = x if self.symmetry is None else self.symmetry(x)
        return jax.tree.map(jnp.subtract, self.flow(x, t0, period, *args), image)


class FreeShooting(eqx.Module):
    """The same for an autonomous rhs, unknowns (x, T), the start kept on the plane across the flow at a reference."""

    shooting: Shooting

    def __call__(self, z: tuple[PyTree, Array], t0: Array, reference: PyTree, *args: Any) -> tuple[PyTree, Array]:
        """Residual for unknowns z = (x, T)."""
        x, period = z
        along = ravel_pytree(self.shooting.rhs(t0, reference, *args))[0]
        off = ravel_pytree(jax.tree.map(jnp.subtract, x, reference))[0]
        return self.shooting(x, t0, period, *args), jnp.mean(along * off)


def shoot(
    rhs: Rhs,
    guess: PyTree,
    period: ArrayLike,
    steps: int,
    *args: Any,
    t0: ArrayLike = 0.0,
    free_period: bool = False,
    symmetry: Symmetry | None = None,
    copies: int = 1,
    tableau: ButcherTableau = RK5,
    **newton_settings: Any,
) -> Orbit:
    """Periodic orbit of x' = rhs(t, x, *args) by shooting over T/copies in `steps` Runge-Kutta steps.

    guess: state at t0. period: T, or a guess of it with free_period=True for an autonomous rhs. symmetry, copies: as in
    `collocate`. Further settings go to `newton`. The orbit holds the states after every step of the whole period; its
    accuracy is that of the march (fifth order with the default tableau), whatever the residual says.

    Raises InputError as `collocate` does.
    """
    require_symmetry(symmetry, copies)
    guess = jax.tree.map(jnp.asarray, guess)
    t0, period, args = jnp.asarray(t0, float), jnp.asarray(period, float), traceable(args)
    require_like(eqx.filter_eval_shape(rhs, t0, guess, *args), guess, "rhs(t, x, ...)")
    require_periodic(rhs, t0, guess, period, *args)
    residual = Shooting(rhs, steps, symmetry, copies, tableau)
    if free_period:
        found = newton(FreeShooting(residual), (guess, period), t0, guess, *args, **newton_settings)
        x, period = found.x
    else:
        found = newton(residual, guess, t0, period, *args, **newton_settings)
        x = found.x
    states = eqx.filter_jit(Shooting.march)(residual, x, t0, jnp.asarray(period), *args)
    states = jax.tree.map(lambda leaf: leaf[:-1], states)
    return make_orbit(t0, unfold(states, symmetry, copies), period, found)
