"""Roll-up: how the near wake's trailers become a few far filaments.

Trailer i of the last row carries γ_i = Γ_{i−1} − Γ_i. A smooth maximum of the bound circulation over the outer blade,

    Γ_tip = Σ_j p_j Γ_j,   p_j ∝ (Γ_j/max Γ)^n Δr_j   (r > 0.6 R),

is at the same time a split of the trailers: Γ_tip = Σ_i W_i γ_i with W_i = Σ_{j<i} p_j, the share of trailer i that the
tip vortex gathers. What is left, (1 − W_i)γ_i, goes to the inboard filaments by linear weights in span, so the sum of
all strengths is that of the trailers: zero. There is no switch; as n → ∞ the rule becomes "all trailers outboard of the
maximum".

A pair of filaments ±Γ_tip cannot carry the thrust of an arbitrary loading if Γ_tip is its maximum: the impulse of the
wake, ρΣγ r²/2 per radian, would differ from what the blade put in, by 20 % for the peaked loading of a UH-60, and the
inflow with it. The default "impulse" rule hands every trailer to the two filaments it lies between, or the two nearest
at the ends, by weights linear in r², so that for any loading both

    Σ_f Γ_f = Σ_i γ_i = 0   and   Σ_f Γ_f r_f² = Σ_i γ_i r_i² = 2 ∫ Γ r dr

hold. It is linear in Γ: as smooth as a rule can be.

The tip vortex starts at the mean place of a short stretch of the last row, `release` ± `release_band`. A single point
of that row will not do: its edge has begun to roll up, and the point moves on with every panel that resolves it.
"""

from typing import Literal, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from rotorjax.wake.model import FreeWake

SAMPLES = 16
"""Stations over which the place of the tip vortex is averaged."""


class Release(NamedTuple):
    """Where the far filaments start and how strong: points (F, 3), strength (F,)."""

    points: Float[Array, "F 3"]
    strength: Float[Array, " F"]


def trailers(gamma: Float[Array, "R ..."]) -> Float[Array, "R+1 ..."]:
    """Strength γ_i = Γ_{i−1} − Γ_i of the trailers between panels of strength Γ; they add up to zero."""
    edge = jnp.zeros_like(gamma[:1])
    return -jnp.diff(jnp.concatenate([edge, gamma, edge]), axis=0)


def tip_share(model: FreeWake, gamma: Float[Array, " R"]) -> Float[Array, " R+1"]:
    """W_i: the share of each trailer that goes into the tip vortex, rising from 0 at the root to 1 at the tip."""
    outer = jax.nn.sigmoid((model.stations - 0.6) / 0.03)
    # log of (Γ/Γ_max)^n through softplus: Γ ≤ 0 gets a weight that fades smoothly instead of a NaN
    scale = jnp.sqrt(jnp.mean(gamma**2) + 1e-12)
    height = jnp.log(jax.nn.softplus(8 * gamma / scale) / 8)
    weight = jax.nn.softmax(model.settings.sharpness * height + jnp.log(model.widths * outer))
    return jnp.concatenate([jnp.zeros(1, weight.dtype), jnp.cumsum(weight)])


def release(model: FreeWake, last_row: Float[Array, "R+1 3"], gamma: Float[Array, " R"]) -> Release:
    """Start points and strengths of the far filaments from the last row of the near wake and its ring strengths."""
    settings, inboard = model.settings, model.settings.inboard
    if settings.roll_up == "impulse":
        stations = jnp.stack([*(jnp.asarray(r) for r in inboard), settings.release])
        strength = _weights(model.edges**2, stations**2, "extrapolate") @ trailers(gamma)
        points = jnp.stack([*(at_span(model, last_row, r) for r in stations[:-1]), tip_point(model, last_row)])
        return Release(jnp.roll(points, 1, axis=0), jnp.roll(strength, 1))
    gathered = tip_share(model, gamma) * trailers(gamma)
    strength = jnp.sum(gathered)
    if model.settings.roll_up == "paper":
        point = last_row[-1]
    elif model.settings.roll_up == "centroid":
        # Γ_tip > 0 wherever the blade lifts; the floor keeps an unloaded blade finite
        point = (gathered @ last_row) / jnp.sqrt(strength**2 + 1e-16)
    else:
        point = tip_point(model, last_row)
    if not inboard:
        return Release(point[None], strength[None])
    rest = _weights(model.edges, jnp.asarray(inboard)) @ (trailers(gamma) - gathered)
    points = jnp.stack([at_span(model, last_row, jnp.asarray(r)) for r in inboard])
    return Release(jnp.concatenate([point[None], points]), jnp.concatenate([strength[None], rest]))


def tip_point(model: FreeWake, row: Float[Array, "R+1 3"]) -> Float[Array, "3"]:
    """Mean of a row of nodes over the span stations `release` ± `release_band`: where the rows roll up to."""
    across = (np.arange(SAMPLES) + 0.5) / SAMPLES * 2 - 1
    places = jax.vmap(lambda r: at_span(model, row, r))
    return jnp.mean(places(model.settings.release + model.settings.release_band * across), axis=0)


def at_span(model: FreeWake, row: Float[Array, "R+1 3"], r: Float[Array, ""]) -> Float[Array, "3"]:
    """Point of a row of nodes at span station r (over R), linear between trailers."""
    return jnp.stack([jnp.interp(r, model.edges, row[:, i]) for i in range(3)])


def _weights(
    x: Float[Array, " N"], nodes: Float[Array, " G"], beyond: Literal["extrapolate"] | None = None
) -> Float[Array, "G N"]:
    """Linear weights that hand each x to its neighbouring nodes; they sum to one over the nodes.

    Beyond the ends all goes to the last node, or with "extrapolate" to the last two so that Σ weights · nodes is x.
    """
    return jnp.stack([jnp.interp(x, nodes, unit, left=beyond, right=beyond) for unit in jnp.eye(len(nodes))])
