"""Gradient descent on the mean square of a residual with optax, in blocks that can be watched."""

import time
from collections.abc import Callable
from typing import Any, Literal

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import optax
from jaxtyping import Array, Float

BLOCKS = 20  # of a whole run; the history is kept for every step all the same
_ADAM_STEP = 0.1
_FLAT = 1e-12  # norm of the gradient of the mean square, over its value at the start, where L-BFGS stops

Method = Literal["lbfgs", "adam"]


def descend(
    unknown: Callable[[Array, Any], Array],
    data: Any,
    z: Float[Array, " P"],
    method: Method,
    max_steps: int,
    progress: Callable[[int, float], None] | None,
) -> tuple[Float[Array, " P"], list[float], float]:
    """Minimise the mean square of unknown(z, data) from z.

    Adam steps along a cosine schedule that ends at zero. L-BFGS (memory 10) searches along each line by Wolfe's rule.
    Returns the best z met, the rms after every step, and the time in s before the first block of steps was done.
    """
    begun, compiled, history = time.perf_counter(), 0.0, []
    scale = jnp.mean(unknown(z, data) ** 2)
    scale = jnp.where(scale > 0, scale, 1.0)
    size = max(1, max_steps // BLOCKS)
    carry: Any = (z, _solver(method, max_steps).init(z), (jnp.asarray(jnp.inf), z))
    carry = jax.tree.map(lambda x: jnp.asarray(x, x.dtype), carry)  # weak types, which no step returns: compiled twice
    for done in range(size, max_steps + 1, size):
        carry, values, slopes = _block(unknown, data, carry, scale, method, max_steps, size)
        history += np.sqrt(np.asarray(values) * float(scale)).tolist()
        if done == size:
            compiled = time.perf_counter() - begun
        if progress is not None:
            progress(done, history[-1])
        if method == "lbfgs" and (float(slopes[-1]) < _FLAT or not np.isfinite(history[-1])):
            break
    last = float(jnp.mean(unknown(carry[0], data) ** 2) / scale)
    return (carry[0] if last < float(carry[2][0]) else carry[2][1]), history, compiled


def _solver(method: Method, max_steps: int) -> Any:
    return optax.lbfgs() if method == "lbfgs" else optax.adam(optax.cosine_decay_schedule(_ADAM_STEP, max_steps))


@eqx.filter_jit
def _block(unknown, data, carry, scale, method: Method, max_steps: int, size: int):
    """`size` steps from (z, state, (least value met, z there)); also the values and gradient norms before each."""
    solver = _solver(method, max_steps)

    def loss(z):
        return jnp.mean(unknown(z, data) ** 2) / scale

    def step(carry, _):
        z, state, best = carry
        if method == "lbfgs":
            value, slope = optax.value_and_grad_from_state(loss)(z, state=state)
            change, state = solver.update(slope, state, z, value=value, grad=slope, value_fn=loss)
        else:
            value, slope = jax.value_and_grad(loss)(z)
            change, state = solver.update(slope, state, z)
        best = jax.tree.map(lambda new, old: jnp.where(value < best[0], new, old), (value, z), best)
        return (optax.apply_updates(z, change), state, best), (value, optax.tree.norm(slope))

    carry, (values, slopes) = jax.lax.scan(step, carry, None, length=size)
    return carry, values, slopes
