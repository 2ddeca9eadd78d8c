"""Jacobians forward and in reverse from one linearisation, so that one program is traced and compiled for the two."""

import jax
import jax.numpy as jnp


def both_ways(f):
    """x (n,) ↦ (forward (m, n), reverse (m, n)) of f: the linear map along each coordinate, and its transpose."""

    @jax.jit
    def jacobians(x):
        value, linear = jax.linearize(f, x)
        back = jax.linear_transpose(linear, x)
        return jax.vmap(linear, out_axes=-1)(jnp.eye(x.size)), jax.vmap(lambda u: back(u)[0])(jnp.eye(value.size))

    return jacobians
