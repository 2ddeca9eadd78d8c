"""The finite-state inflow model of a rotor in hover, in or out of ground effect, beside and above solid surfaces: the
functions that users call.

    model = finite_state_model(plane(1.0, 15.0), harmonics=1, ground_harmonics=1)
    tau = loading.from_distribution(dct_dr, r, weights, psi, model.modes)
    state = steady_state(model, tau)
    lam = inflow(state, r, psi, model)

The paper leaves choices open or makes them in a way that neither measurements nor a free wake bear out. Each is named,
and the model carries it (`Settings`); `finite_state_model(printed=True)` is the paper's own:

| choice | default | as printed |
|---|---|---|
| strengths | "closed": c = G a, the plane is closed | "printed": S = V_e G; half of the flow goes through the plane |
| ground_parity | "odd": sources on the plane alone | "even", with the factor (π/7)^{η²} on the r = j terms |
| ground_in_mass_flow | V_T, V̄ of the inflow that the disk has | V = √(C_T/2), the ground left out |
| slope | "tilted": sources where the plane is | "sheared": at the depth under each point (Eq. 9) |
| wake | `contraction()`: it narrows to R/√2 | None: a cylinder |
| wake_edge | "free" over a whole plane: gives way as a jet's, tilts fade (`potential.wake_edge`) | "rigid" |
| mass_flow | "harmonics": V_T, and V̄ for harmonics | "paper": V̄ = 2V for all but the first state (Eq. 4) |

Lengths over R, velocities over ΩR, hub frame (x aft, y to starboard, z up); inflow positive down.
"""

from typing import Any, Literal, TypedDict, Unpack, get_args

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer
from jaxtyping import Array, Float

from rotorjax.checks import known
from rotorjax.errors import InputError
from rotorjax.ground import Plane
from rotorjax.panels.surface import Panels, Solid, check_clear, check_panels, floor, solid
from rotorjax.potential import surfaces as beside
from rotorjax.potential.contraction import Contraction, Functions, contraction, disk_flow, disk_means, wake_flow
from rotorjax.potential.field import column_functions, disk_functions, field_functions
from rotorjax.potential.ground_source import (
    Correction,
    DiskQuadrature,
    correction,
    ground_on_rotor,
    level_flow,
    printed_strengths,
    rotor_on_ground,
    self_flow,
    sheet_flow,
    source_solver,
)
from rotorjax.potential.modes import ModeTable, ground_modes, rotor_modes
from rotorjax.potential.wake_edge import with_free_edge
from rotorjax.region import Region

MassFlow = Literal["harmonics", "paper", "linear"]
Strengths = Literal["closed", "printed"]
Slope = Literal["tilted", "sheared"]
WakeEdge = Literal["free", "rigid"]
MEAN = DiskQuadrature(16, 16)  # of the sources' upflow, smooth on the disk
SPOTS = 4  # along each side of a panel, for the mean of the wake's column over it
LOWEST_EVEN = 0.2
NO_THRUST = 1e-10  # of C_T/2: below it V, which has no derivative there, stays at 1e-5


class Settings(TypedDict, total=False):
    """The model's choices (see the module's head) and sizes, by keyword."""

    strengths: Strengths
    ground_parity: Literal["even", "odd"]
    ground_in_mass_flow: bool
    slope: Slope
    wake: Contraction | None
    wake_edge: WakeEdge
    mass_flow: MassFlow
    b: float
    p: float
    even_terms: int
    quadrature: DiskQuadrature | None
    region: Region | None
    ground_radius: float | None


PRINTED = Settings(
    strengths="printed",
    ground_parity="even",
    ground_in_mass_flow=False,
    slope="sheared",
    wake=None,
    wake_edge="rigid",
    mass_flow="paper",
)
_CHOICES = {
    "strengths": get_args(Strengths),
    "ground_parity": ("even", "odd"),
    "ground_in_mass_flow": (True, False),
    "slope": get_args(Slope),
    "wake_edge": get_args(WakeEdge),
    "mass_flow": get_args(MassFlow),
}


class FiniteStateModel(eqx.Module):
    """The model's static choices and its parameters.

    modes: rotor table, M modes; sources: ground table, G modes (static). ground: `Plane` or None. correction: b and
    p of the factor on the r = j terms. quadrature: nodes of the correlation integrals (static). wake: how it contracts
    far from the ground, None for a cylinder. surfaces: beside and under the rotor, or None. region: the part of the
    plane where there is ground, None for all of it. ground_radius (): of the ground disk, over R, None for that of the
    wake there. lean (): tan χ of the wake in a wind, which a free edge alone heeds. strengths, ground_in_mass_flow,
    slope, wake_edge, mass_flow: static, see the module's head; mass_flow "paper" gives V_T to a_1^0 and V̄ to all
    others, "linear" V_T to all, "harmonics" V_T to the axisymmetric ones.
    """

    modes: ModeTable
    sources: ModeTable
    ground: Plane | None
    correction: Correction
    quadrature: DiskQuadrature
    mass_flow: MassFlow = eqx.field(static=True)
    region: Region | None = None
    ground_radius: Float[Array, ""] | None = None
    wake: Contraction | None = None
    surfaces: Solid | None = None
    strengths: Strengths = eqx.field(static=True, default="closed")
    ground_in_mass_flow: bool = eqx.field(static=True, default=False)
    slope: Slope = eqx.field(static=True, default="sheared")
    wake_edge: WakeEdge = eqx.field(static=True, default="rigid")
    lean: Float[Array, ""] | float = 0.0

    def __check_init__(self) -> None:
        """Raise InputError where the modes' parities do not match their use."""
        if self.modes.parity == "even" or not bool(self.modes.odd.any()):
            raise InputError("Argument `modes` must have modes with n + m odd, which carry the load, but has none")
        if self.sources.parity == "both":
            raise InputError("Argument `sources` must be all even or all odd in j + r, but has parity 'both'")
        if self.slope == "tilted" and self.sources.parity == "even":
            raise InputError(
                "Argument `slope` must be 'sheared' with ground_parity 'even', whose sources are not on the plane "
                "alone, but is 'tilted'"
            )

    @property
    def varying(self) -> np.ndarray:
        """Which modes the mass flow V̄ carries, (M,); V_T carries the others."""
        if self.mass_flow == "linear":
            return np.zeros(len(self.modes), bool)
        if self.mass_flow == "harmonics":
            return self.modes.m > 0
        return np.arange(len(self.modes)) != self.modes.index(0, 1)


class FiniteState(eqx.Module):
    """Velocity states over ΩR. a (M,): rotor. c (S,): sources, the ground's G, which are zero without it, and behind
    them the densities of the surfaces' panels.
    """

    a: Float[Array, " M"]
    c: Float[Array, " S"]


def finite_state_model(
    ground: Plane | None = None,
    harmonics: int = 0,
    radial_terms: int = 3,
    ground_harmonics: int = 0,
    ground_radial_terms: int = 7,
    printed: bool = False,
    surfaces: Panels | None = None,
    **settings: Unpack[Settings],
) -> FiniteStateModel:
    """Make the model: by default the choices that agree best with measurements and the free wake, or the paper's own.

    harmonics, ground_harmonics: the highest harmonic (a slope needs at least 1); radial_terms, ground_radial_terms:
    terms of each harmonic (τ₁, τ₃, τ₅). printed: the paper's choices (`PRINTED`). surfaces: that no air goes through,
    in the hub frame (`panels.shapes`; how: `potential.surfaces`); ground beside them must be level. settings: single
    ones instead of these (`Settings`): b, p: of the factor b^{η^p} on the r = j terms, which only even sources have
    (π/7 and 2);
    even_terms: see `modes.rotor_modes`, for dynamics; region: the part of the plane where there is ground
    (`rotorjax.region`, best with ground_harmonics 6 and ground_radial_terms 5); ground_radius: of the ground disk.
    Raises InputError where a count or a setting is not allowed.
    """
    whole = surfaces is None and settings.get("region") is None
    chosen: dict[str, Any] = {**(PRINTED if printed else _default(whole)), **settings}
    _check(chosen, harmonics, ground_harmonics)
    _check_height(ground, chosen)
    if surfaces is not None:
        _check_surfaces(surfaces, ground, chosen)
    radius = chosen.get("ground_radius")
    return FiniteStateModel(
        rotor_modes(harmonics, radial_terms, chosen.get("even_terms", 0)),
        ground_modes(ground_harmonics, ground_radial_terms, chosen["ground_parity"]),
        ground,
        correction(chosen.get("b", float(np.pi / 7)), chosen.get("p", 2.0)),
        chosen.get("quadrature") or DiskQuadrature(),
        chosen["mass_flow"],
        chosen.get("region"),
        None if radius is None else jnp.asarray(radius, float),
        surfaces=None if surfaces is None else solid(surfaces, ground),
        **{name: chosen[name] for name in ("wake", "strengths", "ground_in_mass_flow", "slope", "wake_edge")},
    )


def _default(whole: bool) -> Settings:
    """The choices that agree best. whole: whether the ground is a whole plane or none; else the wake keeps its edge."""
    return Settings(
        strengths="closed",
        ground_parity="odd",
        ground_in_mass_flow=True,
        slope="tilted",
        wake=contraction(),
        wake_edge="free" if whole else "rigid",
        mass_flow="harmonics",
    )


def _check(chosen: dict[str, Any], harmonics: int, ground_harmonics: int) -> None:
    """Raise InputError for a setting that does not exist, is not allowed or would have no effect."""
    if unknown := set(chosen) - set(Settings.__annotations__):
        raise InputError(f"Arguments must be among {', '.join(Settings.__annotations__)}, but hold {unknown.pop()!r}")
    for name, allowed in _CHOICES.items():
        if chosen[name] not in allowed:
            raise InputError(f"Argument `{name}` must be one of {allowed}, but is {chosen[name]!r}")
    if chosen["ground_parity"] == "odd" and (idle := {"b", "p"} & set(chosen)):
        raise InputError(
            f"Argument `{idle.pop()}` must come with ground_parity='even', whose r = j terms it damps, but the sources "
            "are odd"
        )
    radius = chosen.get("ground_radius")
    if radius is not None and not (np.isfinite(radius) and radius > 0):
        raise InputError(f"Argument `ground_radius` must be positive and finite (over R), but is {radius}")
    quadrature, least = chosen.get("quadrature") or DiskQuadrature(), 2 * max(harmonics, ground_harmonics) + 1
    if quadrature.nodes_psi < least:
        raise InputError(f"Argument `quadrature` must have at least {least} nodes in ψ, but has {quadrature.nodes_psi}")


def _check_height(ground: Plane | None, chosen: dict[str, Any]) -> None:
    """Raise InputError where even sources that close the plane would turn the mean inflow upward."""
    if ground is None or isinstance(ground.height, Tracer) or chosen["ground_parity"] == "odd":
        return
    if chosen["strengths"] == "closed" and float(ground.height) < LOWEST_EVEN:
        raise InputError(
            f"Argument `height` must be at least {LOWEST_EVEN} (over R) with ground_parity='even' and "
            f"strengths='closed', whose inflow is negative below, but is {float(ground.height):g}: take the default's "
            "odd sources"
        )


def _check_surfaces(surfaces: Panels, ground: Plane | None, chosen: dict[str, Any]) -> None:
    """Raise InputError where surfaces cut the disk, or a setting or a slope does not go with them."""
    check_panels(surfaces)
    check_clear(surfaces)
    if chosen["wake_edge"] != "rigid":
        raise InputError(
            "Argument `wake_edge` must be 'rigid' beside surfaces, whose flow has all three components, but is "
            f"{chosen['wake_edge']!r}: leave it out"
        )
    if chosen.get("even_terms", 0):
        raise InputError(
            f"Argument `even_terms` must be 0 beside surfaces, which answer steady flow, but is {chosen['even_terms']}"
        )
    if ground is None:
        return
    if known(ground.slope) and float(ground.slope) != 0:
        raise InputError(
            f"Argument `ground` must be level beside surfaces, but its slope is {np.rad2deg(float(ground.slope)):g} "
            "deg: make the slope of panels (rj.terrain), or take the free wake (rj.free_wake)"
        )
    if chosen["ground_parity"] == "even":
        raise InputError(
            "Argument `ground_parity` must be 'odd' beside surfaces, since even sources leave the plane open, but is "
            "'even': leave it out, and `printed`, or make the ground of panels"
        )
    if chosen.get("region") is not None:
        raise InputError(
            "Argument `region` must be left out beside surfaces, whose images need the whole plane: make the deck of "
            "panels (rj.slab)"
        )


def choices(model: FiniteStateModel) -> dict[str, Any]:
    """Return the model's choices by name, as plain values; the wake by its three numbers, absent where a cylinder."""
    names = ("strengths", "ground_in_mass_flow", "slope", "wake_edge", "mass_flow")
    wake = {} if model.wake is None else {f"wake_{k}": float(v) for k, v in vars(model.wake).items()}
    return {**{name: getattr(model, name) for name in names}, "ground_parity": model.sources.parity, **wake}


def wake_over(model: FiniteStateModel, ground: Plane | None) -> Contraction | None:
    """Return how the wake contracts over a plane and surfaces (`panels.surface.floor`), or far from any; None for a
    cylinder.
    """
    if model.surfaces is not None:
        ground = floor(model.surfaces.panels, ground)
    return model.wake if model.wake is None or ground is None else model.wake.over(ground.height)


def source_radius(model: FiniteStateModel, ground: Plane) -> Float[Array, ""]:
    """Return the radius of the ground disk over R: the one that was given, or that of the wake there."""
    if model.ground_radius is not None:
        return model.ground_radius
    wake = wake_over(model, ground)
    return jnp.asarray(1.0) if wake is None else wake.radius


def footprint(model: FiniteStateModel, ground: Plane) -> tuple[Float[Array, " N"], Float[Array, " N"]]:
    """Return the stations (x, y) of the ground disk's quadrature points, over R."""
    x, y, _, _ = model.quadrature.rule()
    size = source_radius(model, ground)
    return size * jnp.asarray(x), size * jnp.asarray(y)


def closing(model: FiniteStateModel, ground: Plane) -> Float[Array, "G N"]:
    """Return the matrix from normal velocities at the ground disk's points to the source states that answer them."""
    return source_solver(model.sources, model.quadrature, model.region, source_radius(model, ground))


def rotor_into_ground(model: FiniteStateModel, ground: Plane) -> Float[Array, "M N"]:
    """Return the flow of unit rotor states into a plane at the ground disk's points, along its normal."""
    (x, y), wake = footprint(model, ground), wake_over(model, ground)
    into = rotor_on_ground(model.modes, ground, x, y, wake)
    if model.surfaces is None:
        return into
    points = jnp.stack([x, y, jnp.broadcast_to(-ground.height, x.shape)], axis=-1)
    column = column_functions(model.modes, points if wake is None else points / wake.radius)  # as in `far_flow`
    return into - beside.shadow(model.surfaces.panels, points) * column


def ground_matrix(model: FiniteStateModel, ground: Plane) -> Float[Array, "G M"]:
    """Return G of c = G a (Eq. 36) for the model's region, ground disk and strengths over a plane."""
    row, column = strength_factors(model)
    return row[:, None] * (closing(model, ground) @ rotor_into_ground(model, ground).T) * column


def strength_factors(model: FiniteStateModel) -> tuple[Float[Array, " G"], Float[Array, " M"]]:
    """Return the factors by row and by column, (G,) and (M,), on G that closes the plane; ones but for "printed"."""
    if model.strengths == "printed":
        row, column = printed_strengths(model.modes, model.sources)
        return jnp.asarray(row), jnp.asarray(column)
    return jnp.ones(len(model.sources)), jnp.ones(len(model.modes))


def ground_upflow(model: FiniteStateModel, ground: Plane, points: Float[Array, "*N 3"]) -> Float[Array, "G ..."]:
    """Return the upward velocity of unit ground states at hub-frame points above a plane (Eqs. 35, 46)."""
    if model.wake_edge == "free":
        wake = wake_over(model, ground)
        return with_free_edge(lambda places: _sources_upflow(model, ground, places), ground, wake, model.lean, points)
    return _sources_upflow(model, ground, points)


def _sources_upflow(model: FiniteStateModel, ground: Plane, points: Float[Array, "*N 3"]) -> Float[Array, "G ..."]:
    """Upward velocity of the sources themselves, whatever the wake's edge does."""
    size = source_radius(model, ground)
    ground, points = Plane(ground.height / size, ground.slope), points / size
    if model.slope == "tilted":
        return sheet_flow(model.sources, ground, points) / jnp.cos(ground.slope)
    return ground_on_rotor(model.sources, ground, model.correction, points)


def level_velocity(model: FiniteStateModel, ground: Plane, points: Float[Array, "*N 3"]) -> Float[Array, "3 G ..."]:
    """Return the velocity (hub frame) of unit states of odd sources at points above level ground."""
    size = source_radius(model, ground)
    return level_flow(model.sources, ground.height / size, points / size)


def answer_matrix(model: FiniteStateModel) -> Float[Array, "S M"]:
    """Return G of c = G a: the sources with which ground and surfaces answer unit rotor states."""
    none = jnp.zeros((len(model.sources), len(model.modes)))
    of_ground = none if model.ground is None else ground_matrix(model, model.ground)
    if model.surfaces is None:
        return of_ground
    panels = model.surfaces.panels
    through = jnp.einsum("amp,pa->mp", _open_flow(model, of_ground, panels.middles), panels.normals)
    through = through - _spread(model, panels) * panels.normals[:, 2]
    return jnp.concatenate([of_ground, beside.answers(model.surfaces, through, model.ground)])


def _spread(model: FiniteStateModel, panels: Panels) -> Float[Array, "M P"]:
    """What the wake's column, whose rim is sharp, brings each panel in the mean more than its middle."""
    points, shares = panels.spots(SPOTS)
    places = jnp.concatenate([points, panels.middles[:, None]], axis=1)
    column = _in_wake(model, model.ground, column_functions, places)
    more = jnp.sum(column[..., :-1] * shares, axis=-1) - column[..., -1]
    return more * (1 - beside.shadow(panels, panels.middles))


def _open_flow(
    model: FiniteStateModel, of_ground: Float[Array, "G M"], points: Float[Array, "*N 3"]
) -> Float[Array, "3 M ..."]:
    """Velocity of unit rotor states with the answer of a level ground, but without the surfaces'."""
    rotor = rotor_velocity(model, model.ground, points)
    if model.ground is None:
        return rotor
    return rotor + jnp.einsum("gm,ag...->am...", of_ground, level_velocity(model, model.ground, points))


def answer_upflow(
    model: FiniteStateModel, sources: Float[Array, "S M"], points: Float[Array, "*N 3"]
) -> Float[Array, "M ..."]:
    """Return the upward velocity of M sets of source states at hub-frame points, of ground and surfaces."""
    count = len(model.sources)
    up = jnp.zeros((sources.shape[1], *points.shape[:-1]), points.dtype)
    if model.ground is not None:
        up = jnp.tensordot(sources[:count].T, ground_upflow(model, model.ground, points), 1)
    if model.surfaces is not None:
        up = up + beside.flow(model.surfaces, sources[count:], points, model.ground)[2]
    return up


def mean_upflow(model: FiniteStateModel, sources: Float[Array, "S M"]) -> Float[Array, " M"]:
    """Return the area-weighted mean over the disk of the upward velocity of M sets of source states."""
    x, y, nu, weights = MEAN.rule()  # r dr = −ν dν
    count, up = len(model.sources), jnp.zeros(sources.shape[1])
    if model.ground is not None:
        up = _ground_means(model, model.ground) @ sources[:count]
    if model.surfaces is not None:
        points = jnp.asarray(np.stack([x, y, 0 * x], axis=-1))
        up = up + beside.flow(model.surfaces, sources[count:], points, model.ground)[2] @ (2 * nu * weights)
    return up


def _ground_means(model: FiniteStateModel, ground: Plane) -> Float[Array, " G"]:
    """Area-weighted mean over the disk of the upward velocity of unit ground states."""
    x, y, nu, weights = MEAN.rule()
    half = y > 0  # the plane rises along x: cosines are even in y, and sines have no mean
    points = jnp.asarray(np.stack([x, y, 0 * x], axis=-1)[half])  # r dr = −ν dν
    cosine = np.array([mode.kind == "cos" for mode in model.sources.modes])
    return jnp.where(cosine, _sources_upflow(model, ground, points) @ (4 * nu * weights)[half], 0.0)


def rotor_means(model: FiniteStateModel, ground: Plane | None) -> Float[Array, " M"]:
    """Return the area-weighted mean inflow of unit rotor states: 2/√3 of the first, little of others."""
    wake = wake_over(model, ground)
    if wake is None:
        return jnp.where(np.arange(len(model.modes)) == model.modes.index(0, 1), 2 / np.sqrt(3), 0.0)
    return disk_means(model.modes, wake)


def answer_means(model: FiniteStateModel) -> Float[Array, " M"]:
    """Return the mean upflow of the ground's answer to unit rotor states, zero where the mass flow leaves it out."""
    alone = model.ground is None and model.surfaces is None
    return jnp.zeros(len(model.modes)) if alone or not model.ground_in_mass_flow else unit_states(model).up


class UnitStates(eqx.Module):
    """What unit rotor states make, whatever the loading: the costly part of a model, linear, so once is enough.

    sources (S, M): the answer of ground and surfaces, G of c = G a. down, up (M,): area-weighted mean over the disk of
    their own inflow and of the answer's upflow; sources and up are zero without either.
    """

    sources: Float[Array, "S M"]
    down: Float[Array, " M"]
    up: Float[Array, " M"]


@eqx.filter_jit
def unit_states(model: FiniteStateModel) -> UnitStates:
    """Return what unit rotor states make."""
    sources = answer_matrix(model)
    return UnitStates(sources, rotor_means(model, model.ground), mean_upflow(model, sources))


@eqx.filter_jit
def mass_flow_parameters(
    model: FiniteStateModel,
    tau: Float[Array, " M"],
    climb: Float[Array, ""] | float = 0.0,
    unit: UnitStates | None = None,
) -> Float[Array, " M"]:
    """Return the diagonal of V̂ under a loading in steady climb over ΩR: V_T = V_c + u and V̄ = V_c + 2u.

    u is the induced mean flow through the disk, of the states τ/V̂ themselves: u V_T = Σ q (τ of V_T) + Σ q (τ of
    V̄) V_T/V̄, where q is the mean inflow of unit states, the ground's answer included. In hover the ratio is ½
    and nothing is left to solve; in climb four rounds are exact to rounding. Where the ground is left out, q τ =
    C_T/2: V and 2V with V = √(C_T/2) in hover (Eq. 4). Under a thrust that points down V_T is that of the
    opposite one; at zero thrust it is 1e-5. unit: where it is at hand.
    """
    unit = unit_states(model) if unit is None else unit
    loads = (unit.down - unit.up if model.ground_in_mass_flow else unit.down) * tau
    first, rest = (jnp.sum(jnp.where(carried, loads, 0.0)) for carried in (~model.varying, model.varying))
    ratio = jnp.asarray(0.5)
    for _ in range(4):
        root = jnp.sqrt(jnp.sqrt((first + ratio * rest) ** 2 + NO_THRUST**2) + climb**2 / 4)  # u + V_c/2
        ratio = (root + climb / 2) / (2 * root)
    return jnp.where(model.varying, 2 * root, root + climb / 2)


@eqx.filter_jit
def steady_state(
    model: FiniteStateModel,
    tau: Float[Array, " M"],
    climb: Float[Array, ""] | float = 0.0,
    unit: UnitStates | None = None,
) -> FiniteState:
    """Return the states of a steady loading in hover or climb (over ΩR), a = V̂⁻¹τ (Eq. 3) and c = G a (Eq. 36).

    tau: pressure coefficients of `model.modes`. unit: where it is at hand. Raises InputError where tau's shape differs.
    """
    if tau.shape != (len(model.modes),):
        raise InputError(
            f"Argument `tau` must have shape ({len(model.modes)},) as the model's modes, but has {tau.shape}"
        )
    unit = unit_states(model) if unit is None else unit
    a = tau / mass_flow_parameters(model, tau, climb, unit)
    return FiniteState(a, unit.sources @ a)


@eqx.filter_jit
def with_ground(a: Float[Array, " M"], model: FiniteStateModel) -> FiniteState:
    """Return the state with rotor states a and the sources c = G a of ground (Eq. 36) and surfaces."""
    return FiniteState(a, answer_matrix(model) @ a)


def rotor_flow(
    model: FiniteStateModel, ground: Plane | None, x: Float[Array, "*N"], y: Float[Array, "*N"]
) -> Float[Array, "M ..."]:
    """Return the inflow of unit rotor states at stations (x, y) of the disk, over R, the wake as it is over a plane."""
    wake = wake_over(model, ground)
    return disk_functions(model.modes, x, y) if wake is None else disk_flow(model.modes, x, y, wake)


@eqx.filter_jit
def rotor_velocity(
    model: FiniteStateModel, ground: Plane | None, points: Float[Array, "*N 3"]
) -> Float[Array, "3 M ..."]:
    """Return the velocity (hub frame) of unit rotor states at any points, the wake as it is over a plane; in the shadow
    of surfaces without its column.
    """
    flow = _in_wake(model, ground, field_functions, points)
    if model.surfaces is None:
        return flow
    column = _in_wake(model, ground, column_functions, points)
    return flow.at[2].add(beside.shadow(model.surfaces.panels, points) * column)


def _in_wake(model: FiniteStateModel, ground: Plane | None, functions: Functions, points: Array) -> Array:
    """Functions of unit states in a cylinder, laid along the wake as it is over a plane."""
    wake = wake_over(model, ground)
    return functions(model.modes, points) if wake is None else wake_flow(functions, model.modes, points, wake)


@eqx.filter_jit
def unit_inflow(
    model: FiniteStateModel, unit: UnitStates, x: Float[Array, "*N"], y: Float[Array, "*N"]
) -> Float[Array, "M ..."]:
    """Return the inflow of unit rotor states at stations (x, y) of the disk, over R, with the answer to it."""
    points = jnp.stack([x, y, jnp.zeros_like(x)], axis=-1)
    return rotor_flow(model, model.ground, x, y) - answer_upflow(model, unit.sources, points)


@eqx.filter_jit
def disk_inflow(
    state: FiniteState, x: Float[Array, "*N"], y: Float[Array, "*N"], model: FiniteStateModel
) -> Float[Array, "*N"]:
    """Return λ over ΩR, positive down, at hub-frame stations (x, y) of the disk, over R, with the effect of ground and
    surfaces.
    """
    points = jnp.stack([x, y, jnp.zeros_like(x)], axis=-1)
    down = jnp.tensordot(state.a, rotor_flow(model, model.ground, x, y), 1)
    return down - answer_upflow(model, state.c[:, None], points)[0]


@eqx.filter_jit
def velocity(state: FiniteState, points: Float[Array, "*N 3"], model: FiniteStateModel) -> Float[Array, "*N 3"]:
    """Return the induced velocity at hub-frame points over R, in the hub frame over ΩR.

    On, above and below the disk, inside and outside the wake. The ground's part is its axial component only, as in the
    paper, and holds above the plane; beside surfaces, which the ground's flow has to go round, it is all three.
    """
    rotor = jnp.tensordot(state.a, rotor_velocity(model, model.ground, points), [[0], [1]])
    if model.surfaces is None:
        return jnp.moveaxis(rotor.at[2].add(answer_upflow(model, state.c[:, None], points)[0]), 0, -1)
    of_ground, of_panels = state.c[: len(model.sources)], state.c[len(model.sources) :]
    flow = rotor + beside.flow(model.surfaces, of_panels[:, None], points, model.ground)[:, 0]
    if model.ground is not None:
        flow = flow + jnp.tensordot(of_ground, level_velocity(model, model.ground, points), [[0], [1]])
    return jnp.moveaxis(flow, 0, -1)


@eqx.filter_jit
def inflow(
    state: FiniteState, r: Float[Array, " R"], psi: Float[Array, " K"], model: FiniteStateModel
) -> Float[Array, "K R"]:
    """Return λ over ΩR, positive down, at radii r (over R) and azimuths psi (rad), the ground's effect included."""
    return disk_inflow(state, r[None, :] * jnp.cos(psi)[:, None], r[None, :] * jnp.sin(psi)[:, None], model)


@eqx.filter_jit
def mean_inflow(state: FiniteState, model: FiniteStateModel) -> Float[Array, ""]:
    """Return the area-weighted mean of λ over the whole disk, over ΩR."""
    return rotor_means(model, model.ground) @ state.a - mean_upflow(model, state.c[:, None])[0]


@eqx.filter_jit
def ground_normal_velocity_rms(state: FiniteState, model: FiniteStateModel) -> Float[Array, ""]:
    """Return the rms of the normal velocity left on the plane over that of the flow into it, on the ground disk.

    Area-weighted; with a region on that part of the disk, weighted by its mask. Raises InputError where the model has
    no ground.
    """
    if model.ground is None:
        raise InputError("Argument `model` must have a ground, but its ground is None")
    into = state.a @ rotor_into_ground(model, model.ground)
    return relative_residual(state.c[: len(model.sources)], into, model, model.ground)


def relative_residual(
    c: Float[Array, " G"], into: Float[Array, " N"], model: FiniteStateModel, ground: Plane
) -> Float[Array, ""]:
    """Return the rms of what source states c leave of the flow `into` the ground disk's points, over that flow's."""
    x, y, nu, weights = (jnp.asarray(v, c.dtype) for v in model.quadrature.rule())
    mask = jnp.ones_like(x) if model.region is None else model.region.mask(*footprint(model, ground))
    area = nu * weights * mask
    left = mask * into - c @ self_flow(model.sources, x, y)
    return jnp.sqrt((area @ left**2) / (area @ (mask * into) ** 2))
