"""Several rotors in one free wake as a linear system: collectives and speeds to thrusts, torques and inflows.

Each rotor's blades keep their own states, thousands in all, so no matrix of theirs is ever made. A pulse of each input,
held over a step of the march, is carried on by the derivative of that step about the periodic wake; what the outputs
show of it, averaged over where in a blade's passage it came, is the mean system's response in full, whatever changes
with the azimuth. The smallest model with that response is the eigensystem realisation's (Juang and Pappa 1985,
doi:10.2514/3.20031): a balanced truncation for a finite time, which modes that grow do no harm. Its steps are those of
`rj.march`, its rates the matrix logarithm's.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple, cast

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import scipy.linalg
from jaxtyping import Array, Float

from rotorjax.checks import check_whole
from rotorjax.errors import InputError
from rotorjax.linearisation.drive import UNITS, check_double
from rotorjax.linearisation.system import WakeBase
from rotorjax.ode.labels import labels, select, units_of
from rotorjax.ode.models import LinearModel
from rotorjax.ode.reduction import even
from rotorjax.ode.threads import one_thread
from rotorjax.simulation.several_march import marching, stepped, steps_of
from rotorjax.wake.model import WakeState
from rotorjax.wake.several import SeveralWakes
from rotorjax.wake.several_dynamics import SeveralInputs, SeveralState, nominal
from rotorjax.wake.several_solution import SeveralSolution

TURNS = 2
"""Revolutions that a pulse is followed."""
PHASES = 2
"""Instants of a blade's passage at which pulses come."""
LEAST = 1e-4
"""Singular value over the largest below which nothing is kept where no order is asked for."""


class SeveralOutputs(NamedTuple):
    """CT, CQ, lambda0 (N,): thrust, torque and mean inflow of each rotor, in units of the nominal speed."""

    CT: Float[Array, " N"]
    CQ: Float[Array, " N"]
    lambda0: Float[Array, " N"]


@dataclass(frozen=True)
class Pulses:
    """outputs (L + 1, q, m): after a unit of each input held over the first step, at the start of every step, in the
    order of `labels` of SeveralOutputs and SeveralInputs. rest (q,): the outputs' means. dt: a step, rad.
    """

    outputs: Float[np.ndarray, "L1 q m"]
    rest: Float[np.ndarray, " q"]
    dt: float

    def steps(self) -> Float[np.ndarray, "L1 q m"]:
        """Outputs after unit steps."""
        return np.cumsum(self.outputs, axis=0)


def linear_several(
    solution: SeveralSolution,
    inputs: Sequence[str] | None = None,
    outputs: Sequence[str] | None = None,
    order: int | None = None,
    *,
    turns: float = TURNS,
    phases: int = PHASES,
) -> LinearModel:
    """The mean linear model of several rotors about their periodic wake, as it answers within so many `turns`.

    inputs: of `SeveralInputs`, outputs: of `SeveralOutputs`, a name with its rotor's number (`omega[1]`) or without for
    all; None takes all. order: states, None for as many as tell. turns, phases: of `pulses`. Notes hold the smallest
    singular value's share of the largest and the error of a step within a revolution, over its largest value.

    Raises InputError where the solution has not converged or is one of mean flows, a name is unknown or the order is
    out of range.
    """
    if not solution.converged:
        raise InputError(f"Argument `about` must be converged to be linearised, but: {solution.why}")
    several, u = solution.model, nominal(solution.model)
    if several.slices == 1 and len(several) > 1:
        raise InputError(
            "Argument `about` must hold rotors beside each other, but they stand on one shaft: each is solved in the "
            "others' mean flow, which a march, whose blades pass each other, leaves at once; march them (rj.march)"
        )
    check_double("about", several.places.dtype)
    blank = SeveralOutputs(*(jnp.zeros(len(several)),) * 3)
    u_names, y_names = labels(u, "u"), labels(blank, "y")
    chosen, kept = select(u_names, inputs, "inputs"), select(y_names, outputs, "outputs")
    found = pulses(several, solution.state, chosen, turns=turns, phases=phases)
    found = Pulses(found.outputs[:, kept], found.rest[kept], found.dt)
    a, b, c, d, told = realised(found, order)
    in_names, out_names = tuple(u_names[i] for i in chosen), tuple(y_names[i] for i in kept)
    model = LinearModel(
        a,
        b,
        c,
        d,
        states=tuple(f"wakes[{i}]" for i in range(len(a))),
        inputs=in_names,
        outputs=out_names,
        input_units=units_of(in_names, UNITS),
        output_units=units_of(out_names, {"lambda0": "ΩR"}),
        u=np.concatenate([np.asarray(u.theta_0), np.asarray(u.omega)])[chosen],
        y=found.rest,
    )
    truth = found.steps()[: round(2 * np.pi / found.dt) + 1]
    # over the output's largest response to any input: many are zero by symmetry or distance
    gap = np.abs(truth - model.step(found.dt * np.arange(len(truth)))).max(axis=(0, 2)) / np.abs(truth).max(axis=(0, 2))
    return replace(model, notes=notes(several) | told | {"step_error": float(gap.max())})


def notes(several: SeveralWakes) -> dict[str, Any]:
    """What a reader needs to make numbers of the model."""
    rotor, operating = several.one(0).rotor, several.one(0).operating
    return {
        "rotor": rotor.name,
        "rotors": float(len(several)),
        "inflow": "free wake",
        "omega_rad_s": float(operating.omega),
        "radius_m": float(rotor.radius),
        "density_kg_m3": float(operating.density),
        "blades": float(rotor.blades),
    }


def pulses(
    several: SeveralWakes,
    state: WakeState,
    chosen: Sequence[int] | np.ndarray | None = None,
    *,
    turns: float = TURNS,
    phases: int = PHASES,
) -> Pulses:
    """Responses of the marched equations, linear about a periodic wake, to pulses of the inputs (`chosen` of them).

    Means over pulses at so many `phases` of a blade's passage; they are followed for so many `turns`.
    """
    several = marching(several)
    steps, blades = steps_of(several), several.wakes.rotor.blades
    dt, count = 2 * np.pi / steps, round(turns * steps)
    size = 2 * len(several)
    push = jnp.eye(size)[jnp.arange(size) if chosen is None else jnp.asarray(chosen)]
    rows, rest = [], []
    for phase in range(phases):
        began, along, row = 2 * np.pi / blades * phase / phases, None, []
        for k in range(count + 1):
            x = about(several, state, jnp.asarray(began + k * dt))
            if along is None:
                along = jax.tree.map(lambda v: jnp.zeros((len(push), *v.shape)), x)
            along, seen, level = carried(x, along, push * (k == 0), jnp.asarray(dt), several)
            row.append(np.asarray(seen).T)
            rest.append(np.asarray(level))
        rows.append(row)
    return Pulses(np.mean(rows, axis=0), np.mean(rest, axis=0), dt)


@eqx.filter_jit
def about(several: SeveralWakes, state: WakeState, t: Float[Array, ""]) -> SeveralState:
    """The periodic wake of all blades at Ω t, from its slices."""
    wakes = eqx.filter_vmap(lambda wake, model: WakeBase(wake, model).at(t))(state, several.wakes)
    return SeveralState(several.phases + t, wakes)


@eqx.filter_jit
def carried(
    x: SeveralState, along: SeveralState, push: Float[Array, "m 2N"], dt: Float[Array, ""], several: SeveralWakes
) -> tuple[SeveralState, Float[Array, "m q"], Float[Array, " q"]]:
    """Disturbances (leading axis m) a step later, under changes of the inputs held over it; what they make of the
    outputs at its start, and the outputs there.
    """

    def step(x: SeveralState, u: SeveralInputs) -> tuple[SeveralState, Array]:
        after, y = stepped(x, dt, u, several)
        return after, jnp.concatenate([y.thrust, y.power / u.omega, y.mean_inflow])

    (_, level), product = jax.linearize(step, x, nominal(several))
    changes = jax.vmap(lambda v: SeveralInputs(*jnp.split(v, 2)))(push)
    after, seen = jax.lax.map(lambda one: product(*one), (along, changes))
    return after, seen, level


@one_thread
def realised(found: Pulses, order: int | None = None) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, dict]:
    """A, B, C, D of a model with these responses, and how small the singular values are that it keeps.

    Raises InputError where the order is out of range.
    """
    rows, columns = even(np.abs(found.steps()).max(axis=0))
    scaled = found.outputs / rows[:, None] / columns
    (_, q, m), half = scaled.shape, (len(scaled) - 1) // 2
    at = 1 + np.arange(half)[:, None] + np.arange(half)
    now, then = (scaled[at + late].transpose(0, 2, 1, 3).reshape(half * q, half * m) for late in (0, 1))
    left, singular, right = np.linalg.svd(now)
    if order is not None:
        check_whole("order", order, 1, singular.size)
    keep = int(np.sum(singular > LEAST * singular[0])) if order is None else order
    root = np.sqrt(singular[:keep])
    leap = (left[:, :keep] / root).T @ then @ (right[:keep].T / root)
    joint = np.zeros((keep + m, keep + m))
    joint[:keep] = np.concatenate([leap, root[:, None] * right[:keep, :m]], axis=1)
    joint[keep:, keep:] = np.eye(m)
    rate = np.real(cast(Any, scipy.linalg.logm)(joint)) / found.dt
    told = {"singular_value": float(singular[keep - 1] / singular[0])}
    c, d = rows[:, None] * left[:q, :keep] * root, found.outputs[0]
    return rate[:keep, :keep], rate[:keep, keep:] * columns, c, d, told
