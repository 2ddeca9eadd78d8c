"""Names for the numbers in a pytree, and choosing among them."""

import difflib
from collections.abc import Mapping, Sequence

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Int, PyTree

from rotorjax.errors import InputError

NO_UNIT = "-"


def labels(tree: PyTree, root: str) -> tuple[str, ...]:
    """One name a number, in the order of `jax.flatten_util.ravel_pytree`: `a`, `a.b`, `a[0]`, `a[0,2]`.

    root: name of a tree that is one bare array.
    """
    names = []
    for path, leaf in jax.tree_util.tree_flatten_with_path(tree)[0]:
        base = jax.tree_util.keystr(path, simple=True, separator=".") or root
        shape = jnp.shape(leaf)
        names += [f"{base}[{','.join(map(str, i))}]" if shape else base for i in np.ndindex(*shape)]
    return tuple(names)


def _belongs(name: str, group: str) -> bool:
    return name == group or name.startswith((f"{group}[", f"{group}."))


def select(available: Sequence[str], wanted: Sequence[str] | None, what: str) -> Int[np.ndarray, " k"]:
    """Numbers of the wanted names, in the order wanted; a name without its index stands for all of its elements.

    what: argument name for the message. None means all.

    Raises InputError for a name that is not there, naming those that are.
    """
    if wanted is None:
        return np.arange(len(available))
    chosen = []
    for name in [wanted] if isinstance(wanted, str) else wanted:
        found = [i for i, label in enumerate(available) if _belongs(label, name)]
        if not found:
            near = difflib.get_close_matches(name, available, 3) or available[:12]
            more = "" if len(near) < len(available) and len(near) == 3 else f" of {len(available)} in all"
            raise InputError(
                f"Argument `{what}` must name what the model has, but has {name!r}: try {', '.join(near)}{more}"
            )
        chosen += found
    return np.array(chosen, int)


def units_of(names: Sequence[str], units: Mapping[str, str] | None) -> tuple[str, ...]:
    """Unit of each name: its own entry, or that of the group it belongs to, or "-"."""
    given = units or {}

    def unit(name: str) -> str:
        groups = [group for group in given if _belongs(name, group)]
        return given[max(groups, key=len)] if groups else NO_UNIT

    return tuple(unit(name) for name in names)
