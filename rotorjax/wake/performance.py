"""What a rotor in its wake does: thrust, power and mean inflow."""

from typing import NamedTuple

import jax.numpy as jnp
from jaxtyping import Array, Float

from rotorjax.rotor.blade_element import SectionLoads, rotor_coefficients
from rotorjax.wake.equilibrium import Evaluation
from rotorjax.wake.model import FreeWake


class Coefficients(NamedTuple):
    """thrust: C_T = T/(ρA(ΩR)²); power: C_P = P/(ρA(ΩR)³) = induced + profile; mean_inflow: over ΩR (`disk_mean`)."""

    thrust: Float[Array, ""]
    power: Float[Array, ""]
    induced: Float[Array, ""]
    profile: Float[Array, ""]
    mean_inflow: Float[Array, ""]


def performance(model: FreeWake, found: Evaluation) -> Coefficients:
    """Coefficients of the rotor in a wake, mean over its azimuths."""
    return performance_in(model, found.velocities.control, found.loads)


def performance_in(model: FreeWake, control: Float[Array, "K R 3"], loads: SectionLoads) -> Coefficients:
    """Coefficients from the air's velocity at the control points and the blades' loads in it."""
    mean = disk_mean(model, -control[..., 2])
    return Coefficients(*rotor_coefficients(model.rotor, loads, model.stations, model.widths), mean)


def disk_mean(model: FreeWake, inflow: Float[Array, "K R"]) -> Float[Array, ""]:
    """Mean of an inflow at the control points over the area that the blades sweep.

    The cut-out does not count: the innermost point lies beside the root's trailing vortex, the closer the narrower its
    panel, and its upwash is no measure of what goes through the hub (UH-60, h = 1: −0.005 to 0.059 ΩR down from 14
    panels to 40; the mean with it fell by 3.8 %, without it by 0.6 %).
    """
    edges = model.edges
    return jnp.mean(inflow, axis=0) @ jnp.diff(edges**2) / (edges[-1] ** 2 - edges[0] ** 2)
