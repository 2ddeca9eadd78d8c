"""Rotors of several kinds in arrays of one shape."""

from collections.abc import Sequence
from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np

from rotorjax.checks import known, refuse, shown
from rotorjax.rotor.geometry import Rotor, Table


def alike(rotor: Rotor | Sequence[Rotor], count: int) -> tuple[Rotor, ...]:
    """One rotor for each of `count`, whose arrays can be stacked: blade tables that are not as long are read at the
    stations of all.

    Raises InputError for what are no rotors or not so many, and where they differ in their number of blades, in radius
    or in the size of their airfoil tables.

    >>> import rotorjax as rj
    >>> two = rj.rotor("knight_hefner_2")[0]
    >>> [len(kind.chord.stations) for kind in alike([two, two], 2)]
    [2, 2]
    """
    given = [rotor] * count if isinstance(rotor, Rotor) else rotor
    kinds = tuple(given) if isinstance(given, Sequence) else ()
    if not kinds or len(kinds) != count or not all(isinstance(kind, Rotor) for kind in kinds):
        raise refuse("rotor", f"be one rotor, the kind that all are of, or {count} of them", shown(rotor))
    first = kinds[0]
    if all(kind is first for kind in kinds):
        return kinds
    for what, of in _MUST_AGREE.items():
        found = [value for kind in kinds if (value := of(kind)) is not None]
        if any(value != found[0] for value in found):
            raise refuse("rotor", f"have one {what} for all", " and ".join(dict.fromkeys(map(str, found))))
    name = " and ".join(dict.fromkeys(kind.name for kind in kinds))
    tables = {
        table: np.unique(np.concatenate([np.asarray(getattr(kind, table).stations) for kind in kinds]))
        for table in ("chord", "twist", "sweep")
        if len({len(getattr(kind, table).stations) for kind in kinds}) > 1
    }
    return tuple(
        replace(
            kind,
            name=name,
            hinge=None,
            rotation=first.rotation,
            **{table: _at(getattr(kind, table), stations) for table, stations in tables.items()},
        )
        for kind in kinds
    )


def _at(table: Table, stations: np.ndarray) -> Table:
    """The same straight lines with more stations."""
    return Table(jnp.asarray(stations), table(jnp.asarray(stations)))


_MUST_AGREE = {
    "number of blades": lambda rotor: rotor.blades,
    "radius": lambda rotor: float(rotor.radius) if known(rotor.radius) else None,
    "size of airfoil table": lambda rotor: [jnp.shape(leaf) for leaf in jax.tree.leaves(rotor.airfoil)],
}
