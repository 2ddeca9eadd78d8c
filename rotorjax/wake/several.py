"""Several rotors in one free wake: every rotor has its own states, and all are carried by the flow of all.

Hubs stand at places over R in a common frame (x aft, y to starboard, z up), shafts upright or tilted; one radius, one
speed, one number of blades. A rotor that turns clockwise is kept in a frame mirrored in y, as in potential/rotors.py,
so that its blades run along rising azimuth too. Level ground answers every wake with its image; surfaces answer all
wakes of an instant together.

How the rotors see each other:
    K = 1           rotors on one upright shaft, each in the flow of the others averaged over their azimuth: what is
                    left out is how the inflow pulses as blades pass each other, 2B times a revolution; not among
                    surfaces;
    K slices        rotors anywhere, periodic over the passage of a blade: the slices of one instant see each other
                    where they stand.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from rotorjax.checks import Range, array, check_range, known, refuse, shown
from rotorjax.ground import Plane, TurnedPlane
from rotorjax.operating import OperatingPoint
from rotorjax.panels.kernel import panel_velocity
from rotorjax.panels.surface import Panels, Solid, check_clear, floor, leak, solid, watched
from rotorjax.rotor.alike import alike
from rotorjax.rotor.geometry import Rotor
from rotorjax.wake.arrangement import axes_of, check_apart, places_of, senses_of, tilts_of
from rotorjax.wake.biot_savart import segment_velocity
from rotorjax.wake.dynamics import inputs_of
from rotorjax.wake.equilibrium import Evaluation, Unknowns, full_state, transported
from rotorjax.wake.field import Velocities, at_instants, from_hub, node_velocities, targets_of, to_hub, wake_segments
from rotorjax.wake.loads import blade_loads
from rotorjax.wake.model import FreeWake, WakeState, among_settings, check_surfaces, free_wake
from rotorjax.wake.performance import Coefficients, performance
from rotorjax.wake.segments import Segments
from rotorjax.wake.settings import WakeSettings

COPIES = 24
"""Least number of blades that stand for the mean over another rotor's azimuth: twice as many change the C_T of UH-60
rotors 0.2 R apart by 0.1 %."""

THRUST_SLOPE = 0.05
"""About ∂C_T/∂θ₀ of a rotor in its wake: the scale on which a missed thrust counts beside the wake's residual."""


class SeveralWakes(eqx.Module):
    """N rotors in one free wake, and the ground under the common origin.

    wakes: every array with a leading axis N. places (N, 3): hubs, over R. senses (N,): 1 counter-clockwise, −1 not.
    axes (N, 3, 3): each rotor's own axes in the common frame, as columns; mirrored in y where it turns clockwise.
    phases (N,): azimuth of each rotor's blade 0 as slice 0 stands there, in its own sense. coupling: share of each
    other's flow that counts, 1 in every physical case; a search may begin below. thrusts (N,): C_T that the collectives
    are trimmed to, or None. surfaces: in the common frame; what each rotor has of them is its floor. slices (static):
    K.
    """

    wakes: FreeWake
    places: Float[Array, "N 3"]
    senses: Float[Array, " N"]
    axes: Float[Array, "N 3 3"]
    phases: Float[Array, " N"]
    coupling: Float[Array, ""]
    thrusts: Float[Array, " N"] | None
    surfaces: Solid | None
    slices: int = eqx.field(static=True)

    def __len__(self) -> int:
        """N."""
        return len(self.places)

    @property
    def ground(self) -> Plane | None:
        """The ground in the common frame."""
        seen = self.wakes.ground
        return None if seen is None else Plane(seen.height[0] - self.places[0, 2], seen.slope[0])

    @property
    def angles(self) -> Float[Array, "N K"]:
        """Azimuth of each slice, in its rotor's own sense."""
        return self.phases[:, None] + 2 * jnp.pi / self.slices * jnp.arange(self.slices)

    def one(self, i: int) -> FreeWake:
        """The model of one rotor alone, over its own ground."""
        return jax.tree.map(lambda a: a[i], self.wakes)


class Together(NamedTuple):
    """What is solved for: the wakes' unknowns with a leading axis N, and the collectives (N,), rad."""

    wakes: Unknowns
    collective: Float[Array, " N"]


def several_wakes(
    rotor: Rotor | Sequence[Rotor],
    operating: OperatingPoint,
    places: Sequence[Sequence[float]],
    senses: Sequence[int] | None = None,
    ground: Plane | None = None,
    settings: WakeSettings | None = None,
    *,
    surfaces: Panels | None = None,
    collectives_deg: ArrayLike | None = None,
    thrusts: ArrayLike | None = None,
    phases_deg: ArrayLike | None = None,
    tilts_deg: Sequence[Sequence[float]] | None = None,
) -> SeveralWakes:
    """Make the model of N rotors in one free wake, hovering or climbing, in or out of ground effect.

    rotor: the one kind that all are of, or N of them with as many blades, one radius and airfoil tables of one size.
    places (N, 3): hubs over R, x aft, y to starboard, z up. senses: 1 counter-clockwise, −1 clockwise, seen from above;
    by default they alternate. ground: level, its height counted from the common origin. surfaces: as in `free_wake`,
    in the common frame. collectives_deg (N,): the operating point's by default. thrusts (N,): C_T of each rotor that
    its collective is trimmed to. phases_deg (N,): where blade 0 of each stands as slice 0 does. tilts_deg (N, 2): of
    each shaft forward and to starboard. Rotors on one upright shaft are solved in each other's mean flow (K = 1) where
    there are no surfaces.

    Raises InputError where shapes differ, a sense is not ±1, disks overlap, the ground is tilted or cuts a disk, the
    rotors are not alike in what they must be, and as `free_wake` does.

    >>> import rotorjax as rj
    >>> pair = several_wakes(*rj.rotor("uh60"), [(0, 0, 0), (0, 0, -0.2)])
    >>> pair.slices, pair.senses.tolist()
    (1, [1.0, -1.0])
    """
    place = places_of(places)
    rotors, sense = alike(rotor, len(place)), senses_of(senses, len(place))
    axes = axes_of(tilts_of(tilts_deg, len(place)), sense)
    check_apart(place, axes[..., 2])
    _check_ground(place, axes[..., 2], ground)
    if surfaces is not None:
        check_surfaces(surfaces, operating)
        settings = among_settings() if settings is None else settings
    count, pitch = len(place), operating.collective * 180 / np.pi if collectives_deg is None else collectives_deg
    models = [
        _over(free_wake(kind, _pitched(operating, angle), _under(ground, at, own), settings), surfaces, at, own)
        for kind, angle, at, own in zip(rotors, _each("collectives_deg", pitch, count), place, axes, strict=True)
    ]
    shared = np.all(np.ptp(place[:, :2], axis=0) == 0) and np.all(axes[:, 2, 2] == 1) and surfaces is None
    return SeveralWakes(
        wakes=jax.tree.map(lambda *a: jnp.stack(a), *models),
        places=jnp.asarray(place),
        senses=jnp.asarray(sense),
        axes=jnp.asarray(axes),
        phases=_each("phases_deg", 0.0 if phases_deg is None else phases_deg, count) * (jnp.pi / 180),
        coupling=array(1.0),
        thrusts=None if thrusts is None else _thrusts(thrusts, count),
        surfaces=None if surfaces is None else solid(surfaces, ground),
        slices=1 if shared else models[0].settings.azimuths,
    )


def _each(name: str, values: ArrayLike, count: int) -> Float[Array, " N"]:
    """One number for each rotor; a lone number stands for all."""
    refused = refuse(name, f"be a number or {count} of them, all finite", shown(values))
    try:
        found = array(values)
    except (TypeError, ValueError):  # words, lists of unlike lengths
        raise refused from None
    if found.shape not in ((), (count,)) or (known(found) and not np.all(np.isfinite(found))):
        raise refused
    return jnp.broadcast_to(found, (count,))


def _thrusts(values: ArrayLike, count: int) -> Float[Array, " N"]:
    found = _each("thrusts", values, count)
    if known(found):
        for value in np.asarray(found):
            check_range("thrusts", float(value), Range(0.0, 0.1, above=True, hint="C_T = T/(ρA(ΩR)²) of each rotor"))
    return found


def _pitched(operating: OperatingPoint, degrees: Array) -> OperatingPoint:
    return eqx.tree_at(lambda o: o.collective, operating, degrees * (jnp.pi / 180))


def _under(ground: Plane | None, place: np.ndarray, axes: np.ndarray) -> Plane | None:
    """The plane seen from a hub in its own axes."""
    return None if ground is None else TurnedPlane(ground.height + place[2], ground.slope, jnp.asarray(axes.T))


def _over(model: FreeWake, surfaces: Panels | None, place: np.ndarray, axes: np.ndarray) -> FreeWake:
    """A rotor's own model over its floor among surfaces. Raises InputError where they cut its disk."""
    if surfaces is None:
        return model
    turn = axes * np.array([1.0, np.sign(np.linalg.det(axes)), 1.0])  # not mirrored, which would turn panels inside out
    seen = Panels((surfaces.corners - place) @ turn)
    check_clear(seen)
    return replace(model, over=floor(seen, model.ground))


def _check_ground(place: np.ndarray, shafts: np.ndarray, ground: Plane | None) -> None:
    if ground is None or not known(ground):
        return
    if float(ground.slope) != 0:
        raise refuse("ground", "be level under several rotors", f"tilted by {np.rad2deg(float(ground.slope)):g} deg")
    lowest = float(ground.height) + place[:, 2] - np.hypot(shafts[:, 0], shafts[:, 1])
    if not np.all(lowest > 0):
        i = int(np.argmin(lowest))
        raise refuse("places", "keep every disk above the ground", f"{-lowest[i]:.3g} R under it for rotor {i}")


def evaluate(several: SeveralWakes, x: Unknowns) -> Evaluation:
    """States, velocities and loads of all rotors in one another's flow; every array with a leading axis N."""
    state, start = eqx.filter_vmap(full_state)(several.wakes, x)
    velocities = velocities_in(several, state)
    loads = eqx.filter_vmap(lambda m, v, gamma: blade_loads(m, v, gamma, inputs_of(m)))(
        several.wakes, velocities.control, x.gamma_bound
    )
    return Evaluation(state, velocities, loads, start)


def velocities_in(several: SeveralWakes, state: WakeState) -> Velocities:
    """Velocities at each rotor's control points and nodes in the flow of all, leading axis N."""
    own = jax.lax.map(lambda one: node_velocities(*one), (several.wakes, state, several.phases))
    added = several.coupling * interference(several, state)
    if several.surfaces is not None:
        added = added + answer(several, state)
    ends = np.cumsum([own.control.shape[2], np.prod(own.near.shape[2:4])])
    parts = jnp.split(added, ends, axis=2)
    return jax.tree.map(lambda v, more: v + more.reshape(v.shape), own, Velocities(*parts))


def interference(several: SeveralWakes, state: WakeState) -> Float[Array, "N K T 3"]:
    """What the other rotors' wakes and their images induce at each rotor's control points and nodes, in the frames of
    its slices, over ΩR.
    """
    count = len(several)
    targets = eqx.filter_vmap(targets_of)(several.wakes, state)
    segments = eqx.filter_vmap(wake_segments)(several.wakes, state, several.phases)
    here = jnp.arange(count)

    def seen(i: Array, j: Array) -> Array:
        source, sources = jax.tree.map(lambda a: a[j], (several.wakes, segments))
        return _from_another(several, i, j, targets[i], source, sources)

    def of_all_others(i: Array) -> Array:
        return jnp.sum(jax.lax.map(lambda j: seen(i, j), (i + 1 + here[:-1]) % count), axis=0)

    return jax.lax.map(of_all_others, here)  # one rotor after the other: a batch of kernels has no linear map


def _from_another(
    several: SeveralWakes, i: Array, j: Array, targets: Float[Array, "K T 3"], source: FreeWake, segments: Segments
) -> Float[Array, "K T 3"]:
    """Velocity at points of rotor i's slices from the wake of rotor j."""
    apart, turned = several.places[i] - several.places[j], several.axes[j].T @ several.axes[i]
    angles = several.angles
    at = to_hub(targets, angles[i], source.rotor.blades)
    points = at @ turned.T + apart @ several.axes[j]
    if several.slices == 1:
        flow = _mean_flow(source, jax.tree.map(lambda a: a[0], segments), points[0])[None]
    else:
        flow = at_instants(source, segments, points, angles[j])
    return from_hub(flow @ turned, angles[i], several.slices)


def _mean_flow(model: FreeWake, segments: Segments, points: Float[Array, "T 3"]) -> Float[Array, "T 3"]:
    """Flow of a rotor's axisymmetric wake averaged over its azimuth: many weak copies of one blade's."""
    blades = model.rotor.blades
    copies = -(-COPIES // blades)
    weak = segments._replace(strength=segments.strength / copies)
    return segment_velocity(points, *weak, plane=model.ground, blades=blades * copies)


def answer(several: SeveralWakes, state: WakeState) -> Float[Array, "N K T 3"]:
    """What the surfaces induce at each rotor's control points and nodes, in the frames of its slices, over ΩR."""
    density = densities(several, eqx.filter_vmap(wake_segments)(several.wakes, state, several.phases))
    assert several.surfaces is not None
    corners, share, ground = several.surfaces.panels.corners, several.surfaces.share, several.ground
    blades = several.wakes.rotor.blades

    def at(one: tuple[Array, Array, Array, Array]) -> Array:
        targets, place, axes, angles = one
        points = to_hub(targets, angles, blades) @ axes.T + place
        flow = jax.lax.map(lambda both: share * panel_velocity(both[0], corners, both[1], ground), (points, density))
        return from_hub(flow @ axes, angles, several.slices)

    targets = eqx.filter_vmap(targets_of)(several.wakes, state)
    return jax.lax.map(at, (targets, several.places, several.axes, several.angles))


def densities(several: SeveralWakes, segments: Segments) -> Float[Array, "I P"]:
    """Source densities of the panels over ΩR at each instant, against the flow of all wakes and their images."""
    surfaces = several.surfaces
    assert surfaces is not None
    blown = _blown(several, segments, surfaces.panels.middles, surfaces.panels.normals)
    return jax.lax.map(lambda one: surfaces.densities(one, several.ground), blown)


def leaked(several: SeveralWakes, state: WakeState) -> Float[Array, ""]:
    """Share of what all wakes blow on the surfaces that goes through between their panels' middles."""
    surfaces = several.surfaces
    assert surfaces is not None
    points, normals = watched(surfaces.panels), surfaces.panels.normals
    normal = jnp.broadcast_to(normals[:, None], points.shape).reshape(-1, 3)
    segments = eqx.filter_vmap(wake_segments)(several.wakes, state, several.phases)
    blown = _blown(several, segments, points.reshape(-1, 3), normal)
    return leak(surfaces, several.ground, blown.reshape(-1, *points.shape[:2]))


def _blown(
    several: SeveralWakes, segments: Segments, points: Float[Array, "P 3"], normals: Float[Array, "P 3"]
) -> Float[Array, "I P"]:
    """Normal velocity at points of the common frame, of all wakes and their images, at each instant."""
    instants = several.slices // several.wakes.rotor.blades

    def through(one: tuple[FreeWake, Segments, Array, Array, Array]) -> Array:
        model, sources, place, axes, angles = one
        at = jnp.broadcast_to((points - place) @ axes, (instants, len(points), 3))
        return jnp.sum(at_instants(model, sources, at, angles) * (normals @ axes), axis=-1)

    each = (several.wakes, segments, several.places, several.axes, several.angles)
    return jnp.sum(jax.lax.map(through, each), axis=0)


def told(x: Together, several: SeveralWakes) -> tuple[Together, Evaluation]:
    """How far a pass through all rotors' flow moves the wakes and how far the thrusts are off; with the evaluation."""
    driven = with_collectives(several, x.collective)
    found = evaluate(driven, x.wakes)
    new = eqx.filter_vmap(transported)(driven.wakes, found)
    moved = jax.tree.map(lambda a, b: a - b, new, x.wakes)
    if several.thrusts is None:
        missed = several.wakes.operating.collective - x.collective
    else:
        missed = (several.thrusts - loads_of(driven, found).thrust) / THRUST_SLOPE
    return Together(moved, missed), found


def residual(x: Together, several: SeveralWakes) -> Together:
    """`told` without the evaluation: zero at the periodic equilibrium."""
    return told(x, several)[0]


def with_collectives(several: SeveralWakes, collective: Float[Array, " N"]) -> SeveralWakes:
    """The rotors at other collectives (rad)."""
    return eqx.tree_at(lambda s: s.wakes.operating.collective, several, collective)


def loads_of(several: SeveralWakes, found: Evaluation) -> Coefficients:
    """Thrust, power and mean inflow of each rotor, arrays (N,)."""
    return eqx.filter_vmap(performance)(several.wakes, found)


def velocity(state: WakeState, points: Float[Array, "P 3"], several: SeveralWakes) -> Float[Array, "P 3"]:
    """Induced velocity over ΩR at points of the common frame (over R), mean over the instants of a blade's passage."""
    segments = eqx.filter_vmap(wake_segments)(several.wakes, state, several.phases)

    def one(model: FreeWake, sources: Segments, place: Array, axes: Array, angles: Array) -> Array:
        own = (points - place) @ axes
        if several.slices == 1:
            return _mean_flow(model, jax.tree.map(lambda a: a[0], sources), own) @ axes.T
        instants = several.slices // model.rotor.blades
        at = jnp.broadcast_to(own, (instants, *own.shape))
        return jnp.mean(at_instants(model, sources, at, angles), axis=0) @ axes.T

    each = (several.wakes, segments, several.places, several.axes, several.angles)
    flow = jnp.sum(jax.lax.map(lambda args: one(*args), each), axis=0)
    if several.surfaces is None:
        return flow
    mean = jnp.mean(densities(several, segments), axis=0)
    corners, share = several.surfaces.panels.corners, several.surfaces.share
    return flow + share * panel_velocity(points, corners, mean, several.ground)
