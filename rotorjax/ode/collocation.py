"""Periodic orbits by Fourier collocation in time: spectral accuracy, all times solved together."""

from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jax.typing import ArrayLike
from jaxtyping import Array, PyTree

from rotorjax.errors import InputError
from rotorjax.ode.fourier import fourier_differentiation
from rotorjax.ode.newton import newton
from rotorjax.ode.orbit import Orbit, make_orbit, require_periodic
from rotorjax.ode.outcome import traceable
from rotorjax.ode.runge_kutta import Rhs
from rotorjax.ode.structure import require_like

Symmetry = Callable[[PyTree], PyTree]


def unfold(x: PyTree, symmetry: Symmetry | None, copies: int) -> PyTree:
    """States of the whole period from those of its first part, x(t + T/copies) = symmetry(x(t)), leaves (K, ...)."""
    parts = [x]
    for _ in range(copies - 1):
        assert symmetry is not None
        parts.append(jax.vmap(symmetry)(parts[-1]))
    return jax.tree.map(lambda *leaves: jnp.concatenate(leaves), *parts)


class Collocation(eqx.Module):
    """Residual dx/dt − rhs(t, x, *args) at equally spaced nodes, dx/dt from the trigonometric interpolant.

    rhs: right-hand side. symmetry, copies: x(t + T/copies) = symmetry(x(t)), so that only the first part of the period
    is unknown (identical blades: permute them), or None and 1.
    """

    rhs: Rhs
    symmetry: Symmetry | None = None
    copies: int = eqx.field(static=True, default=1)

    def __call__(self, x: PyTree, t0: Array, period: Array, *args: Any) -> PyTree:
        """Residual, shaped like x: leaves (K, ...), nodes of the first part of the period."""
        nodes = jax.tree.leaves(x)[0].shape[0]
        total = nodes * self.copies
        table = fourier_differentiation(total)[:nodes] * 2 * jnp.pi
        times = t0 + period * jnp.arange(nodes, dtype=period.dtype) / total
        slope = jax.vmap(lambda t, y: self.rhs(t, y, *args))(times, x)

        def leaf(whole: Array, right: Array) -> Array:
            return jnp.tensordot(jnp.asarray(table, whole.dtype) / period.astype(whole.dtype), whole, axes=1) - right

        return jax.tree.map(leaf, unfold(x, self.symmetry, self.copies), slope)


class FreePeriod(eqx.Module):
    """The same for an autonomous rhs, unknowns (x, T), with the phase fixed by ∫ (x − ref)·ref' dt = 0.

    The phase condition (Doedel 1981) keeps the orbit as near to the reference as a shift in time allows.
    """

    collocation: Collocation

    def __call__(self, z: tuple[PyTree, Array], t0: Array, reference: PyTree, *args: Any) -> tuple[PyTree, Array]:
        """Residual for unknowns z = (x, T)."""
        x, period = z
        residual = self.collocation(x, t0, period, *args)
        whole = self.collocation
        table = fourier_differentiation(jax.tree.leaves(x)[0].shape[0] * whole.copies)
        far, ref = (unfold(v, whole.symmetry, whole.copies) for v in (x, reference))

        def leaf(y: Array, r: Array) -> Array:
            return jnp.mean((y - r) * jnp.tensordot(jnp.asarray(table, r.dtype), r, axes=1))

        return residual, sum(jax.tree.leaves(jax.tree.map(leaf, far, ref)), start=jnp.zeros(()))


def collocate(
    rhs: Rhs,
    guess: PyTree,
    period: ArrayLike,
    *args: Any,
    t0: ArrayLike = 0.0,
    free_period: bool = False,
    symmetry: Symmetry | None = None,
    copies: int = 1,
    **newton_settings: Any,
) -> Orbit:
    """Periodic orbit of x' = rhs(t, x, *args) by Fourier collocation.

    guess: states at K equally spaced times from t0 over the first 1/copies of the period, leaves (K, ...). period: T,
    or a guess of it with free_period=True for an autonomous rhs, where the phase stays nearest to the guess. symmetry,
    copies: x(t + T/copies) = symmetry(x(t)); only that part of the period is solved for. Further settings go to
    `newton`.

    Errors fall geometrically with K where the orbit is analytic. Returns an Orbit, converged or not: look at
    `converged`.

    Raises InputError where rhs returns another structure than the state's, does not repeat after the period, or where
    `copies` is not matched by a symmetry.
    """
    require_symmetry(symmetry, copies)
    guess = jax.tree.map(jnp.asarray, guess)
    start = jax.tree.map(lambda leaf: leaf[0], guess)
    t0, period, args = jnp.asarray(t0, float), jnp.asarray(period, float), traceable(args)
    require_like(eqx.filter_eval_shape(rhs, t0, start, *args), start, "rhs(t, x, ...)")
    require_periodic(rhs, t0, start, period, *args)
    residual = Collocation(rhs, symmetry, copies)
    if free_period:
        found = newton(FreePeriod(residual), (guess, period), t0, guess, *args, **newton_settings)
        x, period = found.x
    else:
        found = newton(residual, guess, t0, period, *args, **newton_settings)
        x = found.x
    return make_orbit(t0, unfold(x, symmetry, copies), period, found)


def require_symmetry(symmetry: Symmetry | None, copies: int) -> None:
    """Raise InputError unless there is a symmetry exactly where there is more than one copy."""
    if copies < 1 or (copies > 1) != (symmetry is not None):
        raise InputError(
            f"Argument `copies` must be 1 without and at least 2 with a `symmetry`, but is {copies} with {symmetry}"
        )
