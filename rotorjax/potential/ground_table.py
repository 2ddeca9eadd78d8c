"""The ground's response tabulated over height and slope (and a moving edge), for steps of some microseconds.

What the ground does to the rotor is linear in the rotor's states, in those that its wake carries and in the plane's
velocity; only the matrix depends on the geometry. It is computed at tensor Chebyshev nodes of the geometry (the square
root of the height, the slope, the edge), split by symmetry into blocks that do not couple, and compressed to the
combinations that matter. The interpolation is smooth: derivatives by height, slope and place are those of the
interpolant.

Rows: the L coefficients of the upward flow on the rotor's disk in the functions P̄_j^r (j + r even) of `disk_modes`,
which are complete there but for harmonics above the rotor's own, which bear no load; the nearest ones by area, so that
mean and first harmonic are exact. What the rotor's own inflow loses where its wake contracts less over ground is
counted among it. Columns: states at K + 1 nodes of the wake (one where it has no transit time), then the plane's
velocity, uniform and by x. The source states themselves are those of `moving_ground.ground_states`.
"""

from collections.abc import Callable, Sequence

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from rotorjax.errors import InputError
from rotorjax.ground import Plane
from rotorjax.potential.contraction import NODES
from rotorjax.potential.field import disk_functions
from rotorjax.potential.ground_source import DiskQuadrature
from rotorjax.potential.model import (
    FiniteStateModel,
    closing,
    footprint,
    ground_upflow,
    rotor_flow,
    rotor_into_ground,
    strength_factors,
)
from rotorjax.potential.modes import ModeTable, ground_modes
from rotorjax.potential.wake_transport import WakeTransport, transported_flow
from rotorjax.region import HalfPlane, Region


class GroundTable(eqx.Module):
    """Matrices over a box of parameters, (√height, slope) or (√height, slope, edge).

    low, high (P,): the box, static. nodes: Chebyshev nodes for each parameter, static. rows, columns: what each block
    holds, static; an index past the end is padding. amplitudes (prod nodes, Q): of the Q leading matrices at each node.
    matrices (Q, blocks, rows, columns).
    """

    low: tuple[float, ...] = eqx.field(static=True)
    high: tuple[float, ...] = eqx.field(static=True)
    nodes: tuple[int, ...] = eqx.field(static=True)
    rows: tuple[tuple[int, ...], ...] = eqx.field(static=True)
    columns: tuple[tuple[int, ...], ...] = eqx.field(static=True)
    size: tuple[int, int] = eqx.field(static=True)
    amplitudes: Float[Array, "P Q"]
    matrices: Float[Array, "Q B I J"]

    def apply(self, parameters: Sequence[Float[Array, ""]], x: Float[Array, " C"]) -> Float[Array, " I"]:
        """Return matrix · x at parameters inside the box (outside of it the nearest ones of the box)."""
        basis = jnp.ones(1, x.dtype)
        for value, low, high, count in zip(parameters, self.low, self.high, self.nodes, strict=True):
            basis = (basis[:, None] * _cardinal(jnp.clip(value, low, high), low, high, count)).ravel()
        blocks = jnp.tensordot(basis @ self.amplitudes, self.matrices, 1)
        padded = jnp.append(x, 0.0)[np.array(self.columns)]
        result = jnp.einsum("bij,bj->bi", blocks, padded).ravel()
        return result[_inverse(self.rows, self.size[0])]


def _cardinal(value: Float[Array, ""], low: float, high: float, count: int) -> Float[Array, " C"]:
    """Weights of the values at `count` Chebyshev nodes of [low, high]."""
    if count == 1:
        return jnp.ones(1)
    t = (2 * value - low - high) / (high - low)
    rows = [jnp.ones_like(t), t]
    for _ in range(count - 2):
        rows.append(2 * t * rows[-1] - rows[-2])
    node = np.polynomial.chebyshev.chebpts1(count)
    inverse = np.linalg.inv(np.polynomial.chebyshev.chebvander(node, count - 1))
    return jnp.stack(rows) @ jnp.asarray(inverse)


def _inverse(rows: tuple[tuple[int, ...], ...], count: int) -> np.ndarray:
    """Where in the flattened blocks each row's result lies."""
    flat = np.array(rows).ravel()
    place = np.zeros(count, int)
    place[flat[flat < count]] = np.flatnonzero(flat < count)
    return place


def disk_modes(model: FiniteStateModel) -> ModeTable:
    """Functions of the ground's flow on the rotor disk: the rotor's harmonics and the first, six terms or fewer."""
    harmonics = min(int(model.sources.m.max()), max(1, int(model.modes.m.max())))
    return ground_modes(harmonics, min(6, (15 - harmonics) // 2 + 1))


@eqx.filter_jit
def disk_projection(model: FiniteStateModel, ground: Plane) -> Float[Array, "L G"]:
    """Return the matrix from source states to the coefficients of their upward flow on the rotor disk."""
    return _on_disk(
        model, model.quadrature, lambda x, y: ground_upflow(model, ground, jnp.stack([x, y, 0 * x], axis=-1))
    )


def _on_disk(
    model: FiniteStateModel, quadrature: DiskQuadrature, flow: Callable[[Array, Array], Float[Array, "X N"]]
) -> Float[Array, "L X"]:
    """Coefficients of flows (x, y) ↦ (X, N) on the disk: least squares by area."""
    x, y, nu, weights = (jnp.asarray(v) for v in quadrature.rule())
    basis = disk_functions(disk_modes(model), x, y)
    return jnp.linalg.solve((basis * nu * weights) @ basis.T, (basis * nu * weights) @ flow(x, y).T)


def flow_matrix(model: FiniteStateModel, ground: Plane, transport: WakeTransport | None) -> Float[Array, "N C"]:
    """Return the flow into the plane at the ground disk's points of each column."""
    x, y = footprint(model, ground)
    if transport is None:
        flow = rotor_into_ground(model, ground).T
    else:
        flow = jnp.moveaxis(transported_flow(model, transport, ground, x, y), 1, 2).reshape(x.size, -1)
    return jnp.concatenate([flow, jnp.ones_like(x)[:, None], x[:, None]], axis=1)


@eqx.filter_jit
def response(
    model: FiniteStateModel, ground: Plane, transport: WakeTransport | None, edges: Float[Array, " E"] | None = None
) -> Float[Array, "E L C"]:
    """Return the matrix of one plane, untabulated, for each edge of a half-plane; without edges E = 1."""
    into, onto = flow_matrix(model, ground, transport), disk_projection(model, ground)
    row, column = strength_factors(model)
    copies = 1 if transport is None else transport.nodes + 1
    factor = row[:, None] * jnp.tile(column, copies)

    def answer(region: Region | None) -> Float[Array, "L C"]:
        states = closing(eqx.tree_at(lambda m: m.region, model, region, is_leaf=lambda r: r is None), ground) @ into
        return onto @ jnp.concatenate([factor * states[:, :-2], states[:, -2:]], axis=1)

    if edges is None:
        found = answer(model.region)[None]
    else:
        found = jax.lax.map(lambda edge: answer(eqx.tree_at(lambda r: r.edge, model.region, edge)), edges)
    return found.at[:, :, : len(model.modes)].add(_lost(model, ground))


def _lost(model: FiniteStateModel, ground: Plane) -> Float[Array, "L M"]:
    """What the rotor's inflow loses where its wake contracts less than far from the ground."""
    if model.wake is None:
        return jnp.zeros((len(disk_modes(model)), len(model.modes)))
    fine = DiskQuadrature(NODES, model.quadrature.nodes_psi)
    return _on_disk(model, fine, lambda x, y: rotor_flow(model, None, x, y) - rotor_flow(model, ground, x, y))


def ground_table(
    model: FiniteStateModel,
    height: tuple[float, float],
    slope_deg: tuple[float, float] = (0.0, 0.0),
    edge: tuple[float, float] | None = None,
    transport: WakeTransport | None = None,
    nodes: tuple[int, int, int] = (18, 7, 33),
    tolerance: float = 1e-7,
) -> GroundTable:
    """Tabulate the ground's response over heights (over R), slopes (degrees) and, for a half-plane, edges (over R).

    model: its plane does not matter; its region must be a `HalfPlane` where `edge` is given. nodes: Chebyshev nodes in
    height, slope and edge; a parameter without range takes one. tolerance: of the compression, relative to the largest
    singular value, 1.5e-8 at the least. Raises InputError where a range is not one, the disk would cut the ground, or
    the wake is followed less deep than the ground may lie.
    """
    _check(model, height, slope_deg, edge, transport)
    ranges = [np.sqrt(height), np.deg2rad(slope_deg)] + ([] if edge is None else [np.array(edge)])
    counts = tuple(1 if low == high else n for (low, high), n in zip(ranges, nodes, strict=False))
    grids = [
        low + (high - low) * (np.polynomial.chebyshev.chebpts1(n) + 1) / 2 if n > 1 else np.array([low])
        for (low, high), n in zip(ranges, counts, strict=True)
    ]
    points = jnp.asarray(np.stack(np.meshgrid(*grids[:2], indexing="ij"), axis=-1).reshape(-1, 2))
    values = np.asarray(_over_planes(model, points, transport, None if edge is None else jnp.asarray(grids[2])))
    values = values.reshape(-1, *values.shape[2:])
    level = not np.any(np.array(slope_deg)) and model.region is None
    rows, columns = _blocks(model, 1 if transport is None else transport.nodes + 1, level)
    blocks = _gather(values, rows, columns)
    left, right = _compressed(blocks.reshape(len(values), -1), tolerance)
    return GroundTable(
        tuple(float(r[0]) for r in ranges),
        tuple(float(r[1]) for r in ranges),
        counts,
        rows,
        columns,
        (values.shape[1], values.shape[2]),
        jnp.asarray(left),
        jnp.asarray(right.reshape(-1, *blocks.shape[1:])),
    )


def _compressed(
    rows: Float[np.ndarray, "P N"], tolerance: float
) -> tuple[Float[np.ndarray, "P Q"], Float[np.ndarray, "Q N"]]:
    """Factors whose product is `rows` but for what singular values below a tolerance, of the largest, bring.

    The left one holds eigenvectors of A Aᵀ, in a third of the time of singular vectors and sharp down to the root of a
    rounding error.
    """
    rows = rows.astype(float)
    square, vectors = np.linalg.eigh(rows @ rows.T)
    left = vectors[:, square >= max(tolerance, np.sqrt(np.finfo(float).eps)) ** 2 * square[-1]]
    return left, left.T @ rows


@eqx.filter_jit
def _over_planes(
    model: FiniteStateModel,
    points: Float[Array, "P 2"],
    transport: WakeTransport | None,
    edges: Float[Array, " E"] | None,
) -> Float[Array, "P E L C"]:
    return jax.lax.map(lambda point: response(model, Plane(point[0] ** 2, point[1]), transport, edges), points)


def _check(model, height, slope_deg, edge, transport) -> None:
    for name, (low, high) in {"height": height, "slope_deg": slope_deg, "edge": edge or (0.0, 0.0)}.items():
        if not (np.isfinite(low) and np.isfinite(high) and low <= high):
            raise InputError(f"Argument `{name}` must be a range (low, high), but is ({low}, {high})")
    steepest = float(np.abs(slope_deg).max())
    radius = 1.0 if model.ground_radius is None else float(model.ground_radius)
    least = np.tan(np.deg2rad(steepest)) * max(radius, 1.0) if steepest < 60 else np.inf
    if not height[0] > least:
        raise InputError(
            f"Argument `height` must stay above {least:.3g} at {steepest:g} deg, where the disk cuts the ground, but "
            f"goes down to {height[0]}"
        )
    deepest = height[1] + least
    if transport is not None and transport.length < deepest:
        raise InputError(
            f"Argument `transport` must follow the wake down to {deepest:.3g} R, where the ground may lie, but ends at "
            f"{transport.length:g}"
        )
    if edge is not None and not isinstance(model.region, HalfPlane):
        raise InputError(f"Argument `edge` needs a model whose region is a half-plane, but it is {model.region!r}")


def _blocks(model: FiniteStateModel, copies: int, level: bool):
    """Rows and columns that couple: each harmonic's on level ground, else cosine and sine, or all of a region."""

    def key(mode) -> object:
        return (mode.m, mode.kind) if level else (mode.kind if model.region is None else 0)

    modes = list(model.modes.modes)
    row_keys = [key(mode) for mode in disk_modes(model).modes]
    column_keys = [key(mode) for mode in modes] * copies
    uniform, by_x = (key(type(modes[0])(m, m, "cos")) for m in (0, 1))
    column_keys += [uniform, by_x]
    keys = list(dict.fromkeys(row_keys))
    found = [
        tuple(tuple(i for i, k in enumerate(which) if k == one) for one in keys) for which in (row_keys, column_keys)
    ]
    return tuple(_padded(group, len(which)) for group, which in zip(found, (row_keys, column_keys), strict=True))


def _padded(groups: tuple[tuple[int, ...], ...], past: int) -> tuple[tuple[int, ...], ...]:
    longest = max(map(len, groups))
    return tuple(group + (past,) * (longest - len(group)) for group in groups)


def _gather(values: np.ndarray, rows: tuple[tuple[int, ...], ...], columns: tuple[tuple[int, ...], ...]) -> np.ndarray:
    """Blocks (P, B, I, J) of matrices (P, I, C), zero where padded."""
    padded = np.pad(values, ((0, 0), (0, 1), (0, 1)))
    parts = [padded[:, np.array(r)[:, None], np.array(c)[None, :]] for r, c in zip(rows, columns, strict=True)]
    return np.stack(parts, axis=1)
