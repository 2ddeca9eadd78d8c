"""The finite-state model with six physically named corrections; at their printed values it is the published model.

What they stand for, and why these: driven by the free wake's loads, the published model misses the free wake in two
ways. Out of ground effect the inflow's radial shape is off, because the wake contracts: the states' gains (what the
influence matrix makes of each pressure term) answer for that. Near the ground the r = j sources act much too far up,
and the ground acts at the centre of the disk rather than at its edge, where the free wake turns outward before it
stagnates: the reach of the r = j sources and the gain of the others answer for that. On a slope the free wake runs
downhill, and its inflow tilts less than a column that stays under the rotor: the share of the slope that the sources
see answers for that.

The price: a gain on the sources gives up the flow condition on the ground that they were solved for. The corrections
are for the inflow at the disk, not for the flow field at the ground.
"""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from rotorjax.calibration.parameters import Parameter, ParameterSet
from rotorjax.ground import Plane
from rotorjax.potential.loading import thrust_coefficient
from rotorjax.potential.model import FiniteState, FiniteStateModel, ground_matrix, mass_flow_parameters

SHARPNESS = 2.0  # exponent of η, the paper's
PRINTED_REACH = float((-np.log(np.pi / 7)) ** (-1 / SHARPNESS))  # where (π/7)^(η²) has fallen to 1/e

PARAMETERS = ParameterSet(
    "freewake",
    (
        Parameter("mean_gain", 0.2, 3.0, 1.0, "factor on the axisymmetric state n = 1 (mean inflow)"),
        Parameter("third_gain", -1.0, 4.0, 1.0, "factor on the axisymmetric state n = 3"),
        Parameter("fifth_gain", -4.0, 4.0, 1.0, "factor on the axisymmetric states n >= 5"),
        Parameter("reach", 0.05, 4.0, PRINTED_REACH, "height eta at which the r = j sources have fallen to 1/e"),
        Parameter("source_gain", 0.0, 10.0, 1.0, "factor on the ground sources other than r = j"),
        Parameter("slope_share", -1.0, 2.0, 1.0, "tangent of the slope that the sources see, over that of the ground"),
    ),
)


def taught_model(model: FiniteStateModel, values: Float[Array, " P"]) -> FiniteStateModel:
    """Return the model with the reach and the slope of `values` (in the order of PARAMETERS)."""
    reach, share = (values[PARAMETERS.names.index(n)] for n in ("reach", "slope_share"))
    base = jnp.exp(-(reach**-SHARPNESS))
    model = eqx.tree_at(lambda m: (m.correction.b, m.correction.p), model, (base, jnp.asarray(SHARPNESS)))
    if model.ground is None:
        return model
    seen = Plane(model.ground.height, jnp.arctan(share * jnp.tan(model.ground.slope)))
    return eqx.tree_at(lambda m: m.ground, model, seen)


def taught_state(
    model: FiniteStateModel, tau: Float[Array, " M"], values: Float[Array, " P"], climb: Float[Array, ""] | float = 0.0
) -> FiniteState:
    """Return the steady states of a loading, corrected; model: as `taught_model` returns it.

    tau (M,): pressure coefficients with positive thrust; climb: over ΩR, added to both mass-flow parameters.
    """
    mean, third, fifth, source = (
        values[PARAMETERS.names.index(n)] for n in ("mean_gain", "third_gain", "fifth_gain", "source_gain")
    )
    modes = model.modes
    gain = jnp.where(modes.n == 1, mean, jnp.where(modes.n == 3, third, fifth))
    gain = jnp.where(modes.m == 0, gain, 1.0)
    hover = jnp.sqrt(thrust_coefficient(tau, modes) / 2)
    induced = jnp.sqrt(hover**2 + climb**2 / 4) - climb / 2
    a = gain * tau / (mass_flow_parameters(model, tau) * induced / hover + climb)
    if model.ground is None:
        return FiniteState(a, jnp.zeros(len(model.sources), a.dtype))
    c = ground_matrix(model, model.ground) @ a
    return FiniteState(a, c * jnp.where(model.sources.diagonal, 1.0, source))
