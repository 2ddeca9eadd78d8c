"""Exact steady flow of pressure and source modes in a skewed stream: the reference that finite states converge to.

At unit speed along e = (sin χ, 0, −cos χ), aft and down, the velocity is ∫ ∇Φ dξ from far upstream. Above the disk the
integrand is smooth and taken by quadrature. Below, the streamline has crossed the disk: the adjoint theorem (Eq. 7 with
right parities) brings that back to flow above,

    axial  v_A = v_B + s (v†_B − v†_D),   in-plane  q_A = q_B − s (q†_B − q†_D),   s = (−1)^{n+m+1},

B where the streamline of A met the disk's plane, D the mirror image of A above, † the flow in the stream that comes
down from aft, of skew −χ. For χ = 0 it is `field.field_functions`. Finite states represent the integral by functions
of the axial stream, which takes many of them where χ is large (tests/potential/test_skewed.py).
"""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from rotorjax.errors import InputError
from rotorjax.potential.field import pressure_functions
from rotorjax.potential.modes import ModeTable

_NODES = 20
_SPLITS = (0.3, 1.0, 3.0)  # beside the places where the streamline passes the edge


def _clustered() -> tuple[np.ndarray, np.ndarray]:
    """Gauss nodes and weights in [0, 1], crowded at both ends, where the edge of the disk may be near."""
    node, weight = np.polynomial.legendre.leggauss(_NODES)
    node, weight = (node + 1) / 2, weight / 2
    return node**3 * (10 - 15 * node + 6 * node**2), 30 * node**2 * (1 - node) ** 2 * weight


def _way_up(points: Float[Array, "N 3"], chi: Float[Array, ""]) -> tuple[Float[Array, "N S"], Float[Array, "N S"]]:
    """Distances upstream from each point and their weights, from 0 to infinity."""
    x, y, sine = points[:, 0], points[:, 1], jnp.sin(chi)
    slow = jnp.abs(sine) < 1e-2
    within = jnp.sqrt(jnp.maximum(1 - y * y, 0.0))
    passed = [jnp.clip((x + side * within) / jnp.where(slow, 1e-2, sine), 0.0, 60.0) for side in (-1, 1)]
    splits = [jnp.full_like(x, s) for s in _SPLITS]
    ends = jnp.sort(jnp.stack([jnp.zeros_like(x), *splits, *passed], axis=1), axis=1)
    node, weight = (jnp.asarray(v, x.dtype) for v in _clustered())
    width = jnp.diff(ends, axis=1)[:, :, None]
    s, ds = ends[:, :-1, None] + width * node, width * weight
    plain, share = np.polynomial.legendre.leggauss(_NODES)
    plain, share = jnp.asarray((plain + 1) / 2, x.dtype), jnp.asarray(share / 2, x.dtype)
    far = ends[:, -1:] + 1.0
    between = ends[:, -1:] + plain, jnp.broadcast_to(share, (x.size, _NODES))
    beyond = far / plain, far * share / plain**2
    rows = [(s.reshape(x.size, -1), ds.reshape(x.size, -1)), between, beyond]
    return jnp.concatenate([r[0] for r in rows], axis=1), jnp.concatenate([r[1] for r in rows], axis=1)


def _from_upstream(modes: ModeTable, points: Float[Array, "N 3"], chi: Float[Array, ""]) -> Float[Array, "3 M N"]:
    """∫ ∇Φ ds from the points up to infinity, on and above the disk."""
    s, ds = _way_up(points, chi)
    way = jnp.stack([-jnp.sin(chi), jnp.zeros_like(chi), jnp.cos(chi)])
    along = points[:, None, :] + s[..., None] * way

    def component(axis: Array) -> Array:
        direction = jnp.broadcast_to(axis, along.shape)
        slope = jax.jvp(lambda p: pressure_functions(modes, p), (along,), (direction,))[1]
        return jnp.einsum("mns,ns->mn", slope, ds)

    return jax.vmap(component)(jnp.eye(3, dtype=points.dtype))


@jax.jit
def skewed_functions(modes: ModeTable, points: Float[Array, "N 3"], chi: Float[Array, ""]) -> Float[Array, "3 M N"]:
    """Return the velocity (hub frame) of unit pressure of each mode at unit speed, at any hub-frame points over R.

    chi: skew of the stream (rad), 0 axial, up to 85°. A mode's unit pressure over a mass flow V gives 1/V of it. The
    source mode (0, 0) is left out of the in-plane components' accuracy: its flow falls off slowly. Raises InputError
    where the points are not (N, 3).
    """
    if points.ndim != 2 or points.shape[-1] != 3:
        raise InputError(f"Argument `points` must have shape (N, 3), but has {points.shape}")
    height = points[:, 2]
    below = jnp.maximum(-height, 0.0)
    foot = jnp.stack([points[:, 0] - below * jnp.tan(chi), points[:, 1], jnp.maximum(height, 0.0)], axis=-1)
    mirror = points.at[:, 2].set(below)
    flow = _from_upstream(modes, foot, chi)
    adjoint = _from_upstream(modes, foot, -chi) - _from_upstream(modes, mirror, -chi)
    sign = jnp.where(modes.odd, 1.0, -1.0)[None, :, None] * jnp.array([-1.0, -1.0, 1.0])[:, None, None]
    return flow + jnp.where(height < 0, sign * adjoint, 0.0)
