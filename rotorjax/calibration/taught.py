"""The finite-state model with six physically named corrections; at their printed values it is the default model.

What they stand for: how far the wake contracts (radius), how fast (length) and how near the ground keeps it from that
(clearance); what the influence matrix makes of the mean and of the third pressure term (gains, within half of their
values); and the share of a slope that the sources see: what the free wake, which runs downhill, leaves of it beyond
what a jet's edge does (`potential.wake_edge`).

The corrections keep what the sources are solved for: no flow through the ground that they see.
"""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from rotorjax.calibration.parameters import Parameter, ParameterSet
from rotorjax.ground import Plane
from rotorjax.potential.contraction import CLEARANCE, LENGTH, MOMENTUM, Contraction
from rotorjax.potential.model import FiniteState, FiniteStateModel, mass_flow_parameters, with_ground

PARAMETERS = ParameterSet(
    "freewake",
    (
        Parameter("radius", 0.5, 1.0, MOMENTUM, "radius of the contracted wake far below, over R"),
        Parameter("length", 0.02, 1.0, LENGTH, "depth in which most of the contraction is done, over R"),
        Parameter("clearance", 0.02, 4.0, CLEARANCE, "height over ground at which it contracts half as much, over R"),
        Parameter("mean_gain", 0.5, 1.5, 1.0, "factor on the axisymmetric state n = 1 (mean inflow)"),
        Parameter("third_gain", 0.5, 1.5, 1.0, "factor on the axisymmetric state n = 3"),
        Parameter("slope_share", 0.0, 1.5, 1.0, "tangent of the slope that the sources see, over that of the ground"),
    ),
)


def _value(values: Float[Array, " P"], name: str) -> Float[Array, ""]:
    return values[PARAMETERS.names.index(name)]


def taught_model(model: FiniteStateModel, values: Float[Array, " P"]) -> FiniteStateModel:
    """Return the model with the wake and the slope of `values` (in the order of PARAMETERS)."""
    wake = Contraction(*(_value(values, name) for name in ("radius", "length", "clearance")))
    model = eqx.tree_at(lambda m: m.wake, model, wake, is_leaf=lambda w: w is None)
    if model.ground is None:
        return model
    seen = Plane(model.ground.height, jnp.arctan(_value(values, "slope_share") * jnp.tan(model.ground.slope)))
    return eqx.tree_at(lambda m: m.ground, model, seen)


def taught_state(
    model: FiniteStateModel, tau: Float[Array, " M"], values: Float[Array, " P"], climb: Float[Array, ""] | float = 0.0
) -> FiniteState:
    """Return the steady states of a loading, corrected; model: as `taught_model` returns it.

    tau (M,): pressure coefficients; climb: over ΩR.
    """
    n, axisymmetric = model.modes.n, model.modes.m == 0
    gain = jnp.where(n == 1, _value(values, "mean_gain"), jnp.where(n == 3, _value(values, "third_gain"), 1.0))
    a = jnp.where(axisymmetric, gain, 1.0) * tau / mass_flow_parameters(model, tau, climb)
    return with_ground(a, model)
