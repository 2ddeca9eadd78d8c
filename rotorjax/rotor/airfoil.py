"""Lift and drag of an aerofoil section, for every angle of attack and Mach number, with continuous derivatives.

The table is a bicubic Hermite surface through the data: exact at every node, C1 in angle and Mach number everywhere,
periodic at ±180°, constant beyond the first and last Mach number. The slopes at the nodes are those of Fritsch &
Carlson's monotone interpolant (scipy's PCHIP, doi:10.1137/0717021), chosen because a table of a stalled section has
steps that an ordinary spline would overshoot, to a negative drag, say. They are computed once in float64 numpy;
derivatives with respect to the table's values hold them fixed.

A low-speed table may ask for the Prandtl-Glauert rule: cl/√(1 − M²) where the flow is attached (|α| up to 6°), fading
out by 14°, where the lift is set by separation, which the rule knows nothing of. The drag is left as it is: without a
measured drag rise the result is to be trusted below the critical Mach number only.
"""

from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from scipy.interpolate import PchipInterpolator

from rotorjax.checks import check_number
from rotorjax.errors import InputError

# The rule is used as it stands to M = 0.7; above, its Mach number levels off towards 0.85 so that it stays finite
# through M = 1.
_GLAUERT_EXACT, _GLAUERT_RANGE = 0.7, 0.15
_ATTACHED, _SEPARATED = np.deg2rad(6.0), np.deg2rad(14.0)


class AirfoilTable(eqx.Module):
    """Section lift and drag over angle of attack and Mach number.

    alpha: rad, from −π to π, [N]. mach: [C], at least two. nodes: [N, C, 2, 2, 2]: at each node, of (cl, cd), the value
    and its derivatives in α (index 1 of the fourth axis) and in M (index 1 of the fifth). name, prandtl_glauert:
    static.
    """

    name: str = eqx.field(static=True)
    prandtl_glauert: bool = eqx.field(static=True)
    alpha: Float[Array, " N"]
    mach: Float[Array, " C"]
    nodes: Float[Array, "N C 2 2 2"]

    @property
    def cl(self) -> Float[Array, "N C"]:
        """Lift coefficients at the nodes, without the Prandtl-Glauert rule."""
        return self.nodes[:, :, 0, 0, 0]

    @property
    def cd(self) -> Float[Array, "N C"]:
        """Drag coefficients at the nodes."""
        return self.nodes[:, :, 1, 0, 0]


def lift_drag(
    table: AirfoilTable, alpha: Float[Array, "*n"], mach: Float[Array, "*#n"]
) -> tuple[Float[Array, "*n"], Float[Array, "*n"]]:
    """(cl, cd) at angles of attack α (rad, any number of turns) and Mach numbers, elementwise."""
    alpha, mach = jnp.broadcast_arrays(alpha, mach)
    wrapped = alpha - 2 * jnp.pi * jnp.floor((alpha + jnp.pi) / (2 * jnp.pi))
    i, basis_a = _hermite(wrapped, table.alpha)
    j, basis_m = _hermite(jnp.clip(mach, table.mach[0], table.mach[-1]), table.mach)
    # One gather for the four corners: [*n, corner α, corner M, (cl, cd), order α, order M].
    corner = jnp.arange(2)
    patch = table.nodes[(i[..., None] + corner)[..., :, None], (j[..., None] + corner)[..., None, :]]
    weights = basis_a[..., :, None, None, :, None] * basis_m[..., None, :, None, None, :]
    cl, cd = jnp.moveaxis(jnp.sum(patch * weights, axis=(-5, -4, -2, -1)), -1, 0)
    if table.prandtl_glauert:
        cl = cl * (1 + (prandtl_glauert_factor(mach) - 1) * _attached(wrapped))
    return cl, cd


def prandtl_glauert_factor(mach: Float[Array, "*n"]) -> Float[Array, "*n"]:
    """1/√(1 − M²), exactly up to M = 0.7; above, M is levelled off smoothly (C2) towards 0.85."""
    above = jnp.maximum(mach - _GLAUERT_EXACT, 0.0)
    levelled = jnp.minimum(mach, _GLAUERT_EXACT) + _GLAUERT_RANGE * jnp.tanh(above / _GLAUERT_RANGE)
    return 1 / jnp.sqrt(1 - levelled**2)


def airfoil_table(
    alpha_deg: Any, mach: Any, cl: Any, cd: Any, name: str = "", prandtl_glauert: bool = False
) -> AirfoilTable:
    """Make a table from angles (deg, −180 to 180) [N], Mach numbers [C], and cl, cd [N, C].

    A single Mach number serves for all.

    Raises InputError where a value is not finite, angles or Mach numbers do not increase, the angles do not run from
    −180 to 180 with equal values at both ends, a drag is negative, or the shapes do not agree.
    """
    alpha_deg, mach = np.asarray(alpha_deg, float), np.atleast_1d(np.asarray(mach, float))
    cl, cd = (np.asarray(c, float).reshape(len(alpha_deg), -1) for c in (cl, cd))
    _check_table(name, alpha_deg, mach, cl, cd)
    if mach.size == 1:
        mach, cl, cd = np.array([0.0, 1.0]), np.repeat(cl, 2, 1), np.repeat(cd, 2, 1)
    alpha = np.deg2rad(alpha_deg)
    # −π and π are the wrap's own ends; deg2rad may miss them by a rounding.
    alpha[0], alpha[-1] = -np.pi, np.pi
    nodes = np.stack([_with_slopes(alpha, mach, c) for c in (cl, cd)], axis=2)
    return AirfoilTable(name, bool(prandtl_glauert), *(jnp.asarray(x, float) for x in (alpha, mach, nodes)))


def linear_airfoil(slope: float = 2 * np.pi, cd: float = 0.0, zero_lift: float = 0.0) -> AirfoilTable:
    """A section with cl = slope · (α − zero_lift) to ±28° and a constant drag, for checks against theory.

    slope per rad, zero_lift in rad. Beyond 28° the lift falls off to zero at ±180°. Raises InputError where a value is
    not finite.
    """
    check_number("slope", slope)
    check_number("cd", cd, 0.0)
    check_number("zero_lift", zero_lift)
    alpha_deg = np.array([-180.0, *np.arange(-90, 91, 2.0), 180.0])
    cl = slope * (np.deg2rad(alpha_deg) - zero_lift)
    cl = np.where(np.abs(alpha_deg) <= 30, cl, cl * np.clip((90 - np.abs(alpha_deg)) / 60, 0, 1))
    return airfoil_table(alpha_deg, 0.0, cl, np.full_like(cl, cd), name="linear")


def _hermite(x, nodes):
    """Interval index and the cubic Hermite basis [*n, corner, order] at x, that of slopes times the width."""
    i = jnp.clip(jnp.searchsorted(nodes, x, side="right", method="compare_all") - 1, 0, nodes.size - 2)
    start, width = jnp.moveaxis(jnp.stack([nodes[:-1], jnp.diff(nodes)], axis=-1)[i], -1, 0)
    t = (x - start) / width
    value = t * t * (3 - 2 * t)
    basis = jnp.stack([1 - value, width * t * (1 - t) ** 2, value, width * t * t * (t - 1)], -1)
    return i, basis.reshape(*basis.shape[:-1], 2, 2)


def _attached(alpha):
    """One up to 6°, zero from 14° on, a C2 step between."""
    t = jnp.clip((_SEPARATED - jnp.abs(alpha)) / (_SEPARATED - _ATTACHED), 0.0, 1.0)
    return t**3 * (10 - 15 * t + 6 * t**2)


def _with_slopes(alpha: np.ndarray, mach: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Values and node derivatives, [N, C, order α, order M]."""
    in_alpha, in_mach = _slopes_alpha(alpha, values), _slopes_mach(mach, values)
    cross = _slopes_mach(mach, in_alpha)
    return np.stack([np.stack([values, in_mach], -1), np.stack([in_alpha, cross], -1)], -2)


def _slopes_alpha(alpha: np.ndarray, values: np.ndarray) -> np.ndarray:
    turn, inner = 2 * np.pi, values[:-1]
    n = len(inner)
    thrice = np.concatenate([alpha[:-1] - turn, alpha[:-1], alpha[:-1] + turn])
    slopes = PchipInterpolator(thrice, np.tile(inner, (3, 1)), axis=0).derivative()(thrice[n : 2 * n + 1])
    return np.asarray(slopes)


def _slopes_mach(mach: np.ndarray, values: np.ndarray) -> np.ndarray:
    slopes = np.array(PchipInterpolator(mach, values, axis=1).derivative()(mach))
    slopes[:, [0, -1]] = 0.0  # so that the constant beyond the table's ends joins it without a kink
    return slopes


def _check_table(name: str, alpha: np.ndarray, mach: np.ndarray, cl: np.ndarray, cd: np.ndarray) -> None:
    where = f"Airfoil table {name!r}: "
    for label, c in (("cl", cl), ("cd", cd)):
        if c.shape != (alpha.size, mach.size):
            raise InputError(
                f"{where}`{label}` must have shape {(alpha.size, mach.size)} (angle, Mach), but has {c.shape}"
            )
        bad = np.argwhere(~np.isfinite(c))
        if bad.size:
            i, j = bad[0]
            raise InputError(
                f"{where}`{label}` must be finite, but is {c[i, j]} at alpha {alpha[i]:g} deg, Mach {mach[j]:g}"
            )
    for label, x in (("alpha_deg", alpha), ("mach", mach)):
        bad = np.flatnonzero(~(np.diff(x) > 0))
        if bad.size:
            i = int(bad[0])
            raise InputError(f"{where}`{label}` must increase, but {x[i]:g} is followed by {x[i + 1]:g} (row {i + 2})")
    if alpha.size < 3 or alpha[0] != -180 or alpha[-1] != 180:
        raise InputError(f"{where}`alpha_deg` must run from -180 to 180, but runs from {alpha[0]:g} to {alpha[-1]:g}")
    if not np.all(np.isfinite(mach)) or mach[0] < 0:
        raise InputError(f"{where}`mach` must be finite and not negative, but is {mach}")
    for label, c in (("cl", cl), ("cd", cd)):
        if not np.allclose(c[0], c[-1], rtol=0, atol=1e-6):
            raise InputError(f"{where}`{label}` must be the same at -180 and 180 deg, but is {c[0]} and {c[-1]}")
    if np.any(cd < 0):
        i, j = np.argwhere(cd < 0)[0]
        raise InputError(f"{where}`cd` must not be negative, but is {cd[i, j]} at alpha {alpha[i]:g} deg")
