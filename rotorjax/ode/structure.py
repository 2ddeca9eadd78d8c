"""Checks that a pytree is shaped like another one, made while tracing."""

import jax
import jax.numpy as jnp
from jaxtyping import PyTree

from rotorjax.errors import InputError


def require_like(found: PyTree, wanted: PyTree, name: str, *, dtype: bool = True) -> None:
    """Raise InputError unless `found` has the structure, the leaf shapes and (by default) the dtypes of `wanted`."""
    tree, target = jax.tree.structure(found), jax.tree.structure(wanted)
    if tree != target:
        raise InputError(f"Argument `{name}` must return the state's structure {target}, but returns {tree}")
    leaves, _ = jax.tree_util.tree_flatten_with_path(wanted)
    for (path, leaf), other in zip(leaves, jax.tree.leaves(found), strict=True):
        where = jax.tree_util.keystr(path) or "the state"
        if jnp.shape(leaf) != jnp.shape(other):
            raise InputError(
                f"Argument `{name}` must return shape {jnp.shape(leaf)} at {where}, but {jnp.shape(other)}"
            )
        kind, other_kind = jnp.result_type(leaf), jnp.result_type(other)
        if dtype and kind != other_kind:
            raise InputError(f"Argument `{name}` must return {kind} at {where}, but returns {other_kind}: cast it")
