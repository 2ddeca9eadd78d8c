"""Solving for the periodic wake, from nothing or from a neighbouring case, and what is read off it.

`solve` does its own continuation. From a prescribed wake it starts in an auxiliary axial flow that carries the wake
away, at a collective raised by the same inflow angle so that the loading stays, and takes that flow back to zero. The
ground then rises from far below, and tilts. From a solved case it moves height and slope from there to here.
Each step is a few Newton–Krylov iterations on the residual of equilibrium.py.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from rotorjax.frames import disk_points, rotate_about_shaft
from rotorjax.ground import Plane
from rotorjax.ode.anderson import anderson
from rotorjax.ode.continuation import Branch, continuation
from rotorjax.ode.linear import Krylov
from rotorjax.ode.newton import newton
from rotorjax.ode.outcome import Outcome
from rotorjax.rotor.blade_element import disk_loading, rotor_coefficients
from rotorjax.wake.equilibrium import Evaluation, Unknowns, advance, displacement, evaluate, residual, spread
from rotorjax.wake.field import velocity
from rotorjax.wake.model import FreeWake, WakeState, azimuths
from rotorjax.wake.start import prescribed

Progress = Callable[[str, float], None]

WASHOUT = 0.08
"""Auxiliary flow at the start (over ΩR): strong enough for Anderson's iteration to converge outright."""


@dataclass(frozen=True)
class Solution:
    """A periodic wake and the rotor in it. Lengths over R, velocities over ΩR, ψ in rad; arrays are numpy's.

    model, state: the state belongs to this model; where `converged` is False it is the last point reached, with
    whatever washout or ground it had. why: one sentence. residual: rms distance that nodes move when the wake is passed
    once through its own velocities (several revolutions of transport). load_change: relative change of C_T in that
    pass. iterations: Newton's, over all steps. wall_time_s includes compile_time_s.

    r, widths (R,): control points and panel widths. psi (K,); K = 1 where the wake is axisymmetric. dct_dr, inflow
    (positive down, climb included), circulation (over ΩR²): (K, R). CT, CP: T/(ρA(ΩR)²) and P/(ρA(ΩR)³) with CP =
    CP_induced + CP_profile. mean_inflow: area-weighted over the disk, the cut-out counted with the innermost value.
    tip_vortex (K, A, 3): free nodes in the hub frame at ages tip_vortex_age (A,), the release point first.
    """

    model: FreeWake
    state: WakeState
    converged: bool
    why: str
    residual: float
    load_change: float
    iterations: int
    wall_time_s: float
    compile_time_s: float
    r: np.ndarray
    widths: np.ndarray
    psi: np.ndarray
    dct_dr: np.ndarray
    inflow: np.ndarray
    circulation: np.ndarray
    CT: float
    CP: float
    CP_induced: float
    CP_profile: float
    mean_inflow: float
    tip_vortex: np.ndarray
    tip_vortex_age: np.ndarray
    residuals: tuple[float, ...] = ()

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
        r, psi = np.meshgrid(np.linspace(0.1, 2.0, 12), np.linspace(0, 2 * np.pi, 16, endpoint=False))
        flat = disk_points(jnp.asarray(r.ravel()), jnp.asarray(psi.ravel()))
        points = flat - plane.distance(flat)[:, None] * plane.normal
        through = _velocity(self.state, points, self.model) @ plane.normal
        return float(jnp.sqrt(jnp.mean(through**2)) / np.sqrt(abs(self.CT) / 2))


def solve(
    model: FreeWake,
    start: Solution | None = None,
    progress: Progress | None = None,
    tol: float = 1e-8,
) -> Solution:
    """Find the periodic wake of a model, from a prescribed wake or from the solution of a neighbouring case.

    start: a solution with the same rotor and settings; used where both have ground, or neither. progress(stage,
    residual) is called after each continuation step. tol: relative rms of the residual. A solve that does not get there
    comes back with `converged` False, the reason, and the last good state.
    """
    clock = _Clock()
    search = _Search(tol, progress)
    if start is None or not start.converged:
        here, x = search.from_nothing(eqx.tree_at(lambda m: m.ground, model, None, is_leaf=lambda v: v is None))
    else:
        here, x = start.model, start.unknowns
        if here.ground is not None and model.ground is None:
            here, x = search.from_nothing(model)
    if search.ok and here.ground is None and model.ground is not None:
        here, x = search.settle(_over_distant_ground(model), x)
    if search.ok:
        slices = 1 if model.ground is None or float(model.ground.slope) == 0 else model.settings.azimuths
        if x.near.shape[0] > slices:
            x = jax.tree.map(lambda a: jnp.mean(a, axis=0, keepdims=True), x)
        here, x = search.move(here, model, spread(x, slices), "to the case")
    return _read(here, x, search, clock)


@dataclass
class _Search:
    """The way so far: whether it still goes on, why it ended, and what it took."""

    tol: float
    progress: Progress | None
    ok: bool = True
    why: str = ""
    iterations: int = 0
    residuals: list[float] = field(default_factory=list)

    def from_nothing(self, model: FreeWake) -> tuple[FreeWake, Unknowns]:
        """Wake of a model without ground, by way of the auxiliary flow."""
        washed = with_washout(model, WASHOUT)
        first = anderson(_advance, prescribed(model, WASHOUT + 0.03), washed, mixing=0.3, tol=1e-3, max_iterations=80)
        self.note("prescribed wake", first)
        if not np.isfinite(first.residual):
            self.ok, self.why = False, f"the prescribed wake diverged: {first.why}"
            return washed, first.x
        return self.follow(lambda s: with_washout(model, WASHOUT * (1 - s)), first.x, "washout", 0.4)

    def move(self, here: FreeWake, there: FreeWake, x: Unknowns, stage: str) -> tuple[FreeWake, Unknowns]:
        """Follow the branch from one model to another of the same structure."""
        same = all(bool(jnp.all(a == b)) for a, b in zip(_leaves(here), _leaves(there), strict=True))
        if same:
            return self.settle(there, x)

        def between(s):
            model = jax.tree.map(lambda a, b: a + s * (b - a) if eqx.is_inexact_array(a) else b, here, there)
            if here.ground is None or there.ground is None:
                return model
            # even steps in 1/h: the ground's effect goes with it
            height = 1 / ((1 - s) / here.ground.height + s / there.ground.height)
            return eqx.tree_at(lambda m: m.ground.height, model, height)

        return self.follow(between, x, stage, 1.0)

    def settle(self, model: FreeWake, x: Unknowns) -> tuple[FreeWake, Unknowns]:
        """Newton at the model itself."""
        found = self.newton(model, x, self.tol)
        self.note("case", found)
        self.ok, self.why = found.converged, found.why
        return model, found.x

    def follow(self, at: Callable[[float], FreeWake], x: Unknowns, stage: str, first: float):
        """Continuation over s from 0 to 1 with the model at(s)."""

        def step(guess, s, memory):
            found = self.newton(at(s), guess, self.tol if s == 1 else max(self.tol, 1e-5))
            self.note(f"{stage} {s:.2f}", found)
            return found

        def carry(x, here, there):
            return with_the_ground(x, at(here).ground, at(there).ground)

        branch: Branch = continuation(
            step, x, 0.0, 1.0, step=first, largest=1.0, smallest=0.02, easy=5, jump=0.3, carry=carry
        )
        if not branch.outcomes:
            self.ok, self.why = False, branch.why
            return at(0.0), x
        reached = branch.parameters[-1]
        self.ok, self.why = branch.reached, branch.last.why if branch.reached else f"{stage}: {branch.why}"
        return at(reached), branch.last.x

    def newton(self, model: FreeWake, x: Unknowns, tol: float) -> Outcome:
        return newton(residual, x, model, linear=Krylov(forcing=0.03), tol=tol, max_iterations=8)

    def note(self, stage: str, found: Outcome) -> None:
        self.iterations += found.iterations
        self.residuals.extend(found.residuals)
        if self.progress is not None:
            self.progress(stage, found.residual)


def _over_distant_ground(model: FreeWake) -> FreeWake:
    """The model over level ground so far down that the wake out of ground effect is a good guess."""
    ground = model.ground
    assert ground is not None
    level = Plane(jnp.maximum(3.0, 1.5 * ground.height), jnp.zeros_like(ground.slope))
    return eqx.tree_at(lambda m: m.ground, model, level)


def with_the_ground(x: Unknowns, before: Plane | None, after: Plane | None) -> Unknowns:
    """Move a wake's nodes along as the ground rises and tilts: wholly at the ground, not at all at the rotor.

    The guess that continuation needs: the wake of the old ground may lie under the new one.
    """
    if before is None or after is None:
        return x
    at = 2 * jnp.pi / x.near.shape[0] * jnp.arange(x.near.shape[0])[:, None, None]
    tilt = after.slope - before.slope
    down = jnp.array([0.0, 0.0, 1.0])

    def move(nodes):
        hub = rotate_about_shaft(nodes, at)
        depth = 1 - before.distance(hub) / (before.height * jnp.cos(before.slope))
        share = jnp.clip(depth, 0, 1)[..., None] ** 2
        arm = hub + before.height * down
        # the mountain side, x > 0, goes up
        turned = jnp.stack(
            [
                jnp.cos(tilt) * arm[..., 0] - jnp.sin(tilt) * arm[..., 2],
                arm[..., 1],
                jnp.sin(tilt) * arm[..., 0] + jnp.cos(tilt) * arm[..., 2],
            ],
            axis=-1,
        )
        moved = hub + share * (turned - arm + (before.height - after.height) * down)
        return rotate_about_shaft(moved, -at)

    return x._replace(near=move(x.near), far=move(x.far))


def with_washout(model: FreeWake, washout: float) -> FreeWake:
    """The model in an auxiliary flow, its collective raised by the flow's angle at 0.75 R so that the loading stays."""
    return eqx.tree_at(
        lambda m: (m.washout, m.operating.collective),
        model,
        (jnp.asarray(washout, float), model.operating.collective + washout / 0.75),
    )


def _read(model: FreeWake, x: Unknowns, search: _Search, clock: "_Clock") -> Solution:
    """Evaluate the wake and collect what a user wants of it."""
    found: Evaluation = _evaluate(model, x)
    moved = _advance(x, model)
    once_more = _evaluate(model, moved)
    stations, widths = model.stations, model.widths
    now = rotor_coefficients(model.rotor, found.loads, stations, widths)
    then = rotor_coefficients(model.rotor, once_more.loads, stations, widths)
    inflow = -np.asarray(found.velocities.control[..., 2])
    edges = np.asarray(model.edges)
    area = np.diff(edges**2)
    area[0] += edges[0] ** 2
    tip = jnp.concatenate([found.start.points[:, :1], found.state.far[:, 0]], axis=1)
    psi = azimuths(found.state)
    settings = model.settings
    solution = Solution(
        model=model,
        state=found.state,
        converged=search.ok,
        why=search.why,
        residual=displacement(jax.tree.map(lambda a, b: a - b, moved, x)),
        load_change=abs(float(then.thrust / now.thrust) - 1),
        iterations=search.iterations,
        wall_time_s=0.0,
        compile_time_s=0.0,
        r=np.asarray(stations),
        widths=np.asarray(widths),
        psi=np.asarray(psi),
        dct_dr=np.asarray(disk_loading(model.rotor, found.loads)),
        inflow=inflow,
        circulation=np.asarray(found.loads.circulation),
        CT=float(now.thrust),
        CP=float(now.power),
        CP_induced=float(now.induced),
        CP_profile=float(now.profile),
        mean_inflow=float(np.mean(inflow, axis=0) @ area),
        tip_vortex=np.asarray(rotate_about_shaft(tip, psi[:, None])),
        tip_vortex_age=settings.age_step * (settings.near_ages + np.arange(settings.far_ages + 1)),
        residuals=tuple(search.residuals),
    )
    wall, compiling = clock.read()
    return replace(solution, wall_time_s=wall, compile_time_s=compiling)


def _leaves(model: FreeWake) -> list:
    return jax.tree.leaves(eqx.filter(model, eqx.is_inexact_array))


@eqx.filter_jit
def _advance(x: Unknowns, model: FreeWake) -> Unknowns:
    return advance(model, x)


@eqx.filter_jit
def _evaluate(model: FreeWake, x: Unknowns) -> Evaluation:
    return evaluate(model, x)


_velocity = eqx.filter_jit(velocity)


class _Clock:
    """Wall time, and the part of it that XLA spent compiling, from jax's own monitoring events."""

    seconds = 0.0
    listening = False

    def __init__(self) -> None:
        if not _Clock.listening:
            jax.monitoring.register_event_duration_secs_listener(_Clock.hear)
            _Clock.listening = True
        self.wall, self.compiling = time.perf_counter(), _Clock.seconds

    @staticmethod
    def hear(event: str, seconds: float, **_) -> None:
        if event.startswith("/jax/core/compile"):
            _Clock.seconds += seconds

    def read(self) -> tuple[float, float]:
        return time.perf_counter() - self.wall, _Clock.seconds - self.compiling
