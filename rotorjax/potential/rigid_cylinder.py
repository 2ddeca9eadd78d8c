"""Exact ground effect of a rigid wake cylinder that ends at the plane: the reference beside the ground sources.

The wake of a steady loading is a column of doublet disks of density μ = 2 Σ a P̄ {cos, sin} mψ along z, from the
disk down to the plane. Integrated along z, the column is a sink disk of density μ at the rotor, a source patch of
the same density (per area of the rotor disk) where the column meets the plane, and the flow μ downward inside. The
images of a source patch on the plane and of the column make the plane impermeable everywhere, inside the wake and
out:

    w = Σ a [Φ(0) − 2 (patch) + (reflected sink disk)];   level ground: w = Σ a [Φ(0) − 2Φ(h) + Φ(2h)].

For a level plane the patch is Φ(h), at any height; on a slope its points (x, y) lie at the depth h − x tan δ and what
that adds to the flow is integrated over the patch. The one approximation on a slope is that the wake stays a vertical
cylinder down to the plane; no flow condition is approximated. The states and the model are those of
`rotorjax.potential.model`; its correction and its wake's contraction do not enter.
"""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from rotorjax.errors import InputError
from rotorjax.ground import Plane
from rotorjax.potential.field import disk_functions, velocity_functions
from rotorjax.potential.ground_source import SHEET, DiskQuadrature, sheet_flow
from rotorjax.potential.model import FiniteState, FiniteStateModel


def _on_disk(state: FiniteState, x: Float[Array, "*N"], y: Float[Array, "*N"], model: FiniteStateModel) -> Array:
    return jnp.tensordot(state.a, disk_functions(model.modes, x, y), 1)


def patch_upflow(
    state: FiniteState, points: Float[Array, "*N 3"], model: FiniteStateModel, patch: DiskQuadrature = SHEET
) -> Float[Array, "*N"]:
    """Return the upward velocity (over ΩR) of the source patch without its image, at hub-frame points off the plane."""
    return jnp.tensordot(state.a, sheet_flow(model.modes, _ground(model), points, patch), 1)


def reflected_sink_downflow(
    state: FiniteState, points: Float[Array, "*N 3"], model: FiniteStateModel
) -> Float[Array, "*N"]:
    """Return the downward velocity (over ΩR) of the sink disk's image: reflected, at the reflected point."""
    ground = _ground(model)
    below = ground.reflect_points(points)
    mirror = jnp.concatenate([below[..., :2], -below[..., 2:]], axis=-1)
    above = jnp.moveaxis(jnp.tensordot(state.a, velocity_functions(model.modes, mirror), [[0], [1]]), 0, -1)
    sink = above * jnp.array([1, 1, -1], points.dtype)  # the field of a sink disk is mirror-symmetric
    return -ground.reflect_vectors(sink)[..., 2]


def _ground(model: FiniteStateModel) -> Plane:
    if model.ground is None:
        raise InputError("Argument `model` must have a ground, but its ground is None")
    if model.region is not None:
        raise InputError("Argument `model` must have the whole plane as ground for the exact image, but has a region")
    return model.ground


@eqx.filter_jit
def inflow(
    state: FiniteState,
    r: Float[Array, " R"],
    psi: Float[Array, " K"],
    model: FiniteStateModel,
    patch: DiskQuadrature = SHEET,
) -> Float[Array, "K R"]:
    """Return λ over ΩR, positive down, at radii r (over R) and azimuths psi (rad), with the exact image of the wake.

    patch: quadrature of what the patch's tilt adds; finer where a slope comes closer to the disk than 0.3 R.
    """
    x, y = r[None, :] * jnp.cos(psi)[:, None], r[None, :] * jnp.sin(psi)[:, None]
    return disk_inflow(state, x, y, model, patch)


def disk_inflow(
    state: FiniteState,
    x: Float[Array, "*N"],
    y: Float[Array, "*N"],
    model: FiniteStateModel,
    patch: DiskQuadrature = SHEET,
) -> Float[Array, "*N"]:
    """Return λ over ΩR, positive down, at hub-frame stations (x, y) of the disk, over R."""
    down = _on_disk(state, x, y, model)
    if model.ground is None:
        return down
    points = jnp.stack([x, y, jnp.zeros_like(x)], axis=-1)
    up = patch_upflow(state, points, model, patch)
    return down - 2 * up + reflected_sink_downflow(state, points, model)


@eqx.filter_jit
def mean_inflow(state: FiniteState, model: FiniteStateModel, patch: DiskQuadrature = SHEET) -> Float[Array, ""]:
    """Return the area-weighted mean of λ over the whole disk, over ΩR."""
    x, y, nu, weights = (jnp.asarray(v, state.a.dtype) for v in model.quadrature.rule())
    return (2 * nu * weights) @ disk_inflow(state, x, y, model, patch)
