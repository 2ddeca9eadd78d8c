"""Marching a flight from its trim, with the histories added to the trim's inputs."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from scipy.interpolate import PPoly

from rotorjax.coupled import CoupledRotor, CoupledState, Outputs, output, rhs
from rotorjax.errors import InputError
from rotorjax.inflow.choice import LOWEST
from rotorjax.ode.trajectory import Trajectory, march
from rotorjax.rotor.hub import RotorInputs
from rotorjax.simulation.case import SimulationCase, steps_of
from rotorjax.simulation.history import Piecewise, piecewise
from rotorjax.trim.problem import inputs_at
from rotorjax.trim.run import Result
from rotorjax.trim.run import run as run_trim

SAVES = 12  # of a revolution
Progress = Callable[[str], None]


class Driver(eqx.Module):
    """Inputs over time. trim: those at the start. added (10 columns), rates: histories in rotor units over Ω_ref t;
    height: over R, or None.
    """

    trim: RotorInputs
    added: Piecewise
    rates: Piecewise
    height: Piecewise | None

    def __call__(self, t: Float[Array, ""]) -> RotorInputs:
        """The inputs at one instant; rotor speed is set, everything else added."""
        extra, rate = self.added(t), self.rates(t)
        names = ("theta_1c", "theta_1s", "theta_0", "u", "v", "w", "p", "q", "r")
        values = {name: getattr(self.trim, name) + extra[k] for k, name in enumerate(names)}
        values |= {f"{name}_rate": rate[k] for k, name in enumerate(names) if k >= 3}
        height = self.trim.height if self.height is None else self.height(t)[0]
        return RotorInputs(**values, omega=extra[9], omega_rate=rate[9], height=height)


class Flown(NamedTuple):
    """A march. t: Ω_ref t (T,); states; inputs and outputs at the same instants, leading axis T."""

    t: Float[Array, " T"]
    x: CoupledState
    u: RotorInputs
    y: Outputs


@dataclass(frozen=True)
class Simulated:
    """A flight. march_s: seconds of the march without compilation; finished, why: how it ended."""

    case: SimulationCase
    start: Result
    flown: Flown
    driver: Driver
    steps: int
    march_s: float
    finished: bool
    why: str


def driven(t: Float[Array, ""], x: CoupledState, driver: Driver, p: CoupledRotor) -> CoupledState:
    """Rate of the coupled rotor under the histories."""
    return rhs(t, x, driver(t), p)


def driver_of(case: SimulationCase, start: Result) -> Driver:
    """Histories in rotor units. Raises InputError where the hub's path takes the disk into the ground."""
    p, inputs = start.p, inputs_at(start.z.controls, start.flight)
    omega, tip = float(p.operating.omega), float(p.operating.tip_speed(p.rotor.radius))
    turn = np.pi / 180
    units = np.array([turn, turn, turn, 1 / tip, 1 / tip, 1 / tip, turn / omega, turn / omega, turn / omega, 0.01])
    told = case.polynomials()
    powers = omega ** -np.arange(told.c.shape[0] - 1, -1, -1.0)  # from seconds to Ω_ref t
    scaled = PPoly(told.c * powers[:, None, None] * units, told.x * omega)
    height = None
    if start.flight.height is not None:
        tilt = float(start.z.controls.tilt)
        up = scaled.c @ np.array([0, 0, 0, np.sin(tilt), 0, -np.cos(tilt), 0, 0, 0, 0])
        path = PPoly(up[..., None], scaled.x).antiderivative()
        path.c[-1] += float(start.flight.height)
        _check_clear(path, case, start, omega, tilt)
        height = piecewise(path)
    return Driver(inputs, piecewise(scaled), piecewise(scaled.derivative()), height)


def _check_clear(path: PPoly, case: SimulationCase, start: Result, omega: float, tilt: float) -> None:
    t = np.linspace(0.0, case.duration * omega, 2001)
    lowest = abs(np.sin(tilt)) + np.tan(np.deg2rad(start.request.slope_deg))
    why = "where the disk cuts the ground"
    if start.request.inflow != "vpbfsm" and lowest < LOWEST:
        lowest, why = LOWEST, "the lowest that Cheeseman and Bennett's source is good for"
    under = np.flatnonzero(path(t)[:, 0] <= lowest)
    if under.size:
        raise InputError(
            f"[history] the hub's path must stay above {lowest:.3g} R, {why}, "
            f"but goes below it at {t[under[0]] / omega:.2f} s"
        )


def fly(case: SimulationCase, progress: Progress | None = None) -> Simulated:
    """Trim, check the path and march. Raises InputError where the case cannot be flown or does not trim."""
    report = progress or (lambda stage: None)
    report("trim")
    start = run_trim(case.request)
    if not start.trimmed.outcome.converged:
        raise InputError(f"[flight] must be a flight that can be trimmed, but: {start.trimmed.outcome.why}")
    driver = driver_of(case, start)
    p = start.p
    omega = float(p.operating.omega)
    steps = steps_of(case, omega)
    x = CoupledState(jnp.zeros(()), *jax.tree.map(lambda v: v[0], (start.z.rotor, start.z.inflow)))
    every = case.steps_per_turn // SAVES
    steps -= steps % every
    dt = 2 * np.pi / case.steps_per_turn

    def go(count: int, show: bool) -> Trajectory:
        return march(driven, x, 0.0, dt, count, driver, p, save_every=every, progress=show)

    report("compile the march")
    go(every, False)
    report("march")
    begun = time.perf_counter()
    found = go(steps, False)
    jax.block_until_ready(found.x)
    spent = time.perf_counter() - begun
    report("outputs")
    u, y = _outputs(found.t, found.x, driver, p)
    return Simulated(case, start, Flown(found.t, found.x, u, y), driver, steps, spent, found.finished, found.why)


@eqx.filter_jit
def _outputs(t, x, driver, p) -> tuple[RotorInputs, Outputs]:
    def at(row):
        now, state = row
        u = driver(now)
        return u, output(now, state, u, p)

    return jax.lax.map(at, (t, x), batch_size=64)
