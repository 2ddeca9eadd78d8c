"""The three-quarter-chord condition: what a blade of finite chord changes in its own lifting line's downwash.

A lifting line reads the downwash where the bound vortex lies, a quarter of the chord behind the edge. A section answers
to the flow at three quarters of its chord (Pistolesi), where the wing's own trailers have half a chord more of their
length upstream, and where its bound vortex, not being straight and endless with one strength, no longer gives just
Γ/πc. Weissinger's method reads it there (NACA TM 1120, 1947): for a wing of aspect ratio 6 the lift slope falls by four
per cent, as lifting-surface theory and experiment have it; for slender blades the change goes away like 1/A². Towards
the tip, where the bound vortex ends and a chord is long against the distance to the edge, it is felt on any blade.

The free wake's lattice gives the downwash at the lifting line, across which the force acts: it decides the induced
power. What the other place adds decides the lift only; it is geometry of the blade alone, so it is one constant matrix
of a flat wake that leaves straight to the rear; half a chord of curvature is of the next order.
"""

from functools import partial

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float


@partial(jax.jit, inline=True)
def chord_downwash(
    stations: Float[Array, " R"], edges: Float[Array, " R+1"], behind: Float[Array, " R"]
) -> Float[Array, "R R"]:
    """Matrix S: (S Γ)_i is the downwash at `behind` the lifting line less that on it and less Γ_i/(2π behind).

    stations, edges: control points and panel edges along the span; behind: distance downstream of the line at each
    control point, half a chord for Weissinger's condition; any one unit of length. Zero where `behind` is 0.

    At an edge h = y − y_edge, R² = h² + d² a panel's trailer gains d/(hR) and its bound vortex, beyond the straight
    endless one, −sgn(h) d/(R(R + |h|)), both over 4π; together d/(h(R + |h|)).
    """
    h = stations[:, None] - edges
    d = behind[:, None]
    edge = d / (h * (jnp.sqrt(h**2 + d**2) + jnp.abs(h)))
    return (edge[:, :-1] - edge[:, 1:]) / (4 * jnp.pi)
