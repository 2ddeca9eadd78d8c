"""The trimmed rotor as a linear system: flap, lag and inflow or free wake against named inputs.

Time is azimuth (rad): rates are those that are marched, over the rotor's speed, so that a deviation is one from the
trim at the same azimuth also where the speed is an input. Blades and their wakes are in multi-blade coordinates: in
hover the model is time-invariant; in flight it repeats B times a revolution, the differential coordinate with its sign
changed, and is linearised over a B-th of it.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.flatten_util import ravel_pytree
from jaxtyping import Array, Float, PyTree

from rotorjax.coupled import Coupled, CoupledRotor, CoupledState, RotorState, rate_and_output
from rotorjax.coupled_wake import CoupledWake
from rotorjax.inflow.finite_state import FiniteStateInflow
from rotorjax.inflow.pitt_peters import PittPeters
from rotorjax.linearisation import drive, readings
from rotorjax.linearisation.drive import Drive, check_double, check_names, drive_of, driven
from rotorjax.ode.jacobian import value_and_jacobian
from rotorjax.ode.labels import labels
from rotorjax.ode.linearise import linearise
from rotorjax.ode.models import PeriodicModel
from rotorjax.ode.orbit import Orbit, make_orbit
from rotorjax.rotor import multiblade
from rotorjax.simulation.march import marching
from rotorjax.simulation.start import from_wake, state_at
from rotorjax.trim.in_wake import TrimmedInWake
from rotorjax.trim.problem import inputs_at, revolution
from rotorjax.trim.solve import Trimmed

AZIMUTHS = 48
"""Of a revolution, at which a model that changes with the azimuth is linearised."""


class SteadyState(eqx.Module):
    """The coupled state at a known azimuth. rotor: flap and lag. inflow: the inflow model's own, or the wakes of the B
    blades in multi-blade coordinates (along their leading axis).
    """

    rotor: RotorState
    inflow: PyTree


class Base(NamedTuple):
    """A trim as it is linearised. p: rotor. u: inputs. orbit: over a B-th of a revolution, one state where it is steady
    seen from the hub. model: name of the inflow model.
    """

    p: Coupled
    u: Drive
    orbit: Orbit
    model: str

    @property
    def steady(self) -> bool:
        """Whether the model is time-invariant."""
        return self.orbit.nodes == 1


def coupled_state(psi: Array, x: SteadyState, p: Coupled) -> CoupledState:
    """The state that is marched, with blade 0 at azimuth psi."""
    return CoupledState(psi, x.rotor, _wakes(multiblade.transform(psi, p.rotor.blades), x.inflow, p))


def _wakes(matrix: Array, inflow: PyTree, p: Coupled) -> PyTree:
    """The matrix over the blades' wakes; an inflow model's state as it is."""
    if not isinstance(p, CoupledWake):
        return inflow
    return jax.tree.map(lambda leaf: jnp.tensordot(matrix.astype(leaf.dtype), leaf, axes=1), inflow)


def rate_and_readings(psi: Array, x: SteadyState, u: Drive, p: Coupled) -> tuple[SteadyState, dict[str, Array]]:
    """Rate per radian of azimuth, and everything that can be read off, of a rotor whose blade 0 stands at psi."""
    hub, moved = driven(u, p)
    state, blades = coupled_state(psi, x, p), p.rotor.blades
    rate, out = rate_and_output(psi, state, hub, moved)
    found = jax.tree.map(lambda v: v / hub.omega, (rate.rotor, rate.inflow))
    inflow = _wakes(multiblade.inverse(psi, blades), found[1], p)
    if isinstance(p, CoupledWake):
        turning = _wakes(jnp.asarray(multiblade.generator(blades)), x.inflow, p)
        inflow = jax.tree.map(jnp.subtract, inflow, turning)
    return SteadyState(found[0], inflow), readings.readings(psi, state, out, hub, moved)


def rates(psi: Array, x: SteadyState, u: Drive, p: Coupled) -> SteadyState:
    """rhs(t, x, u, p) of `rate_and_readings`."""
    return rate_and_readings(psi, x, u, p)[0]


def outputs(psi: Array, x: SteadyState, u: Drive, p: Coupled) -> dict[str, Array]:
    """Its outputs."""
    return rate_and_readings(psi, x, u, p)[1]


def _joint(z: tuple[SteadyState, Drive], psi: Array, p: Coupled) -> tuple[SteadyState, dict[str, Array]]:
    """Both of a state and inputs together, from one evaluation of the blades."""
    return rate_and_readings(psi, *z, p)


def base_of(found: Trimmed | TrimmedInWake, nodes: int = AZIMUTHS) -> Base:
    """A trim as it is linearised; nodes: azimuths of a revolution, where things change with it.

    Raises InputError for a trim in single precision.
    """
    check_double("about", jax.tree.leaves(found.z)[0].dtype)
    return _base_in_wake(found) if isinstance(found, TrimmedInWake) else _base_in_model(found, nodes)


def _base_in_model(found: Trimmed, nodes: int) -> Base:
    u, blades = drive_of(inputs_at(found.z.controls, found.flight), found.p), found.residual.blades
    whole = make_orbit(0.0, SteadyState(*revolution(found.z, blades)), 2 * np.pi, found.outcome)
    tilted = any(float(u[name]) != 0 for name in ("u", "v", "roll", "pitch")) or float(u.get("slope", 0.0)) != 0
    modes = found.p.inflow.model.modes.modes if isinstance(found.p.inflow, FiniteStateInflow) else ()
    # B blades tell harmonics of the inflow apart below B/2 only; a higher one comes and goes as they pass
    passing = blades < 3 or any(2 * mode.m >= blades for mode in modes)
    count = -(-nodes // blades) if tilted or passing else 1
    part = whole.at(2 * np.pi / blades * np.arange(count) / count)
    names = {PittPeters: "Pitt-Peters inflow", FiniteStateInflow: "finite-state inflow"}
    orbit = make_orbit(0.0, part, 2 * np.pi / blades, found.outcome)
    return Base(found.p, u, orbit, names.get(type(found.p.inflow), "uniform inflow"))


def _base_in_wake(found: TrimmedInWake) -> Base:
    start = from_wake(found)
    blades, count = start.p.rotor.blades, max(found.z.flap.size // start.p.rotor.blades, 1)
    states = [state_at(found, k) for k in range(count)]
    parts = [SteadyState(x.rotor, _wakes(multiblade.inverse(x.psi, blades), x.inflow, start.p)) for x in states]
    whole = jax.tree.map(lambda *leaves: jnp.stack(leaves), *parts)
    orbit = make_orbit(0.0, whole, 2 * np.pi / blades, found.outcome)
    u = drive_of(start.inputs, start.p)
    return Base(marching(start.p), drive.lasting(u) if count == 1 else u, orbit, "a free wake")


def linear_rotor(
    base: Base, inputs: Sequence[str] | None = None, kept: Sequence[str] | None = None, chunk: int = 64
) -> PeriodicModel:
    """Linearise about a converged trim: A(ψ), B(ψ), C(ψ), D(ψ) over a revolution.

    inputs: of `drive.drive_of`; kept: outputs of `readings.readings`; None for those of `chosen_names`. Raises
    InputError where the trim has not converged or a name is unknown.
    """
    start = jax.tree.map(lambda leaf: leaf[0], base.orbit.x)
    ins, outs = chosen_names(base, inputs, kept)
    blades, steady = base.p.rotor.blades, base.steady and not set(ins) & set(drive.WAVES)

    def derivative(psi: Array, x: SteadyState) -> tuple[np.ndarray, np.ndarray]:
        return value_and_jacobian(_joint, (x, base.u), psi, base.p, chunk=chunk)

    found = linearise(
        rates,
        outputs,
        base.orbit,
        base.u,
        base.p,
        inputs=ins,
        outputs=outs,
        units=drive.UNITS,
        nodes=-(-AZIMUTHS // blades) if base.steady and not steady else None,
        derivative=derivative,
    )
    names, units = state_names(start, base.p)
    found = replace(
        found, states=names, state_units=units, output_units=tuple(map(readings.unit_of, found.outputs)),
        notes=notes(base),
    )  # fmt: skip
    return replace(found, period=2 * np.pi) if steady else unfolded(found, blades)


def chosen_names(
    base: Base, inputs: Sequence[str] | None, outputs: Sequence[str] | None
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Names of inputs and outputs, None for all but section loads and, of what is steady, `drive.WAVES`. Raises
    InputError for one that is unknown.
    """
    ins, outs = drive_names(base.u), output_names(base.p, "height" in base.u)
    check_names("inputs", inputs, ins, base.model)
    check_names("outputs", outputs, outs, base.model)
    usual = tuple(name for name in outs if not name.startswith(readings.LIFT))
    all_ = tuple(name for name in ins if not (base.steady and name in drive.WAVES))
    return all_ if inputs is None else tuple(inputs), usual if outputs is None else tuple(outputs)


def drive_names(u: Drive) -> tuple[str, ...]:
    """Names of the inputs, controls first."""
    return tuple(name for name in drive.UNITS if name in u)


def output_names(p: Coupled, ground: bool) -> tuple[str, ...]:
    """Names of `readings.readings`, loads first."""
    names = multiblade.names(p.rotor.blades)
    motions = [f"{kind}_{name}" for kind in ("beta", "lag") for name in names]
    clear = [f"clearance_{side}" for side in readings.SIDES] if ground else []
    lifts = [f"{readings.LIFT}_{name}" for name in names]
    return ("CT", "CQ", *"XYZLMN", *motions, "lambda_0", "lambda_1c", "lambda_1s", *clear, *lifts)


def signs(names: Sequence[str]) -> Float[np.ndarray, " n"]:
    """−1 for differential coordinates, which change their sign from one B-th of a revolution to the next."""
    return np.array([-1.0 if "_D" in name else 1.0 for name in names])


def unfolded(model: PeriodicModel, blades: int) -> PeriodicModel:
    """The model over a whole revolution, from that over a B-th of it."""
    s, o = signs(model.states), signs(model.outputs)
    u = np.ones(len(model.inputs))

    def copies(values: np.ndarray, left: np.ndarray, right: np.ndarray) -> np.ndarray:
        return np.concatenate([(left[:, None] * right) ** k * values for k in range(blades)])

    sides = {"a": (s, s), "b": (s, u), "c": (o, s), "d": (o, u)}
    held = {name: copies(getattr(model, name), *side) for name, side in sides.items()}
    held |= {
        name: np.concatenate([side**k * getattr(model, name) for k in range(blades)])
        for name, side in (("x", s), ("y", o))
    }
    times = np.concatenate([model.t + 2 * np.pi * k / blades for k in range(blades)])
    return replace(model, t=times, period=2 * np.pi, **held)


def state_names(start: SteadyState, p: Coupled) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Name and unit of each state, in the order of `ravel_pytree`."""
    motions = (("beta_{}", "rad"), ("beta_{}_rate", "rad Ω"), ("lag_{}", "rad"), ("lag_{}_rate", "rad Ω"))
    blades = [(form.format(c), unit) for form, unit in motions for c in multiblade.names(p.rotor.blades)]
    whole = [*blades, *_inflow_names(start.inflow, p)]
    return tuple(name for name, _ in whole), tuple(unit for _, unit in whole)


def _inflow_names(inflow: PyTree, p: Coupled) -> list[tuple[str, str]]:
    """Name and unit of each state of the inflow."""
    if isinstance(p, CoupledRotor):
        if isinstance(p.inflow, FiniteStateInflow):
            return [(f"a_{m.n}{m.m}{m.kind[0]}", "ΩR") for m in p.inflow.model.modes.modes]
        names = ("lambda_0", "lambda_1c", "lambda_1s")
        return [(name, "ΩR") for name in names[: ravel_pytree(inflow)[0].size]]
    parts = multiblade.names(p.rotor.blades)

    def named(label: str) -> tuple[str, str]:
        field, _, index = label.partition("[")
        blade, _, rest = index.rstrip("]").partition(",")
        return f"{field}_{parts[int(blade)]}[{rest}]", "ΩR²" if field.startswith("gamma") else "R"

    return [named(label) for label in labels(inflow, "wake")]


def notes(base: Base) -> dict[str, Any]:
    """What a reader needs to make numbers of it."""
    rotor, operating = base.p.rotor, base.p.operating
    return {
        "rotor": rotor.name,
        "inflow": base.model.removeprefix("a "),
        "omega_rad_s": float(operating.omega),
        "radius_m": float(rotor.radius),
        "density_kg_m3": float(operating.density),
        "blades": float(rotor.blades),
    }
