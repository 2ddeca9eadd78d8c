"""Dense Jacobians a few columns at a time, so that memory stays bounded and progress can be shown."""

from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.flatten_util import ravel_pytree
from jaxtyping import Array, Float, PyTree
from tqdm import tqdm

from rotorjax.errors import InputError
from rotorjax.ode.outcome import traceable

CHUNK = 64


@eqx.filter_jit
def _columns(
    f: Callable, unravel: Callable, x: Float[Array, " n"], args: PyTree, first: Array, width: int
) -> tuple[Float[Array, " m"], Float[Array, "width m"]]:
    """f(x), and columns first..first + width of the Jacobian, as rows; f itself is evaluated once for all."""

    def flat(v: Array) -> Array:
        return ravel_pytree(f(unravel(v), *args))[0]

    numbers = first + jnp.arange(width)
    tangents = (numbers[:, None] == jnp.arange(x.size)[None, :]).astype(x.dtype)
    return jax.vmap(lambda v: jax.jvp(flat, (x,), (v,)), out_axes=(None, 0))(tangents)


def value_and_jacobian(
    f: Callable[..., PyTree], x: PyTree, *args: Any, chunk: int = CHUNK, progress: bool = False
) -> tuple[Float[np.ndarray, " m"], Float[np.ndarray, "m n"]]:
    """f(x, *args) and its Jacobian with respect to x by forward mode, `chunk` columns at a time.

    x and the value of f are pytrees of floating-point arrays; rows and columns run over their leaves in the order of
    `jax.flatten_util.ravel_pytree`. Memory on the device is that of `chunk` evaluations; the results are numpy arrays.

    Raises InputError where `chunk` is not positive.
    """
    if chunk < 1:
        raise InputError(f"Argument `chunk` must be at least 1 column, but is {chunk}")
    flat, unravel = ravel_pytree(x)
    args = traceable(args)
    width = min(chunk, flat.size)
    starts = range(0, flat.size, width)
    value, parts = np.zeros(0), []
    for start in tqdm(starts, desc="jacobian", disable=not progress, leave=False):
        value, columns = _columns(f, unravel, flat, args, jnp.asarray(start), width)
        parts.append(np.asarray(columns))
    return np.asarray(value), np.concatenate(parts)[: flat.size].T


def dense_jacobian(
    f: Callable[..., PyTree], x: PyTree, *args: Any, chunk: int = CHUNK, progress: bool = False
) -> Float[np.ndarray, "m n"]:
    """The Jacobian alone of `value_and_jacobian`."""
    return value_and_jacobian(f, x, *args, chunk=chunk, progress=progress)[1]
