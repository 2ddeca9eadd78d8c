"""Solid surfaces in a flow: panels, and the source densities that close them.

Air in which u·n blows through the middle of a panel is kept out by sources of density σ with

    σ_i/2 + Σ_j≠i a_ij σ_j = −(u·n)_i,

a_ij the normal velocity at middle i by panel j at density 1 (with its image, over a plane): N equations for N panels,
the matrix inverted once. Sources stop air on the side that normals point to. Behind an open surface, a sheet, it comes
out again; a closed one stops it all round, which a deck or a roof wants: give them some thickness.
"""

from collections.abc import Sequence
from dataclasses import replace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.custom_derivatives import SymbolicZero
from jaxtyping import ArrayLike, Float

from rotorjax.checks import array, known, refuse, shown
from rotorjax.errors import InputError
from rotorjax.ground import Plane
from rotorjax.panels.kernel import normal_velocities, panel_velocity, seen

MOST = 4000
"""Panels whose matrix is still inverted: 128 MB, some seconds."""

ON_GROUND = 1e-6
"""Distance over R from the ground within which a face rests on it and is left out."""

FOOTPRINT = 0.7
"""Radius over R of the Gaussian with which what lies under a rotor counts for its floor."""

SPOTS = 2
"""Places along each side of a panel at which the flow between the middles is looked at."""

LEAKY = 0.3
"""Share of what blows on surfaces that goes through between the panels' middles, beyond which a user is warned."""

DEEPEST = 100.0
"""Depth over R of the floor where nothing lies under the rotor: a wake over it is that in free air, to 1e-6."""


class Panels(eqx.Module):
    """Flat panels. corners (P, 4, 3): over R, in the hub frame (x aft, y to starboard, z up) that does not turn,
    counter-clockwise seen from the air; a triangle has its last corner twice.
    """

    corners: Float[Array, "P 4 3"]

    def __len__(self) -> int:
        """P."""
        return len(self.corners)

    def __add__(self, other: "Panels") -> "Panels":
        """Both surfaces."""
        return Panels(jnp.concatenate([self.corners, other.corners]))

    @property
    @jax.jit
    def halves(self) -> Float[Array, "2 P 3"]:
        """Vector areas of the two triangles that a panel is made of."""
        a, b, c, d = jnp.moveaxis(self.corners, 1, 0)
        return 0.5 * jnp.stack([jnp.cross(b - a, c - a), jnp.cross(c - a, d - a)])

    @property
    @jax.jit
    def areas(self) -> Float[Array, " P"]:
        """Areas over R²."""
        return jnp.linalg.norm(jnp.sum(self.halves, axis=0), axis=-1)

    @property
    @jax.jit
    def normals(self) -> Float[Array, "P 3"]:
        """Unit normals, into the air."""
        return jnp.sum(self.halves, axis=0) / self.areas[:, None]

    @property
    @jax.jit
    def middles(self) -> Float[Array, "P 3"]:
        """Centroids: where no air goes through."""
        share = jnp.sum(self.halves * self.normals, axis=-1) / self.areas
        thirds = jnp.stack([self.corners[:, :3].mean(axis=1), self.corners[:, np.array([0, 2, 3])].mean(axis=1)])
        return jnp.sum(share[..., None] * thirds, axis=0)

    def spots(self, count: int) -> tuple[Float[Array, "P K 3"], Float[Array, "P K"]]:
        """K = count² points spread over each panel, and the share of its area that each stands for."""
        u, v = (w.ravel()[:, None] for w in np.meshgrid(*2 * [(np.arange(count) + 0.5) / count]))
        a, b, c, d = (w[:, None] for w in jnp.moveaxis(self.corners, 1, 0))
        points = (1 - v) * ((1 - u) * a + u * b) + v * ((1 - u) * d + u * c)
        patch = jnp.cross((1 - v) * (b - a) + v * (c - d), (1 - u) * (d - a) + u * (c - b))
        area = jnp.linalg.norm(patch, axis=-1)
        return points, area / jnp.sum(area, axis=1, keepdims=True)

    def moved(self, by: ArrayLike | Sequence[ArrayLike]) -> "Panels":
        """The same surface elsewhere, over R."""
        return Panels(self.corners + jnp.asarray(by, float))


class Solid(eqx.Module):
    """Surfaces that no air goes through, over a plane that mirrors them or none.

    panels: all of them. inverse (P, P): of the matrix of normal velocities; it belongs to the numbers of `panels` and
    of the plane, so make it anew where they change (`refitted`). share: of the panels' flow that counts, 1 in every
    physical case; a search may start below. wind (3,): of the air far away over the surfaces, over ΩR, in their axes;
    None where they stand still under the hub, and the wind is the hub's.
    """

    panels: Panels
    inverse: Float[Array, "P P"]
    share: Float[Array, ""]
    wind: Float[Array, "3"] | None = None

    def seen_from(self, place: Float[Array, "3"] | None, turn: Float[Array, "3 3"] | None) -> "Solid":
        """The surfaces in the frame of a hub at a place over R, turned by a matrix; the inverse stays what it is."""
        corners, wind = self.panels.corners, self.wind
        if place is not None:
            corners = corners - place
        if turn is not None:
            corners, wind = corners @ turn.T, None if wind is None else turn @ wind
        return replace(self, panels=Panels(corners), wind=wind)

    def densities(self, through: Float[Array, " P"], ground: Plane | None = None) -> Float[Array, " P"]:
        """Source densities over ΩR that answer a flow with these normal velocities at the panels' middles."""
        return _solved(self.panels, ground, self.inverse, -through)

    def answer(
        self, points: Float[Array, "N 3"], through: Float[Array, " P"], ground: Plane | None = None
    ) -> Float[Array, "N 3"]:
        """Velocity at points with which the surfaces answer a flow with these normal velocities at their middles."""
        return self.share * panel_velocity(points, self.panels.corners, self.densities(through, ground), ground)


@jax.jit
def influence(panels: Panels, ground: Plane | None = None) -> Float[Array, "P P"]:
    """Normal velocity at each panel's middle, on the side of the air, by each panel of density 1 and its image."""
    middles, normals = panels.middles, panels.normals
    own = jnp.eye(len(panels), dtype=middles.dtype)
    found = normal_velocities(middles, normals, panels.corners)
    found = (1 - own) * found + 0.5 * own
    if ground is None:
        return found
    # what an image induces at a point is the mirror of what its panel induces at the mirror point
    return found + normal_velocities(ground.reflect_points(middles), ground.reflect_vectors(normals), panels.corners)


def normal_flow(panels: Panels, ground: Plane | None, density: Float[Array, " P"]) -> Float[Array, " P"]:
    """`influence` times densities, without the matrix."""
    flow = panel_velocity(panels.middles, panels.corners, density, ground)
    normals = panels.normals
    # a panel's own flow at its middle is along the panel; its own part of n·v is the limit from the air, a half
    return jnp.sum(flow * normals, axis=1) + 0.5 * density


def watched(panels: Panels) -> Float[Array, "P W 3"]:
    """Where a flow is looked at for `leak`: each panel's middle, then SPOTS² places spread over it."""
    return jnp.concatenate([panels.middles[:, None], panels.spots(SPOTS)[0]], axis=1)


def leak(surfaces: Solid, ground: Plane | None, blown: Float[Array, "I P W"]) -> Float[Array, ""]:
    """Share of a flow that goes through between the panels' middles: normal velocities left there over those of the
    flow alone, both rms over all faces and instants.

    blown: normal velocities of the flow at the points of `watched`. Close before a panel a flow changes within it, and
    one density cannot answer that: smaller panels can.
    """
    panels, (points, shares) = surfaces.panels, surfaces.panels.spots(SPOTS)
    weights = panels.areas[:, None] * shares

    def of_instant(one: Float[Array, "P W"]) -> tuple[Array, Array]:
        density = surfaces.densities(one[:, 0], ground)
        answer = panel_velocity(points.reshape(-1, 3), panels.corners, density, ground).reshape(points.shape)
        left = one[:, 1:] + jnp.sum(answer * panels.normals[:, None], axis=-1) + 0.5 * density[:, None]
        return jnp.sum(weights * left**2), jnp.sum(weights * one[:, 1:] ** 2)

    left, met = jax.lax.map(of_instant, blown)
    return jnp.sqrt(jnp.sum(left) / jnp.sum(met))


def told(share: float | None) -> str | None:
    """What to know of surfaces that leak, in one line; None of those that do not."""
    if share is None or not share > LEAKY:
        return None
    return (
        f"{100 * share:.0f} % of what blows on the surfaces goes through between their panels' middles: where the wake "
        "runs close to them take smaller panels (`panel`), until little changes"
    )


@jax.custom_jvp
def _solved(panels: Panels, ground: Plane | None, inverse: Array, b: Array) -> Array:
    """Densities with influence @ σ = b; how they move with panels and ground needs no derivative of the matrix."""
    return inverse @ b


def _moved(primals: tuple, tangents: tuple) -> tuple[Array, Array]:
    """A dσ = db − dA σ, the last term only where panels or ground move."""
    panels, ground, inverse, _ = primals
    density = _solved(*primals)
    still = [isinstance(t, SymbolicZero) for t in jax.tree.leaves(tangents[:2])]
    moved_panels, moved_ground, _, change = jax.tree.map(_dense, tangents)
    if not all(still):
        both = (panels, ground), (moved_panels, moved_ground)
        change = change - jax.jvp(lambda p, g: normal_flow(p, g, density), *both)[1]
    return density, _solved(panels, ground, inverse, change)


_solved.defjvp(_moved, symbolic_zeros=True)


def _dense(tangent: Array | SymbolicZero) -> Array:
    return jnp.zeros(tangent.shape, tangent.dtype) if isinstance(tangent, SymbolicZero) else tangent  # type: ignore[arg-type]


def solid(surfaces: Panels, ground: Plane | None = None) -> Solid:
    """Close surfaces to the air: leave out what rests on the ground, and invert the matrix of normal velocities.

    Raises InputError where nothing is left, a panel has no area or lies under the ground, or there are more than MOST.
    """
    kept = _checked(surfaces, ground)
    fixed = jax.lax.stop_gradient((kept, ground))
    return Solid(kept, _inverse(*fixed), array(1.0))


@jax.jit
def _inverse(panels: Panels, ground: Plane | None) -> Array:
    return jnp.linalg.inv(influence(panels, ground))


def refitted(surfaces: Solid, ground: Plane | None) -> Solid:
    """The same surfaces with the inverse that belongs to their numbers and the ground's."""
    return replace(surfaces, inverse=_inverse(*jax.lax.stop_gradient((surfaces.panels, ground))))


def _checked(surfaces: Panels, ground: Plane | None) -> Panels:
    """Surfaces without the faces that rest on the ground; traced ones are looked at as numbers, if they can be."""
    numbers = jax.lax.stop_gradient((surfaces, ground))
    if not known(numbers):
        return surfaces
    panels, plane = numbers
    areas = np.asarray(panels.areas)
    if not np.all(areas > 0) or not np.all(np.isfinite(np.asarray(panels.corners))):
        worst = int(np.argmin(np.where(np.isfinite(areas), areas, -1)))
        raise InputError(
            f"Argument `surfaces` must hold panels with an area, but panel {worst} with corners "
            f"{np.asarray(panels.corners[worst]).tolist()} has none: leave it out"
        )
    if plane is not None:
        above = np.asarray(plane.distance(panels.corners))
        if np.any(above < -ON_GROUND):
            raise InputError(
                f"Argument `surfaces` must stay above the ground, but reaches {-above.min():.3g} R below it: "
                "end it on the ground, where its foot is left out"
            )
        surfaces = Panels(surfaces.corners[np.any(above > ON_GROUND, axis=1)])
    if not 0 < len(surfaces) <= MOST:
        raise InputError(
            f"Argument `surfaces` must hold 1 to {MOST} panels above the ground, but holds {len(surfaces)}: "
            "make the panels larger"
        )
    return surfaces


def check_panels(surfaces: object) -> None:
    """Raise InputError for what is no surface."""
    if not isinstance(surfaces, Panels):
        raise refuse("surfaces", "be made by rj.box, slab, wall, terrain or read_stl", shown(surfaces))


def check_clear(surfaces: Panels) -> None:
    """Raise InputError where a surface cuts the disk of a rotor at the origin, or has it inside."""
    numbers = jax.lax.stop_gradient(surfaces)
    if not known(numbers):
        return
    corners = np.asarray(numbers.corners, float)
    cut = _least_radius(corners)
    if np.min(cut) < 1:
        worst = int(np.argmin(cut))
        raise InputError(
            f"Argument `surfaces` must keep clear of the disk, but panel {worst} comes to {cut[worst]:.3g} R from the "
            "shaft at the height of the hub: move it away, by `.moved((dx, dy, dz))`"
        )
    if (around := -float(seen(jnp.zeros(3), numbers.corners)) / (4 * np.pi)) > 0.75:
        raise InputError(
            f"Argument `surfaces` must have the rotor outside, but encloses its hub ({around:.2f} of all directions "
            "meet it from inside): move it away, by `.moved((dx, dy, dz))`"
        )


def _least_radius(corners: Float[np.ndarray, "P 4 3"]) -> Float[np.ndarray, " P"]:
    """Least distance from the z axis at which each panel meets the plane z = 0; inf where it does not."""
    here, there = corners, np.roll(corners, -1, axis=1)
    a, b = here[..., 2], there[..., 2]
    crosses = a * b <= 0
    share = np.where(crosses & (a != b), a / np.where(a != b, a - b, 1.0), 0.0)
    met = np.where(crosses[..., None], here[..., :2] + share[..., None] * (there - here)[..., :2], np.nan)
    ends, starts = met[:, :, None], met[:, None]  # the chord between any two places where the rim crosses
    way = ends - starts
    length = np.sum(way**2, axis=-1)
    along = np.clip(-np.sum(starts * way, axis=-1) / np.where(length > 0, length, 1.0), 0.0, 1.0)
    nearest = np.linalg.norm(starts + along[..., None] * way, axis=-1).reshape(len(corners), -1)
    return np.where(np.isnan(nearest), np.inf, nearest).min(axis=1)


def floor(panels: Panels, ground: Plane | None) -> Plane:
    """Level plane that stands for what lies under a rotor: 1/height is the mean of 1/depth over its footprint.

    The footprint is a Gaussian about the shaft; what no panel under the hub covers is as deep as the ground. It serves
    the wake where only a plane is known: turns beyond the free ones, a search's start. Over a large roof it is the
    roof; beside a rotor's footprint nothing; smooth between.
    """
    middles = panels.middles
    depth = jnp.maximum(-middles[:, 2], 1e-2)
    near = jnp.exp(-0.5 * jnp.sum(middles[:, :2] ** 2, axis=1) / FOOTPRINT**2) / (2 * jnp.pi * FOOTPRINT**2)
    facing_up = panels.areas * jnp.maximum(panels.normals[:, 2], 0) * (middles[:, 2] < 0)
    share = facing_up * near
    covered = jnp.sum(share)
    deepest = 1 / DEEPEST if ground is None else 1 / ground.height
    mean = (jnp.sum(share / depth) + jnp.maximum(1 - covered, 0) * deepest) / jnp.maximum(covered, 1)
    height = 1 / jnp.maximum(mean, 1 / DEEPEST)
    return Plane(height, jnp.zeros_like(height))
