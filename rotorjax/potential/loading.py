"""Pressure coefficients τ of a blade loading (Eqs. 2, 17), and the loading that a set of τ stands for.

Δp/(ρΩ²R²) = 2 Σ τ P̄_n^m(ν) {cos, sin} mψ. The distribution dC_T/dr̄ (r̄, ψ) is the azimuth-dependent loading whose
mean over ψ is the usual dC_T/dr̄: Q L/(πρΩ²R³) for Q blades of sectional lift L(r̄, ψ). C_T = T/(ρA(ΩR)²).
"""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from rotorjax.errors import InputError
from rotorjax.potential.legendre import powers, reduced_legendre_p
from rotorjax.potential.modes import ModeTable


@jax.jit
def azimuthal(modes: ModeTable, psi: Float[Array, "*N"]) -> Float[Array, "M ..."]:
    """Return cos mψ or sin mψ of each mode at azimuths psi (rad)."""
    shape = (-1,) + (1,) * psi.ndim
    angle = jnp.asarray(modes.m, psi.dtype).reshape(shape) * psi
    cosine = np.array([mode.kind == "cos" for mode in modes.modes]).reshape(shape)
    return jnp.where(cosine, jnp.cos(angle), jnp.sin(angle))


@jax.jit
def shaping(modes: ModeTable, r: Float[Array, "*N"]) -> Float[Array, "M ..."]:
    """Return the radial shaping functions Ψ_n^m(r̄) = P̄_n^m(ν)/ν of Eq. 2 at radii r (over R), He's φ_n^m (He 1989).

    They are polynomials in r̄, finite at the disk edge. Even modes of a table
    of both parities carry no load: zero. Raises InputError where all are even.
    """
    if modes.parity == "even":
        raise InputError("Argument `modes` must have n + m odd to carry a load, but has n + m even")
    rows = powers(r, list(modes.m)) * reduced_legendre_p(modes.pairs, 1 - r * r)
    return jnp.where(modes.odd.reshape((-1,) + (1,) * r.ndim), rows, 0.0)


def _share(modes: ModeTable) -> Float[Array, " M"]:
    """¼ of the mean loading for m = 0, ½ for a harmonic (Eqs. 2, 17), (M,)."""
    return jnp.where(modes.m == 0, 0.25, 0.5)


@jax.jit
def from_blades(
    lift: Float[Array, "B R"],
    r: Float[Array, " R"],
    weights: Float[Array, " R"],
    psi: Float[Array, " B"],
    modes: ModeTable,
) -> Float[Array, " M"]:
    """Return τ of blades at one instant (Eq. 2).

    lift: sectional lift over ρΩ²R³ of each blade; r, weights: stations and quadrature weights in r̄; psi: blade
    azimuths (rad).
    """
    radial = shaping(modes, r) * weights  # (M, R)
    return _share(modes) / jnp.pi * jnp.einsum("br,mr,mb->m", lift, radial, azimuthal(modes, psi))


@jax.jit
def from_distribution(
    dct_dr: Float[Array, "K R"],
    r: Float[Array, " R"],
    weights: Float[Array, " R"],
    psi: Float[Array, " K"],
    modes: ModeTable,
) -> Float[Array, " M"]:
    """Return τ of a loading over the disk, averaged over equally spaced azimuths (Eqs. 2, 17).

    dct_dr: dC_T/dr̄ at the azimuths psi (rad, equally spaced over a turn) and stations r; weights: quadrature
    weights in r̄. Raises InputError where the shapes do not agree.
    """
    if dct_dr.shape != (psi.size, r.size) or weights.shape != r.shape:
        raise InputError(
            f"Argument `dct_dr` must have shape (K, R) = ({psi.size}, {r.size}) and `weights` (R,), "
            f"but they are {dct_dr.shape} and {weights.shape}"
        )
    if psi.size <= 2 * modes.m.max():
        raise InputError(
            f"Argument `psi` must hold more than {2 * modes.m.max()} azimuths for harmonic {modes.m.max()}, "
            f"but holds {psi.size}"
        )
    radial = shaping(modes, r) * weights
    return _share(modes) / psi.size * jnp.einsum("kr,mr,mk->m", dct_dr, radial, azimuthal(modes, psi))


@jax.jit
def from_axisymmetric(
    dct_dr: Float[Array, " R"], r: Float[Array, " R"], weights: Float[Array, " R"], modes: ModeTable
) -> Float[Array, " M"]:
    """Return τ of an axisymmetric loading dC_T/dr̄; the harmonics are zero (Eqs. 2, 17)."""
    mean = jnp.where(modes.m == 0, 0.25, 0.0).astype(dct_dr.dtype)
    return mean * ((shaping(modes, r) * weights) @ dct_dr)


@jax.jit
def distribution(
    tau: Float[Array, " M"], r: Float[Array, " R"], psi: Float[Array, " K"], modes: ModeTable
) -> Float[Array, "K R"]:
    """Return dC_T/dr̄ = 4 r̄ Σ τ P̄_n^m(ν) {cos, sin} mψ at azimuths psi (rad) and radii r (over R); inverse of Eq. 2."""
    inside = r < 1
    # the root's slope is infinite at the edge: there the loading is zero with a zero slope
    nu = jnp.where(inside, jnp.sqrt(jnp.where(inside, 1 - r * r, 1.0)), 0.0)
    return jnp.einsum("m,mr,mk->kr", tau, shaping(modes, r) * (4 * r * nu), azimuthal(modes, psi))


def thrust_coefficient(tau: Float[Array, " M"], modes: ModeTable) -> Float[Array, ""]:
    """Return C_T = (4/√3) τ₁⁰."""
    return 4 / jnp.sqrt(3.0) * tau[modes.index(0, 1)]
