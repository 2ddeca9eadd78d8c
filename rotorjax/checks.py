"""Checks on concrete values at constructors: one line that names the argument, the rule and the value.

A traced value (under jit, grad, vmap) has no number yet: `known` says so, and every check lets it pass, so that
constructors may be differentiated through.
"""

import difflib
import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer
from jaxtyping import Array, ArrayLike

from rotorjax.errors import ArgumentError, InputError

_LONGEST = 60  # characters of a value in a message


@dataclass(frozen=True)
class Range:
    """What a quantity may be: from low to high (`above`: low itself excluded) in a unit; hint: what is often meant."""

    low: float = -math.inf
    high: float = math.inf
    unit: str = ""
    above: bool = False
    hint: str = ""

    def __contains__(self, number: float) -> bool:
        """Whether a number lies in the range."""
        return math.isfinite(number) and self.low <= number <= self.high and not (self.above and number == self.low)

    def __str__(self) -> str:
        """The range in words."""
        unit = f" {self.unit}" if self.unit else ""
        if math.isinf(self.low) and math.isinf(self.high):
            return "a finite number" + (f" ({self.unit})" if self.unit else "")
        if math.isinf(self.high):
            return f"a finite number {'above' if self.above else 'of at least'} {self.low:g}{unit}"
        return f"a number in {'(' if self.above else '['}{self.low:g}, {self.high:g}]{unit}"


def known(*values: Any) -> bool:
    """Whether everything in some values has a number yet; a traced array has none."""
    return not any(isinstance(leaf, Tracer) for leaf in jax.tree.leaves(values))


def array(value: ArrayLike) -> Array:
    """A floating-point array of a value; of a number a concrete one, inside of jit too, so that it can be looked at."""
    if not known(value):
        return jnp.asarray(value, float)
    with jax.ensure_compile_time_eval():
        return jnp.asarray(value, float)


def shown(value: object) -> str:
    """A value as a message shows it: in one line, a long one cut short."""
    try:
        text = " ".join(repr(value).split())
    except (ValueError, RecursionError):  # an integer of more digits than Python prints, a nest of lists
        return f"a very long {type(value).__name__}"
    return text if len(text) <= _LONGEST else f"{text[: _LONGEST - 20]}… ({len(text)} characters)"


def closest(word: str, allowed: Iterable[str]) -> str:
    """`Did you mean …?` where something allowed is close, else the list of what is allowed."""
    return _meant(word, allowed := list(allowed)) or "it must be one of " + ", ".join(allowed)


def _meant(word: str, allowed: list[str]) -> str:
    near = difflib.get_close_matches(word[:100], allowed, n=1)
    return f"did you mean '{near[0]}'?" if near else ""


def refuse_choice(name: str, found: object, allowed: Iterable[str]) -> InputError:
    """The error for a word that is none of those allowed, for the caller to raise."""
    meant = _meant(str(found), allowed := list(allowed))
    return refuse(name, f"be one of {', '.join(allowed)}", shown(found) + (meant and f": {meant}"))


def refuse(name: str, rule: str, found: str) -> InputError:
    """Make the error ``Argument `name` must rule, but is found``, for the caller to raise."""
    return ArgumentError(name, rule, found)


def number_of(value: object) -> float:
    """A value as a float, NaN where it is no number: a truth value, text, a list, an integer beyond all floats."""
    if isinstance(value, bool | np.bool_ | str | bytes) or value is None:
        return math.nan
    try:
        return float(value) if np.ndim(value) == 0 else math.nan  # type: ignore[arg-type]
    except (TypeError, ValueError, OverflowError):
        return math.nan


def check_range(name: str, value: Any, allowed: Range) -> Any:
    """Return `value` if it is a number in the range or traced, else raise InputError."""
    if known(value) and number_of(value) not in allowed:
        number = number_of(value)
        found = shown(value) if math.isnan(number) and not isinstance(value, float) else f"{number:g}"
        hint = f": {allowed.hint}" if allowed.hint and abs(number) < math.inf and number != allowed.low else ""
        raise refuse(name, f"be {allowed}", found + hint)
    return value


def check_number(
    name: str, value: Any, lowest: float = -math.inf, highest: float = math.inf, *, open_: bool = False
) -> Any:
    """Return `value` if it is a finite number in [lowest, highest] (`open_`: above lowest), else raise InputError.

    A traced value passes.
    """
    return check_range(name, value, Range(lowest, highest, above=open_))


def check_whole(name: str, value: Any, lowest: int, highest: int) -> int:
    """Return `value` if it is a whole number from lowest to highest, else raise InputError."""
    if isinstance(value, bool) or not isinstance(value, int | np.integer) or not lowest <= value <= highest:
        raise refuse(name, f"be a whole number from {lowest} to {highest}", shown(value))
    return int(value)


def check_stations(name: str, stations: Any, values: Any, first: float, last: float) -> tuple[Any, Any]:
    """Return (stations, values), as float64 numpy where they are known, or raise InputError.

    Stations must increase and cover [first, last]; both must be finite, one-dimensional and of one length. Traced
    stations or values pass; their shapes are checked all the same.
    """
    s, v = check_list(f"{name}.r", stations), check_list(f"{name}.value", values)
    if s.shape != v.shape:
        raise refuse(name, f"hold as many values as stations ({s.size})", f"{v.size} values")
    if not known(s):
        return s, v
    bad = np.flatnonzero(np.diff(s) <= 0)
    if bad.size:
        i = int(bad[0])
        raise refuse(f"{name}.r", "increase from root to tip", f"{s[i]:g} followed by {s[i + 1]:g}")
    if known(first, last) and (s[0] > first or s[-1] < last):
        raise refuse(f"{name}.r", f"cover {first:g} to {last:g} (r/R)", f"{s[0]:g} to {s[-1]:g}")
    return s, v


def check_list(name: str, values: Any, allowed: Range | None = None, least: int = 2) -> Any:
    """Return a list of numbers as float64 numpy, or a traced vector as it is; raise InputError for anything else."""
    if not known(values):
        array = jax.numpy.asarray(values)
    else:
        try:
            array = np.asarray(values, float)
        except (TypeError, ValueError, OverflowError, RecursionError):
            raise refuse(name, "be a list of numbers", shown(values)) from None
    if array.ndim != 1 or array.size < least or _has_truth(values):
        more = "two or more" if least == 2 else f"{least} or more"
        raise refuse(name, f"be a list of {more} numbers", shown(values))
    if known(array):
        bad = np.flatnonzero([number not in (allowed or Range()) for number in array])
        if bad.size:
            raise refuse(name, f"be {allowed or Range()} throughout", f"{array[bad[0]]:g} at entry {bad[0] + 1}")
    return array


def _has_truth(values: Any) -> bool:
    return isinstance(values, list | tuple) and any(isinstance(v, bool | str) for v in values)
