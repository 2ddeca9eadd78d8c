"""Roll-up: how the near wake's trailers become a few far filaments.

Trailer i of a row carries γ_i = Γ_{i−1} − Γ_i. A smooth maximum of the bound circulation over the outer blade,

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

The tip vortex starts at the mean place of a short stretch of a row, `release` ± `release_band`. A single point of that
row will not do: its edge has begun to roll up, and the point moves on with every panel that resolves it.

The filaments start at the near wake's last row (`roll_up_start` 1), or before it: then they carry a share that rises
linearly in age, from nothing to all at that row, and the trailers what is left. A sheet takes some chords to roll up,
and where a lattice ends at once can be felt: under the next blade of four C_T rises by 2 to 3 % (docs/free_wake.md).
"""

from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from rotorjax.wake.model import FreeWake
from rotorjax.wake.settings import WakeSettings

SAMPLES = 16
"""Stations over which the place of the tip vortex is averaged."""


class Release(NamedTuple):
    """Where the far filaments start and how strong: points (F, 3), strength (F,)."""

    points: Float[Array, "F 3"]
    strength: Float[Array, " F"]


@partial(jax.jit, inline=True)
def trailers(gamma: Float[Array, "R ..."]) -> Float[Array, "R+1 ..."]:
    """Strength γ_i = Γ_{i−1} − Γ_i of the trailers between panels of strength Γ; they add up to zero."""
    edge = jnp.zeros_like(gamma[:1])
    return -jnp.diff(jnp.concatenate([edge, gamma, edge]), axis=0)


@partial(jax.jit, inline=True)
def tip_share(model: FreeWake, gamma: Float[Array, " R"]) -> Float[Array, " R+1"]:
    """W_i: the share of each trailer that goes into the tip vortex, rising from 0 at the root to 1 at the tip."""
    outer = jax.nn.sigmoid((model.stations - 0.6) / 0.03)
    # log of (Γ/Γ_max)^n through softplus: Γ ≤ 0 gets a weight that fades smoothly instead of a NaN
    scale = jnp.sqrt(jnp.mean(gamma**2) + 1e-12)
    height = jnp.log(jax.nn.softplus(8 * gamma / scale) / 8)
    weight = jax.nn.softmax(model.settings.sharpness * height + jnp.log(model.widths * outer))
    return jnp.concatenate([jnp.zeros(1, weight.dtype), jnp.cumsum(weight)])


def rolled_up(settings: WakeSettings, age: Float[np.ndarray, "*n"]) -> Float[Array, "*n"]:
    """Share of the trailers' circulation, 0 to 1, that the far filaments carry at these ages (rad).

    >>> settings = WakeSettings(near_wake_deg=120.0, roll_up_start=0.5)
    >>> rolled_up(settings, np.deg2rad([45.0, 90.0, 150.0])).round(3).tolist()
    [0.0, 0.5, 1.0]
    """
    first, last = settings.lattice_ages[[settings.release_ages, -1]]
    # where both are one age all is rolled up from there on
    return jnp.clip((age - first) / max(last - first, 1e-6), 0, 1)


@partial(jax.jit, inline=True)
def release(model: FreeWake, row: Float[Array, "R+1 3"], gamma: Float[Array, " R"]) -> Release:
    """Start points and strengths of the far filaments from the row of the near wake that they leave, and its rings'."""
    settings, inboard = model.settings, model.settings.inboard
    points = _along(row, _risen(model))
    if settings.roll_up == "impulse":
        stations = jnp.stack([*map(jnp.asarray, inboard), settings.release])
        return Release(points, trailers(gamma) @ _weights(model.edges**2, stations**2, beyond=True, first=-1))
    gathered = tip_share(model, gamma) * trailers(gamma)
    strength = jnp.sum(gathered)
    if settings.roll_up == "paper":
        points = points.at[0].set(row[-1])
    elif settings.roll_up == "centroid":
        # Γ_tip > 0 wherever the blade lifts; the floor keeps an unloaded blade finite
        points = points.at[0].set((gathered @ row) / jnp.sqrt(strength**2 + 1e-16))
    if not inboard:
        return Release(points, strength[None])
    rest = (trailers(gamma) - gathered) @ _weights(model.edges, jnp.asarray(inboard))
    return Release(points, jnp.concatenate([strength[None], rest]))


def tip_point(model: FreeWake, row: Float[Array, "R+1 3"]) -> Float[Array, "3"]:
    """Mean of a row of nodes over the span stations `release` ± `release_band`: where the rows roll up to."""
    return _along(row, _risen(model))[0]


def _risen(model: FreeWake) -> Float[Array, "F R"]:
    """How far along each panel the filaments start, 0 to 1: the tip vortex (a mean), then the others."""
    settings = model.settings
    across = (np.arange(SAMPLES) + 0.5) / SAMPLES * 2 - 1
    centres = jnp.stack([settings.release, *map(jnp.asarray, settings.inboard)])
    bands = settings.release_band * np.eye(settings.filaments)[0]
    return jnp.mean(ramps(centres[:, None] + bands[:, None] * across, model.edges), axis=1)


def _along(row: Float[Array, "R+1 3"], risen: Float[Array, "F R"]) -> Float[Array, "F 3"]:
    """Points on the straight lines through a row of nodes."""
    return row[0] + risen @ jnp.diff(row, axis=0)


def _weights(
    x: Float[Array, " N"], nodes: Float[Array, " G"], beyond: bool = False, first: int = 0
) -> Float[Array, "N G"]:
    """Linear weights that hand each x to its neighbouring nodes; they sum to one over the nodes.

    What lies outside all goes to the last node, or with `beyond` to the last two so that Σ weights · nodes is x.
    first: the node that comes first.
    """
    unit = np.roll(np.eye(nodes.shape[0]), -first, axis=1)
    return unit[0] + ramps(x, nodes, beyond) @ np.diff(unit, axis=0)


@partial(jax.jit, static_argnames="beyond", inline=True)
def ramps(x: Float[Array, "*n"], nodes: Float[Array, " G"], beyond: bool = False) -> Float[Array, "*n G-1"]:
    """How far each x has come along each interval between rising nodes: 0 before it, 1 behind it.

    beyond: the first and the last interval go on outside.
    """
    low, high = np.zeros(nodes.shape[0] - 1), np.ones(nodes.shape[0] - 1)
    if beyond:
        low[:1], high[-1:] = -np.inf, np.inf
    return jnp.clip((x[..., None] - nodes[:-1]) / jnp.diff(nodes), low, high)
