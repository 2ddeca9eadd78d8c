"""Several rotors: each with its place, tilt and sense of rotation, each inducing on the others, each with its ground
and its surfaces.

Every rotor has the states of `rotorjax.potential.dynamics` in its own frame; for one that turns clockwise that frame is
mirrored in y, so that its blades run along rising azimuth too. Another rotor's flow adds to the air that passes a disk:
the mass flow is V_T = |λ| and V̄ = λ + λ_i with λ = climb + own mean inflow λ_i + mean of what the others induce there;
λ_i has the own ground's answer in it where the model counts that in.
Two rotors at one place so share their flow, and one far below another climbs in its far wake. Wakes are straight along
their own rotor's axis and reach the others at once. Over ground and among surfaces each rotor's own sources and panels
close them to its wake (`rotorjax.potential.model`, `.surfaces`), and act on all rotors: what answers each answers all.
"""

from collections.abc import Sequence
from dataclasses import replace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import optimistix as optx
from jaxtyping import Array, Float

from rotorjax.checks import refuse
from rotorjax.errors import InputError
from rotorjax.ground import Plane
from rotorjax.panels.surface import Panels, Solid, check_clear, check_panels, solid
from rotorjax.potential.dynamics import rate_table
from rotorjax.potential.model import (
    FiniteState,
    FiniteStateModel,
    answer_matrix,
    answer_upflow,
    rotor_means,
    rotor_velocity,
)
from rotorjax.potential.model import velocity as velocity_of_one


class Rotors(eqx.Module):
    """B rotors of one radius.

    model: modes of each rotor, and the ground's sources. positions (B, 3): hubs in the common frame (x aft, y to
    starboard, z up), over R. frames (B, 3, 3): columns are each rotor's axes there. ground: plane under the common
    origin, or None; surfaces: in that frame, or None. sources (B, S, M): what answers unit states of each rotor, of
    ground and panels. inflow (B, B, N, M): downward flow of unit states of the second rotor at the N quadrature points
    of the first one's disk, with that answer.
    """

    model: FiniteStateModel
    positions: Float[Array, "B 3"]
    frames: Float[Array, "B 3 3"]
    ground: Plane | None
    surfaces: Solid | None
    sources: Float[Array, "B S M"]
    inflow: Float[Array, "B B N M"]


def rotors(
    model: FiniteStateModel,
    positions: Sequence[Sequence[float]],
    tilts_deg: Sequence[Sequence[float]] | None = None,
    senses: Sequence[int] | None = None,
    ground: Plane | None = None,
    surfaces: Panels | None = None,
) -> Rotors:
    """Make rotors from their hubs (over R), tilts about x and y (degrees) and senses (1 counter-clockwise, −1 not).

    model: its own plane is not used. ground: under the common origin; every rotor must be level then. surfaces: that no
    air goes through, in the common frame (`panels.shapes`); rotors and ground beside them must be level. Raises
    InputError where shapes differ, a sense is not ±1, disks meet, a disk would cut the ground or a surface, or the
    model does not go with surfaces.
    """
    if model.surfaces is not None:
        raise InputError(
            "Argument `model` must have no surfaces among several rotors, but has some: give them to `rotors`"
        )
    place = np.array(positions, float)
    count = len(place)
    tilts = np.zeros((count, 2)) if tilts_deg is None else np.array(tilts_deg, float)
    sense = np.ones(count) if senses is None else np.array(senses, float)
    if place.shape != (count, 3) or tilts.shape != (count, 2) or sense.shape != (count,) or count < 1:
        raise InputError(
            "Arguments `positions`, `tilts_deg`, `senses` must have shapes (B, 3), (B, 2), (B,), but have "
            f"{place.shape}, {tilts.shape}, {sense.shape}"
        )
    if not np.all(np.abs(sense) == 1):
        raise InputError(f"Argument `senses` must hold 1 (counter-clockwise) or -1, but is {sense.tolist()}")
    frames = np.array([_frame(row[0], row[1], s) for row, s in zip(np.deg2rad(tilts), sense, strict=True)])
    _require_apart(place, frames[:, :, 2])
    _require_over(place, tilts, ground)
    if surfaces is not None:
        _require_among(surfaces, place, tilts, ground, model)
    closed = None if surfaces is None else solid(surfaces, ground)
    places, axes = jnp.asarray(place), jnp.asarray(frames)
    sources, inflow = _unit_flow(model, places, axes, ground, closed)
    return Rotors(model, places, axes, ground, closed, sources, inflow)


def _require_among(
    surfaces: Panels, place: np.ndarray, tilts: np.ndarray, ground: Plane | None, model: FiniteStateModel
) -> None:
    """Refuse surfaces that cut a disk, and what does not go with them (`potential.model.finite_state_model`)."""
    check_panels(surfaces)
    for hub in place:
        check_clear(surfaces.moved(-hub))
    if np.any(tilts != 0):
        raise InputError(f"Argument `tilts_deg` must be zero among surfaces, but is {tilts.tolist()}")
    if ground is not None and float(ground.slope) != 0:
        raise refuse("ground", "be level beside surfaces", f"tilted by {np.rad2deg(float(ground.slope)):g} deg")
    if model.sources.parity == "even" or model.region is not None or model.modes.parity == "both":
        raise InputError(
            "Argument `model` must have odd ground sources, no region and no even terms beside surfaces: make it by "
            "finite_state_model(harmonics=1, ground_harmonics=6, ground_radial_terms=5)"
        )


def _frame(about_x: float, about_y: float, sense: float) -> np.ndarray:
    cx, sx, cy, sy = np.cos(about_x), np.sin(about_x), np.cos(about_y), np.sin(about_y)
    turn = np.array([[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]]) @ np.array([[1, 0, 0], [0, cx, -sx], [0, sx, cx]])
    return turn * np.array([1, sense, 1])


def _require_apart(place: np.ndarray, axes: np.ndarray) -> None:
    for i in range(len(place)):
        for j in range(i):
            if _meet(place[i], axes[i], place[j], axes[j]):
                raise InputError(
                    f"Argument `positions` must keep the disks apart, but rotors {j} and {i} at {place[j].tolist()} "
                    f"and {place[i].tolist()} overlap: move one by a radius or along its axis"
                )


def _meet(p: np.ndarray, n: np.ndarray, q: np.ndarray, m: np.ndarray) -> bool:
    """Whether two unit disks, at p and q with normals n and m, have a point in common."""
    along = np.cross(n, m)
    if np.linalg.norm(along) < 1e-9:
        return bool(abs((q - p) @ n) < 1e-6 and np.linalg.norm(q - p) < 2)
    along = along / np.linalg.norm(along)
    point = np.linalg.solve(np.stack([n, m, along]), np.array([n @ p, m @ q, 0.0]))
    spans = []
    for centre in (p, q):
        middle = (centre - point) @ along
        half2 = 1 - np.sum((centre - point - middle * along) ** 2)
        if half2 <= 0:
            return False
        spans.append((middle - np.sqrt(half2), middle + np.sqrt(half2)))
    return bool(max(spans[0][0], spans[1][0]) < min(spans[0][1], spans[1][1]))


def _require_over(place: np.ndarray, tilts: np.ndarray, ground: Plane | None) -> None:
    if ground is None:
        return
    if np.any(tilts != 0):
        raise InputError(f"Argument `tilts_deg` must be zero over ground, but is {tilts.tolist()}")
    slope = float(jnp.tan(ground.slope))
    height = float(ground.height) + place[:, 2] - place[:, 0] * slope
    if not np.all(height > abs(slope)):
        i = int(np.flatnonzero(~(height > abs(slope)))[0])
        raise InputError(
            f"Argument `positions` must keep every disk above the ground, but rotor {i} is {height[i]:.3g} R over it"
        )


def _under(ground: Plane, place: Float[Array, "3"]) -> Plane:
    """The plane seen from a rotor's hub."""
    return Plane(ground.height + place[2] - place[0] * jnp.tan(ground.slope), ground.slope)


def _own(model: FiniteStateModel, place: Array, frame: Array, ground: Plane | None, surfaces: Solid | None):
    """One rotor's model alone, over the ground and beside the surfaces that it sees."""
    seen = None if ground is None else _under(ground, place)
    return replace(model, ground=seen, surfaces=None if surfaces is None else _seen(surfaces, place, frame))


def _seen(surfaces: Solid, place: Float[Array, "3"], frame: Float[Array, "3 3"]) -> Solid:
    """Surfaces in a rotor's frame; in a mirrored one corners run the other way round. The inverse stays what it is."""
    corners = (surfaces.panels.corners - place) @ frame
    mirrored = corners[:, np.array([0, 3, 2, 1])]
    return replace(surfaces, panels=Panels(jnp.where(jnp.linalg.det(frame) < 0, mirrored, corners)))


@eqx.filter_jit
def _unit_flow(
    model: FiniteStateModel, places: Array, frames: Array, ground: Plane | None, surfaces: Solid | None
) -> tuple[Float[Array, "B S M"], Float[Array, "B B N M"]]:
    """`Rotors.sources` and `.inflow`."""
    x, y, _, _ = (jnp.asarray(v) for v in model.quadrature.rule())
    local = jnp.stack([x, y, jnp.zeros_like(x)], axis=-1)
    points = places[:, None] + local @ jnp.swapaxes(frames, 1, 2)

    def of_one(one: tuple[Array, Array]) -> tuple[Array, Array]:
        own, frame = _own(model, *one, ground, surfaces), one[1]
        sources, seen = answer_matrix(own), (points - one[0]) @ frame
        flow = rotor_velocity(own, own.ground, seen)
        flow = flow.at[2].add(answer_upflow(own, sources, seen))  # its axial part is all that level disks see
        return sources, -jnp.einsum("ia,ab,bmin->inm", frames[:, :, 2], frame, flow)

    sources, inflow = jax.lax.map(of_one, (places, frames))
    return sources, jnp.swapaxes(inflow, 0, 1)


def _area(model: FiniteStateModel) -> Float[Array, " N"]:
    _, _, nu, weights = model.quadrature.rule()
    return jnp.asarray(2 * nu * weights)


def mass_flows(a: Float[Array, "B M"], climb: Float[Array, " B"], system: Rotors) -> Float[Array, "B M"]:
    """Return the diagonals of V of all rotors."""
    model = system.model
    passing = jnp.einsum("n,ijnm,jm->ij", _area(model), system.inflow, a)
    others = jnp.sum(passing * (1 - jnp.eye(len(a))), axis=1)
    induced = jnp.diag(passing) if model.ground_in_mass_flow else a @ rotor_means(model, None)
    through = climb + induced + others
    return jnp.where(model.varying, jnp.abs(through + induced)[:, None], jnp.abs(through)[:, None])


def rates(
    t: Float[Array, ""], a: Float[Array, "B M"], tau: Float[Array, "B M"], climb: Float[Array, " B"], system: Rotors
) -> Float[Array, "B M"]:
    """Return d(a)/dψ of all rotors under loads tau and climb speeds (over ΩR); t does not enter."""
    del t
    return (tau - mass_flows(a, climb, system) * a) @ jnp.asarray(rate_table(system.model.modes)).T


@eqx.filter_jit
def steady(system: Rotors, tau: Float[Array, "B M"], climb: Float[Array, " B"] | None = None) -> Float[Array, "B M"]:
    """Return the states that stay under constant loads, by Newton's method from those of rotors on their own.

    tau: pressure coefficients with positive thrust; climb: over ΩR, zero by default. Raises InputError where the shape
    of tau differs, and an error at run time where Newton's method does not converge.
    """
    shape = (len(system.positions), len(system.model.modes))
    if tau.shape != shape:
        raise InputError(f"Argument `tau` must have shape {shape}, rotors and modes, but has {tau.shape}")
    still = jnp.zeros(shape[0]) if climb is None else climb
    first = tau[:, system.model.modes.index(0, 1)]
    start = tau / jnp.sqrt(2 / np.sqrt(3) * first)[:, None]

    def residual(a: Array, _: None) -> Array:
        return tau - mass_flows(a, still, system) * a

    return optx.root_find(residual, optx.Newton(rtol=1e-11, atol=1e-14), start, max_steps=60).value


def inflows(a: Float[Array, "B M"], system: Rotors) -> Float[Array, "B N"]:
    """Return λ (over ΩR, positive down through each disk) at the quadrature points of every disk, all rotors' flow."""
    return jnp.einsum("ijnm,jm->in", system.inflow, a)


def mean_inflows(a: Float[Array, "B M"], system: Rotors) -> Float[Array, " B"]:
    """Return the area-weighted mean of λ over each disk."""
    return inflows(a, system) @ _area(system.model)


@eqx.filter_jit
def velocity(a: Float[Array, "B M"], points: Float[Array, "N 3"], system: Rotors) -> Float[Array, "N 3"]:
    """Return the velocity (over ΩR) that all rotors, their ground and surfaces induce at points of the common frame,
    over R.
    """

    def of_one(one: tuple[Array, Array, Array, Array]) -> Array:
        place, frame, states, sources = one
        own = _own(system.model, place, frame, system.ground, system.surfaces)
        state = FiniteState(states, sources @ states)
        return velocity_of_one(state, (points - place) @ frame, own) @ frame.T

    return jnp.sum(jax.lax.map(of_one, (system.positions, system.frames, a, system.sources)), axis=0)


def inflow_at(
    a: Float[Array, "B M"], r: Float[Array, " R"], psi: Float[Array, " K"], system: Rotors
) -> Float[Array, "B K R"]:
    """Return λ (over ΩR, positive down through each disk) of all rotors' flow, at radii over R and azimuths of each
    rotor in its own sense (rad).
    """
    x, y = r * jnp.cos(psi)[:, None], r * jnp.sin(psi)[:, None]
    local = jnp.stack([x, y, jnp.zeros_like(x)], axis=-1).reshape(-1, 3)
    points = system.positions[:, None] + local @ jnp.swapaxes(system.frames, 1, 2)
    flow = velocity(a, points.reshape(-1, 3), system).reshape(points.shape)
    return -jnp.einsum("ina,ia->in", flow, system.frames[:, :, 2]).reshape(len(points), *x.shape)
