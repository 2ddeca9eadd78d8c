"""Shaping functions Φ, velocity potentials Ψ and the velocity of one set of steady states anywhere (Appendices C–E).

The wake is the rigid cylinder below the disk along z; velocities over ΩR in the hub frame (z up). With
∂Ψ/∂z̄ = Φ, z̄ down, a state a gives the downward velocity aΦ on and above the disk.

Below the disk, at the point A with D its mirror image above and B the disk plane's upper face on the same streamline:
axial  v_A = v_B + s(v_B − v_D), in-plane q_A = q_B − s(q_B − q_D),  s = (−1)^{n+m+1}.
That is 2v_B − v_D for pressure modes (Eq. 32) and v_A = v_D for mass sources. Eq. 7 with the printed τ† = (−1)^{j+1}τ
holds only with the adjoint terms at ψ + π; this form needs no such turn. It is exact outside the cylinder too, where
v_B = 0 for pressure modes (tests/potential/test_field.py integrates along streamlines).
"""

from functools import partial
from math import factorial, log, pi, sqrt

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from rotorjax.potential.ellipsoidal import Ellipsoidal, ellipsoidal
from rotorjax.potential.legendre import Pairs, combined, double_factorial, k_constant, legendre_p, legendre_q
from rotorjax.potential.modes import ModeTable


def _harmonics(highest: int, at: Ellipsoidal) -> tuple[list[Array], list[Array]]:
    """(1−ν²)^{m/2} cos mψ and sin mψ for m = 0 … highest, as polynomials: smooth on the axis."""
    cosines, sines = [jnp.ones_like(at.nu)], [jnp.zeros_like(at.nu)]
    for _ in range(highest):
        c, s = cosines[-1], sines[-1]
        cosines.append(at.cosine * c - at.sine * s)
        sines.append(at.cosine * s + at.sine * c)
    return cosines, sines


def _by_mode(modes: ModeTable, radial: Float[Array, "M ..."], at: Ellipsoidal) -> Float[Array, "M ..."]:
    """Multiply functions of (ν, η), one for each mode, by (1−ν²)^{m/2} {cos, sin} mψ."""
    highest = int(modes.m.max())
    if highest == 0:
        return radial
    cosines, sines = _harmonics(highest, at)
    waves = [(m, kind) for kind in ("cos", "sin") for m in range(highest + 1)]
    choice = np.array([[(mode.m, mode.kind) == wave for wave in waves] for mode in modes.modes])
    return radial * combined(choice, jnp.stack(cosines + sines))


def _radial(pairs: Pairs, at: Ellipsoidal) -> Float[Array, "L ..."]:
    return legendre_p(pairs, at.nu) * legendre_q(pairs, at.eta)


@jax.jit
def pressure_functions(modes: ModeTable, points: Float[Array, "*N 3"]) -> Float[Array, "M ..."]:
    """Return Φ_n^m = P̄_n^m(ν) Q̄_n^m(iη) {cos, sin} mψ at hub-frame points over R (Eqs. 6, 29)."""
    at = ellipsoidal(points)
    return _by_mode(modes, _radial(modes.pairs, at), at)


@jax.jit
def disk_functions(modes: ModeTable, x: Float[Array, "*N"], y: Float[Array, "*N"]) -> Float[Array, "M ..."]:
    """Return P̄_n^m {cos, sin} mψ on the disk's upper face at hub-frame stations (x, y), zero outside the disk.

    Outside that is Φ of pressure modes in the plane of the disk too, but not of mass sources.
    """
    inside = x * x + y * y < 1
    x, y = jnp.where(inside, x, 0.0), jnp.where(inside, y, 0.0)
    nu = jnp.sqrt(1 - x * x - y * y)
    on_disk = Ellipsoidal(nu, jnp.zeros_like(nu), x, y)
    return jnp.where(inside, _by_mode(modes, legendre_p(modes.pairs, nu), on_disk), 0.0)


RIM = 1e-6  # over R: how far off the rim the velocity there is taken


def sigma(m: int, n: int) -> float:
    """Return σ_n^m of Eq. 26."""
    return 1 / (k_constant(m, n) * sqrt((2 * n + 1) * (2 * n + 3) * ((n + 1) ** 2 - m**2)))


def zeta(m: int, n: int) -> float:
    """Return ζ_n^m of Eq. 26, n > m."""
    return 1 / (k_constant(m, n) * sqrt((4 * n**2 - 1) * (n**2 - m**2)))


def _diagonal_remainder(r: int, at: Ellipsoidal) -> Float[Array, "*N"]:
    """The second term of Ψ_r^r (Eqs. 43–45) without (1−ν²)^{r/2} {cos, sin} rψ.

    Two slips of the print: Eq. 44 lacks j! in the denominator (without it the term is not harmonic for r ≥ 3), and
    a = 1 in Eq. 45.
    """
    if r == 0:
        return -2 / pi * jnp.log(1 + at.nu) - jnp.log(1 + at.eta**2) / pi
    total = jnp.zeros_like(at.nu)
    for j in range(r - 1, -1, -1):
        c = factorial(r - 1) * 2 ** (r - 1 - j) * (-1) ** j / (factorial(j) * factorial(r - 1 - j) * (r + j))
        total = total * (1 - at.nu) + c
    scale = 2 / pi * sqrt(double_factorial(2 * r) / double_factorial(2 * r + 1))
    return scale * total / ((1 + at.nu) ** r * (1 + at.eta**2) ** (r / 2))


@partial(jax.jit, static_argnames="outer_radius")
def velocity_potentials(
    modes: ModeTable, points: Float[Array, "*N 3"], outer_radius: float = 1e3
) -> Float[Array, "M ..."]:
    """Return Ψ with ∂Ψ/∂z̄ = Φ (Eqs. 26, 43–45) at hub-frame points on or above the disk, over R.

    outer_radius: R_max of Eq. 45, a constant in Ψ_0^0 that no velocity depends on. The n = m terms are singular on the
    axis below the disk.
    """
    at = ellipsoidal(points)
    parts, shares = _neighbours(modes)
    rows = combined(shares, _radial(parts, at))
    diagonal = modes.diagonal.reshape(-1, *(1,) * at.nu.ndim)
    for m in dict.fromkeys(modes.m[modes.diagonal]):
        more = _diagonal_remainder(int(m), at) + (2 / pi * log(outer_radius) if m == 0 else 0.0)
        rows = rows + jnp.where(diagonal & (modes.m == m).reshape(diagonal.shape), more, 0.0)
    return _by_mode(modes, rows, at)


def _neighbours(modes: ModeTable) -> tuple[Pairs, np.ndarray]:
    """The pairs of one degree more and less (P of them), and what share each mode's Ψ has of them, (M, P) (Eq. 26)."""
    above, below = ([(mode.m, mode.n + step) for mode in modes.modes] for step in (1, -1))
    pairs = tuple(dict.fromkeys(above + [(m, n) for m, n in below if n >= m]))
    shares = np.zeros((len(modes), len(pairs)))
    for row, (m, n, _) in zip(shares, modes.modes, strict=True):
        row[pairs.index((m, n + 1))] = sigma(m, n)
        if n > m:
            row[pairs.index((m, n - 1))] = zeta(m, n)
    return pairs, shares


@jax.jit
def velocity_functions(modes: ModeTable, points: Float[Array, "*N 3"]) -> Float[Array, "3 M *N"]:
    """Return the velocity (hub frame) of each mode's unit state on and above the disk: ∇Ψ, the axial one being −Φ.

    On the rim itself, where the coordinates have no derivative, the in-plane components are those just outside it.
    """
    rim = (points[..., 0] ** 2 + points[..., 1] ** 2 == 1) & (points[..., 2] == 0)
    outward = jnp.where(rim[..., None], RIM * jnp.array([1.0, 1.0, 0.0], points.dtype), 0.0)

    def potentials(p: Array) -> Array:
        return velocity_potentials(modes, p)

    axes = jnp.broadcast_to(
        jnp.eye(3, dtype=points.dtype)[:2].reshape(2, *(1,) * (points.ndim - 1), 3), (2, *points.shape)
    )
    in_plane = jax.vmap(lambda axis: jax.jvp(potentials, (points * (1 + outward),), (axis,))[1])(
        axes
    )  # each value has its own point
    return jnp.concatenate([in_plane, -pressure_functions(modes, points)[None]])


def _mirrored(points: Float[Array, "*N 3"]) -> Float[Array, "*N 3"]:
    """Points below the disk moved to their mirror image above."""
    return jnp.concatenate([points[..., :2], jnp.abs(points[..., 2:])], axis=-1)


@jax.jit
def axial_functions(modes: ModeTable, points: Float[Array, "*N 3"]) -> Float[Array, "M ..."]:
    """Return the downward velocity of each mode's unit state at any hub-frame points."""
    above = pressure_functions(modes, _mirrored(points))
    if modes.parity == "even":
        return above
    odd = 2 * disk_functions(modes, points[..., 0], points[..., 1]) - above
    below = jnp.where(modes.odd.reshape((-1,) + (1,) * (points.ndim - 1)), odd, above)
    return jnp.where(points[..., 2] >= 0, above, below)


@jax.jit
def column_functions(modes: ModeTable, points: Float[Array, "*N 3"]) -> Float[Array, "M ..."]:
    """Return the part of `axial_functions` that the air of the wake's column has alone: 2P̄ of odd modes, below.

    Without it the flow of a disk of sinks is left, the same above and below.
    """
    inside = 2 * disk_functions(modes, points[..., 0], points[..., 1]) * (points[..., 2] < 0)
    return jnp.where(modes.odd.reshape((-1,) + (1,) * (points.ndim - 1)), inside, 0.0)


@jax.jit
def field_functions(modes: ModeTable, points: Float[Array, "*N 3"]) -> Float[Array, "3 M *N"]:
    """Return the velocity (hub frame) of each mode's unit state at any hub-frame points."""
    above = velocity_functions(modes, _mirrored(points))[:2]
    if modes.parity != "odd":
        disk = velocity_functions(modes, points * jnp.array([1, 1, 0], points.dtype))[:2]
        same = modes.odd.reshape((-1,) + (1,) * (points.ndim - 1)) | (points[..., 2] >= 0)
        above = jnp.where(same, above, 2 * disk - above)
    return jnp.concatenate([above, -axial_functions(modes, points)[None]])
