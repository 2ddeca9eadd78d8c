"""Solving for trim in the free wake, and what it comes to.

From a trim nearby the way leads straight to the case, the wake carried by what the wind changes. From nothing, in hover
the wake is first solved for on rigid blades (wake/solution.py), with its own continuation. In a wind it starts from a
prescribed one with thick cores, which thin as passes of the fixed point go on under Anderson's iteration. Where that is
lost they thin in careful steps, at last with those harmonics damped that the azimuths hardly hold. Where there is none
with thick cores it starts far over the ground in an auxiliary flow down that carries the wake away, and follows the
branch as the flow is taken back and the ground comes up.
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
from rotorjax.ode.continuation import Branch, Carry, Steps, continuation, unchanged
from rotorjax.ode.linear import Krylov
from rotorjax.ode.newton import SMALLEST_STEP, newton
from rotorjax.ode.outcome import Outcome
from rotorjax.operating import OperatingPoint
from rotorjax.panels.surface import Panels, refitted
from rotorjax.rotor.flap_lag import blade_of, lag_frequency
from rotorjax.rotor.geometry import Rotor
from rotorjax.rotor.hub import RotorInputs
from rotorjax.trim.free_wake import InWake, WakeTrim, carried, first_guess, flown, passed, residual
from rotorjax.trim.problem import Aim
from rotorjax.wake.model import AMONG, FreeWake, free_wake
from rotorjax.wake.search import Progress
from rotorjax.wake.settings import WakeSettings, flight_settings, wake_settings
from rotorjax.wake.solution import solve

TOL = 1e-7
"""Relative rms of the residual of wake, blades and controls together."""

ROUGH, CLOSE, TIGHT, NEAR = 1e-3, 2e-4, 1e-5, 5e-3
"""The same on the way to the case, quickly, carefully and with the highest harmonics damped, and where to go on all the
same: from further off no search has arrived.
"""

SHARE, WINDOW, PASSES = 0.1, 100, 250
"""Anderson's iteration: the share of the residual that is added, how many past passes are combined, and how many are
made at most. With so many combined, passes converge as Newton's method does, which takes two to four times as many
products with the Jacobian, each as dear as one or two passes.
"""

BESIDE = 0.3
"""The share from a neighbour, which is near: up to a quarter fewer passes; from a prescribed wake some stall."""

FEW, EASY = 100, 40
"""Passes after which a rough step is given up, and those of an easy one."""

THICK = 4.0
"""Cores at the start in a wind, over the settings': with these, vortices beside the disk do not roll up and passes of
the fixed point converge from a prescribed wake, in slow flight and near the ground, too.
"""

QUICK, CAREFUL, FINE = (2.0, 1.4), (2.8, 2.0, 1.7, 1.5, 1.35, 1.2, 1.1), (THICK, 3.0, 2.3, 1.8, 1.4, 1.2)
"""Cores on the way: on the first one, where that is lost, and with the highest harmonics damped."""

DAMPED = (0.3, 1.0)
"""Damping of the highest harmonics over the azimuth (`azimuth_damping`) for a wake that is not found without, or with
less: beside the disk in slow flight vortices lie within each other's cores and wind round each other, twelve azimuths
have one or two nodes for that, and nothing else damps it.
"""

WASHOUT, FAR = 0.08, 4.0
"""Auxiliary flow (over ΩR) and height (over R) that a search begins with where it is lost without."""

LEAST, NEAREST = 0.01, 0.1
"""Least step of a continuation over the whole way, and over that from a neighbour, which is to be short."""


@dataclass(frozen=True)
class TrimmedInWake:
    """A trim in the free wake, converged or not. outcome: of the last search; iterations: passes and Newton's."""

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

    def found(self, stage: str, z: InWake, p: WakeTrim, tol: float, share: float = SHARE) -> Outcome:
        """By passes of the fixed point, and at the case itself by Newton's method where these stall near it; from one
        hover to the next by Newton's alone.
        """
        if z.flap.shape[0] == 1:
            return self.newton(stage, z, p, min(tol, 1e-5), hard=False)
        near = self.passes(stage, z, p, tol, share)
        if near.converged or near.interrupted or tol == ROUGH or near.residual > ROUGH:
            return near
        return self.newton(stage, near.x, p, tol, hard=False)

    def passes(self, stage: str, z: InWake, p: WakeTrim, tol: float, share: float = SHARE) -> Outcome:
        """Passes of the fixed point under Anderson's iteration."""
        most = FEW if tol == ROUGH else PASSES
        return self.done(stage, anderson(passed, z, p, mixing=share, window=WINDOW, tol=tol, max_iterations=most))

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

    branch = _follow("trim", at, near.z, 1.0, stages, BESIDE, NEAREST, carry)
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

    branch = continuation(step, z, 0.0, 1.0, steps=Steps(1.0, 0.1, 1.0), jump=0.3)
    if branch.reached or branch.failed is None:
        return branch.last
    return replace(branch.failed, why=f"on the way to the thrust: {branch.why}")


def _from_wind(p: WakeTrim, controls, coning: float, stages: _Stages) -> TrimmedInWake:
    """From a wake with thick cores as these thin, quickly; where that is lost in careful steps; where those are, too,
    with the highest harmonics over the azimuth damped, as little as leads there.
    """
    thick = _with_cores(replace(p, aim="flapping"), THICK)
    start = stages.passes("thick cores", _prescribed(thick, controls, coning), thick, ROUGH)
    if not (start.converged or stages.interrupted):
        start = _by_way_of_washout(thick, controls, coning, stages)
    if not start.converged:
        return _lost(start.x, start.why, p, stages)
    for cores, rough in ((QUICK, ROUGH), (CAREFUL, CLOSE)):
        found = _thinner(p, start.x, cores, rough, stages)
        if found.converged or stages.interrupted:
            return TrimmedInWake(found.x, p, found, stages.iterations)
    asked = p.model.settings.azimuth_damping
    for rate in dict.fromkeys(max(rate, asked) for rate in DAMPED):
        damped = _damped(p, rate)
        again = _thinner(damped, start.x, FINE, TIGHT, stages)
        if again.converged or stages.interrupted:
            return TrimmedInWake(again.x, damped, again, stages.iterations)
    return _lost(found.x, f"{found.why}; with the highest harmonics damped {again.why}", p, stages)


def _damped(p: WakeTrim, rate: float) -> WakeTrim:
    """The trim with the highest harmonics over the azimuth damped."""
    return replace(p, model=replace(p.model, settings=replace(p.model.settings, azimuth_damping=rate)))


def _thinner(p: WakeTrim, z: InWake, cores: tuple[float, ...], rough: float, stages: _Stages) -> Outcome:
    """The trim by passes to `rough` at each of some thicknesses of the cores, down to the settings' own."""
    for factor in (*cores, 1.0):
        found = stages.passes("thinner cores", z, _with_cores(replace(p, aim="flapping"), factor), rough)
        z = found.x
        if found.residual > NEAR:
            return replace(found, why=f"with cores {factor:g} times as thick as asked for: {found.why}")
    return stages.found("trim", z, p, TOL)


def _among(p: WakeTrim, controls, coning: float, stages: _Stages) -> TrimmedInWake:
    """The trim over the rotor's floor; then the surfaces at once, or as their flow comes up from nothing."""
    open_air = replace(p, model=replace(p.model, surfaces=None, over=p.model.floor))
    found = _from_wind(open_air, controls, coning, stages)
    if not found.outcome.converged:
        return replace(found, outcome=replace(found.outcome, why=f"without surfaces: {found.outcome.why}"))
    p = replace(p, model=replace(p.model, settings=found.p.model.settings))

    def at(s: float) -> WakeTrim:
        return eqx.tree_at(lambda q: q.model.surfaces.share, p, jnp.asarray(s, float))

    branch = _follow("trim", at, found.z, 1.0, stages)
    if not branch.reached:
        return _lost(branch.last.x if branch.outcomes else found.z, branch.why, p, stages)
    return TrimmedInWake(branch.last.x, p, branch.last, stages.iterations)


def _refitted(p: WakeTrim) -> WakeTrim:
    """A trim whose surfaces have moved, with the inverse that belongs to them."""
    if p.model.surfaces is None:
        return p
    return replace(p, model=replace(p.model, surfaces=refitted(p.model.surfaces, p.model.ground)))


def _by_way_of_washout(thick: WakeTrim, controls, coning: float, stages: _Stages) -> Outcome:
    """Trim with thick cores in a flow that carries the wake away, far over the ground; that flow is taken back and the
    ground comes up.
    """
    washed = _washed(thick, 0.0)
    first = stages.passes("auxiliary flow", _prescribed(washed, controls, coning), washed, ROUGH)
    branch = _follow("less auxiliary flow", lambda s: _washed(thick, s), first.x, 0.5, stages)
    if branch.reached and thick.model.ground is not None:
        branch = _follow("nearer to the ground", lambda s: _lowered(thick, s), branch.last.x, 0.5, stages)
    if branch.reached:
        return branch.last
    return replace(branch.failed or first, converged=False, why=branch.why)


def _follow(
    stage: str,
    at: Callable[[float], WakeTrim],
    x: InWake,
    first: float,
    stages: _Stages,
    share: float = SHARE,
    smallest: float = LEAST,
    carry: Carry = unchanged,
) -> Branch:
    """Continuation over s from 0 to 1 with the trim at(s); its end is told apart by TOL. share: of passes;
    smallest: step; carry: of `continuation`.
    """

    def step(guess, s, memory):
        last = s == 1 and stage == "trim"
        found = stages.found(stage, guess, at(s), TOL if last else ROUGH, share)
        if last and (stages.nearest is None or found.residual < stages.nearest.residual):
            stages.nearest = found
        return found

    return continuation(step, x, 0.0, 1.0, steps=Steps(first, smallest, 1.0, EASY), jump=0.5, carry=carry)


def _lost(x: InWake, why: str, p: WakeTrim, stages: _Stages) -> TrimmedInWake:
    """The end of a search that did not arrive: of the last wake found and the nearest one at the case itself that which
    is nearer to a trim of the case.
    """
    here = anderson(passed, x, p, tol=TOL, max_iterations=0)
    if stages.nearest is not None and stages.nearest.residual < here.residual:
        here = stages.nearest
    return TrimmedInWake(here.x, p, replace(here, converged=False, why=why), stages.iterations)


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
