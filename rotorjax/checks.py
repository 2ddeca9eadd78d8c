"""Checks on concrete values at constructors: one line that names the argument, the rule and the value."""

import difflib
import math
from collections.abc import Iterable

import jax
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer
from jaxtyping import Array, ArrayLike

from rotorjax.errors import InputError


def refuse(name: str, rule: str, shown: str) -> InputError:
    """Make the error ``Argument `name` must rule, but is shown``, for the caller to raise."""
    return InputError(f"Argument `{name}` must {rule}, but is {shown}")


def known(*values: object) -> bool:
    """Whether values are numbers yet: traced ones (grad, vmap, jit) are not, and pass every check."""
    return not any(isinstance(leaf, Tracer) for leaf in jax.tree.leaves(values))


def array(value: ArrayLike) -> Array:
    """A floating-point array of a value; of a number a concrete one, inside of jit too, so that it can be looked at."""
    if not known(value):
        return jnp.asarray(value, float)
    with jax.ensure_compile_time_eval():
        return jnp.asarray(value, float)


def check_number(
    name: str, value: object, lowest: float = -math.inf, highest: float = math.inf, *, open_: bool = False
):
    """Return `value` if it is a finite number in [lowest, highest] (`open_`: above lowest), else raise InputError.

    A traced value has no number yet and passes, so that constructors may be differentiated through.
    """
    if not known(value):
        return value
    rule = f"be {_range_in_words(lowest, highest, open_)}"
    if isinstance(value, bool | str) or value is None or np.ndim(value) != 0:  # type: ignore[arg-type]
        raise refuse(name, rule, repr(value))
    try:
        number = float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        raise refuse(name, rule, repr(value)) from None
    if not math.isfinite(number) or not lowest <= number <= highest or (open_ and number == lowest):
        raise refuse(name, rule, f"{number:g}")
    return value


def closest(word: str, allowed: Iterable[str]) -> str:
    """`Did you mean …?` where something allowed is close, else the list of what is allowed."""
    allowed = list(allowed)
    near = difflib.get_close_matches(word, allowed, n=1)
    return f"did you mean '{near[0]}'?" if near else "it must be one of " + ", ".join(allowed)


def check_stations(name: str, stations: object, values: object, first: float, last: float):
    """Return (stations, values) as float64 numpy, or raise InputError.

    Stations must increase and cover [first, last]; both must be finite, one-dimensional and of one length.
    """
    s, v = _numbers(f"{name}.r", stations), _numbers(f"{name}.value", values)
    if s.shape != v.shape:
        raise refuse(name, f"hold as many values as stations ({s.size})", f"{v.size} values")
    bad = np.flatnonzero(np.diff(s) <= 0)
    if bad.size:
        i = int(bad[0])
        raise refuse(f"{name}.r", "increase from root to tip", f"{s[i]:g} followed by {s[i + 1]:g}")
    if s[0] > first or s[-1] < last:
        raise refuse(f"{name}.r", f"cover {first:g} to {last:g} (r/R)", f"{s[0]:g} to {s[-1]:g}")
    return s, v


def _numbers(name: str, values: object) -> np.ndarray:
    try:
        array = np.asarray(values, float)
    except (TypeError, ValueError):
        raise refuse(name, "be a list of numbers", repr(values)) from None
    if array.ndim != 1 or array.size < 2:
        raise refuse(name, "be a list of two or more numbers", repr(values))
    if not np.all(np.isfinite(array)):
        raise refuse(
            name,
            "be finite throughout",
            f"{array[~np.isfinite(array)][0]} at entry {int(np.flatnonzero(~np.isfinite(array))[0])}",
        )
    return array


def _range_in_words(lowest: float, highest: float, open_: bool) -> str:
    if math.isinf(lowest) and math.isinf(highest):
        return "a finite number"
    if math.isinf(highest):
        return f"a finite number {'above' if open_ else 'of at least'} {lowest:g}"
    return f"a number in {'(' if open_ else '['}{lowest:g}, {highest:g}]"
