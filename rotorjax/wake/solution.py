"""Solving for the periodic wake, from nothing or from a neighbouring case, and what is read off it.

`solve` does its own continuation. From a prescribed wake over level ground or none it goes to the case by Anderson's
iteration and Newton's; where that is lost, by way of a distant ground or an auxiliary flow. The ground then tilts. From
a solved case it moves height and slope from there to here (search.py).
"""

from dataclasses import dataclass, replace
from typing import Any, Protocol

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from rotorjax.frames import disk_points, rotate_about_shaft
from rotorjax.rotor.blade_element import disk_loading
from rotorjax.wake.above import above_ground
from rotorjax.wake.clock import Clock
from rotorjax.wake.equilibrium import Evaluation, Unknowns, displacement, evaluated, look, spread
from rotorjax.wake.field import leaked, velocity
from rotorjax.wake.model import FreeWake, WakeState, azimuths
from rotorjax.wake.performance import performance
from rotorjax.wake.search import Progress, Search, on_host
from rotorjax.wake.start import lengthens, prescribed

Number = Numbers = Any  # of numpy, or traced by jax


@dataclass(frozen=True)
class Solution:
    """A periodic wake and the rotor in it. Lengths over R, velocities over ΩR, ψ in rad; arrays are numpy's and
    numbers floats, but under tracing (sensitivity.py), where both are jax's.

    model, state: the state belongs to this model; where `converged` is False it is the last point reached, with
    whatever washout or ground it had. why: one sentence. residual: rms distance that nodes move when the wake is passed
    once through its own velocities (several revolutions of transport). load_change: relative change of C_T in that
    pass. iterations: Newton's, over all steps. interrupted: by the user. wall_time_s includes compile_time_s.

    r, widths (R,): control points and panel widths. psi (K,); K = 1 where the wake is axisymmetric. dct_dr, inflow
    (positive down, climb included), circulation (over ΩR²): (K, R). CT, CP: T/(ρA(ΩR)²) and P/(ρA(ΩR)³) with CP =
    CP_induced + CP_profile. mean_inflow: area-weighted over what the blades sweep.
    tip_vortex (K, A, 3): free nodes in the hub frame at ages tip_vortex_age (A,), the release point first.
    """

    model: FreeWake
    state: WakeState
    converged: bool
    why: str
    residual: Number
    load_change: Number
    iterations: int
    wall_time_s: float
    compile_time_s: float
    r: Numbers
    widths: Numbers
    psi: Numbers
    dct_dr: Numbers
    inflow: Numbers
    circulation: Numbers
    CT: Number
    CP: Number
    CP_induced: Number
    CP_profile: Number
    mean_inflow: Number
    tip_vortex: Numbers
    tip_vortex_age: Numbers
    residuals: tuple[float, ...] = ()
    interrupted: bool = False

    @property
    def unknowns(self) -> Unknowns:
        """What the solver works on, for a start elsewhere."""
        return Unknowns(self.state.near, self.state.far, self.state.gamma_bound)

    @property
    def ground_normal_velocity_rms(self) -> float | None:
        """Rms velocity through the plane within 2 R of the shaft, over √(C_T/2); None without ground."""
        plane = self.model.ground
        if plane is None:
            return None
        return float(_through_the_ground(self.state, self.model)) / float(np.sqrt(abs(self.CT) / 2))

    @property
    def clearance(self) -> float:
        """Height over R of the lowest wake node above the ground; inf without ground."""
        return float("inf") if self.model.ground is None else float(lowest_node(self.state, self.model))

    @property
    def leak(self) -> float | None:
        """Share of what blows on the surfaces that goes through between their panels' middles (`panels.surface.leak`);
        None without any.
        """
        return None if self.model.surfaces is None else float(_leaked(self.model, self.state))


ARRAYS = ("r", "widths", "psi", "dct_dr", "inflow", "circulation", "tip_vortex")
NUMBERS = ("CT", "CP", "CP_induced", "CP_profile", "mean_inflow")
jax.tree_util.register_dataclass(
    Solution,
    data_fields=["model", "state", "residual", "load_change", *ARRAYS, "tip_vortex_age", *NUMBERS],
    meta_fields=["converged", "why", "iterations", "wall_time_s", "compile_time_s", "residuals", "interrupted"],
)


def solve(
    model: FreeWake,
    start: Solution | None = None,
    progress: Progress | None = None,
    tol: float = 1e-7,
) -> Solution:
    """Find the periodic wake of a model, from a prescribed wake or from the solution of a neighbouring case.

    start: a solution with the same rotor and settings, but for numbers and free turns: a longer wake is found from a
    shorter one. Used where both have ground, or neither. Where the way from it is lost, the one from nothing is tried;
    a level wake is sought from it at once first, in small steps last.
    progress(stage, residual) is called after each continuation step. tol: relative rms of the residual. A solve that
    does not get there comes back with `converged` False, the reason, and the last good state.
    """
    clock = Clock()
    near = start if start is not None and start.converged and _fits(start, model) else None
    search = Search(tol, progress, at_once=near is not None and model.axisymmetric)
    here, x = _way(model, near, search)
    for other in _other_ways(near, search.at_once):
        if search.ok or search.interrupted:
            break
        again = Search(tol, progress, iterations=search.iterations)
        there, y = _way(model, other, again)
        nearer = _is_case(there, model) and not _is_case(here, model)
        if again.ok or again.interrupted or nearer:
            here, x, search = there, y, again
        search.iterations = again.iterations  # of all ways
    return read(here, x, search, clock)


def _other_ways(near: Solution | None, at_once: bool) -> tuple[Solution | None, ...]:
    """Where a search starts anew that was lost on its way from `near`, in small steps from there last."""
    if near is None:
        return ()
    return (None, near) if at_once else (None,)


def _is_case(here: FreeWake, model: FreeWake) -> bool:
    """Whether a search that ended here had come to the case, if not to its wake."""
    return bool(eqx.tree_equal(on_host(here), on_host(model)))


def _way(model: FreeWake, start: Solution | None, search: Search) -> tuple[FreeWake, Unknowns]:
    """Where a search for a model's wake ends, from a neighbour or from nothing."""
    if start is None:
        here, x = search.from_nothing(on_host(model.levelled))
    else:
        # the static choices are the model's own (azimuths may differ), the numbers the start's
        numbers = jax.tree.leaves(start.model.settings)
        settings = jax.tree.unflatten(jax.tree.structure(model.settings), numbers)
        here, x = eqx.tree_at(lambda m: m.settings, start.model, settings), start.unknowns
        if settings.far_ages != start.model.settings.far_ages:
            here, x = search.other_turns(start.model, here, x)
    if search.ok:
        slices = 1 if model.axisymmetric else model.settings.azimuths
        if x.near.shape[0] > slices:
            x = jax.tree.map(lambda a: np.mean(a, axis=0, keepdims=True), x)
        x = _spread(x, slices)
        if here.surfaces is None and model.surfaces is not None:
            here, x = search.among(model, x)
        else:
            here, x = search.move(here, model, x, "to the case")
    return here, x


def rehearse(model: FreeWake) -> Solution:
    """Compile what `solve` runs on a case of this kind, on a prescribed wake that solves nothing and is returned."""
    slices = 1 if model.axisymmetric else model.settings.azimuths
    x = _spread(prescribed(model), slices)
    search = Search(tol=0.0, progress=None, ok=False, why="a rehearsal")
    search.prepare(model, x)
    search.newton(model, x, 0.0, effort=1)
    return read(model, x, search, Clock())


def _fits(start: Solution, model: FreeWake) -> bool:
    """Whether a solution has the blades, nodes, ground and panels of a model."""
    a, b = start.model, model
    nodes = ("panels", "age_step_deg", "near_ages", "release_ages", "stretch", "filaments", "roll_up")
    same = all(getattr(a.settings, n) == getattr(b.settings, n) for n in nodes)
    short, long = sorted((a.settings, b.settings), key=lambda s: s.far_ages)
    same = same and (short.far_ages == long.far_ages or lengthens(short, long))
    same = same and (a.ground is None) == (b.ground is None)
    panels = [0 if one.surfaces is None else len(one.surfaces.panels) for one in (a, b)]
    same = same and panels[0] == panels[1]
    return same and jax.tree.structure(a.rotor) == jax.tree.structure(b.rotor)


def read(model: FreeWake, x: Unknowns, search: Search, clock: Clock) -> Solution:
    """Evaluate the wake that a search ended with, and collect what a user wants of it, as numbers."""
    model = jax.tree.map(jnp.asarray, model)  # a search reckons with numpy's, which do not go into a traced function
    change, evaluation = look(model, x)
    moved = jax.tree.map(lambda a, b: np.asarray(a) + np.asarray(b), x, change)
    then = _read_off(model, look(model, moved)[1], jnp.asarray(0.0))["CT"]
    found = readings(model, x, evaluation)
    numbers: dict[str, Any] = {n: np.asarray(getattr(found, n)) for n in ARRAYS} | {
        n: float(getattr(found, n)) for n in NUMBERS
    }
    wall, compiling = clock.read()
    return replace(
        found,
        **numbers,
        converged=search.ok,
        why=told_of(found, search.why) if search.ok else search.why,
        residual=displacement(change),
        load_change=abs(float(then) / numbers["CT"] - 1),
        iterations=search.iterations,
        interrupted=search.interrupted,
        residuals=tuple(search.residuals),
        wall_time_s=wall,
        compile_time_s=compiling,
    )


class HasClearance(Protocol):
    """What has nodes over ground, or none under it."""

    @property
    def clearance(self) -> float:
        """Height over R of the lowest node."""
        ...


def told_of(found: HasClearance, why: str) -> str:
    """Why a search ended where it converged, and what to know of what it found."""
    return why if (under := submerged(found)) is None else f"{why}, but {under}"


def submerged(found: HasClearance) -> str | None:
    """What to know of a wake that lies under the ground, in one line; None of one that does not."""
    if found.clearance >= 0:
        return None
    return (
        f"its lowest node is {-found.clearance:.2g} R under the ground, which no flow crosses, and stands for its "
        "mirror image: too few nodes; take `stretch` = 1, then a smaller `age_step_deg`, until little changes"
    )


def readings(model: FreeWake, x: Unknowns, found: Evaluation | None = None, phase: ArrayLike = 0.0) -> Solution:
    """What can be read off a converged periodic wake, as functions of model and wake: for jax to differentiate.

    found: the wake's evaluation, where it is at hand. phase: azimuth of slice 0, which a ground that leans knows.
    """
    found = evaluated(model, x) if found is None else found
    read: dict[str, Any] = _read_off(model, found, jnp.asarray(phase))
    return Solution(
        model=model,
        state=found.state,
        converged=True,
        why="converged",
        residual=0.0,
        load_change=0.0,
        iterations=0,
        wall_time_s=0.0,
        compile_time_s=0.0,
        tip_vortex_age=model.settings.filament_ages,
        **read,
    )


def tip_vortices(found: Solution, blades: int) -> Float[np.ndarray, "B A 3"]:
    """Tip vortices of all blades at the instant at which blade 0 stands at ψ = 0, hub frame, over R."""
    path = np.asarray(found.tip_vortex)
    if path.shape[0] > 1:
        return path[:: path.shape[0] // blades]
    turns = 2 * np.pi / blades * np.arange(blades)
    return np.stack([np.asarray(rotate_about_shaft(jnp.asarray(path[0]), jnp.asarray(turn))) for turn in turns])


@eqx.filter_jit
def _read_off(model: FreeWake, found: Evaluation, phase: Float[Array, ""]) -> dict[str, Float[Array, "..."]]:
    """Fields of a solution: along blades and vortices, and of the whole rotor."""
    psi, now = azimuths(found.state), performance(model, found)
    tip = jnp.concatenate([found.start.points[:, :1], above_ground(model, found.state, phase).far[:, 0]], axis=1)
    return {
        "r": model.stations,
        "widths": model.widths,
        "psi": psi,
        "dct_dr": disk_loading(model.rotor, found.loads),
        "inflow": -found.velocities.control[..., 2],
        "circulation": found.loads.circulation,
        "tip_vortex": rotate_about_shaft(tip, psi[:, None]),
        "CT": now.thrust,
        "CP": now.power,
        "CP_induced": now.induced,
        "CP_profile": now.profile,
        "mean_inflow": now.mean_inflow,
    }


@eqx.filter_jit
def lowest_node(state: WakeState, model: FreeWake, phase: ArrayLike = 0.0) -> Float[Array, ""]:
    """Least distance of the wake's nodes from the plane, negative under it. phase: azimuth of slice 0."""
    psi = jnp.asarray(phase + azimuths(state))[:, None]  # each slice's nodes are in its own blade's frame
    nodes = jnp.concatenate([v.reshape(len(psi), -1, 3) for v in (state.near, state.far)], axis=1)
    assert model.ground is not None
    return jnp.min(model.ground.distance(rotate_about_shaft(nodes, psi)))


@eqx.filter_jit
def _through_the_ground(state: WakeState, model: FreeWake) -> Float[Array, ""]:
    """Rms velocity through the plane within 2 R of the shaft."""
    plane = model.ground
    assert plane is not None
    r, psi = np.meshgrid(np.linspace(0.1, 2.0, 12), np.linspace(0, 2 * np.pi, 16, endpoint=False))
    flat = disk_points(jnp.asarray(r.ravel()), jnp.asarray(psi.ravel()))
    points = flat - plane.distance(flat)[:, None] * plane.normal
    return jnp.sqrt(jnp.mean((velocity(state, points, model) @ plane.normal) ** 2))


_spread = eqx.filter_jit(spread)
_leaked = eqx.filter_jit(leaked)
