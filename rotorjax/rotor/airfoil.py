"""Lift and drag of an aerofoil section, for every angle of attack and Mach number, with continuous derivatives.

The table is a bicubic Hermite surface through the data: exact at every node, C1 in angle and Mach number everywhere,
periodic at ±180°, constant beyond the first and last Mach number. It is monotone between nodes (monotone.py), because a
table of a stalled section has steps that an ordinary spline would overshoot, to a negative drag, say. Slopes at the
nodes are computed once in float64 numpy, from traced coefficients in jax; derivatives with respect to the nodes of a
table that is made already hold them fixed.

A low-speed table may ask for the Prandtl-Glauert rule: cl/√(1 − M²) where the flow is attached (|α| up to 6°), fading
out by 14°, where the lift is set by separation, which the rule knows nothing of. The drag is left as it is: without a
measured drag rise the result is to be trusted below the critical Mach number only.
"""

from functools import partial
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from rotorjax.checks import Range, array, check_list, check_range, known
from rotorjax.errors import InputError
from rotorjax.rotor.monotone import hermite, inner_slopes

# The rule is used as it stands to M = 0.7; above, its Mach number levels off towards 0.85 so that it stays finite
# through M = 1.
_GLAUERT_EXACT, _GLAUERT_RANGE = 0.7, 0.15
_ATTACHED, _SEPARATED = np.deg2rad(6.0), np.deg2rad(14.0)
_LOW_SPEED = 0.2  # Mach number up to which a table counts as one of low speed (the rule's own factor is 1.02 there)
_MOST = 20.0  # of any coefficient
_ANGLES, _MACHS = Range(-180.0, 180.0, "deg"), Range(0.0, 5.0)
_FINEST = 1e-4  # steps in degrees and Mach number: finer ones make slopes that no section has


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


@partial(jax.jit, inline=True)
def lift_drag(
    table: AirfoilTable, alpha: Float[Array, "*n"], mach: Float[Array, "*#n"]
) -> tuple[Float[Array, "*n"], Float[Array, "*n"]]:
    """(cl, cd) at angles of attack α (rad, any number of turns) and Mach numbers, elementwise."""
    alpha, mach = jnp.broadcast_arrays(alpha, mach)
    wrapped = alpha - 2 * jnp.pi * jnp.floor((alpha + jnp.pi) / (2 * jnp.pi))
    i, basis_a = hermite(wrapped, table.alpha)
    j, basis_m = hermite(jnp.clip(mach, table.mach[0], table.mach[-1]), table.mach)
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

    A single Mach number serves for all. cl and cd may be traced, so that a section may be differentiated in them.

    Raises InputError where a value is not finite or beyond ±20, angles or Mach numbers do not increase, the angles do
    not run from −180 to 180 with equal values at both ends, a drag is negative, the shapes do not agree, or the
    Prandtl-Glauert rule would be applied to a table that has Mach effects of its own.
    """
    alpha_deg = check_list("alpha_deg", alpha_deg, _ANGLES, least=3)
    mach = check_list("mach", [mach] if np.ndim(mach) == 0 else mach, _MACHS, least=1)
    cl, cd = (_coefficient(label, c, (alpha_deg.size, mach.size)) for label, c in (("cl", cl), ("cd", cd)))
    _check_axes(name, alpha_deg, mach, prandtl_glauert)
    for label, c in (("cl", cl), ("cd", cd)):
        if known(c):
            _check_coefficient(name, label, c, alpha_deg, mach)
    xp = np if known(cl, cd) else jnp
    if mach.size == 1:
        mach, cl, cd = np.array([0.0, 1.0]), xp.repeat(cl, 2, 1), xp.repeat(cd, 2, 1)
    alpha = np.deg2rad(alpha_deg)
    # −π and π are the wrap's own ends; deg2rad may miss them by a rounding.
    alpha[0], alpha[-1] = -np.pi, np.pi
    # differences in float64: in single precision fine steps at large angles would lose their digits
    nodes = (_nodes if xp is np else _traced_nodes)(np.diff(alpha), np.diff(mach), cl, cd)
    return AirfoilTable(name, bool(prandtl_glauert), *map(array, (alpha, mach, nodes)))


def linear_airfoil(slope: float = 2 * np.pi, cd: float = 0.0, zero_lift: float = 0.0) -> AirfoilTable:
    """A section with cl = slope · (α − zero_lift) to ±28° and a constant drag, for checks against theory.

    slope per rad, zero_lift in rad. Beyond 28° the lift falls off to zero at ±180°. Raises InputError where a value is
    not finite.
    """
    check_range("slope", slope, Range(-20.0, 20.0, "per rad"))
    check_range("cd", cd, Range(0.0, _MOST))
    check_range("zero_lift", zero_lift, Range(-0.5, 0.5, "rad", hint="degrees go through np.deg2rad"))
    xp = np if known(slope, cd, zero_lift) else jnp
    alpha_deg = np.array([-180.0, *np.arange(-90, 91, 2.0), 180.0])
    fade = np.where(np.abs(alpha_deg) <= 30, 1.0, np.clip((90 - np.abs(alpha_deg)) / 60, 0, 1))
    cl = slope * (np.deg2rad(alpha_deg) - zero_lift) * fade
    return airfoil_table(alpha_deg, 0.0, cl, cd * xp.ones_like(cl), name="linear")


def _attached(alpha):
    """One up to 6°, zero from 14° on, a C2 step between."""
    t = jnp.clip((_SEPARATED - jnp.abs(alpha)) / (_SEPARATED - _ATTACHED), 0.0, 1.0)
    return t**3 * (10 - 15 * t + 6 * t**2)


def _nodes(d_alpha: Any, d_mach: Any, cl: Any, cd: Any, xp: Any = np) -> Any:
    """Both coefficients `_with_slopes`, [N, C, (cl, cd), order α, order M]; d_alpha, d_mach: between the nodes."""
    return xp.stack([_with_slopes(d_alpha, d_mach, c, xp) for c in (cl, cd)], axis=2)


_traced_nodes = jax.jit(partial(_nodes, xp=jnp), inline=True)


def _with_slopes(d_alpha: Any, d_mach: Any, values: Any, xp: Any) -> Any:
    """Values and node derivatives, [N, C, order α, order M]; xp: numpy, or jax's for traced values."""
    in_alpha, in_mach = _slopes_alpha(d_alpha, values, xp), _slopes_mach(d_mach, values, xp)
    cross = _slopes_mach(d_mach, in_alpha, xp)
    return xp.stack([xp.stack([values, in_mach], -1), xp.stack([in_alpha, cross], -1)], -2)


def _slopes_alpha(d_alpha: Any, values: Any, xp: Any) -> Any:
    """Slopes in α [N, C] of a coefficient that goes round: the first row's neighbours are the second and the last."""
    widths = xp.concatenate([d_alpha[-1:], d_alpha, d_alpha[:1]])
    return inner_slopes(widths, xp.concatenate([values[-2:-1], values, values[1:2]]), xp)


def _slopes_mach(d_mach: Any, values: Any, xp: Any) -> Any:
    """Slopes in M [N, C]: zero at the ends, so that the constant beyond them joins the table without a kink."""
    zero = xp.zeros_like(values[:, :1])
    return xp.concatenate([zero, inner_slopes(d_mach, values.T, xp).T, zero], axis=1)


def _coefficient(label: str, values: Any, shape: tuple[int, int]) -> Any:
    """cl or cd as an array [N, C]; a traced one stays traced."""
    try:
        array = np.asarray(values, float) if known(values) else jnp.asarray(values)
    except (TypeError, ValueError, OverflowError):
        raise InputError(f"Argument `{label}` must be numbers of shape {shape} (angle, Mach), but is not") from None
    if array.size != shape[0] * shape[1] or array.ndim not in (1, 2):
        raise InputError(f"Argument `{label}` must have shape {shape} (angle, Mach), but has {array.shape}")
    return array.reshape(shape)


def _check_axes(name: str, alpha: np.ndarray, mach: np.ndarray, prandtl_glauert: bool) -> None:
    where = f"Airfoil table {name!r}: "
    for label, x in (("alpha_deg", alpha), ("mach", mach)):
        bad = np.flatnonzero(~(np.diff(x) > _FINEST))
        if bad.size:
            i = int(bad[0])
            raise InputError(
                f"{where}`{label}` must increase in steps above {_FINEST:g}, but {x[i]:g} is followed by {x[i + 1]:g} "
                f"(row {i + 2})"
            )
    if alpha[0] != -180 or alpha[-1] != 180:
        raise InputError(f"{where}`alpha_deg` must run from -180 to 180, but runs from {alpha[0]:g} to {alpha[-1]:g}")
    if prandtl_glauert and (mach.size > 1 or mach[0] > _LOW_SPEED):
        raise InputError(
            f"{where}`prandtl_glauert` must be false for a table that has the effect of Mach number in it, but it has "
            + (f"{mach.size} Mach numbers" if mach.size > 1 else f"the Mach number {mach[0]:g}")
        )


def _check_coefficient(name: str, label: str, c: np.ndarray, alpha: np.ndarray, mach: np.ndarray) -> None:
    where = f"Airfoil table {name!r}: "
    least = 0.0 if label == "cd" else -_MOST
    bad = np.argwhere(~((c >= least) & (c <= _MOST)))
    if bad.size:
        i, j = bad[0]
        rule = "not be negative" if np.isfinite(c[i, j]) and -_MOST < c[i, j] < 0 else f"lie in [{least:g}, {_MOST:g}]"
        rule = rule if np.isfinite(c[i, j]) else "be finite"
        raise InputError(
            f"{where}`{label}` must {rule}, but is {c[i, j]:g} at alpha {alpha[i]:g} deg, Mach {mach[j]:g}"
        )
    if not np.allclose(c[0], c[-1], rtol=0, atol=1e-6):
        raise InputError(f"{where}`{label}` must be the same at -180 and 180 deg, but is {c[0]} and {c[-1]}")
