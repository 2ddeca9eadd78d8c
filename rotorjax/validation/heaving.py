"""A rotor that heaves over level ground, height h + ε e^{iωψ}, in the linear models of both wakes.

In the frame of the hub air and ground come up to it with the climb velocity dh/dψ, so that climb and height move
together: response to height + iω · response to climb. The free wake holds this exactly, for its image moves with the
ground; so does the finite-state model, where ground at rest has no velocity of its own against the free stream, w = 0
(`rotorjax.potential.moving_ground`).

An endless plane that heaves under a rotor at rest is the same flow, for it takes all the air with it: seen from the
plane the air is at rest, and the frame's acceleration is a uniform pressure gradient, which moves no incompressible air
against it. A deck that heaves is not: it pushes away the air above it only. What is compared is the induced inflow, the
climb taken off.

Both models come as the same linear system: inputs climb and height, outputs induced mean inflow and C_T. The free
wake's has unstable modes, vortices that pair. Its transfer function on the imaginary axis exists all the same, but near
their frequencies it is what only a rotor shows that something keeps from pairing. What a march sees before they have
grown is read off a history from rest (`early`).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import scipy.linalg
from jaxtyping import Array, Complex, Float

from rotorjax.deck.blades import SectionBlades, stations
from rotorjax.deck.over_ground import controls, output, over_ground, trim
from rotorjax.deck.state_space import state_space
from rotorjax.errors import InputError
from rotorjax.ground import plane
from rotorjax.linearisation.assembly import velocities_along
from rotorjax.linearisation.outputs import read
from rotorjax.linearisation.system import linear_wake
from rotorjax.ode.harmonic import average
from rotorjax.ode.models import LinearModel
from rotorjax.ode.threads import one_thread
from rotorjax.ode.trajectory import march
from rotorjax.potential.ground_source import DiskQuadrature
from rotorjax.potential.ground_table import ground_table
from rotorjax.potential.model import finite_state_model
from rotorjax.potential.moving_ground import Variant, still
from rotorjax.potential.wake_transport import wake_transport
from rotorjax.wake.dynamics import driven, inputs_of, rhs
from rotorjax.wake.loads import WakeInputs
from rotorjax.wake.model import FreeWake, WakeState
from rotorjax.wake.solution import Solution

TURNS, SAMPLES = 1.5, 24
"""Revolutions of a history from rest, the last of which is read, and samples in a turn."""


@dataclass(frozen=True)
class Heaving:
    """A rotor over ground at rest and what small heave does to it. lambda0, CT: at rest. linear: inputs climb (ΩR) and
    height (R); outputs induced mean inflow (ΩR) and C_T.
    """

    lambda0: float
    CT: float
    linear: LinearModel

    def response(self, frequencies: Float[np.ndarray, " W"]) -> Complex[np.ndarray, "W 2"]:
        """Complex amplitudes of the outputs over that of the height, at frequencies over Ω."""
        found = self.linear.response(np.asarray(frequencies))
        return found[:, :, 1] + 1j * np.asarray(frequencies)[:, None] * found[:, :, 0]

    @cached_property
    @one_thread
    def _left(self) -> Float[np.ndarray, "N 2 n"]:
        """C e^{Aψ} at `instants`: what a state at the start leaves in the outputs."""
        leap, rows = scipy.linalg.expm(self.linear.a * 2 * np.pi / SAMPLES), [self.linear.c]
        for _ in instants()[1:]:
            rows.append(rows[-1] @ leap)
        return np.stack(rows)

    def _from_rest(self, frequency: float) -> Complex[np.ndarray, "N 2"]:
        """Outputs at `instants` for a height e^{iωψ} that starts at once from rest, exact."""
        climbing = np.array([1j * frequency, 1.0])
        forced = self.linear.resolvent.solve(1j * frequency, self.linear.b @ climbing[:, None])[:, 0]
        wave = np.exp(1j * frequency * instants())[:, None]
        return wave * (self.linear.c @ forced + self.linear.d @ climbing) - self._left @ forced

    def history(self, heave: "Heave") -> Float[np.ndarray, "N 2"]:
        """Changes of the outputs at `instants`."""
        return float(heave.size) * np.real(self._from_rest(0.0) - self._from_rest(float(heave.frequency)))

    def early(self, frequency: float) -> Complex[np.ndarray, "2"]:
        """Complex amplitudes over that of the height in the last of the first TURNS revolutions after rest: the least
        squares of a constant, a cosine and a sine.
        """
        heave = Heave(jnp.asarray(1.0), jnp.asarray(frequency))
        psi = instants()
        last = psi >= psi[-1] - 2 * np.pi - 1e-9
        angle = frequency * psi[last]
        waves = np.stack([np.ones_like(angle), np.cos(angle), np.sin(angle)], axis=1)
        _, cosine, sine = np.linalg.lstsq(waves, self.history(heave)[last], rcond=None)[0]
        return -(cosine - 1j * sine)  # the height goes like −cos


class Heave(NamedTuple):
    """From rest, at rest: height + ε (1 − cos ωψ). size (): ε over R. frequency (): ω over Ω."""

    size: Float[Array, ""]
    frequency: Float[Array, ""]

    def inputs(self, psi: Float[Array, ""], at_rest: WakeInputs) -> WakeInputs:
        """Inputs of a free wake that heaves over still ground."""
        assert at_rest.height is not None
        angle = self.frequency * psi
        return at_rest._replace(
            climb=at_rest.climb + self.size * self.frequency * jnp.sin(angle),
            height=at_rest.height + self.size * (1 - jnp.cos(angle)),
        )


def instants() -> Float[np.ndarray, " N"]:
    """Azimuths of a history from rest (rad)."""
    return 2 * np.pi / SAMPLES * np.arange(round(TURNS * SAMPLES) + 1)


def of_free_wake(solution: Solution) -> Heaving:
    """Heave of an axisymmetric wake over ground. Raises InputError where it has not converged or has no ground."""
    found = average(linear_wake(solution, ("climb", "height"), ("lambda0", "CT")))
    rows = [found.outputs.index(name) for name in ("lambda0", "CT")]
    through = found.d[rows] - np.diag([1.0, 0.0])  # λ₀ counts the climb
    linear = replace(found, c=found.c[rows], d=through, outputs=("induced", "CT"), output_units=("ΩR", "-"))
    return Heaving(solution.mean_inflow, solution.CT, linear)


def of_finite_states(
    wakes: Sequence[FreeWake], variant: Variant, *, radial_terms: int = 3, source_terms: int = 7
) -> list[Heaving]:
    """Heave of the finite-state model with the rotor and collective of free wakes that differ in height only.

    The sections are its loads, as they are the free wake's. radial_terms, source_terms: see
    `potential.model.finite_state_model`. Raises InputError where a wake has no ground.
    """
    if any(wake.ground is None for wake in wakes):
        raise InputError("Argument `wakes` must have ground to heave over, but the ground of one is None")
    heights = [float(wake.ground.height) for wake in wakes if wake.ground is not None]
    first, reach = wakes[0], (0.9 * min(heights), 1.1 * max(heights))
    rotor = finite_state_model(
        radial_terms=radial_terms, ground_radial_terms=source_terms, quadrature=DiskQuadrature(24, 4)
    )
    transport = wake_transport(reach[1], 10) if variant == "dynamic" else None
    table = ground_table(rotor, reach, transport=transport, nodes=(12, 1, 1))
    blades = SectionBlades(first.rotor, first.operating)
    model = over_ground(rotor, table, blades, variant, transport, stations(float(first.rotor.root_cutout), 16, 1))
    found = []
    for height in heights:
        now = controls(still(plane(height)), rotor, first.operating.collective)
        state = trim(model, now)
        rest = output(jnp.zeros(()), state, now, model)
        inputs = ("climb", "ground.height", "ground.height_rate")
        full = state_space(model, state, now, inputs, ("uniform", "thrust"))
        climb, rise, rate = (full.inputs.index(name) for name in inputs)
        b, d = (np.stack([m[:, climb] + m[:, rate], m[:, rise]], axis=1) for m in (full.b, full.d))
        linear = replace(full, b=b, d=d, inputs=("climb", "height"), input_units=("ΩR", "R"))
        found.append(Heaving(float(rest.uniform), float(rest.thrust), linear))
    return found


def marched(solution: Solution, heave: Heave, steps: int = 24) -> Float[np.ndarray, "N 2"]:
    """Changes of induced mean inflow and C_T at `instants`, marched with the nonlinear wake (RK5) from rest.

    steps: between two samples. Raises InputError where the march leaves the finite numbers.
    """
    model, psi = solution.model, instants()
    start, dt = jax.tree.map(jnp.asarray, solution.state), 2 * np.pi / (SAMPLES * steps)
    count = (psi.size - 1) * steps
    path = march(_rate, start, 0.0, dt, count, heave, model, save_every=steps, progress=False)
    if not path.finished:
        raise InputError(f"Argument `steps` must be larger than {steps} for this wake: the march is {path.why}")
    found = []
    for k, t in enumerate(psi):
        state, inputs = jax.tree.map(lambda a, k=k: a[k], path.x), heave.inputs(jnp.asarray(t), inputs_of(model))
        # by the program that has made the velocities for the linear model too
        still_ = jax.tree.map(jnp.zeros_like, inputs)
        out = _read(state, velocities_along(jnp.asarray(t), state, inputs, still_, model)[0], inputs, model)
        found.append([float(out.lambda0 - inputs.climb), float(out.CT)])
    return np.array(found) - np.array(found[0])


def _rate(psi: Float[Array, ""], state: WakeState, heave: Heave, model: FreeWake) -> WakeState:
    return rhs(psi, state, heave.inputs(psi, inputs_of(model)), model)


_read = eqx.filter_jit(lambda state, velocities, inputs, model: read(state, velocities, inputs, driven(model, inputs)))
