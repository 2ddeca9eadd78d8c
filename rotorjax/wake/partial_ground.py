"""Ground on a part of the plane under a free wake: what it does to the flow at one instant.

The plane holds a roof or a deck: solid on its region, open beside it. A flat sheet of sources of density σ gives itself
the normal velocity σ/2 and nothing else, so that σ = −2 w closes the plane where it lies, w being the wake's own flow
through it. Over the whole plane that sheet is the image system; over a part of it the flow is

    c · image + the flow of σ = −2 (mask − c) w,

the same for every number c. With c the share of the footprint that is ground the limits are exact: over the whole plane
the image, over none of it nothing.

Images that are cut off at the edge, each segment's times the mask at its foot, are not right. They let air through the
region, and what would make up for that is no remedy: a filament whose strength changes along it induces a flow that
has vorticity in the air. Over a vortex ring the axial component then comes out right and the others are off by half
(benchmarks/partial_ground.py).

Beside the region air passes through the plane as if no ground were near: the sheet lets out below what it keeps out
above, as that of the finite-state model does (`rotorjax.region`), and the edge sheds no vorticity. Cores
spoil the identity a little: a segment with a core r_c is no potential flow, by (r_c/d)² of it at the distance d.
"""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from rotorjax.errors import InputError
from rotorjax.frames import disk_points, rotate_about_shaft
from rotorjax.ground import Plane
from rotorjax.region import Region
from rotorjax.wake.biot_savart import segment_velocity
from rotorjax.wake.field import wake_segments
from rotorjax.wake.model import FreeWake, WakeState, slices
from rotorjax.wake.segments import Segments

STRETCH = 2.0  # over R: the sheet's grid is even up to here and widens beyond
FOOTPRINT = np.sqrt((np.arange(8) + 0.5) / 8) * STRETCH, 2 * np.pi / 16 * np.arange(16)


class PartialGround(eqx.Module):
    """Ground on a region of a plane. nodes (static): of the sheet, along each axis from the shaft out. reach (static):
    of the sheet from the shaft, over R.
    """

    plane: Plane
    region: Region
    nodes: int = eqx.field(static=True)
    reach: float = eqx.field(static=True)

    def grid(self) -> tuple[Float[Array, "Q 3"], Float[Array, " Q"]]:
        """Points of the sheet (hub frame, over R) and their areas: the trapezoidal rule, even near the shaft."""
        step = np.arcsinh(self.reach / STRETCH) / self.nodes
        u = step * np.arange(-self.nodes, self.nodes + 1)
        line, width = STRETCH * np.sinh(u), step * STRETCH * np.cosh(u)
        x, y = (jnp.asarray(v.ravel()) for v in np.meshgrid(line, line, indexing="ij"))
        z = x * jnp.tan(self.plane.slope) - self.plane.height
        return jnp.stack([x, y, z], axis=-1), jnp.asarray(np.outer(width, width).ravel()) / jnp.cos(self.plane.slope)

    def mask(self, points: Float[Array, "N 3"]) -> Float[Array, " N"]:
        """Mask at points of the plane."""
        return self.region.mask(points[:, 0], points[:, 1])

    @property
    def share(self) -> Float[Array, ""]:
        """Share of the footprint, twice the rotor's radius, that is ground."""
        r, psi = (jnp.asarray(v.ravel()) for v in np.meshgrid(*FOOTPRINT, indexing="ij"))
        return jnp.mean(self.mask(disk_points(r, psi)))


def partial_ground(plane: Plane, region: Region, nodes: int = 60, reach: float = 10.0) -> PartialGround:
    """Make the ground on a region of a plane. Raises InputError where nodes or reach are too small to hold a rotor."""
    if nodes < 4 or nodes != int(nodes):
        raise InputError(f"Argument `nodes` must be a whole number of at least 4, but is {nodes}")
    if not (np.isfinite(reach) and reach >= STRETCH):
        raise InputError(f"Argument `reach` must be finite and at least {STRETCH:g} (over R), but is {reach}")
    return PartialGround(plane, region, int(nodes), float(reach))


def all_segments(model: FreeWake, state: WakeState, psi: float | Float[Array, ""] = 0.0) -> Segments:
    """Segments of all blades' wakes at one instant, blade 0 at azimuth psi, in the hub frame: fields (S, …).

    Raises InputError where the state holds other slices than one or one a blade.
    """
    blades, count = model.rotor.blades, slices(state)
    if count not in (1, blades):
        raise InputError(f"Argument `state` must hold 1 slice or {blades}, those of one instant, but holds {count}")
    found = wake_segments(model, state, psi)
    found = jax.tree.map(lambda a: jnp.broadcast_to(a, (blades, *a.shape[1:])), found)
    angles = (psi + 2 * jnp.pi / blades * jnp.arange(blades))[:, None]
    start, end = (rotate_about_shaft(a, angles).reshape(-1, 3) for a in (found.start, found.end))
    return Segments(start, end, found.strength.ravel(), found.core.ravel())


def ground_velocity(
    points: Float[Array, "N 3"],
    segments: Segments,
    ground: PartialGround,
    share: float | Float[Array, ""] | None = None,
) -> Float[Array, "N 3"]:
    """Velocity over ΩR that the ground adds at points above it (hub frame, over R). segments: of all blades.

    Points must be further from the sheet than its grid is wide, about 0.08 R by default. share: c, by default
    `ground.share`; the result must not depend on it, which shows how fine the grid is.
    """
    plane = ground.plane
    share = ground.share if share is None else share
    image = plane.reflect_vectors(segment_velocity(plane.reflect_points(points), *segments))
    at, area = ground.grid()
    through = segment_velocity(at, *segments) @ plane.normal
    strength = -area * (ground.mask(at) - share) * through / (2 * jnp.pi)  # σ dA / 4π

    def one(point: Array) -> Array:
        way = point - at
        return (strength * jnp.sum(way * way, axis=1) ** -1.5) @ way

    return share * image + jax.lax.map(one, points, batch_size=32)
