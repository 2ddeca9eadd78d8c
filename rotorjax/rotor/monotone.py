"""Tables read by monotone cubics: through every point, with a continuous slope, and never beyond what the points span.

Cubic Hermite pieces whose slopes at the nodes are those of Fritsch & Carlson's monotone interpolant (scipy's PCHIP,
doi:10.1137/0717021). Straight pieces have a kink at every node, about which nothing can be linearised; an ordinary
spline overshoots steps.
"""

from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int


def inner_slopes(widths: Any, y: Any, xp: Any) -> Any:
    """Slopes at all rows but the first and the last, from widths [N−1] between nodes and values y [N, C] at them; xp:
    numpy, or jax's.

    The harmonic mean of the neighbouring intervals' slopes, weighted by their widths (Fritsch & Butland, SIAM J. Sci.
    Stat. Comput. 5, 1984, Eq. 5); zero where those differ in sign.
    """
    width = widths[:, None]
    slope = (y[1:] - y[:-1]) / width
    before, after = slope[:-1], slope[1:]
    w_before, w_after = 2 * width[1:] + width[:-1], width[1:] + 2 * width[:-1]
    same = before * after > 0
    total = w_before / xp.where(same, before, 1.0) + w_after / xp.where(same, after, 1.0)
    return xp.where(same, (w_before + w_after) / xp.where(same, total, 1.0), 0.0)


def hermite(x: Float[Array, "*n"], nodes: Float[Array, " N"]) -> tuple[Int[Array, "*n"], Float[Array, "*n 2 2"]]:
    """Interval index and the cubic Hermite basis [*n, corner, order] at x, that of slopes times the width."""
    i = jnp.clip(jnp.searchsorted(nodes, x, side="right", method="compare_all") - 1, 0, nodes.size - 2)
    start, width = jnp.moveaxis(jnp.stack([nodes[:-1], jnp.diff(nodes)], axis=-1)[i], -1, 0)
    t = (x - start) / width
    value = t * t * (3 - 2 * t)
    basis = jnp.stack([1 - value, width * t * (1 - t) ** 2, value, width * t * t * (t - 1)], -1)
    return i, basis.reshape(*basis.shape[:-1], 2, 2)


def with_slopes(x: Any, y: Any, xp: Any) -> Any:
    """Values and slopes [N, 2] at nodes x [N]; at both ends the slope of the piece there, with which `read` goes on.

    xp: numpy, or jax's.
    """
    widths = xp.diff(x)
    steps = xp.diff(y) / widths
    inner = inner_slopes(widths, y[:, None], xp)[:, 0]
    return xp.stack([y, xp.concatenate([steps[:1], inner, steps[-1:]])], axis=-1)


@partial(jax.jit, inline=True)
def read(at: Float[Array, "*n"], x: Float[Array, " N"], table: Float[Array, "N 2"]) -> Float[Array, "*n"]:
    """Of `with_slopes`, elementwise; straight beyond the nodes."""
    within = jnp.clip(at, x[0], x[-1])
    i, basis = hermite(within, x)
    inside = jnp.sum(table[i[..., None] + jnp.arange(2)] * basis, axis=(-2, -1))
    return inside + jnp.where(at < within, table[0, 1], table[-1, 1]) * (at - within)
