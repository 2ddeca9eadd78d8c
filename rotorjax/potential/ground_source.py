"""The ground as mass sources on a disk under the rotor (Appendices D, E).

The ground disk is the rotor's footprint along the wake, which stays vertical: its point (x, y) lies at the depth
d = h − x tan δ below the rotor's point (x, y) (Eq. 9; x aft). Both maps use that depth: the rotor's wake reaches the
ground's (x, y) at depth d, and the ground's flow reaches the rotor's (x, y) from the distance d. Only the normal
component of the incoming flow, cos δ times the axial one, meets the sources; the tangential one slides along the plane.

Over a part of the plane (`region`) the condition holds on that part only, by least squares; odd sources suit it best,
whose flow through the plane is zero off their disk. The ground disk may have another radius than the rotor.

The integrals of Eq. 37 are taken with Gauss–Legendre nodes in ν and equal steps in ψ instead of the recommended
trapezoidal rule: the integrands are analytic in ν and periodic in ψ, so both rules converge faster than any power,
and a few dozen nodes reach rounding error where 400 trapezoidal points do not
(tests/potential/test_ground_source.py). The states c = G a are used directly; the printed Eq. 40 for the strengths,
S = V_e G, should read S = G V_e.
"""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from rotorjax.errors import InputError
from rotorjax.ground import Plane
from rotorjax.potential.contraction import Contraction, far_flow
from rotorjax.potential.ellipsoidal import ellipsoidal
from rotorjax.potential.field import axial_functions, disk_functions, pressure_functions, velocity_functions
from rotorjax.potential.modes import ModeTable
from rotorjax.region import Region

OFF_REGION = 0.1  # weight of the condition "no source" off the region against that of the flow on it


class Correction(eqx.Module):
    """The empirical factor b^{η^p} on the r = j terms away from the ground (Eqs. 46, 47).

    b (): base in (0, 1], the paper's π/7 by default; p (): exponent, the paper's 2.
    """

    b: Float[Array, ""]
    p: Float[Array, ""]

    def factor(self, eta: Float[Array, "*N"]) -> Float[Array, "*N"]:
        """Return b^{η^p}, one on the ground disk (η = 0)."""
        on_ground = eta <= 0  # d(η^p) is infinite there for p < 1 and 0/0 through the logarithm
        power = jnp.where(on_ground, 0.0, jnp.where(on_ground, 1.0, eta) ** self.p)
        return self.b**power


def correction(b: float = float(np.pi / 7), p: float = 2.0) -> Correction:
    """Make the correction factor. Raises InputError where b is not in (0, 1] or p is not positive."""
    if not 0 < b <= 1:
        raise InputError(f"Argument `b` must lie in (0, 1] (1 switches the correction off), but is {b}")
    if not (np.isfinite(p) and p > 0):
        raise InputError(f"Argument `p` must be positive and finite, but is {p}")
    return Correction(jnp.asarray(b, float), jnp.asarray(p, float))


class DiskQuadrature(eqx.Module):
    """Quadrature over the disk, static: `nodes_nu` Gauss–Legendre nodes in ν and `nodes_psi` equal steps in ψ."""

    nodes_nu: int = eqx.field(static=True, default=24)
    nodes_psi: int = eqx.field(static=True, default=32)

    def rule(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Return x, y, ν and the weights of ∫₀¹ dν ∫ dψ/2π at the N nodes, each (N,), hub frame."""
        node, weight = np.polynomial.legendre.leggauss(self.nodes_nu)
        nu, psi = np.meshgrid(
            (node + 1) / 2, 2 * np.pi * (np.arange(self.nodes_psi) + 0.5) / self.nodes_psi, indexing="ij"
        )
        weights = np.broadcast_to((weight / 2 / self.nodes_psi)[:, None], nu.shape)
        r = np.sqrt(1 - nu**2)
        return (r * np.cos(psi)).ravel(), (r * np.sin(psi)).ravel(), nu.ravel(), weights.ravel()


SHEET = DiskQuadrature(24, 32)  # of a tilted sheet's sources


def depth(ground: Plane, x: Float[Array, "*N"]) -> Float[Array, "*N"]:
    """Return the depth of the plane under the hub-frame station x along the shaft, over R (Eq. 9)."""
    return ground.height - x * jnp.tan(ground.slope)


@jax.jit
def rotor_on_ground(
    modes: ModeTable,
    ground: Plane,
    x: Float[Array, "*N"],
    y: Float[Array, "*N"],
    wake: Contraction | None = None,
) -> Float[Array, "M ..."]:
    """Return the flow of unit rotor states into the plane at its points (x, y), along its normal (Eqs. 32, 34).

    wake: over this plane; None: a cylinder.
    """
    points = jnp.stack([x, y, -depth(ground, x)], axis=-1)
    if wake is None:
        return jnp.cos(ground.slope) * axial_functions(modes, points)
    return jnp.cos(ground.slope) * far_flow(axial_functions, modes, points, wake)


@jax.jit
def ground_on_rotor(
    modes: ModeTable, ground: Plane, correction: Correction, points: Float[Array, "*N 3"]
) -> Float[Array, "G ..."]:
    """Return the upward velocity of unit ground states at hub-frame points above the plane (Eqs. 35, 46)."""
    above = jnp.stack([points[..., 0], points[..., 1], points[..., 2] + depth(ground, points[..., 0])], axis=-1)
    functions = pressure_functions(modes, above)
    if not modes.diagonal.any():
        return functions
    diagonal = jnp.asarray(modes.diagonal).reshape((-1,) + (1,) * (points.ndim - 1))
    return functions * jnp.where(diagonal, correction.factor(ellipsoidal(above).eta), 1.0)


@jax.jit
def sheet_flow(
    modes: ModeTable, ground: Plane, points: Float[Array, "*N 3"], sheet: DiskQuadrature = SHEET
) -> Float[Array, "M ..."]:
    """Return the upward velocity of sources on the plane itself, of density 2P̄ {cos, sin} mψ per area of the disk.

    modes: odd. The sources at (x', y') lie at their own depth h − x' tan δ. Level, that is Φ; the difference to Φ at
    the depth under the point is smooth above the plane and taken by quadrature; it is zero on a level plane.
    """
    x, y, nu, weights = (jnp.asarray(v, points.dtype) for v in sheet.rule())
    density = disk_functions(modes, x, y) * (nu * weights)  # dA/2π
    level = points.at[..., 2].add(depth(ground, points[..., 0]))

    def tilt(point: Array) -> Array:
        """What the sheet's tilt adds at a point."""
        across = (point[0] - x) ** 2 + (point[1] - y) ** 2 + 1e-18  # a point on a node has no flow of that node
        own, under = point[2] + depth(ground, x), point[2] + depth(ground, point[0])
        return density @ (own * (across + own * own) ** -1.5 - under * (across + under * under) ** -1.5)

    added = jax.lax.map(tilt, points.reshape(-1, 3), batch_size=256)
    return pressure_functions(modes, level) + jnp.moveaxis(added.reshape(*points.shape[:-1], len(modes)), -1, 0)


@jax.jit
def level_flow(modes: ModeTable, height: Float[Array, ""], points: Float[Array, "*N 3"]) -> Float[Array, "3 G ..."]:
    """Return the velocity (hub frame) of unit states of odd modes on a level plane at points above it."""
    return -velocity_functions(modes, points + height * np.array([0.0, 0.0, 1.0]))


def self_flow(modes: ModeTable, x: Float[Array, "*N"], y: Float[Array, "*N"]) -> Float[Array, "G ..."]:
    """Return the normal velocity of unit ground states on the ground disk itself."""
    return disk_functions(modes, x, y)


@jax.jit
def correlation(rotor: ModeTable, sources: ModeTable, ground: Plane, quadrature: DiskQuadrature) -> Float[Array, "G M"]:
    """Return the velocity correlation matrix G of c = G a for a cylinder (Eqs. 36, 37, 42), cos δ included.

    The source functions are orthonormal over dν dψ, so projecting the incoming flow on them is the least-squares
    solution.
    """
    x, y, _, _ = (jnp.asarray(v, ground.height.dtype) for v in quadrature.rule())
    return source_solver(sources, quadrature) @ rotor_on_ground(rotor, ground, x, y).T


def printed_strengths(rotor: ModeTable, sources: ModeTable) -> tuple[np.ndarray, np.ndarray]:
    """Return the factors by row and by column, (G,) and (M,), that make G what Eqs. 38, 40 and 41 say as printed.

    ω = V_e G τ with τ = V̂ a and ω = 2V c: c = V_e G (V̂/2V) a. V_e has 2 in its first row, of j = 2 in Appendix D, and
    V̂ is V for a_1^0, 2V for the others (Eq. 4).
    """
    row = np.array([2.0 if (mode.m, mode.n) == (0, 2) else 1.0 for mode in sources.modes])
    column = np.array([0.5 if (mode.m, mode.n) == (0, 1) else 1.0 for mode in rotor.modes])
    return row, column


def source_solver(
    sources: ModeTable, quadrature: DiskQuadrature, region: Region | None = None, radius: Float[Array, ""] | None = None
) -> Float[Array, "G N"]:
    """Return the matrix from normal velocities at the N quadrature points of the ground disk to the source states.

    radius: of the ground disk, over R (None: 1). The states are the least-squares solution of S c = w on the region and
    S c = 0 off it, with `OFF_REGION` as weight there; where the mask is between, S c = mask · w. Without region it is
    the projection of `correlation`, and so it is where the region covers the disk; where it covers nothing the result
    is zero.
    """
    x, y, _, weights = quadrature.rule()
    share = jnp.where(sources.m == 0, 1.0, 2.0)[:, None]
    own = self_flow(sources, jnp.asarray(x), jnp.asarray(y))
    if region is None:
        return share * own * weights
    size = 1.0 if radius is None else radius
    mask = region.mask(size * jnp.asarray(x), size * jnp.asarray(y))
    demand = weights * (mask + OFF_REGION * (1 - mask))
    return jnp.linalg.solve((own * demand) @ own.T, own * (demand * mask))
