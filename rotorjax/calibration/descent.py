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


def descend(
    unknown: Callable[[Array, Any], Array],
    data: Any,
    z: Float[Array, " P"],
    method: Literal["lbfgs", "adam"],
    max_steps: int,
    progress: Callable[[int, float], None] | None,
) -> tuple[Float[Array, " P"], list[float], float]:
    """Minimise the mean square of unknown(z, data) from z.

    Adam steps along a cosine schedule that ends at zero. L-BFGS (memory 10) searches along each line by Wolfe's rule.
    Returns the best z met, the rms after every step, and the compile time in s.
    """

    def loss(z):
        return jnp.mean(unknown(z, data) ** 2)

    scale = float(loss(z)) or 1.0
    solver = optax.lbfgs() if method == "lbfgs" else optax.adam(optax.cosine_decay_schedule(_ADAM_STEP, max_steps))

    def step(carry, _):
        z, state, best = carry
        if method == "lbfgs":
            value, slope = optax.value_and_grad_from_state(scaled)(z, state=state)
        else:
            value, slope = jax.value_and_grad(scaled)(z)
        best = jax.tree.map(lambda new, old: jnp.where(value < best[0], new, old), (value, z), best)
        extra = {"value": value, "grad": slope, "value_fn": scaled} if method == "lbfgs" else {}
        change, state = solver.update(slope, state, z, **extra)
        return (optax.apply_updates(z, change), state, best), (value, optax.tree.norm(slope))

    def scaled(z):
        return loss(z) / scale

    size = max(1, max_steps // BLOCKS)
    block = eqx.filter_jit(lambda carry: jax.lax.scan(step, carry, None, length=size))
    carry = (z, solver.init(z), (jnp.asarray(jnp.inf), z))
    begun = time.perf_counter()
    lowered = block.lower(carry).compile()
    compiled, history = time.perf_counter() - begun, []
    for done in range(size, max_steps + 1, size):
        carry, (values, slopes) = lowered(carry)
        history += np.sqrt(np.asarray(values) * scale).tolist()
        if progress is not None:
            progress(done, history[-1])
        if method == "lbfgs" and (float(slopes[-1]) < _FLAT or not np.isfinite(history[-1])):
            break
    last = float(scaled(carry[0]))
    return (carry[0] if last < float(carry[2][0]) else carry[2][1]), history, compiled
