"""The finite-state inflow model of a rotor in hover, in or out of ground effect: the functions that users call.

    model = finite_state_model(plane(1.0, 15.0), harmonics=1, ground_harmonics=1)
    tau = loading.from_distribution(dct_dr, r, weights, psi, model.modes)
    state = steady_state(model, tau)
    lam = inflow(state, r, psi, model)

Lengths over R, velocities over ΩR, hub frame (x aft, y to starboard, z up); inflow positive down.
"""

from typing import Literal, get_args

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from rotorjax.errors import InputError
from rotorjax.ground import Plane
from rotorjax.potential.field import disk_functions, field_functions
from rotorjax.potential.ground_source import (
    Correction,
    DiskQuadrature,
    correction,
    correlation,
    ground_on_rotor,
    rotor_on_ground,
    self_flow,
    source_solver,
)
from rotorjax.potential.loading import thrust_coefficient
from rotorjax.potential.modes import ModeTable, ground_modes, rotor_modes
from rotorjax.region import Region

MassFlow = Literal["paper", "linear"]


class FiniteStateModel(eqx.Module):
    """The model's static choices and its parameters.

    modes: rotor table, M modes; sources: ground table, G modes (static). ground: `Plane` or None. correction: b and
    p of the factor on the r = j terms. quadrature: nodes of the correlation integrals (static). mass_flow (static):
    "paper" gives V to a_1^0 and 2V to all others (Eq. 4); "linear" gives V to all. region: the part of the plane where
    there is ground, None for all of it. ground_radius (): of the ground disk, over R, None for 1.
    """

    modes: ModeTable
    sources: ModeTable
    ground: Plane | None
    correction: Correction
    quadrature: DiskQuadrature
    mass_flow: MassFlow = eqx.field(static=True)
    region: Region | None = None
    ground_radius: Float[Array, ""] | None = None

    def __check_init__(self) -> None:
        """Raise InputError where the modes' parities do not match their use."""
        if self.modes.parity == "even" or not bool(self.modes.odd.any()):
            raise InputError("Argument `modes` must have modes with n + m odd, which carry the load, but has none")
        if self.sources.parity == "both":
            raise InputError("Argument `sources` must be all even or all odd in j + r, but has parity 'both'")


class FiniteState(eqx.Module):
    """Velocity states. a (M,): rotor; c (G,): ground sources, zero without ground; both over ΩR."""

    a: Float[Array, " M"]
    c: Float[Array, " G"]


def finite_state_model(
    ground: Plane | None = None,
    harmonics: int = 0,
    radial_terms: int = 3,
    ground_harmonics: int = 0,
    ground_radial_terms: int = 5,
    b: float = float(np.pi / 7),
    p: float = 2.0,
    mass_flow: MassFlow = "paper",
    ground_parity: Literal["even", "odd"] = "even",
    even_terms: int = 0,
    quadrature: DiskQuadrature | None = None,
    region: Region | None = None,
    ground_radius: float | None = None,
) -> FiniteStateModel:
    """Make the model; its defaults are the paper's for level ground (τ₁, τ₃, τ₅; b^{η^p} with π/7 and 2).

    harmonics, ground_harmonics: the highest harmonic (a slope needs at least 1); radial_terms, ground_radial_terms:
    terms of each harmonic; ground_parity: see `modes.ground_modes` (b and p matter for "even" only); even_terms: see
    `modes.rotor_modes`, for dynamics; region: the part of the plane where there is ground (`rotorjax.region`,
    best with ground_parity "odd", ground_harmonics 6 and ground_radial_terms 5); ground_radius: of the ground disk, 1
    by default. Raises InputError where a count, b, p, mass_flow, ground_parity or ground_radius is not allowed.
    """
    if mass_flow not in get_args(MassFlow):
        raise InputError(f"Argument `mass_flow` must be one of {get_args(MassFlow)}, but is {mass_flow!r}")
    if ground_parity not in ("even", "odd"):
        raise InputError(f"Argument `ground_parity` must be 'even' or 'odd', but is {ground_parity!r}")
    if ground_radius is not None and not (np.isfinite(ground_radius) and ground_radius > 0):
        raise InputError(f"Argument `ground_radius` must be positive and finite (over R), but is {ground_radius}")
    quadrature = quadrature or DiskQuadrature()
    least = 2 * max(harmonics, ground_harmonics) + 1
    if quadrature.nodes_psi < least:
        raise InputError(f"Argument `quadrature` must have at least {least} nodes in ψ, but has {quadrature.nodes_psi}")
    return FiniteStateModel(
        rotor_modes(harmonics, radial_terms, even_terms),
        ground_modes(ground_harmonics, ground_radial_terms, ground_parity),
        ground,
        correction(b, p),
        quadrature,
        mass_flow,
        region,
        None if ground_radius is None else jnp.asarray(ground_radius, float),
    )


def footprint(model: FiniteStateModel) -> tuple[Float[Array, " N"], Float[Array, " N"]]:
    """Return the stations (x, y) of the ground disk's quadrature points, over R."""
    x, y, _, _ = model.quadrature.rule()
    size = 1.0 if model.ground_radius is None else model.ground_radius
    return size * jnp.asarray(x), size * jnp.asarray(y)


def ground_matrix(model: FiniteStateModel, ground: Plane) -> Float[Array, "G M"]:
    """Return G of c = G a (Eq. 36) for the model's region and ground disk over a plane."""
    if model.region is None and model.ground_radius is None:
        return correlation(model.modes, model.sources, ground, model.quadrature)
    x, y = footprint(model)
    solver = source_solver(model.sources, model.quadrature, model.region, model.ground_radius)
    return solver @ rotor_on_ground(model.modes, ground, x, y).T


def ground_upflow(model: FiniteStateModel, ground: Plane, points: Float[Array, "*N 3"]) -> Float[Array, "G ..."]:
    """Return the upward velocity of unit ground states at hub-frame points above a plane (Eqs. 35, 46)."""
    if model.ground_radius is None:
        return ground_on_rotor(model.sources, ground, model.correction, points)
    shrunk = Plane(ground.height / model.ground_radius, ground.slope)
    return ground_on_rotor(model.sources, shrunk, model.correction, points / model.ground_radius)


def mass_flow_parameters(model: FiniteStateModel, tau: Float[Array, " M"]) -> Float[Array, " M"]:
    """Return the diagonal of V̂ (Eq. 4) with V = √(C_T/2); τ must carry a positive thrust."""
    v = jnp.sqrt(thrust_coefficient(tau, model.modes) / 2)
    if model.mass_flow == "linear":
        return jnp.full_like(tau, 1) * v
    first = np.arange(len(model.modes)) == model.modes.index(0, 1)
    return jnp.where(first, v, 2 * v)


@eqx.filter_jit
def steady_state(model: FiniteStateModel, tau: Float[Array, " M"]) -> FiniteState:
    """Return the states of a steady loading in hover, a = V̂⁻¹τ (Eq. 3) and c = G a (Eq. 36).

    tau: pressure coefficients of `model.modes` with positive C_T. Raises InputError where its shape differs.
    """
    if tau.shape != (len(model.modes),):
        raise InputError(
            f"Argument `tau` must have shape ({len(model.modes)},) as the model's modes, but has {tau.shape}"
        )
    a = tau / mass_flow_parameters(model, tau)
    if model.ground is None:
        return FiniteState(a, jnp.zeros(len(model.sources), a.dtype))
    return FiniteState(a, ground_matrix(model, model.ground) @ a)


def disk_inflow(
    state: FiniteState, x: Float[Array, "*N"], y: Float[Array, "*N"], model: FiniteStateModel
) -> Float[Array, "*N"]:
    """Return λ over ΩR, positive down, at hub-frame stations (x, y) of the disk, over R, with the ground's effect."""
    down = jnp.tensordot(state.a, disk_functions(model.modes, x, y), 1)
    if model.ground is None:
        return down
    points = jnp.stack([x, y, jnp.zeros_like(x)], axis=-1)
    return down - jnp.tensordot(state.c, ground_upflow(model, model.ground, points), 1)


@eqx.filter_jit
def velocity(state: FiniteState, points: Float[Array, "*N 3"], model: FiniteStateModel) -> Float[Array, "*N 3"]:
    """Return the induced velocity at hub-frame points over R, in the hub frame over ΩR.

    On, above and below the disk, inside and outside the wake cylinder. The ground's part is its axial component
    only, as in the paper, and holds above the plane.
    """
    rotor = jnp.tensordot(state.a, field_functions(model.modes, points), [[0], [1]])
    if model.ground is not None:
        up = jnp.tensordot(state.c, ground_upflow(model, model.ground, points), 1)
        rotor = rotor.at[2].add(up)
    return jnp.moveaxis(rotor, 0, -1)


@eqx.filter_jit
def inflow(
    state: FiniteState, r: Float[Array, " R"], psi: Float[Array, " K"], model: FiniteStateModel
) -> Float[Array, "K R"]:
    """Return λ over ΩR, positive down, at radii r (over R) and azimuths psi (rad), the ground's effect included."""
    return disk_inflow(state, r[None, :] * jnp.cos(psi)[:, None], r[None, :] * jnp.sin(psi)[:, None], model)


@eqx.filter_jit
def mean_inflow(state: FiniteState, model: FiniteStateModel) -> Float[Array, ""]:
    """Return the area-weighted mean of λ over the whole disk, over ΩR."""
    x, y, nu, weights = (jnp.asarray(v, state.a.dtype) for v in model.quadrature.rule())
    return (2 * nu * weights) @ disk_inflow(state, x, y, model)  # r dr = −ν dν


@eqx.filter_jit
def ground_normal_velocity_rms(state: FiniteState, model: FiniteStateModel) -> Float[Array, ""]:
    """Return the rms of the normal velocity left on the plane over that of the flow into it, on the ground disk.

    Area-weighted; with a region on that part of the disk, weighted by its mask. Raises InputError where the model has
    no ground.
    """
    if model.ground is None:
        raise InputError("Argument `model` must have a ground, but its ground is None")
    x, y = footprint(model)
    into = state.a @ rotor_on_ground(model.modes, model.ground, x, y)
    return relative_residual(state.c, into, model)


def relative_residual(c: Float[Array, " G"], into: Float[Array, " N"], model: FiniteStateModel) -> Float[Array, ""]:
    """Return the rms of what source states c leave of the flow `into` the ground disk's points, over that flow's."""
    x, y, nu, weights = (jnp.asarray(v, c.dtype) for v in model.quadrature.rule())
    mask = jnp.ones_like(x) if model.region is None else model.region.mask(*footprint(model))
    area = nu * weights * mask
    left = mask * into - c @ self_flow(model.sources, x, y)
    return jnp.sqrt((area @ left**2) / (area @ (mask * into) ** 2))
