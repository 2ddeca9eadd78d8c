"""The lifting line solved in a given wake: the bound circulation that a blade has once its own first ring follows it.

Blade elements give the circulation W(Γ) in the wake of a bound circulation Γ, which runs along the blade, in the first
ring of its near wake and in the section's own downwash (lifting_surface.py). On narrow panels W is steep: it falls
by up to fifteen as Γ rises by one, so that a filter Γ' = (W(Γ) − Γ)/τ is sixteen times faster than τ there. What it
tends to solves G = W(G). With the Jacobian M = 1 − ∂W/∂Γ of the blade's own part one Newton step gives

    G = Γ + M⁻¹ (W(Γ) − Γ),

and Γ' = (G − Γ)/τ has the same equilibrium, W(Γ) = Γ, with no rate beyond 1/τ. In M lift follows the downwash with the
attached slope, for that is what local differences do in `section_loads`, stalled or not; a falling lift curve would
make it singular. What M leaves out (other blades, the stall of a whole stretch) changes the speed and not the goal.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from rotorjax.rotor.blade_element import SectionLoads, attached_slope
from rotorjax.wake.biot_savart import unit_velocities
from rotorjax.wake.loads import WakeInputs, across_blades, blade_loads, follows, own_downwash
from rotorjax.wake.model import FreeWake, WakeState

WEAK = 0.1
"""Share ∂W_i/∂Γ_i below which a row of it fades out of M: it is not stiff, and where the flow over a blade turns round
it may have the wrong sign."""


class Line(NamedTuple):
    """What the lifting lines of K blades carry: control (K, R, 3), velocity of the air there, over ΩR; gamma (K, R),
    what the bound circulation follows; loads (K, R).
    """

    control: Float[Array, "K R 3"]
    gamma: Float[Array, "K R"]
    loads: SectionLoads


def bound_line(model: FreeWake, control: Float[Array, "K R 3"], state: WakeState, inputs: WakeInputs) -> Line:
    """Loads of the blades and what their bound circulation follows, by the settings' `bound_filter`.

    control: velocity of the air at the control points in the wake of the state's own bound circulation.
    """
    now = blade_loads(model, control, state.gamma_bound, inputs)
    if model.settings.bound_filter == "pass":
        return Line(control, now.circulation, now)
    by_ring = own_ring(model, state)
    matrix = newton_matrix(model, control, state.gamma_bound, by_ring)
    step = jnp.linalg.solve(matrix, (now.circulation - state.gamma_bound)[..., None])[..., 0]
    gamma, solved = state.gamma_bound + step, control + jnp.einsum("kijc,kj->kic", by_ring, step)
    return Line(solved, gamma, blade_loads(model, solved, gamma, inputs))


def own_ring(model: FreeWake, state: WakeState) -> Float[Array, "K R R 3"]:
    """Velocity at each blade's control points by its own bound circulation: that of the lattice's first ring, which
    carries half of it (`segments.near_lattice`). The bound vortex, straight, induces nothing on its own line.
    """
    fine = model.settings.control_core
    panels = np.eye(model.settings.panels)
    # circulation of the first ring's trailers, then of its shed edge, for that of each panel
    of_panels = 0.5 * np.concatenate([-np.diff(np.pad(panels, ((1, 1), (0, 0))), axis=0), -panels])

    def one(k, first):
        own = model.of_slice(k)
        start, end = jnp.concatenate([own.leading, first[:-1]]), jnp.concatenate([first, first[1:]])
        return jnp.einsum("isc,sj->ijc", unit_velocities(own.control, start, end, fine), of_panels)

    return jax.vmap(one)(jnp.arange(len(state.near)), state.near[:, :, 0])


def newton_matrix(
    model: FreeWake, control: Float[Array, "K R 3"], gamma: Float[Array, "K R"], by_ring: Float[Array, "K R R 3"]
) -> Float[Array, "K R R"]:
    """M = 1 − ∂W/∂Γ of each blade's own circulation, through the angle of attack alone.

    W = ½ |u| c cl(θ − atan2(w, u_T)) with w = u_P + own downwash: ∂W/∂w = −½ c a |u| u_T/(u_T² + w²), a the attached
    slope of the lift.
    """
    still = jnp.zeros_like(control)
    at_rest = across_blades(model, still)[1][..., None]
    through = jax.vmap(lambda v: across_blades(model, v)[1], in_axes=2, out_axes=2)(by_ring) - at_rest
    tangential, perpendicular = across_blades(model, control)
    extra = own_downwash(model)
    sign = jnp.broadcast_to(follows(model, tangential), tangential.shape)
    downwash = perpendicular + gamma @ extra.T * sign
    speed = jnp.sqrt(tangential**2 + perpendicular**2)
    slope = attached_slope(model.rotor, model.operating, speed)
    gain = 0.5 * model.chords * slope * speed * tangential / (tangential**2 + downwash**2)
    steep = gain[..., None] * (through + sign[..., None] * extra)
    own = jnp.maximum(jnp.diagonal(steep, axis1=1, axis2=2), 0.0)[..., None]
    return jnp.eye(model.settings.panels, dtype=gamma.dtype) + steep * own**2 / (own**2 + WEAK**2)
