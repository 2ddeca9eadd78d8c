"""Fixed-step trajectories under lax.scan, plain or checkpointed for long reverse passes."""

import math
from collections.abc import Callable
from functools import partial
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jax.typing import ArrayLike
from jaxtyping import Array, Float, PyTree
from tqdm import tqdm

from rotorjax.errors import InputError
from rotorjax.ode.outcome import traceable
from rotorjax.ode.runge_kutta import RK5, ButcherTableau, Rhs, step

Scan = Callable[..., tuple[PyTree, PyTree]]


class Trajectory(eqx.Module):
    """States along a march, the start included.

    t: times (S + 1,). x: states, every leaf with a leading axis of S + 1. why: how a watched march ended.
    """

    t: Float[Array, " S+1"]
    x: PyTree
    finished: bool = eqx.field(static=True, default=True)
    why: str = eqx.field(static=True, default="")

    @property
    def last(self) -> PyTree:
        """State at the end of the march."""
        return jax.tree.map(lambda leaf: leaf[-1], self.x)


def _factor(length: int) -> int:
    """Largest divisor of length not above its root: the outer blocks of a two-level scan."""
    return next(n for n in range(math.isqrt(length), 0, -1) if length % n == 0)


def checkpointed_scan(f: Callable, init: PyTree, xs: PyTree = None, length: int | None = None) -> tuple[PyTree, PyTree]:
    """`jax.lax.scan` whose reverse pass keeps about √length states and computes the rest again.

    Same signature, results and derivatives as `jax.lax.scan(f, init, xs, length)`. The length is split into
    outer × inner with the divisor nearest below its root, so a prime length saves nothing.
    """
    if length is None:
        length = jnp.shape(jax.tree.leaves(xs)[0])[0]
    if length == 0:
        return jax.lax.scan(f, init, xs, length)
    outer = _factor(length)
    inner = length // outer
    blocks = jax.tree.map(lambda v: v.reshape(outer, inner, *v.shape[1:]), xs)

    # prevent_cse is not needed inside a scan and costs speed there (jax.checkpoint's documentation).
    @partial(jax.checkpoint, prevent_cse=False)
    def block(carry: PyTree, part: PyTree) -> tuple[PyTree, PyTree]:
        return jax.lax.scan(f, carry, part, inner)

    last, ys = jax.lax.scan(block, init, blocks, outer)
    return last, jax.tree.map(lambda v: v.reshape(length, *v.shape[2:]), ys)


def _require_steps(steps: int, save_every: int) -> None:
    if save_every < 1 or steps < 1 or steps % save_every:
        raise InputError(
            f"Argument `steps` must be a positive multiple of `save_every` = {save_every}, but is {steps}: "
            f"try {max(1, round(steps / max(save_every, 1))) * max(save_every, 1)}"
        )


def integrate(
    rhs: Rhs,
    x0: PyTree,
    t0: ArrayLike,
    dt: ArrayLike,
    steps: int,
    *args: Any,
    save_every: int = 1,
    tableau: ButcherTableau = RK5,
    scan: Scan = jax.lax.scan,
) -> Trajectory:
    """March x' = rhs(t, x, *args) from (t0, x0) over `steps` steps of dt and keep every `save_every`-th state.

    x0: pytree of arrays of any shapes. Differentiable in forward and reverse mode with respect to x0, t0, dt and args;
    scan=checkpointed_scan (or `integrate_checkpointed`) gives the same numbers with less memory in reverse.

    Raises InputError where `steps` is not a positive multiple of `save_every`, or `rhs` returns another shape than the
    state's.
    """
    _require_steps(steps, save_every)
    x0 = jax.tree.map(jnp.asarray, x0)
    time = jnp.result_type(t0, dt, float)
    t0, dt = jnp.asarray(t0, time), jnp.asarray(dt, time)

    def one(x: PyTree, i: Array) -> tuple[PyTree, None]:
        # t0 + i dt and not a running sum: no rounding piles up over many revolutions.
        return step(rhs, t0 + i.astype(time) * dt, x, dt, *args, tableau=tableau), None

    def stretch(x: PyTree, numbers: Array) -> tuple[PyTree, PyTree]:
        x, _ = scan(one, x, numbers)
        return x, x

    numbers = jnp.arange(steps).reshape(-1, save_every)
    _, xs = scan(stretch, x0, numbers)
    t = t0 + dt * jnp.arange(0, steps + 1, save_every, dtype=time)
    return Trajectory(t, jax.tree.map(lambda first, rest: jnp.concatenate([first[None], rest]), x0, xs))


def integrate_checkpointed(
    rhs: Rhs,
    x0: PyTree,
    t0: ArrayLike,
    dt: ArrayLike,
    steps: int,
    *args: Any,
    save_every: int = 1,
    tableau: ButcherTableau = RK5,
) -> Trajectory:
    """`integrate`, with a reverse pass that keeps about √steps states and computes the others again."""
    return integrate(rhs, x0, t0, dt, steps, *args, save_every=save_every, tableau=tableau, scan=checkpointed_scan)


@eqx.filter_jit
def _stretch(
    rhs: Rhs, x: PyTree, first: Array, t0: Array, dt: Array, steps: int, args: tuple, tableau: ButcherTableau
) -> PyTree:
    def one(x: PyTree, i: Array) -> tuple[PyTree, None]:
        return step(rhs, t0 + (first + i).astype(t0.dtype) * dt, x, dt, *args, tableau=tableau), None

    return jax.lax.scan(one, x, jnp.arange(steps))[0]


def march(
    rhs: Rhs,
    x0: PyTree,
    t0: ArrayLike,
    dt: ArrayLike,
    steps: int,
    *args: Any,
    save_every: int = 1,
    tableau: ButcherTableau = RK5,
    progress: bool = True,
) -> Trajectory:
    """`integrate` watched from the host: a progress bar, and an early end that keeps what there is.

    Ends with `finished` False and a reason in `why` where the state is no longer finite (the last finite states are
    kept) or at a keyboard interrupt. Not differentiable: use `integrate` for that.

    Raises InputError as `integrate` does.
    """
    _require_steps(steps, save_every)
    time = jnp.result_type(t0, dt, float)
    start, interval, args = jnp.asarray(t0, time), jnp.asarray(dt, time), traceable(args)
    x = jax.tree.map(jnp.asarray, x0)
    states, why = [x], ""
    try:
        for first in tqdm(range(0, steps, save_every), desc="march", disable=not progress):
            x = _stretch(rhs, x, jnp.asarray(first), start, interval, save_every, args, tableau)
            if not all(bool(jnp.all(jnp.isfinite(leaf))) for leaf in jax.tree.leaves(x)):
                why = f"not finite between steps {first} and {first + save_every}: the last finite states are kept"
                break
            states.append(x)
    except KeyboardInterrupt:
        why = f"interrupted after step {(len(states) - 1) * save_every}"
    t = start + interval * save_every * jnp.arange(len(states), dtype=time)
    return Trajectory(t, jax.tree.map(lambda *leaves: jnp.stack(leaves), *states), not why, why or "finished")
