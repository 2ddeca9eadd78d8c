"""Solving for trim: a first guess from momentum theory and blade elements, then Newton with the exact Jacobian."""

from dataclasses import dataclass, replace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from rotorjax.checks import check_number
from rotorjax.coupled import CoupledRotor, RotorState, sections_of
from rotorjax.errors import InputError
from rotorjax.inflow.momentum import hover_inflow
from rotorjax.ode.implicit import attach
from rotorjax.ode.newton import newton
from rotorjax.ode.outcome import Outcome
from rotorjax.rotor.geometry import chord, solidity, twist
from rotorjax.trim.problem import Controls, SteadyFlight, Trim, TrimResidual, inputs_at, outputs_at

TOL = 1e-9  # largest equation left over: angles in rad, thrust over the wanted one
AZIMUTHS = 24  # of a revolution


@dataclass(frozen=True)
class Trimmed:
    """A trim, converged or not. z: unknowns. outcome: how Newton ended. flight, p: what was trimmed."""

    z: Trim
    outcome: Outcome
    residual: TrimResidual
    flight: SteadyFlight
    p: CoupledRotor

    @property
    def iterations(self) -> int:
        """Newton's."""
        return self.outcome.iterations


def flight(
    thrust: float,
    advance: float = 0.0,
    climb: float = 0.0,
    tilt: float = 0.0,
    drag_area: float = 0.0,
    height: float | None = None,
) -> SteadyFlight:
    """Make a flight condition, tilt in rad, speeds over ΩR, drag_area over the disk's area, height over R.

    Raises InputError where a value is not finite, thrust or height is not positive, advance not in [0, 0.5], the tilt
    beyond ±0.7 rad or the disk would cut the ground.
    """
    check_number("thrust_coefficient", thrust, 0.0, open_=True)
    check_number("advance_ratio", advance, 0.0, 0.5)
    check_number("climb", climb, -0.3, 0.2)
    check_number("tilt", tilt, -0.7, 0.7)
    check_number("drag_area", drag_area, 0.0, 0.2)
    if height is not None:
        check_number("height", height, 0.0, open_=True)
        if height <= abs(float(np.sin(tilt))):
            raise InputError(
                f"Argument `height` must exceed sin(tilt) = {abs(np.sin(tilt)):.3g}, where the disk cuts the ground, "
                f"but is {height:g}"
            )
    scalars = (jnp.asarray(v, float) for v in (thrust, advance, climb, tilt, drag_area))
    return SteadyFlight(*scalars, height=None if height is None else jnp.asarray(height, float))


def most_thrust(p: CoupledRotor, advance: float) -> float:
    """C_T that no inflow can exceed: every section at the greatest lift of its table, all round the disk."""
    sections = sections_of(p)
    most = np.max(np.asarray(p.rotor.airfoil.cl))  # of numpy: of jax's own array it would be a program
    r, widths, lifting = (np.asarray(v) for v in (sections.r, sections.widths, sections.lifting))
    dynamic = 0.5 * np.asarray(chord(p.rotor, sections.r)) * (r**2 + advance**2 / 2)
    return float(p.rotor.blades / np.pi * most * np.sum(dynamic * widths * lifting))


def guess(p: CoupledRotor, flight: SteadyFlight, azimuths: int = AZIMUTHS) -> Trim:
    """Uniform inflow and linear lift without stall: collective for the thrust, cyclic that keeps the disk level."""
    blades, mu = p.rotor.blades, float(flight.advance)
    thrust = float(flight.thrust)
    start = Controls(jnp.zeros(()), jnp.zeros(()), jnp.zeros(()), flight.tilt)
    u = inputs_at(start, flight)
    inflow = float(hover_inflow(flight.thrust, u) + u.climb)
    theta = 3 * (2 * thrust / (5.73 * float(solidity(p.rotor))) + inflow / 2) / (1 + 1.5 * mu**2)
    blade = p.blade
    stiffness = 1 + float(blade.offset * blade.first_moment + blade.flap_spring)
    lift_moment = float(blade.air) * thrust * np.pi / blades * 0.72
    coning = (lift_moment - float(blade.first_moment * blade.gravity)) / stiffness
    controls = Controls(
        jnp.asarray(theta - float(twist(p.rotor, jnp.asarray(0.75)))),
        jnp.asarray(4 / 3 * mu * coning / (1 + mu**2 / 2)),
        jnp.asarray(-mu * (8 / 3 * theta - 2 * inflow) / (1 + 1.5 * mu**2)),
        flight.tilt,
    )
    nodes = -(-azimuths // blades)
    still, level = np.zeros((2, nodes, blades))
    level[:, 0] = coning
    rotor = RotorState(*(jnp.asarray(v) for v in (level, still, still, still)))
    state = p.inflow.start(flight.thrust, inputs_at(controls, flight))
    return Trim(rotor, jax.tree.map(lambda v: jnp.asarray(np.broadcast_to(v, (nodes, *v.shape))), state), controls)


def largest(f: np.ndarray, x: np.ndarray) -> float:
    """Largest equation left over."""
    del x
    return float(np.max(np.abs(f))) if np.all(np.isfinite(f)) else float("inf")


def trim(
    p: CoupledRotor,
    flight: SteadyFlight,
    residual: TrimResidual | None = None,
    start: Trim | None = None,
    azimuths: int = AZIMUTHS,
    progress: bool = False,
) -> Trimmed:
    """Trim a rotor. start: a trim nearby; residual: what is trimmed for, no cyclic flapping at a given tilt by default.

    Where Newton fails from the first guess the thrust is raised in steps; a rotor that stalls on the way comes back
    with `converged` False and the thrust that it reached in `why`.

    Raises InputError where the thrust is more than the blades can give at their greatest lift all round the disk.
    """
    residual = TrimResidual(p.rotor.blades) if residual is None else residual
    most = most_thrust(p, float(flight.advance))
    if float(flight.thrust) > most:
        raise InputError(
            f"Argument `thrust_coefficient` must be below {most:.4g}, where every section has its greatest lift, "
            f"but is {float(flight.thrust):g}"
        )
    z = guess(p, flight, azimuths) if start is None else start
    outcome = newton(residual, z, flight, p, tol=TOL, measure=largest, progress=progress)
    found = Trimmed(outcome.x, outcome, residual, flight, p)
    return found if outcome.converged or start is not None else _raised(found, p, flight, azimuths)


def _raised(failed: Trimmed, p: CoupledRotor, flight: SteadyFlight, azimuths: int) -> Trimmed:
    """Raise the thrust in steps to the wanted one, each trim from the last; if that fails, say how far it came."""
    wanted, reached, z = float(flight.thrust), 0.0, None
    step = wanted / 2
    while step > 0.02 * wanted:
        target = min(wanted, reached + step)
        condition = eqx.tree_at(lambda f: f.thrust, flight, jnp.asarray(target))
        near = guess(p, condition, azimuths) if z is None else z
        outcome = newton(failed.residual, near, condition, p, tol=TOL, measure=largest, max_iterations=12)
        if not outcome.converged:
            step /= 2
            continue
        reached, z = target, outcome.x
        if reached == wanted:
            return Trimmed(z, outcome, failed.residual, flight, p)
    why = (
        f"out of reach: raised in steps, the rotor trims up to C_T = {reached:.4g}; at {wanted:g}: {failed.outcome.why}"
    )
    return replace(failed, outcome=replace(failed.outcome, why=why))


@eqx.filter_jit
def power(z: Trim, flight: SteadyFlight, p: CoupledRotor) -> Float[Array, ""]:
    """Mean C_P = C_Q of a trim."""
    return jnp.mean(outputs_at(z, flight, p).CQ)


def trimmed_power(found: Trimmed, flight: SteadyFlight, p: CoupledRotor) -> Float[Array, ""]:
    """C_P of a converged trim as a function of flight and rotor, differentiable by the implicit function theorem."""
    return power(attach(found.residual, found.z, flight, p), flight, p)
