"""The rotor in its free wake in forward flight: linear about the periodic march next to the trim, and condensed.

The model of all states, flap, lag and some three thousand of the wake, is held at a passage's azimuths only as long as
it takes to find what is handed on: its leading modes, its steps against the nonlinear march, and a periodic model of a
hundred states (condensed.py), from which everything goes on as with any inflow model.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import jax
import numpy as np
from jax.flatten_util import ravel_pytree
from jaxtyping import Float

from rotorjax.coupled import stations
from rotorjax.coupled_wake import CoupledWake
from rotorjax.linearisation import condensed, drive, readings, rotor, steps
from rotorjax.linearisation.condensed import Condensed, shares_of
from rotorjax.linearisation.found import flight_notes
from rotorjax.linearisation.instant import Instant, instant
from rotorjax.linearisation.memory import give_back
from rotorjax.linearisation.modes import FAMILIES, RotorMode, blade_modes, called, family_of, is_upper, named, numbered
from rotorjax.linearisation.rotor import Base
from rotorjax.linearisation.settled import settled
from rotorjax.ode.hill import Exponents, exponents
from rotorjax.ode.models import PeriodicModel
from rotorjax.ode.orbit import require_converged
from rotorjax.ode.repeated import Leading, Repeated, leading
from rotorjax.ode.runge_kutta import RK4
from rotorjax.trim.run import Result

Tell = Callable[[str, float], None]
COUNT = 20
"""Leading exponents that are told."""
FAST = 4 / 3
"""Largest step over the filter's time constant: it falls to 0.30 for e^{−4/3} = 0.26 then."""
KINDS = {"0": "collective", "D": "differential"}


@dataclass(frozen=True)
class WakeFindings:
    """What is known of the model of all states in a free wake. states, azimuths: its numbers. modes: leading ones.
    residual: largest |M v − μ v| of theirs over a passage. step_error (q, m): of its steps against the nonlinear march
    over a revolution. condensed_error (q, m): of the condensed periodic model's steps against its own. thrust: C_T of
    the periodic march, next to the trim's. basis: of `condensed.Condensed`.
    """

    states: int
    azimuths: int
    modes: tuple[RotorMode, ...]
    residual: float
    step_error: Float[np.ndarray, "q m"]
    condensed_error: Float[np.ndarray, "q m"]
    thrust: float
    basis: Float[np.ndarray, "n r"]


def passage_azimuths(p: CoupledWake, azimuths: int) -> int:
    """Of a passage: two for each step of the linear march, as many as are wanted of a revolution at least; a multiple
    of four, so that every second will do where nothing is fast.

    Transport along age allows one age step; of the time constant of the bound circulation's filter a step is FAST at
    most, for what the blades feel first is how that answers (the classical method is stable to 2.785 of them).
    """
    settings, blades = p.settings, p.rotor.blades
    steps = max(settings.steps_per_turn, 2 * np.pi / float(settings.circulation_lag) / FAST, azimuths / 2)
    return 4 * int(np.ceil(steps / (2 * blades) - 1e-9))


def base_in_flight(base: Base, azimuths: int, progress: Tell | None = None) -> Base:
    """The trim with the orbit of the march next to it."""
    require_converged(base.orbit)
    assert isinstance(base.p, CoupledWake)
    return settled(base, passage_azimuths(base.p, azimuths), progress)


def all_states(
    base: Base,
    inputs: Sequence[str] | None = None,
    outputs: Sequence[str] | None = None,
    progress: Tell | None = None,
) -> Repeated:
    """The model of all states over a passage. base: of `base_in_flight`. inputs, outputs: names, None for all but
    section loads.

    Raises InputError where no periodic march was found or a name is unknown.
    """
    require_converged(base.orbit)
    assert isinstance(base.p, CoupledWake)
    inputs, outputs = rotor.chosen_names(base, inputs, outputs)
    names, units = rotor.state_names(base.orbit.start, base.p)
    a, found = np.empty((base.orbit.nodes, len(names), len(names))), []
    for k, psi in enumerate(base.orbit.t):
        x = jax.tree.map(lambda leaf, k=k: leaf[k], base.orbit.x)
        found.append(_put(a[k], instant(psi, x, base.u, base.p, inputs, outputs)))
        if k == 0:
            give_back()  # what compiling took, before the matrices fill
        if progress is not None:
            progress(f"linearisation {(k + 1) / base.orbit.nodes:.0%}", 0.0)
    outs = readings.expanded(outputs, stations(base.p).size)
    part = PeriodicModel(
        t=np.asarray(base.orbit.t),
        period=float(base.orbit.period),
        a=a,
        b=np.stack([one.b for one in found]),
        c=np.stack([one.c for one in found]),
        d=np.stack([one.d for one in found]),
        y=np.stack([one.y for one in found]),
        states=names,
        inputs=inputs,
        outputs=outs,
        state_units=units,
        input_units=tuple(drive.UNITS[name] for name in inputs),
        output_units=tuple(map(readings.unit_of, outs)),
        x=np.asarray(jax.vmap(lambda x: ravel_pytree(x)[0])(base.orbit.x)),
        u=np.array([float(base.u[name]) for name in inputs]),
        notes=rotor.notes(base),
    )
    return condensed.repeated(part)


def _put(place: Float[np.ndarray, "n n"], one: Instant) -> Instant:
    """The instant with its A at a place of its own: one copy of what takes most of the memory."""
    place[:] = one.a
    return one._replace(a=place)


def condense(
    model: Repeated, base: Base, near: PeriodicModel | None = None
) -> tuple[Condensed, Float[np.ndarray, "N q m"]]:
    """The condensed model, and unit steps of the one of all states over a revolution. near: of a flight nearby, whose
    wake has as many states.
    """
    blades = base.p.rotor.blades
    truth = model.step(blades)
    shares = None if near is None else shares_of(near.states)
    return condensed.condensed(model, blades, np.abs(truth).max(axis=0), shares=shares), truth


def linear_in_flight(
    base: Base,
    inputs: Sequence[str],
    outputs: Sequence[str],
    done: Callable[[str], None],
    progress: Tell | None = None,
    near: PeriodicModel | None = None,
) -> tuple[PeriodicModel, WakeFindings]:
    """Condensed periodic model of a flight in the free wake, and what is known of that of all states.

    base: of `base_in_flight`. near: as in `condense`. done(stage) is called after each. Raises InputError as
    `all_states` does.
    """
    outs, blades = readings.expanded(outputs, stations(base.p).size), base.p.rotor.blades
    # by the linear march's own method and steps: of the bound filter, fast against a step, it keeps 0.29 for 0.26; and
    # first, for what its compiling takes is gone before the matrices are there
    marched = steps.marched(base, inputs, outs, blades * (base.orbit.nodes // 2), 1, RK4)
    done("marches")
    model = all_states(base, inputs, outputs, progress)
    done("linearisation")
    (small, basis), unit = condense(model, base, near)
    own = np.stack([small.step(np.eye(len(inputs))[m])[1] for m in range(len(inputs))], axis=-1)
    done("condensation")
    lead = leading(model.halved(), COUNT)
    done("leading modes")
    sizes = np.array([steps.size_of(name) for name in inputs])
    thrust = float(model.part.y[:, outs.index("CT")].mean()) if "CT" in outs else float("nan")
    return small, WakeFindings(
        model.part.order,
        model.part.t.size * blades,
        wake_modes(lead, model.part.states),
        float(lead.residuals.max()),
        steps.largest_gap(marched, unit * sizes),
        steps.largest_gap(unit * sizes, own * sizes),
        thrust,
        basis,
    )


def periodic_in_wake(
    found: Result, inputs: Sequence[str] | None = None, outputs: Sequence[str] | None = None
) -> PeriodicModel:
    """The condensed model of a trim alone; names as in `rotor.linear_rotor`. Raises InputError as `all_states` does."""
    base = base_in_flight(rotor.base_of(found.trimmed), rotor.AZIMUTHS)
    model = condense(all_states(base, inputs, outputs), base)[0].model
    return replace(model, notes={**model.notes, **flight_notes(found)})


def wake_modes(found: Leading, states: tuple[str, ...]) -> tuple[RotorMode, ...]:
    """Leading modes by name: a blade's where its states' own share, with its sign, is the largest, else the wake's.

    Shares of a wake's thousands of states have all signs, and their sizes add up to far more than one.
    """
    families = np.array([family_of(state) for state in states])
    kinds = [*FAMILIES.values(), "inflow"]
    sums = np.array([np.abs(found.shares[families == kind].sum(axis=0)) for kind in kinds])
    weight = np.abs(found.shares)
    known = {k: called(states, weight[:, k], kinds[int(np.argmax(sums[:, k]))]) for k in range(found.values.size)}
    modes = named(Exponents(found.values, found.shares, weight / weight.sum(axis=0)), states, known)
    shown = [k for k, value in enumerate(found.values) if is_upper(value)]
    told = [dict(zip(kinds, map(float, sums[:, k]), strict=True)) for k in shown]
    return tuple(numbered([_of_wake(replace(mode, shares=own)) for mode, own in zip(modes, told, strict=True)]))


def all_modes(periodic: PeriodicModel, wake: WakeFindings) -> tuple[RotorMode, ...]:
    """The blades' modes, those that do not lead from the condensed model, and the leading ones of the wake."""
    parts = exponents(periodic)
    small = named(parts, periodic.states, blade_modes(parts, periodic.states))
    led = {mode.name for mode in wake.modes}
    more = [mode for mode in small if mode.name.partition(" ")[0] != "inflow" and mode.name not in led]
    return tuple(sorted([*wake.modes, *more], key=lambda mode: -mode.exponent.real))


def _of_wake(mode: RotorMode) -> RotorMode:
    """A mode of the wake by the multi-blade coordinate of the state that takes most part in it."""
    kind, _, state = mode.name.partition(" ")
    if kind != "inflow":
        return mode
    coordinate = state.partition("[")[0].rpartition("_")[2]
    return replace(mode, name=f"wake {KINDS.get(coordinate, 'cyclic ' + coordinate[:-1])}")
