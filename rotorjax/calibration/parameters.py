"""Bounded parameters with names: a smooth map between their ranges and all real numbers.

A fit moves unbounded coordinates z; the value is lower + (upper − lower) σ(z) with the logistic σ, so no step can leave
the range and no bound needs a special case. A value that ends at a bound shows as z running away (`at_bound`).
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from math import isfinite

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float
from scipy.special import expit

from rotorjax.errors import InputError

AT_BOUND = 1e-3  # of the range: a fit that ends closer to a bound is held by it


@dataclass(frozen=True)
class Parameter:
    """One parameter. lower, upper: its open range; printed: its value in the published model; meaning: for readers."""

    name: str
    lower: float
    upper: float
    printed: float
    meaning: str


@dataclass(frozen=True)
class ParameterSet:
    """P parameters in order. Values are arrays (P,) in that order."""

    name: str
    parameters: tuple[Parameter, ...]

    def __post_init__(self) -> None:
        """Raise InputError where the set is empty, a name repeats, or a range is empty."""
        if not self.parameters:
            raise InputError("Argument `parameters` must hold at least one parameter, but is empty")
        if len(set(self.names)) < len(self.names):
            raise InputError(f"Argument `parameters` must not repeat a name, but holds {', '.join(self.names)}")
        for p in self.parameters:
            if not (isfinite(p.lower) and isfinite(p.upper) and p.lower < p.upper):
                raise InputError(f"Argument `{p.name}` must have lower < upper, but has ({p.lower}, {p.upper})")

    def __len__(self) -> int:
        """Return P."""
        return len(self.parameters)

    @property
    def names(self) -> tuple[str, ...]:
        """The names in order."""
        return tuple(p.name for p in self.parameters)

    @property
    def lower(self) -> np.ndarray:
        """Lower bounds, (P,)."""
        return np.array([p.lower for p in self.parameters])

    @property
    def upper(self) -> np.ndarray:
        """Upper bounds, (P,)."""
        return np.array([p.upper for p in self.parameters])

    @property
    def printed(self) -> np.ndarray:
        """Values of the published model, (P,)."""
        return np.array([p.printed for p in self.parameters])

    def subset(self, names: Iterable[str]) -> "ParameterSet":
        """The parameters of these names, in the order of this set. Raises InputError where a name is unknown."""
        names = tuple(names)
        if unknown := [n for n in names if n not in self.names]:
            raise InputError(f"Argument `parameters` must be among {', '.join(self.names)}, but holds {unknown[0]!r}")
        return ParameterSet(self.name, tuple(p for p in self.parameters if p.name in names))

    def bounded(self, z: Float[Array | np.ndarray, "*N P"]) -> Float[Array, "*N P"]:
        """Values of unbounded coordinates."""
        return jnp.asarray(self.lower) + (self.upper - self.lower) * jax.nn.sigmoid(z)

    def unbounded(self, values: Float[np.ndarray, "*N P"]) -> Float[np.ndarray, "*N P"]:
        """Coordinates of values inside the range; the inverse of `bounded`."""
        share = (np.asarray(values) - self.lower) / (self.upper - self.lower)
        return np.log(share) - np.log1p(-share)

    def slopes(self, z: Float[np.ndarray, "*N P"]) -> Float[np.ndarray, "*N P"]:
        """Derivative of `bounded`, value by value."""
        return (self.upper - self.lower) * expit(z) * expit(-z)

    def check(self, values: ArrayLike, name: str = "start") -> Float[np.ndarray, "*N P"]:
        """Return values as an array. Raises InputError where one is not finite, not inside its range, or missing."""
        array = np.asarray(values, float)
        if array.ndim == 0 or array.shape[-1] != len(self):
            raise InputError(
                f"Argument `{name}` must hold {len(self)} values ({', '.join(self.names)}), but has shape {array.shape}"
            )
        for i, p in enumerate(self.parameters):
            column = array[..., i]
            if bad := [v for v in column.ravel() if not (isfinite(v) and p.lower < v < p.upper)]:
                raise InputError(f"Argument `{p.name}` must lie inside ({p.lower:g}, {p.upper:g}), but is {bad[0]:g}")
        return array

    def at_bound(self, values: Float[Array, " P"] | np.ndarray) -> tuple[str, ...]:
        """Names of the parameters within AT_BOUND of their range from a bound."""
        share = (np.asarray(values) - self.lower) / (self.upper - self.lower)
        held = (share < AT_BOUND) | (share > 1 - AT_BOUND)
        return tuple(n for n, h in zip(self.names, held, strict=True) if h)

    def table(self, values: Float[Array, " P"] | np.ndarray) -> dict[str, float]:
        """Values by name, as plain numbers."""
        return {n: float(v) for n, v in zip(self.names, np.asarray(values), strict=True)}

    def complete(
        self, values: Float[Array, " F"], free: tuple[str, ...], fixed: Float[Array, " P"]
    ) -> Float[Array, " P"]:
        """All P values, those named in `free` from `values` in the order of `free`, the others from `fixed`."""
        rows = [values[free.index(n)] if n in free else fixed[i] for i, n in enumerate(self.names)]
        return jnp.stack(rows)

    def vector(self, table: Mapping[str, float]) -> Float[Array, " P"]:
        """Values in order from a table by name, the printed one where a name is missing."""
        return jnp.asarray([float(table.get(p.name, p.printed)) for p in self.parameters])
