"""Solving for trim in the free wake, and what it comes to.

From a trim nearby the way leads straight to the case, the wake carried by what the wind changes. From nothing, in hover
the wake is first solved for on rigid blades (wake/solution.py), with its own continuation. In a wind it starts from a
prescribed one: Anderson's iteration and Newton with thick cores, then Newton with the settings' own. Where that is
lost, in slow flight or near the ground, it starts with thicker cores far over the ground in an auxiliary flow down that
carries the wake away, and follows the branch as the flow is taken back, the ground comes up and the cores thin.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from rotorjax.errors import InputError
from rotorjax.ground import Plane, pitched
from rotorjax.inflow.momentum import hover_inflow
from rotorjax.ode.anderson import anderson
from rotorjax.ode.continuation import Branch, continuation
from rotorjax.ode.linear import Krylov
from rotorjax.ode.newton import SMALLEST_STEP, newton
from rotorjax.ode.outcome import Outcome
from rotorjax.operating import OperatingPoint
from rotorjax.panels.surface import Panels, refitted
from rotorjax.rotor.flap_lag import blade_of, lag_frequency
from rotorjax.rotor.geometry import Rotor
from rotorjax.rotor.hub import RotorInputs
from rotorjax.trim.free_wake import InWake, WakeTrim, carried, first_guess, flown, residual
from rotorjax.trim.problem import Aim
from rotorjax.wake.model import AMONG, FreeWake, free_wake
from rotorjax.wake.settings import WakeSettings, flight_settings, wake_settings
from rotorjax.wake.solution import solve

Progress = Callable[[str, float], None]

TOL = 1e-7
"""Relative rms of the residual of wake, blades and controls together."""

COARSE = 1e-5
"""The same on the way to the case."""

THICKER = 1.6
"""Cores at the start in a wind, over the settings': with them Anderson's iteration converges from a prescribed wake."""

THICKEST = 2.5
"""The same where that fails, in slow flight and near the ground: vortices beside the disk do not roll up yet."""

WASHOUT, FAR = 0.08, 4.0
"""Auxiliary flow (over ΩR) and height (over R) that a search begins with where it is lost without."""

DIRECT, WASHED = 80, 80
"""Iterations of Anderson's from a prescribed wake; on the straight way a wake that needs more is lost."""

LEAST, NEAREST = 0.01, 0.1
"""Least step of a continuation over the whole way, and over that from a neighbour, which is to be short."""


@dataclass(frozen=True)
class TrimmedInWake:
    """A trim in the free wake, converged or not. outcome: of the last Newton iteration; iterations: of all of them."""

    z: InWake
    p: WakeTrim
    outcome: Outcome
    iterations: int

    @property
    def model(self) -> FreeWake:
        """The free wake's model as flown."""
        return flown(self.z, self.p)


def wake_trim(
    rotor: Rotor,
    operating: OperatingPoint,
    inputs: RotorInputs,
    thrust: float,
    ground: Plane | None = None,
    settings: WakeSettings | None = None,
    aim: Aim = "flapping",
    surfaces: Panels | None = None,
) -> WakeTrim:
    """Set a trim up. ground, surfaces: in level axes; the trim's model has them as the tilted shaft sees them.

    Raises InputError where the rotor has no hinge data or nothing holds its blades in lag, the disk cuts the ground, or
    as `free_wake` does.
    """
    if settings is None:
        cores: dict[str, Any] = {} if surfaces is None else AMONG
        hover = wake_settings(azimuths=2 * rotor.blades, **cores)
        settings = flight_settings(rotor.blades) if windy(inputs) else hover
    still = eqx.tree_at(lambda o: o.climb, operating, jnp.zeros_like(operating.climb))
    if ground is not None and inputs.pitch is not None:
        ground = pitched(ground, inputs.pitch)
    if ground is not None and not float(ground.clearance) > 0:
        raise InputError(
            f"Argument `ground` must lie under the disk, but the tilted disk's rim is {-float(ground.clearance):.3g} R "
            "under it: set a greater height or less tilt"
        )
    if surfaces is not None and inputs.turn is not None:
        surfaces = Panels(surfaces.corners @ inputs.turn.T)
    model = free_wake(rotor, still, ground, settings, surfaces)
    blade = blade_of(rotor, operating)
    if not float(lag_frequency(blade)) > 0:
        raise InputError(
            f"Argument `rotor` must hold its blades in lag, but those of {rotor.name} have their hinge on the shaft "
            "and no spring: give it `offset` or `lag_spring`"
        )
    return WakeTrim(model, blade, inputs, jnp.asarray(thrust, float), aim)


def alike(one: Any, other: Any) -> bool:
    """Whether two trees differ in numbers alone."""
    shapes = ([np.shape(leaf) for leaf in jax.tree.leaves(tree)] for tree in (one, other))
    return jax.tree.structure(one) == jax.tree.structure(other) and next(shapes) == next(shapes)


def windy(inputs: RotorInputs) -> bool:
    """Whether the hub moves across the air: then no azimuth is like another."""
    return bool(np.any(np.asarray(inputs.velocity)[:2] != 0))


def trim_in_wake(
    p: WakeTrim,
    controls: Float[Array, "3"],
    coning: float,
    progress: Progress | None = None,
    near: TrimmedInWake | None = None,
) -> TrimmedInWake:
    """Trim from a trim nearby, and where there is none or the way from it is lost, from a guess of the controls θ₀,
    θ₁c, θ₁s and of the coning (rad).

    near: of no use where its wake has other numbers of nodes or azimuths. progress(stage, residual) is called as things
    go on. A trim that does not converge comes back with its reason.
    Raises InputError where the hub comes nearer to the ground or leaves it.
    """
    ground = p.model.ground
    nearer = 0.0 if ground is None else float(ground.normal @ p.inputs.velocity)
    if abs(nearer) > 1e-12:
        raise InputError(
            f"Argument `inputs` must keep its height over the ground (a steady state needs it), but the hub moves at "
            f"{nearer:.3g} ΩR away from it: set climb = 0, and advance_ratio = 0 over a slope"
        )
    stages = _Stages(progress)
    if near is not None and near.outcome.converged and alike(near.p, p):
        found = _from_neighbour(p, near, stages)
        if found.outcome.converged or stages.interrupted:
            return found
    if windy(p.inputs):
        way = _from_wind if p.model.surfaces is None else _among
        return way(p, controls, coning, stages)
    return _from_hover(p, controls, coning, stages)


class _Stages:
    """Counts iterations and shows how far things are. nearest: the best outcome at the case itself."""

    def __init__(self, progress: Progress | None) -> None:
        self._progress, self.iterations = progress, 0
        self.nearest: Outcome | None = None
        self.interrupted = False

    def done(self, stage: str, outcome: Outcome) -> Outcome:
        """Count and show an outcome, and hand it on."""
        self.iterations += outcome.iterations
        self.interrupted |= outcome.interrupted
        if self._progress is not None:
            self._progress(stage, outcome.residual)
        return outcome

    def newton(self, stage: str, z: InWake, p: WakeTrim, tol: float, *, hard: bool = True) -> Outcome:
        """Newton-Krylov on wake, blades and controls together. hard: try the least steps; else shorten the way."""
        linear = Krylov(forcing=0.03, restart=120, restarts=1, tightest=1e-8 if hard else 1e-3)
        least = SMALLEST_STEP if hard else 1 / 16
        found = newton(residual, z, p, linear=linear, tol=tol, max_iterations=12, smallest_step=least)
        return self.done(stage, found)


def _from_neighbour(p: WakeTrim, near: TrimmedInWake, stages: _Stages) -> TrimmedInWake:
    """All numbers of the case go evenly from the neighbour's to its own."""

    def at(s: float) -> WakeTrim:
        if s == 1:
            return p
        between = jax.tree.map(lambda a, b: (1 - s) * a + s * b if eqx.is_inexact_array(b) else b, near.p, p)
        return _refitted(between)

    def carry(z: InWake, here: float, there: float) -> InWake:
        wind = (there - here) * (near.p.inputs.velocity - p.inputs.velocity)
        return z._replace(wake=carried(z.wake, p.model, wind))

    branch = _follow("trim", at, near.z, 1.0, stages, carry=carry, smallest=NEAREST)
    last = branch.last if branch.reached or branch.failed is None else branch.failed
    return TrimmedInWake(last.x, p, last if branch.reached else replace(last, converged=False), stages.iterations)


def _from_hover(p: WakeTrim, controls, coning: float, stages: _Stages) -> TrimmedInWake:
    model = eqx.tree_at(
        lambda m: (m.operating.collective, m.operating.climb),
        p.model,
        (controls[0], p.inputs.climb * p.model.operating.tip_speed(p.model.rotor.radius)),
    )
    rigid = solve(model, progress=stages._progress)
    slices = rigid.state.near.shape[0]
    z = InWake(rigid.unknowns, jnp.full(slices, float(coning)), jnp.zeros(slices), controls.at[1:].set(0.0))
    if rigid.converged:
        outcome = _to_thrust(rigid.CT, z, p, stages)
    else:
        outcome = Outcome(z, rigid.residual, (rigid.residual,), 0, False, f"rigid blades: {rigid.why}", 0.0)
    return TrimmedInWake(outcome.x, p, outcome, stages.iterations + rigid.iterations)


def _to_thrust(thrust: float, z: InWake, p: WakeTrim, stages: _Stages) -> Outcome:
    """Trim at the wanted thrust from z, which has this one; near the ground one step may be too far."""

    def at(s):
        return eqx.tree_at(lambda q: q.thrust, p, (1 - s) * thrust + s * p.thrust)

    def step(guess, s, memory):
        return stages.newton("trim", guess, at(s), TOL if s == 1 else 1e-5)

    branch = continuation(step, z, 0.0, 1.0, step=1.0, smallest=0.1, largest=1.0, jump=0.3)
    if branch.reached or branch.failed is None:
        return branch.last
    return replace(branch.failed, why=f"on the way to the thrust: {branch.why}")


def _from_wind(p: WakeTrim, controls, coning: float, stages: _Stages) -> TrimmedInWake:
    """Straight to the case with thick cores, and where that is lost by way of an auxiliary flow; then to its cores."""
    thick = _with_cores(replace(p, aim="flapping"), THICKER)
    found = _to_thick(thick, controls, coning, stages)
    if found.converged:
        branch = _thinner(p, found.x, THICKER, stages)
        if branch.reached:
            return TrimmedInWake(branch.last.x, p, branch.last, stages.iterations)
    if stages.interrupted:
        return TrimmedInWake(found.x, p, replace(found, converged=False, why="interrupted"), stages.iterations)
    return _by_way_of_washout(p, controls, coning, stages)


def _among(p: WakeTrim, controls, coning: float, stages: _Stages) -> TrimmedInWake:
    """The trim over the rotor's floor; then the surfaces at once, or as their flow comes up from nothing."""
    open_air = replace(p, model=replace(p.model, surfaces=None, over=p.model.floor))
    found = _from_wind(open_air, controls, coning, stages)
    if not found.outcome.converged:
        return replace(found, outcome=replace(found.outcome, why=f"without surfaces: {found.outcome.why}"))

    def at(s: float) -> WakeTrim:
        return eqx.tree_at(lambda q: q.model.surfaces.share, p, jnp.asarray(s, float))

    branch = _follow("trim", at, found.z, 1.0, stages)
    if not branch.reached:
        return _lost(branch, found.outcome, p, stages)
    return TrimmedInWake(branch.last.x, p, branch.last, stages.iterations)


def _refitted(p: WakeTrim) -> WakeTrim:
    """A trim whose surfaces have moved, with the inverse that belongs to them."""
    if p.model.surfaces is None:
        return p
    return replace(p, model=replace(p.model, surfaces=refitted(p.model.surfaces, p.model.ground)))


def _to_thick(thick: WakeTrim, controls, coning: float, stages: _Stages) -> Outcome:
    """The trim with thick cores from a prescribed wake."""
    guess = _prescribed(thick, controls, coning)
    first = _anderson("prescribed wake", guess, thick, DIRECT, stages)
    return stages.newton("thick cores", first.x, thick, COARSE) if first.converged else first


def _by_way_of_washout(p: WakeTrim, controls, coning: float, stages: _Stages) -> TrimmedInWake:
    """Trim with thicker cores yet in a flow that carries the wake away, far over the ground; that flow is taken back,
    the ground comes up, and the cores go back to the settings' own.
    """
    thick = _with_cores(replace(p, aim="flapping"), THICKEST)
    first = _anderson(
        "auxiliary flow", _prescribed(_washed(thick, 0.0), controls, coning), _washed(thick, 0.0), WASHED, stages
    )
    branch = _follow("less auxiliary flow", lambda s: _washed(thick, s), first.x, 0.5, stages)
    if branch.reached and p.model.ground is not None:
        branch = _follow("nearer to the ground", lambda s: _lowered(thick, s), branch.last.x, 0.5, stages)
    if not branch.reached:
        return _lost(branch, first, p, stages)
    branch = _thinner(p, branch.last.x, THICKEST, stages)
    if branch.reached:
        return TrimmedInWake(branch.last.x, p, branch.last, stages.iterations)
    return _lost(branch, first, p, stages)


def _thinner(p: WakeTrim, x: InWake, factor: float, stages: _Stages) -> Branch:
    """From cores `factor` times as thick to those of p, and to its aim."""

    def at(s):
        return p if s == 1 else _with_cores(p, factor ** (1 - s))

    return _follow("trim", at, x, 1.0, stages)


def _follow(
    stage: str, at: Callable[[float], WakeTrim], x: InWake, first: float, stages: _Stages, **more: Any
) -> Branch:
    """Continuation over s from 0 to 1 with the trim at(s); its end is told apart by TOL. more: of `continuation`."""

    def step(guess, s, memory):
        last = s == 1 and stage == "trim"
        found = stages.newton(stage, guess, at(s), TOL if last else COARSE, hard=False)
        if last and (stages.nearest is None or found.residual < stages.nearest.residual):
            stages.nearest = found
        return found

    kept = {"smallest": LEAST, "largest": 1.0, "easy": 5, "jump": 0.5}
    return continuation(step, x, 0.0, 1.0, step=first, **kept | more)


def _anderson(stage: str, guess: InWake, p: WakeTrim, most: int, stages: _Stages) -> Outcome:
    return stages.done(
        stage,
        anderson(residual, guess, p, mixing=0.3, window=15, tol=5e-4, max_iterations=most, linear=Krylov()),
    )


def _lost(branch: Branch, first: Outcome, p: WakeTrim, stages: _Stages) -> TrimmedInWake:
    """The end of a search that did not arrive: of the last wake found and the nearest one at the case itself that which
    is nearer to a trim of the case.
    """
    x = branch.last.x if branch.outcomes else first.x
    here = newton(residual, x, p, linear=Krylov(), tol=TOL, max_iterations=0)
    here = replace(here, converged=False, why=branch.why)
    if stages.nearest is not None and stages.nearest.residual < here.residual:
        here = stages.nearest
    return TrimmedInWake(here.x, p, here, stages.iterations)


def _prescribed(p: WakeTrim, controls, coning: float) -> InWake:
    """A prescribed wake that goes down with momentum theory's inflow and the auxiliary flow; the collective of both."""
    washout = float(p.model.washout)
    inflow = washout + 0.02 + 0.5 * float(hover_inflow(p.thrust, p.inputs) + p.inputs.climb)
    return first_guess(p, controls.at[0].add(washout / 0.75), coning, p.model.settings.azimuths, inflow)


def _washed(p: WakeTrim, s: float) -> WakeTrim:
    """The trim far over the ground in what is left of the auxiliary flow at s from 0 to 1."""
    far = _lowered(p, 0.0)
    return eqx.tree_at(lambda q: q.model.washout, far, jnp.asarray(WASHOUT * (1 - s)))


def _lowered(p: WakeTrim, s: float) -> WakeTrim:
    """The trim over a ground that comes up from FAR to its height, evenly in 1/h: the ground's effect goes with it."""
    ground = p.model.ground
    if ground is None or s == 1:
        return p
    height = 1 / ((1 - s) / jnp.maximum(FAR, ground.height) + s / ground.height)
    return eqx.tree_at(lambda q: q.model.ground.height, p, height)


def _with_cores(p: WakeTrim, factor: float) -> WakeTrim:
    """The trim with thicker cores in the wake."""

    def cores(q):
        s = q.model.settings
        return s.tip_core, s.near_core, s.bound_core_chords

    return eqx.tree_at(cores, p, tuple(factor * c for c in cores(p)))
