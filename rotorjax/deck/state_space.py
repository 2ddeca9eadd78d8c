"""A, B, C, D of a rotor over ground at a flight condition, through the package's lineariser.

States: a[i], wake[k,i] and, where blades flap, flap[i] and flap_rate[i] (β₀, β₁c, β₁s). Inputs: collective, climb,
climb_rate, mu, height, height_rate, slope, slope_rate, edge and tau[i], by their names in `DeckControls`. Outputs:
those of `over_ground.Output`, uniform, cosine, sine and thrust by default. Time is azimuth (rad). Height and its rate
are separate inputs, as climb and its rate are: at a frequency ω the plane's heave h e^{iωψ} enters as
h (B_height + iω B_rate) (`heave_response`).
"""

from collections.abc import Sequence

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Complex, Float

from rotorjax.deck.over_ground import DeckControls, DiskState, OverGround, output, rhs
from rotorjax.errors import InputError
from rotorjax.ode.linearise import linearise
from rotorjax.ode.models import LinearModel
from rotorjax.ode.orbit import make_orbit
from rotorjax.ode.outcome import Outcome

INPUTS = ("collective", "climb", "mu", "ground.height", "ground.height_rate", "ground.slope", "ground.slope_rate")
OUTPUTS = ("uniform", "cosine", "sine", "thrust")
UNITS = {
    "collective": "rad",
    "ground.slope": "rad",
    "ground.slope_rate": "rad/rad",
    "ground.height": "R",
    "ground.height_rate": "R/rad",
    "edge": "R",
    "climb": "ΩR",
    "climb_rate": "Ω²R",
    "mu": "ΩR",
    "uniform": "ΩR",
    "cosine": "ΩR",
    "sine": "ΩR",
    "beta_0": "rad",
    "beta_1c": "rad",
    "beta_1s": "rad",
}


def state_space(
    model: OverGround,
    state: DiskState,
    now: DeckControls,
    inputs: Sequence[str] = INPUTS,
    outputs: Sequence[str] = OUTPUTS,
    tolerance: float = 1e-8,
) -> LinearModel:
    """Linearise about a trimmed state and constant controls; hand the result to `rotorjax.ode.export`.

    Raises InputError where the state is not an equilibrium (its rate exceeds `tolerance`, in rotor units), or a name
    is unknown.
    """
    rate = eqx.filter_jit(rhs)(jnp.zeros(()), state, now, model)
    worst = max((float(jnp.abs(leaf).max()) for leaf in jax.tree.leaves(rate) if leaf.size), default=0.0)
    if not worst <= tolerance:
        raise InputError(
            f"Argument `state` must be an equilibrium, but changes by {worst:.3g} a radian: take `over_ground.trim`"
        )
    found = Outcome(None, worst, (worst,), 0, True, "equilibrium", 0.0)
    orbit = make_orbit(0.0, jax.tree.map(lambda leaf: leaf[None], state), 2 * np.pi, found)
    periodic = linearise(
        lambda t, x, u, p: rhs(t, x, u, model),
        lambda t, x, u, p: output(t, x, u, model)._asdict(),
        orbit,
        now,
        inputs=inputs,
        outputs=outputs,
        units=UNITS,
    )
    return LinearModel(
        periodic.a[0],
        periodic.b[0],
        periodic.c[0],
        periodic.d[0],
        periodic.states,
        periodic.inputs,
        periodic.outputs,
        periodic.input_units,
        periodic.output_units,
    )


def heave_response(linear: LinearModel, frequencies: Float[np.ndarray, " W"]) -> Complex[np.ndarray, "W q"]:
    """Return the outputs' complex amplitudes over that of a sinusoidal height; frequencies over Ω."""
    found = linear.response(frequencies)
    height, rate = (linear.inputs.index(name) for name in ("ground.height", "ground.height_rate"))
    return found[:, :, height] + 1j * np.asarray(frequencies)[:, None] * found[:, :, rate]
