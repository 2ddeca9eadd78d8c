"""The VPBFSM of one case: driven by given blade loads, or by those of its own inflow; as printed, and exact image too.

What unit states make is evaluated once, at all places of a case, in a compiled function that every case over ground and
the balance of loads and inflow share: each separate evaluation of the Legendre functions costs half a second of
compilation and microseconds of work.
"""

from typing import Any, NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from rotorjax.bench.cases import Case
from rotorjax.bench.settings import StudySettings
from rotorjax.errors import InputError
from rotorjax.inflow.balance import Balance, StationFlow, Stations, axial_state, balance, pressure, stations_of
from rotorjax.limits import check_axial, check_flight
from rotorjax.potential import loading, rigid_cylinder
from rotorjax.potential.ground_source import DiskQuadrature
from rotorjax.potential.model import (
    FiniteState,
    FiniteStateModel,
    disk_inflow,
    finite_state_model,
    ground_normal_velocity_rms,
    mean_inflow,
    relative_residual,
    rotor_into_ground,
    unit_inflow,
    unit_states,
)

GRID_R = np.linspace(0.0, 1 - 1e-6, 64)  # 64 × 72 points for pictures: on the rim rounding says what is the disk
GRID_PSI = np.linspace(0.0, 2 * np.pi, 72, endpoint=False)
DIAMETER_PSI = np.array([0.0, np.pi])  # mountain side, valley side
PATCH = DiskQuadrature(48, 64)  # of the exact image's source patch on a slope


class FiniteStateResult(NamedTuple):
    """A steady VPBFSM solution and its fields; inflow λ over ΩR, positive down.

    tau (M,): pressure coefficients. states: rotor and ground. inflow, printed_inflow, exact_image_inflow, dct_dr (K,
    R): at the stations, of the default model, of the paper's own, of that over the exact image of its cylinder, and the
    loading that tau stands for. inflow_grid, dct_dr_grid (72, 64): on GRID_PSI × GRID_R. printed_diameter,
    exact_image_diameter (2, 64): on DIAMETER_PSI × GRID_R. mean_inflow, printed_mean_inflow, exact_image_mean_inflow:
    area-weighted over the whole disk. ground_normal_velocity_rms, printed_ground_normal_velocity_rms: velocity left on
    the ground inside the wake radius over the incoming flow, NaN without ground.
    """

    tau: Float[Array, " M"]
    states: FiniteState
    inflow: Float[Array, "K R"]
    printed_inflow: Float[Array, "K R"]
    exact_image_inflow: Float[Array, "K R"]
    dct_dr: Float[Array, "K R"]
    inflow_grid: Float[Array, "72 64"]
    dct_dr_grid: Float[Array, "72 64"]
    printed_diameter: Float[Array, "2 64"]
    exact_image_diameter: Float[Array, "2 64"]
    mean_inflow: Float[Array, ""]
    printed_mean_inflow: Float[Array, ""]
    exact_image_mean_inflow: Float[Array, ""]
    ground_normal_velocity_rms: Float[Array, ""]
    printed_ground_normal_velocity_rms: Float[Array, ""]


def model_of(case: Case, settings: StudySettings, printed: bool = False) -> FiniteStateModel:
    """The VPBFSM of a case, or the paper's own.

    Level ground has the slope's harmonics too: zero there, they share the compilation. Sources have as many terms as
    degrees up to 15 leave.
    """
    return finite_state_model(
        case.ground,
        harmonics=settings.harmonics,
        radial_terms=settings.radial_terms,
        ground_harmonics=settings.harmonics,
        ground_radial_terms=min(settings.source_terms, (14 - settings.harmonics) // 2 + 1),
        printed=printed,
    )


def models_of(case: Case, settings: StudySettings) -> tuple[FiniteStateModel, FiniteStateModel]:
    """The default model of a case, and the paper's own."""
    return model_of(case, settings), model_of(case, settings, printed=True)


def from_loads(case: Case, settings: StudySettings, dct_dr: np.ndarray, stations: Stations) -> FiniteStateResult:
    """The VPBFSM of a loading dC_T/dr̄ (K, R), or (1, R) where it is axisymmetric.

    Raises InputError where the loading holds numbers that are not finite, does not thrust upward, or has too few
    azimuths for the harmonics.
    """
    models = models_of(case, settings)
    model = models[0]
    loads = jnp.broadcast_to(jnp.asarray(dct_dr, float), (stations.psi.size, stations.r.size))
    if not bool(jnp.all(jnp.isfinite(loads))):
        raise InputError("Argument `dct_dr` must be finite throughout, but is not")
    tau = pressure(loads, stations, model)
    thrust = float(loading.thrust_coefficient(tau, model.modes))
    if thrust <= 0:
        raise InputError(f"Argument `dct_dr` must carry a positive thrust, but its C_T is {thrust:.3g}")
    return evaluate(models, tau, stations, jnp.asarray(settings.climb_ratio))


def of_pressure(case: Case, settings: StudySettings, tau: np.ndarray, stations: Stations) -> FiniteStateResult:
    """The VPBFSM of given pressure coefficients (M,) with positive thrust."""
    return evaluate(models_of(case, settings), jnp.asarray(tau), stations, jnp.asarray(settings.climb_ratio))


class UnitFlow(eqx.Module):
    """What a model's unit rotor states make. at: the stations. on_grid (M, 72, 64): inflow on GRID_PSI × GRID_R.
    into_ground (M, N): flow into the plane at the ground disk's points, None without ground.
    """

    at: StationFlow
    on_grid: Float[Array, "M 72 64"]
    into_ground: Float[Array, "M N"] | None


@eqx.filter_jit
def unit_flow(model: FiniteStateModel, stations: Stations) -> UnitFlow:
    """The costly part of a case, which neither blades nor loads change."""
    unit = unit_states(model)
    there, on_grid = _at_once(lambda x, y: unit_inflow(model, unit, x, y), stations.xy, _on_grid(GRID_PSI, stations))
    into = None if model.ground is None else rotor_into_ground(model, model.ground)
    return UnitFlow(StationFlow(unit, there), on_grid, into)


def evaluate(
    models: tuple[FiniteStateModel, FiniteStateModel],
    tau: Float[Array, " M"],
    stations: Stations,
    climb: Float[Array, ""],
    flow: UnitFlow | None = None,
) -> FiniteStateResult:
    """Steady states of a loading and all fields of `FiniteStateResult`.

    models: as `models_of` returns them. flow: of the first one, where it is at hand.
    """
    model, printed = models
    flow = unit_flow(model, stations) if flow is None else flow
    ours, theirs = _default(model, flow, tau, stations, climb), _printed(printed, tau, stations, climb)
    return FiniteStateResult(tau=tau, **ours, **theirs)


@eqx.filter_jit
def _default(model: FiniteStateModel, flow: UnitFlow, tau, stations: Stations, climb) -> dict[str, Any]:
    """The default model's part of the result."""
    unit = flow.at.unit
    state = axial_state(model, tau, climb, unit)
    left = jnp.asarray(jnp.nan, tau.dtype)
    if model.ground is not None and flow.into_ground is not None:
        left = relative_residual(state.c, state.a @ flow.into_ground, model, model.ground)
    grid_r, grid_psi = (jnp.asarray(v, tau.dtype) for v in (GRID_R, GRID_PSI))
    return {
        "states": state,
        "inflow": jnp.tensordot(state.a, flow.at.at, 1),
        "inflow_grid": jnp.tensordot(state.a, flow.on_grid, 1),
        "mean_inflow": (unit.down - unit.up) @ state.a,
        "dct_dr": loading.distribution(tau, stations.r, stations.psi, model.modes),
        "dct_dr_grid": loading.distribution(tau, grid_r, grid_psi, model.modes),
        "ground_normal_velocity_rms": left,
    }


@eqx.filter_jit
def _printed(model: FiniteStateModel, tau, stations: Stations, climb) -> dict[str, Any]:
    """The paper's own model and the exact image of its cylinder."""
    state = axial_state(model, tau, climb)
    across = _on_grid(DIAMETER_PSI, stations)
    paper = _at_once(lambda x, y: disk_inflow(state, x, y, model), stations.xy, across)
    mean = mean_inflow(state, model)
    if model.ground is None:
        exact, exact_mean, left = paper, mean, jnp.asarray(jnp.nan, tau.dtype)
    else:
        x, y, nu, weights = (jnp.asarray(v, tau.dtype) for v in model.quadrature.rule())
        *exact, over_disk = _at_once(
            lambda x, y: rigid_cylinder.disk_inflow(state, x, y, model, PATCH), stations.xy, across, (x, y)
        )
        exact_mean = (2 * nu * weights) @ over_disk  # r dr = −ν dν
        left = ground_normal_velocity_rms(state, model)
    return {
        "printed_inflow": paper[0],
        "printed_diameter": paper[1],
        "printed_mean_inflow": mean,
        "printed_ground_normal_velocity_rms": left,
        "exact_image_inflow": exact[0],
        "exact_image_diameter": exact[1],
        "exact_image_mean_inflow": exact_mean,
    }


def alone(case: Case, settings: StudySettings) -> tuple[FiniteStateResult, Balance]:
    """The VPBFSM with the blade-element loads of its own inflow (`inflow.balance`), and the rotor's coefficients.

    Raises InputError where no such loading is found, or the flight is beyond the model.
    """
    models = models_of(case, settings)
    guess = check_axial("vpbfsm", settings.rotor, settings.operating)
    stations = stations_of(settings.rotor)
    flow = unit_flow(models[0], stations)
    found = balance(models[0], settings.rotor, settings.operating, stations, guess, flow.at)
    check_flight("vpbfsm", float(found.CT), settings.climb_ratio)
    return evaluate(models, found.tau, stations, jnp.asarray(settings.climb_ratio), flow), found


def _on_grid(psi: np.ndarray, stations: Stations) -> tuple[Array, Array]:
    """Places at GRID_R on each of these azimuths, in the stations' precision."""
    r, azimuth = (jnp.asarray(v, stations.r.dtype) for v in (GRID_R, psi))
    return r * jnp.cos(azimuth)[:, None], r * jnp.sin(azimuth)[:, None]


def _at_once(function, *places: tuple[Array, Array]) -> list[Array]:
    """Evaluate function(x, y) at all places in one call and give each its own values back, behind other axes."""
    x, y = (jnp.concatenate([place[i].ravel() for place in places]) for i in (0, 1))
    ends = np.cumsum([place[0].size for place in places])[:-1]
    parts = jnp.split(function(x, y), ends, axis=-1)
    return [v.reshape(*v.shape[:-1], *place[0].shape) for v, place in zip(parts, places, strict=True)]
