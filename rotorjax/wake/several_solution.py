"""Solving for several rotors in one free wake: each alone over its floor, then all at once; where that is lost, in a
growing share of the others' flow and of the surfaces'.
"""

from dataclasses import dataclass, replace
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from rotorjax.checks import known
from rotorjax.errors import InputError
from rotorjax.ode.continuation import Steps, continuation
from rotorjax.ode.implicit import attach
from rotorjax.ode.linear import Krylov
from rotorjax.ode.newton import SMALLEST_STEP, newton
from rotorjax.ode.outcome import Outcome
from rotorjax.wake import several as flow
from rotorjax.wake.equilibrium import METHOD, Evaluation, Unknowns, displacement, spread
from rotorjax.wake.model import FreeWake, WakeState
from rotorjax.wake.performance import Coefficients
from rotorjax.wake.preconditioner import HarmonicInverse, harmonic_inverse
from rotorjax.wake.search import MOST_SLICES, Progress
from rotorjax.wake.several import (
    THRUST_SLOPE,
    SeveralWakes,
    Together,
    evaluate,
    loads_of,
    residual,
    told,
    with_collectives,
)
from rotorjax.wake.solution import Number, Numbers, Solution, lowest_node, readings, solve, told_of

AT_ONCE = 8
"""Newton iterations from wakes alone to wakes together: what takes more is found sooner by shares."""

SHORTEST = 0.25
"""Least share of these steps: wakes from which shorter ones are needed are too far from there."""

TIGHT = 1e-3
"""Least relative tolerance of Newton's linear solve where a step is too long; that is seldom for want of digits."""

CLOSE = 1e-4
"""How close the thrust of a rotor alone comes to what is asked of it, over that."""

FARTHEST = 0.1
"""Most that the collective is moved at once (rad): beyond stall thrust says nothing of the way back."""

STALLED, TOLD = 0.2 * THRUST_SLOPE, 0.01
"""Thrust a radian of collective below which the blades stall, and over how many radians more that is seen."""

MOST_PITCHES = 20
"""Collectives after which a rotor alone is left at the thrust that it has."""


@dataclass(frozen=True)
class SeveralSolution:
    """N rotors in their common periodic wake. Lengths over R, velocities over ΩR, in each rotor's own frame.

    model, state: the state (leading axis N) belongs to this model, whose collectives are those trimmed to. rotors: each
    rotor's own readings. converged, why, residual (rms distance that nodes move in one pass), iterations: of the
    search; coupling: share of the other rotors' flow in what is here, 1 where converged. CT, CP, CP_induced,
    mean_inflow (N,).
    """

    model: SeveralWakes
    state: WakeState
    rotors: tuple[Solution, ...]
    converged: bool
    why: str
    residual: float
    iterations: int
    CT: Numbers
    CP: Numbers
    CP_induced: Numbers
    mean_inflow: Numbers

    @property
    def collective_deg(self) -> Numbers:
        """Collective of each rotor, degrees, (N,)."""
        return np.rad2deg(self.model.wakes.operating.collective)

    @property
    def coupling(self) -> float:
        """Share of the others' flow that each rotor sees."""
        return float(self.model.coupling)

    @property
    def figure_of_merit(self) -> Number:
        """Ideal power of the rotors, each on its own disk, over what they take: Σ C_T^1.5/√2 / Σ C_P."""
        return np.sum(self.CT**1.5) / np.sqrt(2) / np.sum(self.CP)

    @property
    def clearance(self) -> float:
        """Height over R of the lowest node of all wakes above the ground; inf without ground."""
        if self.model.ground is None:
            return float("inf")
        each = zip(self.rotors, np.asarray(self.model.phases), strict=True)
        return min(float(lowest_node(one.state, one.model, phase)) for one, phase in each)

    @property
    def leak(self) -> float | None:
        """Share of what blows on the surfaces that goes through between their panels' middles (`panels.surface.leak`);
        None without any.
        """
        return None if self.model.surfaces is None else float(_leaked(self.model, self.state))

    def velocity(self, points: Float[Array, "P 3"]) -> Float[Array, "P 3"]:
        """Induced velocity over ΩR at points of the common frame over R, mean over the blades' passage."""
        return _velocity(self.state, jnp.asarray(points, float), self.model)


_velocity = eqx.filter_jit(flow.velocity)
_leaked = eqx.filter_jit(flow.leaked)


class EachInverse(eqx.Module):
    """One rotor's inverse Jacobian for each of several, their effect on each other left out."""

    inverse: HarmonicInverse

    def __call__(self, v: Together, x: Together, model: SeveralWakes) -> Together:
        """Return about J⁻¹ v."""
        return Together(jax.vmap(lambda one: self.inverse(one, one, model.wakes))(v.wakes), -v.collective)


def solve_several(
    several: SeveralWakes, start: SeveralSolution | None = None, progress: Progress | None = None, tol: float = 1e-7
) -> SeveralSolution:
    """Find the periodic wake of several rotors, from each one's own or from that of a neighbouring case.

    start: a converged solution of as many like rotors. progress(stage, residual): called after each step. tol: relative
    rms of the residual. A search that does not get there comes back with `converged` False, why, and what it reached:
    its `coupling` says at which share of the other rotors' and the surfaces' flow it was lost.

    Raises InputError under tracing: there `performance_of` has the derivatives.
    """
    if not known(several):
        raise InputError(
            "Argument `several` must be of numbers, but is traced by jax: solve first, and differentiate "
            "wake.several_solution.performance_of"
        )
    if start is not None and start.converged and _fits(start.model, several):
        x, linear = _unknowns(start), _method(several, _mean(start.state))
        found = _newton(several, x, linear, tol, MOST_SLICES)
        _tell(progress, "neighbour", found)
        if found.converged:
            return _read(several, found, found.iterations)
    alone, spent = _alone(several, progress, tol)
    if not all(one.converged for one in alone):
        return _read(_share(several, 0.0), _outcome(several, alone), spent)
    x, linear = _outcome(several, alone).x, _method(several, alone[0].unknowns)
    found = _newton(several, x, linear, tol, AT_ONCE, SHORTEST)
    _tell(progress, "together", found)
    spent += found.iterations
    if found.converged or found.interrupted:
        return _read(several, found, spent)
    return _by_shares(several, x, linear, spent, progress, tol)


def _by_shares(
    several: SeveralWakes, x: Together, linear: Krylov, spent: int, progress: Progress | None, tol: float
) -> SeveralSolution:
    """Follow the branch as the flow of the others and of the surfaces comes up from nothing."""

    def step(x: Together, share: float, _: Any) -> Outcome:
        nonlocal spent
        found = _newton(_share(several, share), x, linear, tol if share == 1 else max(tol, 1e-5), MOST_SLICES)
        _tell(progress, f"together {share:.2f}", found)
        spent += found.iterations
        return found

    branch = continuation(step, x, 0.0, 1.0, steps=Steps(0.5, 0.03, 1.0, easy=5), jump=0.3)
    if not branch.outcomes:
        assert branch.failed is not None
        return _read(_share(several, 0.0), replace(branch.failed, why=branch.why), spent)
    found = branch.last if branch.reached else replace(branch.last, converged=False, why=f"together: {branch.why}")
    return _read(_share(several, branch.parameters[-1]), found, spent)


def performance_of(solution: SeveralSolution, several: SeveralWakes) -> Coefficients:
    """Thrust, power and mean inflow of each rotor (N,), with their derivatives by every number of the model.

    The value is the solution's, whatever the model: give the solution's own, or a traced one with its numbers. One
    linear solve for each direction (implicit function theorem). Raises InputError where the solution is not converged.
    """
    if not solution.converged:
        raise InputError(f"Argument `solution` must be converged to have a derivative, but: {solution.why}")
    x = jax.tree.map(jnp.asarray, _unknowns(solution))
    with jax.ensure_compile_time_eval():  # the solution is at hand: nothing of this belongs into the caller's program
        inverse = EachInverse(harmonic_inverse(solution.model.one(0).levelled, _mean(solution.state), several.slices))
    x = attach(residual, x, several, method="gmres", precondition=lambda x, model: inverse)
    driven = with_collectives(several, x.collective)
    return loads_of(driven, evaluate(driven, x.wakes))


def _fits(a: SeveralWakes, b: SeveralWakes) -> bool:
    """Whether two models have as many rotors, blades and nodes, and both have ground or neither."""
    same = jax.tree.structure(a.wakes.settings) == jax.tree.structure(b.wakes.settings)
    same = same and (a.ground is None) == (b.ground is None)
    return same and (len(a), a.slices, a.wakes.rotor.blades) == (len(b), b.slices, b.wakes.rotor.blades)


def _share(several: SeveralWakes, coupling: float) -> SeveralWakes:
    """Part of the others' flow, and of the answer of the surfaces."""
    part = jnp.asarray(coupling, several.places.dtype)
    several = eqx.tree_at(lambda s: s.coupling, several, part)
    return several if several.surfaces is None else eqx.tree_at(lambda s: s.surfaces.share, several, part)


def _newton(
    several: SeveralWakes, x: Together, linear: Krylov, tol: float, most: int, shortest: float = SMALLEST_STEP
) -> Outcome:
    return newton(told, x, several, linear=linear, tol=tol, max_iterations=most, smallest_step=shortest)


def _method(several: SeveralWakes, alone: Unknowns) -> Krylov:
    """Newton's linear solver, helped by the inverse Jacobian of the first rotor alone, for each."""
    inverse = harmonic_inverse(several.one(0).levelled, alone, several.slices)
    return replace(METHOD, precondition=EachInverse(inverse), tightest=TIGHT)


def _alone(several: SeveralWakes, progress: Progress | None, tol: float) -> tuple[list[Solution], int]:
    """Each rotor's own axisymmetric wake over its floor, at the thrust asked of it; the next begins with the last."""
    found: list[Solution] = []
    spent = 0
    for i in range(len(several)):
        thrust, last = None if several.thrusts is None else float(several.thrusts[i]), found[-1] if found else None
        one, more = _one_alone(several.one(i).levelled, thrust, last, progress, tol)
        found.append(one)
        spent += more
        if not one.converged:
            found += [one] * (len(several) - i - 1)
            break
    return found, spent


def _one_alone(
    model: FreeWake, thrust: float | None, start: Solution | None, progress: Progress | None, tol: float
) -> tuple[Solution, int]:
    """A rotor's wake, or the one closest to a thrust by the secant rule in its collective, and iterations in all."""
    if thrust is not None and start is not None:
        model = _at_collective(model, start.model.operating.collective)
    found = solve(model, start, progress, tol)
    spent, slope = found.iterations, THRUST_SLOPE
    if thrust is None or not found.converged:
        return found, spent
    for _ in range(MOST_PITCHES):
        if abs(thrust - found.CT) < CLOSE * thrust:
            break
        change = np.clip((thrust - found.CT) / slope, -FARTHEST, FARTHEST)
        new = solve(_at_collective(model, found.model.operating.collective + change), found, progress, tol)
        spent += new.iterations
        if not new.converged:
            return (new if new.interrupted else found), spent
        slope = max((new.CT - found.CT) / change, STALLED)
        if thrust > new.CT and slope == STALLED and change > TOLD:
            return replace(new, converged=False, why=_out_of_reach(thrust, new)), spent
        found = new
    return found, spent


def _out_of_reach(thrust: float, found: Solution) -> str:
    pitch = np.rad2deg(float(found.model.operating.collective))
    return (
        f"C_T = {thrust:.4g} is out of a rotor's reach: alone, at {pitch:.1f}° of collective, it has {found.CT:.4g}, "
        "and more pitch brings little more; ask for less in `thrusts`, or give the rotors more or broader blades"
    )


def _at_collective(model: FreeWake, collective: Any) -> FreeWake:
    return eqx.tree_at(lambda m: m.operating.collective, model, jnp.asarray(collective))


def _outcome(several: SeveralWakes, alone: list[Solution]) -> Outcome:
    """The rotors' own wakes as an outcome of the whole."""
    wakes = jax.tree.map(lambda *a: jnp.stack(a), *(spread(one.unknowns, several.slices) for one in alone))
    worst = max(alone, key=lambda one: one.residual)
    x = Together(wakes, jnp.stack([one.model.operating.collective for one in alone]))
    return Outcome(x, worst.residual, (worst.residual,), 0, worst.converged, f"alone: {worst.why}", 0.0)


def _unknowns(solution: SeveralSolution) -> Together:
    state = solution.state
    return Together(Unknowns(state.near, state.far, state.gamma_bound), solution.model.wakes.operating.collective)


def _mean(state: WakeState) -> Unknowns:
    """About the wake of the first rotor alone: its slices' mean."""
    first = Unknowns(state.near[0], state.far[0], state.gamma_bound[0])
    return jax.tree.map(lambda a: jnp.mean(a, axis=0, keepdims=True), first)


def _tell(progress: Progress | None, stage: str, found: Outcome) -> None:
    if progress is not None:
        progress(stage, found.residual)


@eqx.filter_jit
def _looked(x: Together, several: SeveralWakes) -> tuple[Together, Evaluation, Any]:
    moved, found = told(x, several)
    return moved, found, loads_of(several, found)


def _read(several: SeveralWakes, outcome: Outcome, iterations: int) -> SeveralSolution:
    """Evaluate what a search ended with, and collect what a user wants of it."""
    several = jax.tree.map(jnp.asarray, with_collectives(several, jnp.asarray(outcome.x.collective)))
    moved, evaluated, loads = _looked(outcome.x, several)
    rotors = []
    for i in range(len(several)):
        wakes, evaluation = jax.tree.map(lambda a, i=i: a[i], (outcome.x.wakes, evaluated))
        one = readings(several.one(i), wakes, evaluation, several.phases[i])
        rotors.append(replace(one, converged=outcome.converged, why=outcome.why))
    found = SeveralSolution(
        model=several,
        state=evaluated.state,
        rotors=tuple(rotors),
        converged=outcome.converged,
        why=outcome.why,
        residual=displacement(moved.wakes),
        iterations=iterations,
        CT=np.asarray(loads.thrust),
        CP=np.asarray(loads.power),
        CP_induced=np.asarray(loads.induced),
        mean_inflow=np.asarray(loads.mean_inflow),
    )
    return replace(found, why=told_of(found, found.why)) if found.converged else found
