"""Solving for trim in the free wake, and what it comes to.

In hover the wake is first solved for on rigid blades (wake/solution.py), with its own continuation. In a wind it starts
from a prescribed one: Anderson's iteration and Newton with thick cores, then Newton with the settings' own.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from rotorjax.errors import InputError
from rotorjax.ground import Plane, pitched
from rotorjax.inflow.momentum import hover_inflow
from rotorjax.ode.anderson import anderson
from rotorjax.ode.continuation import continuation
from rotorjax.ode.linear import Krylov
from rotorjax.ode.newton import newton
from rotorjax.ode.outcome import Outcome
from rotorjax.operating import OperatingPoint
from rotorjax.rotor.flap_lag import blade_of, lag_frequency
from rotorjax.rotor.geometry import Rotor
from rotorjax.rotor.hub import RotorInputs
from rotorjax.trim.free_wake import InWake, WakeTrim, first_guess, flown, residual
from rotorjax.trim.problem import Aim
from rotorjax.wake.model import FreeWake, free_wake
from rotorjax.wake.settings import WakeSettings, flight_settings, wake_settings
from rotorjax.wake.solution import solve

Progress = Callable[[str, float], None]

TOL = 1e-7
"""Relative rms of the residual of wake, blades and controls together."""

THICKER = 1.6
"""Cores at the start in a wind, over the settings': with them Anderson's iteration converges from a prescribed wake."""


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
) -> WakeTrim:
    """Set a trim up. ground: in level axes; the trim's model has it as the tilted shaft sees it.

    Raises InputError where the rotor has no hinge data or nothing holds its blades in lag, the disk cuts the ground, or
    as `free_wake` does.
    """
    if settings is None:
        settings = flight_settings(rotor.blades) if windy(inputs) else wake_settings(azimuths=2 * rotor.blades)
    still = eqx.tree_at(lambda o: o.climb, operating, jnp.zeros_like(operating.climb))
    if ground is not None and inputs.pitch is not None:
        ground = pitched(ground, inputs.pitch)
    if ground is not None and not float(ground.clearance) > 0:
        raise InputError(
            f"Argument `ground` must lie under the disk, but the tilted disk's rim is {-float(ground.clearance):.3g} R "
            "under it: set a greater height or less tilt"
        )
    model = free_wake(rotor, still, ground, settings)
    blade = blade_of(rotor, operating)
    if not float(lag_frequency(blade)) > 0:
        raise InputError(
            f"Argument `rotor` must hold its blades in lag, but those of {rotor.name} have their hinge on the shaft "
            "and no spring: give it `offset` or `lag_spring`"
        )
    return WakeTrim(model, blade, inputs, jnp.asarray(thrust, float), aim)


def windy(inputs: RotorInputs) -> bool:
    """Whether the hub moves across the air: then no azimuth is like another."""
    return bool(np.any(np.asarray(inputs.velocity)[:2] != 0))


def trim_in_wake(
    p: WakeTrim, controls: Float[Array, "3"], coning: float, progress: Progress | None = None
) -> TrimmedInWake:
    """Trim from a guess of the controls θ₀, θ₁c, θ₁s and of the coning (rad).

    progress(stage, residual) is called as things go on. A trim that does not converge comes back with its reason.
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
    if windy(p.inputs):
        return _from_wind(p, controls, coning, stages)
    return _from_hover(p, controls, coning, stages)


class _Stages:
    """Counts iterations and shows how far things are."""

    def __init__(self, progress: Progress | None) -> None:
        self._progress, self.iterations = progress, 0

    def done(self, stage: str, outcome: Outcome) -> Outcome:
        """Count and show an outcome, and hand it on."""
        self.iterations += outcome.iterations
        if self._progress is not None:
            self._progress(stage, outcome.residual)
        return outcome

    def newton(self, stage: str, z: InWake, p: WakeTrim, tol: float) -> Outcome:
        """Newton-Krylov on wake, blades and controls together."""
        linear = Krylov(forcing=0.03, restart=120, restarts=1)
        return self.done(stage, newton(residual, z, p, linear=linear, tol=tol, max_iterations=12))


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
    inflow = 0.02 + 0.5 * float(hover_inflow(p.thrust, p.inputs) + p.inputs.climb)
    guess = first_guess(p, controls, coning, p.model.settings.azimuths, inflow)
    thick = _with_cores(replace(p, aim="flapping"), THICKER)
    first = stages.done(
        "prescribed wake",
        anderson(residual, guess, thick, mixing=0.3, window=15, tol=5e-4, max_iterations=150, linear=Krylov()),
    )
    outcome = stages.newton("thick cores", first.x, thick, 1e-5)
    if outcome.converged:
        outcome = stages.newton("trim", outcome.x, p, TOL)
    else:
        p = thick
    return TrimmedInWake(outcome.x, p, outcome, stages.iterations)


def _with_cores(p: WakeTrim, factor: float) -> WakeTrim:
    """The trim with thicker cores in the wake."""

    def cores(q):
        s = q.model.settings
        return s.tip_core, s.near_core, s.bound_core_chords

    return eqx.tree_at(cores, p, tuple(factor * c for c in cores(p)))
