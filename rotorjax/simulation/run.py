"""Marching a flight from its trim, with the histories added to the trim's inputs."""

import time
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from scipy.interpolate import PPoly
from tqdm import tqdm

from rotorjax.coupled import Coupled, CoupledState, Outputs, output, rhs
from rotorjax.coupled_wake import CoupledWake
from rotorjax.ode.trajectory import Trajectory, march
from rotorjax.operating import OperatingPoint
from rotorjax.rotor.geometry import Rotor
from rotorjax.rotor.hub import ATTITUDE, RotorInputs
from rotorjax.simulation.case import COLUMNS, MOST_A_TURN, OldAge, Precision, SimulationCase, steps_of
from rotorjax.simulation.history import Piecewise, piecewise
from rotorjax.simulation.march import MarchState, begun, cast, compiled, on_device, precision_of, stretch
from rotorjax.simulation.pace import Pace
from rotorjax.simulation.path import Above, angles, hub_path
from rotorjax.simulation.start import Start, start_of
from rotorjax.simulation.step import check_steps, instant, steps_per_turn

SAVES = 12  # of a revolution
Told = Callable[[str], None]


class Driver(eqx.Module):
    """Inputs over time. trim: those at the start. added (10 columns), rates: histories in rotor units over Ω_ref t.
    path: the hub's attitude and height (`simulation.path`).
    """

    trim: RotorInputs
    added: Piecewise
    rates: Piecewise
    path: Piecewise

    def __call__(self, t: Float[Array, ""]) -> RotorInputs:
        """The inputs at one instant; rotor speed is set, everything else added."""
        extra, rate = self.added(t), self.rates(t)
        names = ("theta_1c", "theta_1s", "theta_0", "u", "v", "w", "p", "q", "r")
        values = {name: getattr(self.trim, name) + extra[k] for k, name in enumerate(names)}
        values |= {f"{name}_rate": rate[k] for k, name in enumerate(names) if k >= 3}
        way = self.path(t)
        values |= dict(zip(ATTITUDE, angles(way[:4]), strict=True))
        height = None if self.trim.height is None else way[4]
        return RotorInputs(**values, omega=extra[9], omega_rate=rate[9], height=height)


class Flown(NamedTuple):
    """A march. t: Ω_ref t (T,); states; inputs and outputs at the same instants, leading axis T."""

    t: Float[Array, " T"]
    x: CoupledState
    u: RotorInputs
    y: Outputs


@dataclass(frozen=True)
class Simulated:
    """A flight. march_s: seconds of the march, without compilation and waiting; finished, why: how it ended; pace: by
    the clock.
    """

    case: SimulationCase
    start: Start
    flown: Flown
    driver: Driver
    steps: int
    march_s: float
    finished: bool
    why: str
    pace: Pace | None = None


def driven(t: Float[Array, ""], x: CoupledState, driver: Driver, p: Coupled) -> CoupledState:
    """Rate of the coupled rotor under the histories."""
    return rhs(t, x, driver(t), p)


def driver_of(case: SimulationCase, start: Start) -> Driver:
    """Histories in rotor units. Raises InputError where the hub's path takes the disk into the ground."""
    scaled = _in_rotor_units(case, start.p.rotor, start.p.operating)
    path = path_of(case, start.p.rotor, start.p.operating, start.tilt)
    return Driver(start.inputs, piecewise(scaled), piecewise(scaled.derivative()), piecewise(path))


def _in_rotor_units(case: SimulationCase, rotor: Rotor, operating: OperatingPoint) -> PPoly:
    omega, tip = float(operating.omega), float(operating.tip_speed(rotor.radius))
    turn = np.pi / 180
    units = np.array([turn, turn, turn, 1 / tip, 1 / tip, 1 / tip, turn / omega, turn / omega, turn / omega, 0.01])
    told = case.polynomials()
    powers = omega ** -np.arange(told.c.shape[0] - 1, -1, -1.0)  # from seconds to Ω_ref t
    return PPoly(told.c * powers[:, None, None] * units, told.x * omega)


def path_of(case: SimulationCase, rotor: Rotor, operating: OperatingPoint, tilt: float) -> PPoly:
    """Attitude and, over ground, height of the hub over Ω_ref t (`simulation.path`); tilt of the shaft (rad).

    Raises InputError where the path takes the disk into the ground, or further than the inflow model knows.
    """
    scaled, omega, request = _in_rotor_units(case, rotor, operating), float(operating.omega), case.request
    motion = PPoly(scaled.c[..., 3:9], scaled.x)
    velocity = request.advance * np.array([np.cos(tilt), 0.0, -np.sin(tilt)])
    ground = None
    if request.height is not None:
        ground = Above(request.height, float(np.deg2rad(request.slope_deg)), request.inflow, omega)
    return hub_path(motion, velocity, -tilt, case.duration * omega, ground)


def fly(case: SimulationCase, progress: Told | None = None, pace: Pace | None = None) -> Simulated:
    """Trim, check the path and march, by the clock with a pace. Raises InputError where the case cannot be flown or
    does not trim.
    """
    report = progress or (lambda stage: None)
    request = case.request
    check_steps(case)  # these are said before the trim's work
    if request.height is not None and request.drag_area is None:
        path_of(case, request.rotor, request.operating, float(np.deg2rad(request.tilt_deg)))
    report("trim")
    return fly_from(case, start_of(case, report), report, pace)


def fly_from(case: SimulationCase, start: Start, progress: Told | None = None, pace: Pace | None = None) -> Simulated:
    """March from a start. Raises InputError where the hub's path takes the disk into the ground.

    Warns of a history that changes faster than the steps.
    """
    report = progress or (lambda stage: None)
    driver, p = driver_of(case, start), start.p
    omega = float(p.operating.omega)
    per_turn = steps_per_turn(case, start)
    steps = steps_of(case, omega, per_turn)
    check_histories(case, omega, per_turn)
    report("compile the march")
    make = _marcher_of_wake if isinstance(p, CoupledWake) else _marcher
    marched = make(case, driver, start, per_turn, pace)
    report("march")
    begun = time.perf_counter()
    watched = progress is not None and isinstance(p, CoupledWake) and pace is None
    found = marched(steps // (per_turn // SAVES), case.duration * omega, watched)
    spent = time.perf_counter() - begun - (0.0 if pace is None else pace.waited)
    report("outputs")
    u, y = _outputs(found.t, found.x, driver, p)
    return Simulated(case, start, Flown(found.t, found.x, u, y), driver, steps, spent, found.finished, found.why, pace)


def check_histories(case: SimulationCase, omega: float, per_turn: int) -> None:
    """Warn where a history does not begin with the trim's values, which it adds to, and where its points stand closer
    than the steps: what they are taken for, and what would do.

    omega: rotor speed (rad/s). per_turn: steps of a revolution.
    """
    for name, value in zip(COLUMNS, case.columns[0], strict=True):
        if value != (100.0 if name == "rotor_speed" else 0.0):
            rest = "100, the trim's" if name == "rotor_speed" else "0: it is added to the trim"
            warnings.warn(f"[history] {name} begins at {value:g}, a jump at the start, not {rest}", stacklevel=3)
    turn = 2 * np.pi / omega
    step = turn / per_turn
    moving = np.any(np.diff(case.columns, axis=0) != 0, axis=1)
    gaps = np.diff(case.t)[moving]
    if not gaps.size or gaps.min() >= step * (1 - 1e-9):
        return
    k = int(np.flatnonzero(moving)[np.argmin(gaps)])
    most, enough = 0.5 / step, 12 * int(np.ceil(turn / gaps.min() / 12 - 1e-9))
    way = f"raise steps_per_turn in [time] to {enough}" if enough <= MOST_A_TURN else "spread the change"
    warnings.warn(
        f"[history] changes between t = {case.t[k]:g} and {case.t[k + 1]:g} s, in less than a step of {step:.3g} s: "
        f"what is faster than {most:.3g} Hz is taken for something slower (f for |f - {2 * most:.3g}|): {way}",
        stacklevel=3,
    )


Marcher = Callable[[int, float, bool], Trajectory]
"""Marches so many stretches, each of a twelfth of a revolution but for the last and shorter one, to an Ω_ref t; watched
or not. Keeps the ends of the stretches.
"""


def _marcher(case: SimulationCase, driver: Driver, start: Start, per_turn: int, pace: Pace | None) -> Marcher:
    """March with an inflow model, compiled by a march of one stretch."""
    every, dt = per_turn // SAVES, 2 * np.pi / per_turn

    def go(x: CoupledState, t: float, dt: float, stretches: int, watched: bool = False) -> Trajectory:
        return march(driven, x, t, dt, stretches * every, driver, start.p, save_every=every, progress=watched)

    def marched(stretches: int, end: float, watched: bool) -> Trajectory:
        if stretches == 1:
            return jax.block_until_ready(go(start.x, 0.0, end / every, 1))
        whole = go(start.x, 0.0, dt, stretches - 1, watched)
        if not whole.finished:
            return whole
        t = (stretches - 1) * every * dt
        last = go(whole.last, t, (end - t) / every, 1)
        t, x = jax.tree.map(lambda a, b: jnp.concatenate([a, b[1:]]), (whole.t, whole.x), (last.t, last.x))
        return jax.block_until_ready(Trajectory(t, x, last.finished, last.why))

    go(start.x, 0.0, dt, 1)
    return marched


def _marcher_of_wake(case: SimulationCase, driver: Driver, start: Start, per_turn: int, pace: Pace | None) -> Marcher:
    """March with a free wake (simulation/march.py), frame by frame by the clock where there is a pace."""
    every, stretch_of = per_turn // SAVES, 2 * np.pi / SAVES
    precision: Precision = case.precision or ("double" if pace is None else "single")
    old_age: OldAge = case.old_age or ("stage" if pace is None else "step")
    omega = float(start.p.operating.omega)
    with precision_of(precision):
        x, u, drive, p = on_device(cast((start.x, start.inputs, driver, start.p), precision))
        first, number = begun(x, u, p, old_age), jnp.zeros(())
        program = compiled(partial(stretch, every), first, number, number, bound=(drive, p))

    def marched(stretches: int, end: float, watched: bool) -> Trajectory:
        ends = np.append(stretch_of * np.arange(stretches), end)
        state, states, why = first, [jax.device_get(start.x)], ""
        if pace is not None:
            pace.start()
        try:
            for k in tqdm(range(stretches), desc="march", disable=not watched):
                t, dt = cast((float(ends[k]), float(ends[k + 1] - ends[k]) / every), precision)
                state = jax.block_until_ready(program(state, t, dt))
                if not bool(state.finite):
                    why = f"not finite before Ω t = {ends[k + 1]:.3f}: what it had before is kept"
                    break
                states.append(jax.device_get(state.x))
                if pace is not None:
                    pace.frame(ends[k + 1] / omega, _line(ends[k + 1] / omega, state))
        except KeyboardInterrupt:
            why = f"interrupted after {len(states) - 1} stretches"
        x = jax.tree.map(lambda *v: jnp.asarray(np.stack(v), float), *states)
        x = eqx.tree_at(lambda x: x.psi, x, jnp.unwrap(x.psi))
        return Trajectory(jnp.asarray(ends[: len(states)]), x, not why, why or "finished")

    return marched


def _line(t: float, state: MarchState) -> str:
    """A frame in words: the loads are those of the last step's start."""
    flap = np.rad2deg(np.asarray(state.x.rotor.flap[:3]))
    told = "  ".join(f"{v:+7.3f}" for v in flap)
    return f"{t:9.3f} s  psi {np.rad2deg(float(state.x.psi)):5.1f}  CT {float(state.y.CT):.5f}  flap {told} deg"


def _outputs(t: Float[Array, " T"], x: CoupledState, driver: Driver, p: Coupled) -> tuple[RotorInputs, Outputs]:
    """Inputs and outputs along a march: many instants at once, or those of a free wake one by one."""
    if not isinstance(p, CoupledWake):
        return _at_once(t, x, driver, p)
    u = _inputs(t, driver)
    rows = (jax.tree.map(lambda v, k=k: v[k], (x, u)) for k in range(t.size))
    found = [instant(state, now, p)[1] for state, now in rows]
    return u, jax.tree.map(lambda *v: jnp.stack(v), *found)


_inputs = eqx.filter_jit(lambda t, driver: jax.lax.map(driver, t))


@eqx.filter_jit
def _at_once(t, x, driver, p) -> tuple[RotorInputs, Outputs]:
    def at(row):
        now, state = row
        u = driver(now)
        return u, output(now, state, u, p)

    return jax.lax.map(at, (t, x), batch_size=64)
