"""The wake between rotor and ground with its transit time: what left the disk is carried down, and accelerated.

A fluid particle at depth d below the disk's point B passed the disk when the wake there was s = d deep in time. With
b(s, ψ) the rotor's states and q(s, ψ) the loading per mass flow of that moment, both carried along,
∂b/∂ψ + V ∂b/∂s = 0 and b(0) = a, its downward velocity is that of the disk and what pressure has added since:

    w(d) = Σ P̄ b(d) + Σ ∫₀^d (−∂Φ(s)/∂s) q(d − s) ds,   Φ(s) at the mirror point, a height s above the disk.

Integrated by parts the last term is P̄ q(d) − Φ(d) q(0) − ∫₀^d Φ(s) q'(d − s) ds: for steady loads 2P̄ − Φ(d) (Eq. 32) at
once. It is the linear flow, causal and without costates; the equation of the rotor gives q = b − ρ D⁻¹M ∂b/∂s
with ρ = V_T/V, so b alone is carried, at Chebyshev nodes of the depth. ρ is taken in hover (1, and ½ for the states
that V̄ carries): exact for "linear" mass flow, and without climb. A contracted wake is carried as the cylinder of its
radius, at the disk's V_T: what it gains in speed is left out.
"""

from functools import cache

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from rotorjax.errors import InputError
from rotorjax.ground import Plane
from rotorjax.potential.field import disk_functions, pressure_functions
from rotorjax.potential.ground_source import depth
from rotorjax.potential.matrices import apparent_mass, damping
from rotorjax.potential.model import FiniteStateModel, wake_over
from rotorjax.potential.modes import ModeTable

_GAUSS = 16  # nodes of the acceleration's integral over the way down


@cache
def _chebyshev(count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Lobatto nodes in [0, 1] from 0 on, nodal values to coefficients in T_k(2s − 1), and d/ds between nodal values."""
    node = -np.cos(np.pi * np.arange(count + 1) / count)
    vandermonde = np.polynomial.chebyshev.chebvander(node, count)
    slopes = np.stack(
        [np.polynomial.chebyshev.chebval(node, np.polynomial.chebyshev.chebder(row)) for row in np.eye(count + 1)],
        axis=-1,
    )
    inverse = np.linalg.inv(vandermonde)
    return (node + 1) / 2, inverse, 2 * slopes @ inverse


class WakeTransport(eqx.Module):
    """The wake below the disk at K + 1 Chebyshev nodes of its depth, all static.

    nodes: K, without the one on the disk. length: depth that is followed, over R, at least that of the ground.
    """

    nodes: int = eqx.field(static=True)
    length: float = eqx.field(static=True)

    @property
    def depths(self) -> np.ndarray:
        """Depths of the nodes from the disk down, over R, (K + 1,)."""
        return self.length * _chebyshev(self.nodes)[0]

    @property
    def slope(self) -> np.ndarray:
        """∂/∂s between nodal values, (K + 1, K + 1)."""
        return _chebyshev(self.nodes)[2] / self.length

    def weights(self, s: Float[Array, "*N"]) -> Float[Array, "*N K+1"]:
        """Weights of the nodal values in the value at depth s."""
        x = 2 * s / self.length - 1
        rows = [jnp.ones_like(x), x]
        for _ in range(self.nodes - 1):
            rows.append(2 * x * rows[-1] - rows[-2])
        return jnp.stack(rows, axis=-1) @ jnp.asarray(_chebyshev(self.nodes)[1], x.dtype)

    def rate(self, a: Float[Array, " M"], wake: Float[Array, "K M"], speed: Float[Array, ""]) -> Float[Array, "K M"]:
        """Return d(wake)/dψ = −V ∂b/∂s below the disk, where b = a."""
        return -speed * (jnp.asarray(self.slope[1:], a.dtype) @ self.whole(a, wake))

    def whole(self, a: Float[Array, " M"], wake: Float[Array, "K M"]) -> Float[Array, "K+1 M"]:
        """b at all nodes, the disk's first."""
        return jnp.concatenate([a[None], wake])

    def settled(self, a: Float[Array, " M"]) -> Float[Array, "K M"]:
        """The wake of a rotor whose states have long been a."""
        return jnp.broadcast_to(a, (self.nodes, a.size))


def wake_transport(length: float, nodes: int = 12) -> WakeTransport:
    """Make the transport. Raises InputError where length is not positive or nodes is less than 2."""
    if not (np.isfinite(length) and length > 0):
        raise InputError(f"Argument `length` must be positive and finite (depth of the wake, over R), but is {length}")
    if nodes < 2:
        raise InputError(f"Argument `nodes` must be at least 2, but is {nodes}")
    return WakeTransport(int(nodes), float(length))


@cache
def _loading_lag(modes: ModeTable, varying: tuple[bool, ...]) -> np.ndarray:
    """ρ D⁻¹M: what q lags behind b, for each unit of ∂b/∂s, (M, M)."""
    ratio = np.where(varying, 0.5, 1.0)
    return ratio[:, None] * np.linalg.solve(damping(modes, modes), apparent_mass(modes, modes))


def transported_flow(
    model: FiniteStateModel,
    transport: WakeTransport,
    ground: Plane,
    x: Float[Array, " N"],
    y: Float[Array, " N"],
) -> Float[Array, "N M K+1"]:
    """Return the flow into the plane at its points (x, y), along its normal, of unit states at each node of the wake.

    Summed over the nodes it is `ground_source.rotor_on_ground` for pressure modes.
    """
    modes, d, wake = model.modes, depth(ground, x), wake_over(model, ground)
    radius = 1.0 if wake is None else wake.radius  # a contracted wake is the cylinder of its radius
    at_foot = disk_functions(modes, x / radius, y / radius).T  # (N, M)
    arrival, on_disk = transport.weights(d), transport.weights(jnp.zeros_like(d))
    node, weight = np.polynomial.legendre.leggauss(_GAUSS)
    heights = d[:, None] * jnp.asarray((node + 1) / 2, x.dtype)  # (N, J)
    above = jnp.stack([*(jnp.broadcast_to(v[:, None], heights.shape) for v in (x, y)), heights], axis=-1)
    between = jnp.einsum(
        "mnj,n,j,njk->nmk",
        pressure_functions(modes, above / radius),
        d,
        jnp.asarray(weight / 2, x.dtype),
        transport.weights(d[:, None] - heights) @ jnp.asarray(transport.slope, x.dtype),
    )
    mirror = pressure_functions(modes, jnp.stack([x, y, d], axis=-1) / radius).T
    carried = at_foot[:, :, None] * arrival[:, None, :]
    loaded = carried - mirror[:, :, None] * on_disk[:, None, :] - between
    loaded = jnp.where(modes.odd[None, :, None], loaded, 0.0)
    lag, slope = (
        jnp.asarray(v, x.dtype) for v in (_loading_lag(modes, tuple(model.varying.tolist())), transport.slope)
    )
    lagged = jnp.einsum("nmj,mp,jk->npk", loaded, lag, slope)
    return jnp.cos(ground.slope) * (carried + loaded - lagged)
