"""Inflow tables for simulators: a small text file that C reads with fscanf, and a smooth interpolator of it.

Between the nodes stand cubic splines (not-a-knot; a parabola over three nodes, a line over two) along each axis, so
that derivatives are smooth and the values at the nodes are the table's own.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import xarray as xr
from jaxtyping import Array, ArrayLike, Float
from scipy.interpolate import CubicSpline

from rotorjax.checks import closest, known, number_of
from rotorjax.errors import InputError
from rotorjax.io.atomic import write_text
from rotorjax.io.reading import read_text
from rotorjax.io.terminal import spelt
from rotorjax.sweep.found import CONVERGED
from rotorjax.sweep.table import axes_of

MAGIC = "rotorjax-inflow-table 1"
COLUMNS = {"lambda_0": "lambda_0", "lambda_1c": "lambda_1c", "lambda_1s": "lambda_1s", "CT": "CT", "CQ": "CP"}
"""Of the file, and the sweep's variables that they are."""


class TableInflow(NamedTuple):
    """Induced inflow λ₀ + λ₁c r cos ψ + λ₁s r sin ψ over ΩR, positive down, C_T = T/(ρA(ΩR)²), C_Q = Q/(ρA(ΩR)²R)."""

    lambda_0: Array
    lambda_1c: Array
    lambda_1s: Array
    CT: Array
    CQ: Array


class InflowTable(eqx.Module):
    """A table over axes. names (static): of the axes. knots: of each, (n,). pieces: of each, (4, n − 1, n), cubics of
    the splines that are 1 at one knot and 0 at the others. values (n₁, n₂, …, 5). title (static).
    """

    names: tuple[str, ...] = eqx.field(static=True)
    knots: tuple[Float[Array, " n"], ...]
    pieces: tuple[Float[Array, "4 m n"], ...]
    values: Float[Array, "*n 5"]
    title: str = eqx.field(static=True, default="")

    def __call__(self, **place: ArrayLike) -> TableInflow:
        """Inflow at a place, a number for each axis by name; under jit, grad and vmap too.

        Raises InputError for an axis that is missing or unknown and a place outside of the table; under jit an error at
        run time.
        """
        self._check(place)
        weights = [
            _weights(name, jnp.asarray(place[name], self.values.dtype), *parts)
            for name, *parts in zip(self.names, self.knots, self.pieces, strict=True)
        ]
        found = self.values
        for weight in weights:
            found = jnp.tensordot(weight, found, 1)
        return TableInflow(*found)

    def _check(self, place: dict[str, Any]) -> None:
        for name in place:
            if name not in self.names:
                raise InputError(f"Argument `{name}` must be an axis of the table: {closest(name, self.names)}")
        for name, knots in zip(self.names, self.knots, strict=True):
            if name not in place:
                raise InputError(f"Argument `{name}` must be given, for it is an axis of the table, but is missing")
            if known(place[name], knots):
                value, low, high = number_of(place[name]), float(knots[0]), float(knots[-1])
                if not low <= value <= high:
                    raise InputError(f"Argument `{name}` must lie in the table, [{low:g}, {high:g}], but is {value:g}")


def _weights(name: str, x: Float[Array, ""], knots: Array, pieces: Array) -> Float[Array, " n"]:
    """What each knot's value counts at x."""
    outside = (x < knots[0]) | (x > knots[-1]) | jnp.isnan(x)
    x = eqx.error_if(x, outside, f"Argument `{name}` must lie in the table, but does not")
    k = jnp.clip(jnp.searchsorted(knots, jax.lax.stop_gradient(x), side="right") - 1, 0, len(knots) - 2)
    return jnp.polyval(pieces[:, k], x - knots[k])


def inflow_table(path: str | Path) -> InflowTable:
    """Read a table that `rotorjax sweep --table` wrote. Raises InputError for a file that is none or is damaged.

    >>> import tempfile
    >>> from pathlib import Path
    >>> text = "rotorjax-inflow-table 1 axes 1 height 3 1 2 3 values 5 lambda_0 lambda_1c lambda_1s CT CQ "
    >>> path = Path(tempfile.mkdtemp()) / "table.txt"
    >>> _ = path.write_text(text + "1 0 0 .005 .0004 2 0 0 .005 .0004 4 0 0 .005 .0004")
    >>> float(inflow_table(path)(height=2.0).lambda_0)
    2.0
    """
    lines = read_text(path).splitlines()
    words = iter(" ".join(line for line in lines if not line.startswith("#")).split())
    try:
        if " ".join((next(words), next(words))) != MAGIC:
            raise ValueError(f"it does not begin with '{MAGIC}'")
        axes = dict(_axis(words) for _ in range(_count(words, "axes")))
        names = [next(words) for _ in range(_count(words, "values"))]
        if names != list(COLUMNS):
            raise ValueError(f"its values are {' '.join(names)}")
        values = np.array([float(word) for word in words])
        shape = (*(len(knots) for knots in axes.values()), len(COLUMNS))
        if values.size != np.prod(shape) or not np.all(np.isfinite(values)):
            raise ValueError(f"it holds {values.size} finite numbers instead of {np.prod(shape)}")
    except (ValueError, StopIteration) as error:
        raise InputError(
            f"{path}: the file must be a whole inflow table, but is not: {error or 'it ends early'}"
        ) from None
    comments = [line.removeprefix("#").strip() for line in lines if line.startswith("#")]
    return _interpolator(axes, values.reshape(shape), comments[0] if comments else "")


def _count(words: Any, name: str) -> int:
    if (word := next(words)) != name:
        raise ValueError(f"'{name}' is expected where '{word[:20]}' is")
    count = int(next(words))
    if not 1 <= count <= 20:
        raise ValueError(f"{name} {count}")
    return count


def _axis(words: Any) -> tuple[str, np.ndarray]:
    name, count = next(words), int(next(words))
    knots = np.array([float(next(words)) for _ in range(count)])
    if count < 2 or not np.all(np.isfinite(knots)) or not np.all(np.diff(knots) > 0):
        raise ValueError(f"axis {name[:40]} does not increase")
    return name, knots


def _interpolator(axes: dict[str, np.ndarray], values: np.ndarray, title: str = "") -> InflowTable:
    pieces = tuple(jnp.asarray(CubicSpline(knots, np.eye(len(knots))).c) for knots in axes.values())
    return InflowTable(tuple(axes), tuple(map(jnp.asarray, axes.values())), pieces, jnp.asarray(values), title)


def tabulated(data: xr.Dataset) -> InflowTable:
    """The interpolator of a sweep's table. Raises InputError where `check_axes` does or a point has not converged."""
    check_axes({name: data[name].to_numpy() for name in axes_of(data)}, data.attrs["design"])
    if (lost := int(np.sum(data["verdict"].to_numpy() != CONVERGED))) > 0:
        raise InputError(
            f"Argument `table` must be made of points that all converged, but {lost} of {data['verdict'].size} did "
            "not: leave their rows out of the axes"
        )
    data = data.sortby(axes_of(data))
    values = np.stack([data[name].to_numpy() for name in COLUMNS.values()], axis=-1)
    axes = {name: data[name].to_numpy() for name in axes_of(data)}
    return _interpolator(axes, values, data.attrs["title"])


def check_axes(axes: dict[str, Sequence[float] | np.ndarray], kind: str) -> None:
    """Raise InputError, before the work, where a sweep's axes make no table to interpolate in."""
    if kind == "random":
        raise InputError("Argument `table` must be of a grid, but [design] kind is 'random'")
    for name, values in axes.items():
        if len(values) < 2 or not np.all(np.isfinite(values)):
            raise InputError(
                f"Argument `table` must be over axes of two or more finite values, but {name} holds "
                f"{', '.join(f'{v:g}' for v in values)}"
            )


def write_table(path: str | Path, data: xr.Dataset) -> None:
    """Write a sweep's table as text. Raises InputError as `tabulated` does, or where it cannot be written."""
    made = tabulated(data)
    about = [
        made.title,
        *(f"{name}: {data[name].attrs['long_name']}, {data[name].attrs['units']}" for name in made.names),
    ]
    lines = [
        MAGIC,
        *("# " + "".join(map(spelt, line)) for line in about),
        "# induced inflow over Omega R, down: lambda_0 + lambda_1c r cos psi + lambda_1s r sin psi, psi = 0 aft",
        "# CT = T/(rho A (Omega R)^2), CQ = Q/(rho A (Omega R)^2 R); one line a point, the last axis fastest",
        f"axes {len(made.names)}",
        *(f"{n} {len(k)} " + " ".join(map(_digits, k)) for n, k in zip(made.names, made.knots, strict=True)),
        f"values {len(COLUMNS)} {' '.join(COLUMNS)}",
        *(" ".join(map(_digits, row)) for row in np.asarray(made.values).reshape(-1, len(COLUMNS))),
    ]
    write_text(path, "\n".join(lines) + "\n")


def _digits(value: Any) -> str:
    """As few digits as tell a number from all others."""
    return repr(float(value))
