"""Histories as piecewise polynomials that a compiled march can read, with exact rates."""

from collections.abc import Mapping

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from scipy.interpolate import PchipInterpolator, PPoly

from rotorjax.checks import check_list, closest
from rotorjax.errors import InputError


class Piecewise(eqx.Module):
    """Polynomials between breaks. breaks (P,), increasing. coefficients (D, P − 1, C): highest power first."""

    breaks: Float[Array, " P"]
    coefficients: Float[Array, "D P1 C"]

    def __call__(self, t: Float[Array, ""]) -> Float[Array, " C"]:
        """Values at t; beyond the ends the last piece goes on."""
        i = jnp.clip(jnp.searchsorted(self.breaks, t, side="right") - 1, 0, self.breaks.size - 2)
        gap = t - self.breaks[i]
        total = self.coefficients[0, i]
        for row in self.coefficients[1:]:
            total = total * gap + row[i]
        return total


def piecewise(polynomial: PPoly) -> Piecewise:
    """Make one from scipy's, columns last."""
    return Piecewise(jnp.asarray(polynomial.x), jnp.asarray(polynomial.c))


def smooth(t: Float[np.ndarray, " P"], columns: Float[np.ndarray, "P C"]) -> PPoly:
    """Monotone cubics through the points (Fritsch & Carlson 1980): no overshoot, continuous slope."""
    found = PchipInterpolator(t, columns, axis=0)
    return PPoly(found.c, found.x)


def read_history(
    data: Mapping[str, object], names: tuple[str, ...], duration: float
) -> tuple[Float[np.ndarray, " P"], Float[np.ndarray, "P C"]]:
    """Times (s) and columns, in the order of `names`, of a case file's history; columns that are not there are zero.

    Raises InputError for an unknown column, times that do not start at 0, do not increase or end before `duration`, a
    column of another length or one with a gap (a value that is not a finite number).
    """
    for key in data:
        if key not in ("t", *names):
            raise InputError(f"[history] has the unknown key '{key}': {closest(key, ('t', *names))}")
    if not data:
        return np.array([0.0, duration]), np.zeros((2, len(names)))
    t = _numbers("t", data.get("t"))
    late = np.flatnonzero(np.diff(t) <= 0)
    if late.size:
        i = int(late[0])
        raise InputError(f"[history] t must increase, but {t[i]:g} is followed by {t[i + 1]:g} (entry {i + 2})")
    if t[0] != 0 or t[-1] < duration:
        raise InputError(f"[history] t must run from 0 to the duration, {duration:g} s, but runs {t[0]:g} to {t[-1]:g}")
    columns = np.zeros((t.size, len(names)))
    for k, name in enumerate(names):
        if name in data:
            columns[:, k] = _numbers(name, data[name], t.size)
    return t, columns


def _numbers(name: str, values: object, length: int | None = None) -> Float[np.ndarray, " P"]:
    found = check_list(f"history.{name}", values)
    if length is not None and found.size != length:
        raise InputError(f"[history] {name} must have as many values as t ({length}), but has {found.size}")
    return found
