"""A wake whose edge gives way: what the ground does on one side of the disk and not on the other fades on the way up.

The slipstream is a free jet. Its edge is a vortex sheet with air at rest outside, so that the pressure on it is that of
the air and a disturbance u' along the jet is zero there. Small disturbances of a jet of radius ρ are then

    φ = J_m(j_mn r/ρ) cos mψ e^{j_mn z/ρ},   J_m(j_mn) = 0,

and what the ground at the depth h sends up in the harmonic m arrives weakened by e^{−j_m1 h/ρ}: over one radius a mean
loses 1 − e^{−2.4/ρ} of itself, a tilt 1 − e^{−3.8/ρ}. Sources on the ground under a wake that keeps its place know
nothing of that: they fade with the powers of the distance, all harmonics alike. The mean they have from measurements
(`potential.contraction`); of the harmonics that change sign across the shaft a share

    κ(d) = exp(−(j_11 − j_01) ∫ ds/ρ(s)),   from the depth d to the ground,

of what they send is left. There is nothing to choose in it. On the ground it is 1, so that the plane stays closed, and
the mean over the disk is untouched. Harmonics across which the sign stays, from the second on, are left as they are:
on a slope they are of its second order. Small is small against the jet: where an edge of the ground lets half of it by,
the free wake's tilt is no less than that of sources under a rigid wake, which is then the default.

In a wind the wake's foot lies h tan χ downwind, and what rises to the disk beside the wake meets no edge: of what is
lost the share e^{−(h tan χ)²} is, within a tenth that of the disk that two circles so far apart have in common, and
smooth.
"""

from collections.abc import Callable

import jax.numpy as jnp
from jaxtyping import Array, Float
from scipy.special import jn_zeros

from rotorjax.ground import Plane
from rotorjax.potential.contraction import Contraction
from rotorjax.potential.ground_source import depth

FADING = float(jn_zeros(1, 1)[0] - jn_zeros(0, 1)[0])
"""By how much faster than a mean a tilt fades in a jet, per radius of it."""


def left_of_tilt(wake: Contraction | None, d: Float[Array, "*N"], height: Float[Array, ""]) -> Float[Array, "*N"]:
    """Return κ at the depth d, over R, of a wake that meets the ground at the depth `height`; None: a cylinder."""
    way = height - d if wake is None else wake.radii_down_to(height) - wake.radii_down_to(d)
    return jnp.exp(-FADING * way)


def with_free_edge(
    upflow: Callable[[Float[Array, "*N 3"]], Float[Array, "G ..."]],
    ground: Plane,
    wake: Contraction | None,
    lean: Float[Array, ""] | float,
    points: Float[Array, "*N 3"],
) -> Float[Array, "G ..."]:
    """Return the ground's upflow at hub-frame points with the part that is odd across the shaft as a jet lets it by.

    upflow: of a wake that keeps its place. wake: over this plane. lean: tan χ. Between disk and plane a
    point has its opposite at the same share of the way down; beyond the disk's edge the wake's answer fades as r⁻⁴.
    """
    x, y, z = points[..., 0], points[..., 1], points[..., 2]
    own, across = depth(ground, x), jnp.maximum(depth(ground, -x), 0.0)
    down = jnp.clip(-z / jnp.maximum(own, 1e-6), 0.0, 1.0)  # share of the way from the disk to the plane
    opposite = jnp.stack([-x, -y, jnp.maximum(jnp.maximum(z, 0.0) - down * across, -depth(ground, -x))], axis=-1)
    here, there = jnp.moveaxis(upflow(jnp.stack([points, opposite])), 1, 0)
    near = jnp.exp(-((lean * ground.height) ** 2)) / (1 + jnp.maximum(x**2 + y**2 - 1, 0.0) ** 2)
    lost = near * (1 - left_of_tilt(wake, down * ground.height, ground.height))
    return here - lost / 2 * (here - there)
