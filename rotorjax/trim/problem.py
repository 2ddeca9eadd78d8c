"""Trim as one periodic problem: the coupled rotor's orbit and its controls, solved for together, with no marching.

Unknowns are the states at K equally spaced azimuths of one B-th of a revolution, the three controls and the shaft's
tilt; equations are the orbit's collocation (ode/collocation.py) and as many trim equations: the mean thrust, no cyclic
flapping or no hub moment, and a given tilt or the balance of the drag of a fuselage. B equal blades repeat after a B-th
of a revolution in multi-blade coordinates, the differential one with its sign changed.
"""

from functools import partial
from typing import Literal

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, PyTree

from rotorjax.coupled import CoupledRotor, CoupledState, Outputs, RotorState, rate_and_output
from rotorjax.ode.collocation import Collocation, unfold
from rotorjax.rotor import multiblade
from rotorjax.rotor.hub import RotorInputs

Aim = Literal["flapping", "moments"]


class Controls(eqx.Module):
    """theta_0, theta_1c, theta_1s (rad). tilt: of the shaft, forward (rad)."""

    theta_0: Float[Array, ""]
    theta_1c: Float[Array, ""]
    theta_1s: Float[Array, ""]
    tilt: Float[Array, ""]


class SteadyFlight(eqx.Module):
    """Steady flight; every field is a scalar array.

    thrust: C_T along the shaft that is wanted. advance: horizontal speed over ΩR. climb: vertical speed over ΩR. tilt:
    of the shaft, forward (rad), where it is given. drag_area: f/A of the fuselage, whose drag the rotor has to balance
    where the tilt is not given. height: hub above ground over R, or None.
    """

    thrust: Float[Array, ""]
    advance: Float[Array, ""]
    climb: Float[Array, ""]
    tilt: Float[Array, ""]
    drag_area: Float[Array, ""]
    height: Float[Array, ""] | None


class Trim(eqx.Module):
    """Unknowns. rotor, inflow: states with a leading axis K of azimuths. controls."""

    rotor: RotorState
    inflow: PyTree
    controls: Controls


@partial(jax.jit, inline=True)
def inputs_at(controls: Controls, flight: SteadyFlight) -> RotorInputs:
    """The rotor's inputs in steady flight: velocities of the hub along the tilted shaft's axes."""
    zero = jnp.zeros_like(controls.tilt)
    sine, cosine = jnp.sin(controls.tilt), jnp.cos(controls.tilt)
    names = ("v", "p", "q", "r", "u_rate", "v_rate", "w_rate", "p_rate", "q_rate", "r_rate", "omega_rate")
    return RotorInputs(
        **dict.fromkeys(names, zero),  # type: ignore[arg-type]
        theta_0=controls.theta_0,
        theta_1c=controls.theta_1c,
        theta_1s=controls.theta_1s,
        u=flight.advance * cosine - flight.climb * sine,
        w=-flight.advance * sine - flight.climb * cosine,
        omega=jnp.ones_like(controls.tilt),
        height=flight.height,
        roll=zero,
        pitch=-controls.tilt,
        heading=zero,
    )


class Still(eqx.Module):
    """A right-hand side of zero: with it the collocation's residual is the slope of the orbit alone."""

    def __call__(self, psi: Array, x: PyTree) -> PyTree:
        """Zeros like x."""
        return jax.tree.map(jnp.zeros_like, x)


class NextBlade(eqx.Module):
    """The state a B-th of a revolution later: each blade takes the place of the next."""

    blades: int = eqx.field(static=True)

    def __call__(self, x: tuple[RotorState, PyTree]) -> tuple[RotorState, PyTree]:
        """Change the sign of the differential coordinate, if there is one."""
        signs = np.array([-1.0 if name == "D" else 1.0 for name in multiblade.names(self.blades)])
        rotor, inflow = x
        return jax.tree.map(lambda q: q * signs, rotor), inflow


class TrimResidual(eqx.Module):
    """What is left of the trim equations. aim: what cyclic pitch is for. balance: whether the tilt is an unknown."""

    blades: int = eqx.field(static=True)
    aim: Aim = eqx.field(static=True, default="flapping")
    balance: bool = eqx.field(static=True, default=False)

    def slopes(self, z: Trim) -> tuple[RotorState, PyTree]:
        """d/dψ of the states at the nodes, from their trigonometric interpolant."""
        symmetry = None if self.blades == 1 else NextBlade(self.blades)
        derivative = Collocation(Still(), symmetry, self.blades)
        return derivative((z.rotor, z.inflow), jnp.zeros(()), jnp.asarray(2 * jnp.pi))

    def __call__(self, z: Trim, flight: SteadyFlight, p: CoupledRotor) -> Trim:
        """Residual, shaped like the unknowns."""
        rates, found = rates_and_outputs(z, flight, p)
        orbit = jax.tree.map(jnp.subtract, self.slopes(z), (rates.rotor, rates.inflow))
        force, moment = jnp.mean(found.force, axis=0), jnp.mean(found.moment, axis=0)
        cosine, sine = (moment[1], moment[0]) if self.aim == "moments" else cyclic(found.flap)
        tilt = z.controls.tilt - flight.tilt
        if self.balance:
            forward = force[2] * jnp.sin(z.controls.tilt) - force[0] * jnp.cos(z.controls.tilt)
            tilt = (forward - 0.5 * flight.drag_area * flight.advance**2) / flight.thrust
        scale = 1 / flight.thrust if self.aim == "moments" else 1.0
        thrust = jnp.mean(found.CT) / flight.thrust - 1
        return Trim(orbit[0], orbit[1], Controls(thrust, scale * cosine, scale * sine, tilt))


def node_azimuths(z: Trim, blades: int) -> Float[Array, " K"]:
    """Azimuths of blade 0 at the nodes (rad)."""
    nodes = z.rotor.flap.shape[0]
    return 2 * jnp.pi / (nodes * blades) * jnp.arange(nodes)


def rates_and_outputs(z: Trim, flight: SteadyFlight, p: CoupledRotor) -> tuple[CoupledState, Outputs]:
    """Rates and outputs at all nodes, leading axis K."""
    u = inputs_at(z.controls, flight)

    def at(psi, rotor, inflow):
        return rate_and_output(psi, CoupledState(psi, rotor, inflow), u, p)

    return jax.vmap(at)(node_azimuths(z, p.rotor.blades), z.rotor, z.inflow)


@eqx.filter_jit
def outputs_at(z: Trim, flight: SteadyFlight, p: CoupledRotor) -> Outputs:
    """Outputs at all nodes, leading axis K: equal weights make them means over time."""
    return rates_and_outputs(z, flight, p)[1]


@partial(jax.jit, inline=True)
def cyclic(flap: Float[Array, "K B"]) -> tuple[Float[Array, ""], Float[Array, ""]]:
    """First harmonics β_1c and β_1s (rad) of a blade's flap, or of its lag, over a revolution."""
    nodes, blades = flap.shape
    psi = 2 * jnp.pi / (nodes * blades) * jnp.arange(nodes)[:, None] + 2 * np.pi / blades * np.arange(blades)
    return 2 * jnp.mean(flap * jnp.cos(psi)), 2 * jnp.mean(flap * jnp.sin(psi))


def revolution(z: Trim, blades: int) -> tuple[RotorState, PyTree]:
    """States over a whole revolution, leading axis K·B."""
    symmetry = None if blades == 1 else NextBlade(blades)
    return unfold((z.rotor, z.inflow), symmetry, blades)
