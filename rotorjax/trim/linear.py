"""The trimmed rotor as a linear system: flap, lag and inflow against the inputs of Eq. 11.

Time is azimuth (rad) and the state is that of the coupled rotor without its azimuth, in multi-blade coordinates: in
hover the model is time-invariant; in forward flight it repeats B times a revolution and `rotorjax.ode` averages it or
keeps its harmonics.
"""

from collections.abc import Sequence

import equinox as eqx
import numpy as np
from jaxtyping import Array, PyTree

from rotorjax.coupled import CoupledRotor, CoupledState, Outputs, RotorState, rate_and_output
from rotorjax.ode.linearise import linearise
from rotorjax.ode.models import PeriodicModel
from rotorjax.ode.orbit import Orbit, make_orbit
from rotorjax.rotor.hub import RotorInputs
from rotorjax.trim.problem import inputs_at, revolution
from rotorjax.trim.solve import Trimmed

OUTPUTS = ("CT", "CQ", "force", "moment")
UNITS = {"rotor": "rad", "theta_0": "rad", "theta_1c": "rad", "theta_1s": "rad"}


class SteadyState(eqx.Module):
    """The coupled state at a known azimuth. rotor: flap and lag. inflow: the inflow model's own."""

    rotor: RotorState
    inflow: PyTree


def rates(psi: Array, x: SteadyState, u: RotorInputs, p: CoupledRotor) -> SteadyState:
    """rhs(t, x, u, p) of a rotor whose blade 0 stands at azimuth psi = t."""
    rate, _ = rate_and_output(psi, CoupledState(psi, x.rotor, x.inflow), u, p)
    return SteadyState(rate.rotor, rate.inflow)


def outputs(psi: Array, x: SteadyState, u: RotorInputs, p: CoupledRotor) -> Outputs:
    """Outputs at that azimuth."""
    return rate_and_output(psi, CoupledState(psi, x.rotor, x.inflow), u, p)[1]


def orbit_of(found: Trimmed) -> Orbit:
    """The trim as a periodic orbit over one revolution, for everything in `rotorjax.ode`."""
    return make_orbit(0.0, SteadyState(*revolution(found.z, found.residual.blades)), 2 * np.pi, found.outcome)


def linear_model(
    found: Trimmed,
    inputs: Sequence[str] | None = None,
    kept: Sequence[str] | None = OUTPUTS,
    nodes: int | None = None,
) -> PeriodicModel:
    """Linearise about a converged trim: A(ψ), B(ψ), C(ψ), D(ψ) over a revolution.

    inputs, kept: names of inputs (fields of `RotorInputs`) and outputs (of `Outputs`), None for all. nodes: azimuths.
    Raises InputError where the trim has not converged or a name is unknown.
    """
    u = inputs_at(found.z.controls, found.flight)
    orbit = orbit_of(found)
    return linearise(rates, outputs, orbit, u, found.p, inputs=inputs, outputs=kept, units=UNITS, nodes=nodes)
