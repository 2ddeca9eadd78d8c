"""The dynamic rotor: M å + D V L⁻¹ M a = D τ forward in time, and its costates backward (Eq. 1).

Time is azimuth (rad), so a dot is d/dψ. Mass flow: V_T = √(μ² + λ²) for a_1^0 and V̄ = (μ² + λ(λ + λ_i))/V_T for the
others, λ = λ_climb + λ_i, λ_i = (2/√3)[L⁻¹Ma]_1; in hover V and 2V, as in Eq. 4. Which modes are "others" is the
model's `mass_flow`. Where the model counts the ground in, λ_i is the whole induced mean flow through the disk, the
sources' upflow taken off.

With odd modes only, the field of an acceleration is the nearest that the odd functions offer; even modes
(`even_terms` of the model) complete them, and the flow converges to the exact linear one at every frequency.

The costates Δ obey the same equation with −[M]Δ̇ and the skew reversed, L(−X): the adjoint stream comes down from aft.
With that and τ itself the terms of Eq. 7 are taken at ψ; the print's τ† = (−1)^{j+1}τ with L(X) has them at ψ + π
(tests/potential/test_dynamics.py compares with the exact skewed flow). Forward in time costates grow, so they are
marched backward from the end of a window, where they start from their steady value; the start is forgotten after the
transit time of the wake.
"""

from functools import cache

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from rotorjax.errors import InputError
from rotorjax.potential.field import pressure_functions
from rotorjax.potential.matrices import apparent_mass, damping, influence
from rotorjax.potential.model import FiniteState, FiniteStateModel, answer_means, rotor_means, with_ground
from rotorjax.potential.modes import ModeTable


class InflowInputs(eqx.Module):
    """Inputs at one instant, or over T instants with a leading axis T on every field.

    tau (M,): pressure coefficients; mu (): advance ratio, the wind blowing aft; climb (): climb speed; both over ΩR.
    """

    tau: Float[Array, "*T M"]
    mu: Float[Array, "*T"]
    climb: Float[Array, "*T"]


def hover_inputs(tau: Float[Array, "*T M"]) -> InflowInputs:
    """Make the inputs of a hovering rotor."""
    zero = jnp.zeros(tau.shape[:-1], tau.dtype)
    return InflowInputs(tau, zero, zero)


def _total_speed(mu: Float[Array, ""], through: Float[Array, ""]) -> Float[Array, ""]:
    """V_T; zero with zero derivative at rest, where the root has none."""
    rest = (mu == 0) & (through == 0)
    return jnp.where(rest, 0.0, jnp.sqrt(jnp.where(rest, 1.0, mu * mu + through * through)))


def mean_induced_inflow(a: Float[Array, " M"], model: FiniteStateModel) -> Float[Array, ""]:
    """Return λ_i, the mean inflow of the rotor's states over ΩR (axial flow): (2/√3) a_1^0, and little of others."""
    return rotor_means(model, model.ground) @ a


def _skew(
    a: Float[Array, " M"], inputs: InflowInputs, model: FiniteStateModel, upflow: Float[Array, ""]
) -> Float[Array, ""]:
    """X = tan(χ/2) = sin χ/(1 + cos χ) of the mean inflow, χ = atan(μ/λ)."""
    through = inputs.climb + mean_induced_inflow(a, model) - upflow
    below = _total_speed(inputs.mu, through) + jnp.abs(through)
    return inputs.mu / jnp.where(below > 0, below, 1.0)


def _unskewed(x: Float[Array, ""], vectors: Float[Array, "M ..."], model: FiniteStateModel) -> Float[Array, "M ..."]:
    """L⁻¹M vectors at a skew X, the cosine and the sine modes on their own."""
    mass = apparent_mass(model.modes, model.modes)
    l = influence(model.modes, model.modes, x)
    result = jnp.zeros_like(vectors)
    for kind in ("cos", "sin"):
        rows = np.array([i for i, mode in enumerate(model.modes.modes) if mode.kind == kind])
        if rows.size:
            block = np.ix_(rows, rows)
            solved = jnp.linalg.solve(l[block], jnp.asarray(mass[block], vectors.dtype) @ vectors[rows])
            result = result.at[rows].set(solved)
    return result


def mass_flow(
    a: Float[Array, " M"], induced: Float[Array, ""], inputs: InflowInputs, model: FiniteStateModel
) -> Float[Array, " M"]:
    """Return the diagonal of V at the induced mean flow λ_i through the disk, over ΩR."""
    through = inputs.climb + induced
    speed = _total_speed(inputs.mu, through)
    later = (inputs.mu**2 + through * (through + induced)) / jnp.where(speed > 0, speed, 1.0)
    return jnp.where(model.varying, later, speed) * jnp.ones_like(a)


def flow_matrices(
    a: Float[Array, " M"], inputs: InflowInputs, model: FiniteStateModel, skewed: bool = True
) -> tuple[Float[Array, " M"], Float[Array, "M M"]]:
    """Return the diagonal of V and L⁻¹M at the present mass flow and skew.

    skewed=False leaves the wake straight (χ = 0), where L⁻¹M = 1 and no system is solved.
    """
    inverse, upflow = jnp.eye(len(model.modes), dtype=a.dtype), answer_means(model) @ a
    if skewed:
        inverse = _unskewed(_skew(a, inputs, model, upflow), inverse, model)
    return mass_flow(a, mean_induced_inflow(inverse @ a, model) - upflow, inputs, model), inverse


@cache
def rate_table(modes: ModeTable) -> np.ndarray:
    """Return M⁻¹D, (M, M)."""
    return np.linalg.solve(apparent_mass(modes, modes), damping(modes, modes))


@eqx.filter_jit
def rhs(
    t: Float[Array, ""], state: FiniteState, inputs: InflowInputs, model: FiniteStateModel, skewed: bool = True
) -> FiniteState:
    """Return d(state)/dψ (Eq. 1); t does not enter. The ground is quasi-steady: c follows a through c = G a.

    Start from a state whose c is G a (`with_ground`). In skewed flow G still assumes the wake under the rotor.
    """
    del t
    return with_ground(rotor_rate(state.a, inputs, model, answer_means(model) @ state.a, skewed), model)


def rotor_rate(
    a: Float[Array, " M"],
    inputs: InflowInputs,
    model: FiniteStateModel,
    upflow: Float[Array, ""],
    skewed: bool = True,
) -> Float[Array, " M"]:
    """Return da/dψ under the mean upflow of the ground's sources through the disk, over ΩR (0: left out)."""
    seen = _unskewed(_skew(a, inputs, model, upflow), a, model) if skewed else a
    v = mass_flow(seen, mean_induced_inflow(seen, model) - upflow, inputs, model)
    return jnp.asarray(rate_table(model.modes), a.dtype) @ (inputs.tau - v * seen)


@eqx.filter_jit
def costates(
    psi: Float[Array, " T"],
    a: Float[Array, "T M"],
    inputs: InflowInputs,
    model: FiniteStateModel,
    skewed: bool = True,
) -> Float[Array, "T M"]:
    """Return the costates Δ over a time window, marched backward from its end (Eq. 1, second row).

    psi: instants (rad), increasing; a: states there, which give mass flow and skew; inputs: with leading axis T.
    The rule is the implicit trapezoidal one, stable for any step and of second order. At the end Δ is taken steady;
    that choice fades within the transit time of the wake. Raises InputError where the shapes do not agree.
    """
    if a.shape[0] != psi.size or inputs.tau.shape != a.shape:
        shapes = f"{psi.shape}, {a.shape}, {inputs.tau.shape}"
        raise InputError(f"Arguments `psi`, `a`, `inputs.tau` must share T and M, but have {shapes}")
    d, mass = (jnp.asarray(f(model.modes, model.modes), a.dtype) for f in (damping, apparent_mass))
    v, inverse = jax.vmap(lambda a, i: flow_matrices(a, i, model, skewed))(a, inputs)
    turn = jnp.asarray(np.where(model.modes.m % 2 == 0, 1.0, -1.0), a.dtype)
    inverse = turn[:, None] * inverse * turn  # L(−X) from L(X)
    decay = d @ (v[:, :, None] * inverse)  # −M Δ̇ + decay Δ = D τ
    force = inputs.tau @ d.T

    def back(later: Array, row: tuple[Array, ...]) -> tuple[Array, Array]:
        step, decay_now, decay_later, force_now, force_later = row
        known = (mass / step - decay_later / 2) @ later + (force_now + force_later) / 2
        now = jnp.linalg.solve(mass / step + decay_now / 2, known)
        return now, now

    last = jnp.linalg.solve(decay[-1], force[-1])
    rows = (jnp.diff(psi), decay[:-1], decay[1:], force[:-1], force[1:])
    return jnp.concatenate([jax.lax.scan(back, last, rows, reverse=True)[1], last[None]])


def rows_at(time: Float[Array, "*N"], psi: Float[Array, " T"], rows: Float[Array, "T M"]) -> Float[Array, "M ..."]:
    """Return rows interpolated linearly in time, held constant outside the window."""
    return jax.vmap(lambda column: jnp.interp(time, psi, column), in_axes=1)(rows)


def passage(
    time: Float[Array, ""],
    points: Float[Array, "*N 3"],
    speed: Float[Array, ""],
    chi: Float[Array, ""] | float,
) -> tuple[Float[Array, "*N 3"], Float[Array, "*N 3"], Float[Array, "*N"]]:
    """Return where (B) and when (t₀) the air at points below the disk passed the disk's plane, and the mirror points D.

    A point above is its own B and D, passed now. Returns B, D, t₀; speed: over ΩR; chi: skew of the wake (rad).
    """
    x, y, z = jnp.moveaxis(points, -1, 0)
    below = jnp.maximum(-z, 0.0)
    foot = jnp.stack([x - below * jnp.tan(chi), y, jnp.maximum(z, 0.0)], axis=-1)
    mirror = jnp.stack([x, y, jnp.abs(z)], axis=-1)
    return foot, mirror, time - below / (speed * jnp.cos(chi))


@eqx.filter_jit
def axial_velocity(
    time: Float[Array, ""],
    points: Float[Array, "*N 3"],
    psi: Float[Array, " T"],
    a: Float[Array, "T M"],
    delta: Float[Array, "T M"],
    speed: Float[Array, ""],
    model: FiniteStateModel,
    chi: Float[Array, ""] | float = 0.0,
) -> Float[Array, "*N"]:
    """Return the rotor's downward velocity (over ΩR) at hub-frame points and one time.

    Above the disk Σ a(t) Φ. Below it (Eq. 7 with right parities) v_A(t) = v_B(t₀) + v_C†(t₀) − v_D†(t), where
    t₀ = t − depth/(speed cos χ) is when the fluid at A passed the disk's plane at B = C, which lies depth · tan χ
    upstream of A, and D is the mirror point above; † takes the costates `delta`. chi: skew of the wake (rad). With odd
    states alone the flow is exact in steady motion and off by some per cent at a reduced frequency ω/speed of 0.3; even
    states (`even_terms`) make it converge at any frequency.
    psi: instants of the window, which must hold t₀ … t; speed: convection speed of the wake, over ΩR.
    """
    z = points[..., 2]
    foot, mirror, passed = passage(time, points, speed, chi)
    phi, disk = pressure_functions(model.modes, mirror), pressure_functions(model.modes, foot)
    wake = jnp.sum((rows_at(passed, psi, a) + rows_at(passed, psi, delta)) * disk, axis=0)
    wake = wake - jnp.tensordot(rows_at(time, psi, delta), phi, 1)
    return jnp.where(z >= 0, jnp.tensordot(rows_at(time, psi, a), phi, 1), wake)
