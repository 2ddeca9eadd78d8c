"""The way to a periodic wake: each step a few Newton-Krylov iterations on the residual of equilibrium.py.

An axisymmetric wake is first brought near by Anderson's iteration.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from rotorjax.ode.anderson import anderson
from rotorjax.ode.continuation import Branch, Steps, continuation
from rotorjax.ode.newton import newton
from rotorjax.ode.outcome import Outcome
from rotorjax.panels.surface import refitted
from rotorjax.rotor.geometry import twist
from rotorjax.wake.equilibrium import METHOD, Unknowns, look, told
from rotorjax.wake.model import FreeWake
from rotorjax.wake.preconditioner import HarmonicInverse, harmonic_inverse
from rotorjax.wake.start import laid_level, prescribed, shorter, with_the_ground, with_turns

Progress = Callable[[str, float], None]

STEEPER, GENTLER = np.deg2rad(10.0), np.deg2rad(1.0)
"""Most that the ground tilts in a step of a continuation, and a step that is tried however far it goes."""

SMALLEST = 0.05
"""Least step of a continuation over the whole way; less on a long way to a steep ground (GENTLER)."""

NEAR, LEFT, PASSES = 2e-3, 0.1, 200
"""Residual from which Newton's method takes over from Anderson's, share of the first residual that has to be left by
then, and passes after which it takes over anyway. A pass is a tenth of one of Newton's iterations, and from a rough
guess these wander. A neighbour's wake at another pitch has a small residual from the start, but where it is wrong it is
as wrong as any: passes find its slow modes, and two iterations of Newton's do what ten did not.
"""

MOST, MOST_SLICES, FEW = 10, 16, 5
"""Newton iterations at one model, of an axisymmetric wake and of all slices: what takes more is found sooner by a
smaller step of the continuation. FEW: where the passes did not come near and there is no preconditioner.
"""

CLOSING, MORE = 0.25, 5
"""Share of the residual that the last of these iterations leaves where Newton's method closes in: it gets MORE then."""

DISTANT = 2.0
"""Height over R at which a prescribed wake is near enough to a wake over ground."""

WASHOUT = 0.08
"""Auxiliary flow at the start (over ΩR): strong enough for Anderson's iteration to converge outright."""


def share(model: FreeWake):
    """Where a model keeps the share of its surfaces' flow that counts."""
    assert model.surfaces is not None
    return model.surfaces.share


@dataclass
class Search:
    """The way so far: whether it still goes on, whether the user ended it, why it ended, and what it took.

    inverse: the preconditioner at hand. hard: whether an axisymmetric wake, which is mostly found without, needs one.
    at_once: move to another model in one step or not at all.
    """

    tol: float
    progress: Progress | None
    ok: bool = True
    interrupted: bool = False
    why: str = ""
    iterations: int = 0
    residuals: list[float] = field(default_factory=list)
    inverse: HarmonicInverse | None = None
    hard: bool = False
    at_once: bool = False

    def from_nothing(self, model: FreeWake) -> tuple[FreeWake, Unknowns]:
        """Axisymmetric wake of a model over level ground or none: straight from a prescribed wake, and where that is
        lost by way of fewer turns, less pitch, a distant ground or the auxiliary flow.
        """
        self.inverse = None
        found = self.ended("prescribed wake", self.from_guess(model, prescribed(model), self.tol))
        if found.converged or found.interrupted:
            return model, found.x
        if (short := shorter(model)) is not None:
            here, x = self.from_nothing(short)
            if self.ok:
                here, x = self.other_turns(here, model, x)
            if self.ok or self.interrupted:
                return here, x
            self.inverse = None  # it may be the shorter wake's
        self.hard = True
        if model.ground is None or model.ground.height >= DISTANT:
            return self.by_way_of_washout(model)
        here, x = self.by_way_of_less_pitch(model)
        if self.ok or self.interrupted:
            return here, x
        here, x = self.from_nothing(on_host(eqx.tree_at(lambda m: m.ground.height, model, np.asarray(DISTANT))))
        return self.move(here, model, x, "nearer to the ground") if self.ok else (here, x)

    def by_way_of_less_pitch(self, model: FreeWake) -> tuple[FreeWake, Unknowns]:
        """Axisymmetric wake of a model over ground by way of half the pitch at 0.75 R: a light wake lies near the
        prescribed one however near the ground is, and grows into the heavy one.
        """
        collective = np.asarray(model.operating.collective)
        pitch = collective + np.asarray(twist(model.rotor, jnp.asarray(0.75)))
        light = on_host(eqx.tree_at(lambda m: m.operating.collective, model, collective - 0.5 * pitch))
        found = self.ended("half the pitch", self.from_guess(light, prescribed(light), self.tol))
        return self.move(light, model, found.x, "more pitch", 0.5) if self.ok else (light, found.x)

    def by_way_of_washout(self, model: FreeWake) -> tuple[FreeWake, Unknowns]:
        """Axisymmetric wake of a model by way of the auxiliary flow, which is taken back."""
        guess = prescribed(model, WASHOUT + 0.03)
        return self.follow(lambda s: with_washout(model, WASHOUT * (1 - s)), guess, "less auxiliary flow", 0.4)

    def move(
        self, here: FreeWake, there: FreeWake, x: Unknowns, stage: str, first: float = 1.0
    ) -> tuple[FreeWake, Unknowns]:
        """Follow the branch from one model to another of the same structure; first: share of the way tried first."""
        here, there = on_host(here), on_host(there)
        if all(np.array_equal(a, b) for a, b in zip(jax.tree.leaves(here), jax.tree.leaves(there), strict=True)):
            return self.settle(there, x)

        def between(s):
            model = on_host(jax.tree.map(lambda a, b: a + s * (b - a) if eqx.is_inexact_array(a) else b, here, there))
            if model.surfaces is not None and s < 1:
                model = on_host(replace(model, surfaces=refitted(model.surfaces, model.ground)))
            if here.ground is None or there.ground is None:
                return model
            # even steps in 1/h: the ground's effect goes with it
            height = 1 / ((1 - s) / here.ground.height + s / there.ground.height)
            return eqx.tree_at(lambda m: m.ground.height, model, np.asarray(height))

        tilt = 0.0 if there.ground is None or here.ground is None else float(there.ground.slope - here.ground.slope)
        largest, last = (min(1.0, step / max(abs(tilt), 1e-9)) for step in (STEEPER, GENTLER))
        least = largest if self.at_once else min(last, SMALLEST)
        return self.follow(between, x, stage, min(first, largest), least, largest)

    def among(self, model: FreeWake, x: Unknowns) -> tuple[FreeWake, Unknowns]:
        """From the wake of `model.levelled`, over K slices, to the surfaces: at once, or as their flow comes up.

        Over a large deck that wake is nearly the one; beside a wall it is the one that the wall's flow is added to.
        """
        self.prepare(model, x)
        found = self.ended("surfaces", self.newton(model, x, self.tol))
        if found.converged or found.interrupted:
            return on_host(model), found.x
        return self.follow(lambda s: on_host(eqx.tree_at(share, model, np.asarray(s))), x, "share of surfaces", 0.5)

    def other_turns(self, here: FreeWake, there: FreeWake, x: Unknowns) -> tuple[FreeWake, Unknowns]:
        """From a wake with fewer free turns, or more (`start.with_turns`); a level one first without an inverse."""
        there, x = on_host(there), with_turns(x, here, there.settings.far_ages)
        if x.near.shape[0] == 1 and not self.hard:
            found = self.ended("free turns", self.from_guess(there, x, self.tol))
            if found.converged or found.interrupted:
                return there, found.x
        self.hard = True
        self.prepare(there, x)
        return there, self.ended("free turns", self.from_guess(there, x, self.tol)).x

    def settle(self, model: FreeWake, x: Unknowns) -> tuple[FreeWake, Unknowns]:
        """Newton at the model itself."""
        return model, self.ended("case", self.newton(model, x, self.tol)).x

    def follow(
        self,
        at: Callable[[float], FreeWake],
        x: Unknowns,
        stage: str,
        first: float,
        smallest: float = SMALLEST,
        largest: float = 1.0,
    ):
        """Continuation over s from 0 to 1 with the model at(s)."""

        def step(guess, s, memory):
            found = self.from_guess(at(s), guess, self.tol if s == 1 else max(self.tol, 1e-5))
            if found.converged and s < 1 and (level or s > 0):
                self.prepare(at(s), found.x)
            self.note(f"{stage} {s:.2f}", found)
            return found

        def carry(x, here, there):
            return with_the_ground(x, at(here).floor, at(there).floor)

        level = x.near.shape[0] == 1
        if not level:
            self.prepare(at(0.0), x)
        steps = Steps(first, smallest, largest, easy=5)
        branch: Branch = continuation(step, x, 0.0, 1.0, steps=steps, jump=0.3, carry=carry)
        if not branch.outcomes:
            self.ok, self.why = False, branch.why
            return at(0.0), x
        reached = branch.parameters[-1]
        self.ok, self.why = branch.reached, branch.last.why if branch.reached else f"{stage}: {branch.why}"
        return at(reached), branch.last.x

    def from_guess(self, model: FreeWake, x: Unknowns, tol: float) -> Outcome:
        """Newton-Krylov from a guess, an axisymmetric one first brought near by passes of the fixed point."""
        if x.near.shape[0] > 1:
            return self.newton(model, x, tol)
        first = anderson(told, x, model, max_iterations=0, linear=METHOD).residual
        enough = min(NEAR, max(LEFT * first, tol))
        near = anderson(told, x, model, mixing=0.1, window=20, tol=enough, max_iterations=PASSES, linear=METHOD)
        return self.newton(model, near.x, tol, MOST if near.converged or self.hard else FEW)

    def newton(self, model: FreeWake, x: Unknowns, tol: float, most: int | None = None, effort: int = 120) -> Outcome:
        """Newton-Krylov at one model, with at most `effort` products with the Jacobian an iteration."""
        level = x.near.shape[0] == 1
        # over a slope the preconditioner is of another wake than this one, and no gauge
        linear = replace(METHOD, precondition=self.inverse, natural=level, restart=effort)
        most = most or (MOST if level else MOST_SLICES)
        found = newton(told, x, model, linear=linear, tol=tol, max_iterations=most if effort > 1 else 1)
        if found.converged or found.iterations < most or found.residuals[-1] > CLOSING * found.residuals[-2]:
            return found
        last = newton(told, found.x, model, linear=linear, tol=tol, max_iterations=MORE, memory=found.memory)
        return replace(
            last,
            iterations=found.iterations + last.iterations,
            residuals=(*found.residuals, *last.residuals[1:]),
            wall_time=found.wall_time + last.wall_time,
        )

    def prepare(self, model: FreeWake, x: Unknowns) -> None:
        """Make the preconditioner, from a wake like x that is axisymmetric, where one is needed."""
        if x.near.shape[0] == 1 and not self.hard:
            return
        about, laid = on_host(model.levelled), laid_level(x, model.floor)
        self.inverse = harmonic_inverse(about, laid, x.near.shape[0], look(about, laid)[1])

    def ended(self, stage: str, found: Outcome) -> Outcome:
        """Count the step with which a way ends, and take over whether it got there."""
        self.note(stage, found)
        self.ok, self.why = found.converged, found.why
        return found

    def note(self, stage: str, found: Outcome) -> None:
        """Count a step and show it."""
        self.iterations += found.iterations
        self.interrupted = found.interrupted
        self.residuals.extend(found.residuals)
        if self.progress is not None:
            self.progress(stage, found.residual)


def with_washout(model: FreeWake, washout: float) -> FreeWake:
    """The model in an auxiliary flow, its collective raised by the flow's angle at 0.75 R so that the loading stays."""
    numbers = washout, np.asarray(model.operating.collective) + washout / 0.75
    return on_host(eqx.tree_at(lambda m: (m.washout, m.operating.collective), model, numbers))


def on_host(model: FreeWake) -> FreeWake:
    """The model with its numbers as numpy's, which need no program to reckon with."""
    return jax.tree.map(lambda a: np.asarray(a, jnp.result_type(a)), model)
