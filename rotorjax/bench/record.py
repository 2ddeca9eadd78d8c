"""One finished case as a labelled data set (both models), and its entry in summary.json."""

from typing import Any

import jax.numpy as jnp
import numpy as np
import xarray as xr

from rotorjax.bench import finite_state
from rotorjax.bench.finite_state import FiniteStateResult, Stations
from rotorjax.bench.flapping import RIGID, flap_harmonics_deg
from rotorjax.bench.settings import StudySettings
from rotorjax.bench.wake_file import case_of, is_sound, lost_at
from rotorjax.potential.modes import ModeTable

COMPARED = (0.25, 0.95)  # radii over R between which the distributions are compared

# name in the data set: (attribute of the result, dimensions, description)
FIELDS: dict[str, tuple[str, tuple[str, ...], str]] = {
    "vpbfsm_tau": ("tau", ("mode",), "VPBFSM: pressure coefficients τ (Eq. 2)"),
    "vpbfsm_inflow": ("inflow", ("station_azimuth", "radius"), "VPBFSM: inflow over ΩR, positive down"),
    "printed_inflow": (
        "printed_inflow",
        ("station_azimuth", "radius"),
        "VPBFSM as printed in the paper: inflow over ΩR, positive down",
    ),
    "exact_image_inflow": (
        "exact_image_inflow",
        ("station_azimuth", "radius"),
        "VPBFSM as printed, over the exact image of its wake: inflow over ΩR, positive down",
    ),
    "vpbfsm_dct_dr": ("dct_dr", ("station_azimuth", "radius"), "loading of the pressure terms: dC_T/d(r/R)"),
    "vpbfsm_inflow_grid": (
        "inflow_grid",
        ("grid_azimuth", "grid_radius"),
        "VPBFSM: inflow over ΩR on a grid",
    ),
    "vpbfsm_dct_dr_grid": ("dct_dr_grid", ("grid_azimuth", "grid_radius"), "loading of the pressure terms on a grid"),
    "printed_inflow_diameter": (
        "printed_diameter",
        ("side", "grid_radius"),
        "VPBFSM as printed: inflow over ΩR on the mountain (0) and valley (1) side",
    ),
    "exact_image_inflow_diameter": (
        "exact_image_diameter",
        ("side", "grid_radius"),
        "VPBFSM over the exact image: inflow over ΩR on the mountain (0) and valley (1) side",
    ),
    "vpbfsm_mean_inflow": ("mean_inflow", (), "VPBFSM: mean inflow over ΩR, by area over the whole disk"),
    "printed_mean_inflow": (
        "printed_mean_inflow",
        (),
        "VPBFSM as printed: mean inflow over ΩR, by area over the whole disk",
    ),
    "exact_image_mean_inflow": (
        "exact_image_mean_inflow",
        (),
        "VPBFSM, exact image: mean inflow over ΩR",
    ),
    "vpbfsm_ground_normal_velocity_rms": (
        "ground_normal_velocity_rms",
        (),
        "VPBFSM: rms normal velocity left on the ground inside the wake radius over that of the incoming flow",
    ),
    "printed_ground_normal_velocity_rms": (
        "printed_ground_normal_velocity_rms",
        (),
        "VPBFSM as printed: rms normal velocity left on the ground inside the wake radius over that of the incoming "
        "flow",
    ),
}
MODELS = {"printed": "printed", "default": "vpbfsm"}  # in summary.json: name of the variables in the data set


def stations_of(data: xr.Dataset, settings: StudySettings) -> Stations:
    """The free wake's radii, at as many azimuths as its cases on a slope have, so that all cases share one grid."""
    psi = 2 * np.pi / settings.wake.azimuths * np.arange(settings.wake.azimuths)
    if data.sizes["azimuth"] not in (1, psi.size):
        psi = data["azimuth"].to_numpy()
    return stations_at(data, psi)


def stations_at(data: xr.Dataset, psi: np.ndarray) -> Stations:
    """The radii and panel widths of a data set at azimuths psi (rad)."""
    return Stations(*(jnp.asarray(v, float) for v in (data["radius"].to_numpy(), data["panel_width"].to_numpy(), psi)))


def add_finite_state(data: xr.Dataset, settings: StudySettings) -> xr.Dataset:
    """Add the VPBFSM driven by the free wake's loads; unchanged where these cannot drive it or are another case's."""
    if not is_sound(data) or lost_at(data) is not None:
        return data
    stations = stations_of(data, settings)
    result = finite_state.from_loads(case_of(data), settings, data["free_wake_dct_dr"].to_numpy(), stations)
    return data.assign(variables_of(result, stations, finite_state.model_of(case_of(data), settings).modes))


def variables_of(result: FiniteStateResult, stations: Stations, modes: ModeTable) -> dict[str, Any]:
    """A VPBFSM result as labelled variables with their grids. modes: of its pressure coefficients."""
    labels = [f"m = {mode.m}, n = {mode.n}, {mode.kind}" for mode in modes.modes]
    grid = {
        "mode": ("mode", labels, {"long_name": "pressure terms: harmonic m, degree n, cosine or sine"}),
        "station_azimuth": ("station_azimuth", np.asarray(stations.psi), {"units": "rad"}),
        "grid_azimuth": ("grid_azimuth", finite_state.GRID_PSI, {"units": "rad"}),
        "grid_radius": ("grid_radius", finite_state.GRID_R, {"units": "1", "long_name": "radius over R"}),
    }
    found = {
        name: (dims, np.asarray(getattr(result, attribute)), {"units": "1", "long_name": about})
        for name, (attribute, dims, about) in FIELDS.items()
    }
    return grid | found


def rms_difference(
    ours: np.ndarray, theirs: np.ndarray, widths: np.ndarray, between: tuple[float, float] = COMPARED
) -> float:
    """Area-weighted rms of the difference of two distributions (K, R) over the annulus `between` (radii over R)."""
    weights = annulus_shares(widths, between)
    return float(np.sqrt(np.mean(np.sum(weights * (ours - theirs) ** 2, axis=-1))))


def annulus_shares(widths: np.ndarray, between: tuple[float, float] = COMPARED) -> np.ndarray:
    """Share of an annulus (radii over R) in each panel of a blade that ends at the tip, (R,); they sum to one.

    By what lies inside of each: whole panels, taken or left by their middles, made a first harmonic over a slope change
    by a tenth from 14 panels to 16. NaN where no panel reaches into it.
    """
    edges = 1 - np.concatenate([np.cumsum(widths[::-1])[::-1], [0.0]])
    area = np.diff(np.clip(edges, *between) ** 2)
    with np.errstate(invalid="ignore"):
        return area / area.sum()


def inflow_rms_difference(data: xr.Dataset, reference: float, model: str = "vpbfsm") -> float | None:
    """Rms difference of a model's inflow ("vpbfsm", "printed", …) and the free wake's, both over `reference`."""
    if f"{model}_inflow" not in data or "free_wake_inflow" not in data:
        return None
    ours, theirs = data[f"{model}_inflow"].to_numpy(), data["free_wake_inflow"].to_numpy()
    return rms_difference(ours / reference, theirs / reference, data["panel_width"].to_numpy())


def summary_entry(data: xr.Dataset, reference: float | None) -> dict[str, Any]:
    """The entry of a case in summary.json; reference: the free wake's mean inflow out of ground effect, over ΩR."""
    case = case_of(data)
    return {
        "height": case.height,
        "slope_deg": case.slope_deg,
        "free_wake": _free_wake_entry(data) if "free_wake_inflow" in data else None,
        "vpbfsm": _finite_state_entry(data) if "vpbfsm_inflow" in data else None,
        "finite_state": _models_entry(data, reference) if "vpbfsm_inflow" in data else None,
        "inflow_rms_difference": None if reference is None else inflow_rms_difference(data, reference),
        "wall_time_s": float(data["wall_time_s"]),
        "compile_time_s": float(data["compile_time_s"]),
        **({"flapping": _flapping_entry(data)} if "flap" in data else {}),
    }


def _models_entry(data: xr.Dataset, reference: float | None) -> dict[str, dict[str, float | None]]:
    return {
        title: {
            "mean_inflow": float(data[f"{name}_mean_inflow"]),
            "inflow_rms_difference": None if reference is None else inflow_rms_difference(data, reference, name),
            "ground_normal_velocity_rms": float(data[f"{name}_ground_normal_velocity_rms"]),
        }
        for title, name in MODELS.items()
    }


def _flapping_entry(data: xr.Dataset) -> dict[str, Any]:
    angles = zip(("beta_0_deg", "beta_1c_deg", "beta_1s_deg"), flap_harmonics_deg(data), strict=True)
    return dict(angles) | {name: float(data[name]) for name in RIGID}


def _free_wake_entry(data: xr.Dataset) -> dict[str, Any]:
    return {
        **_numbers(data, "CT", "CP_induced"),
        "mean_inflow": float(data["free_wake_mean_inflow"]),
        "residual": float(data["free_wake_residual"]),
        "converged": bool(data["converged"]),
        "ground_normal_velocity_rms": float(data["free_wake_ground_normal_velocity_rms"]),
        **_numbers(data, "CP", "CP_profile"),
        "lost_at": lost_at(data),
    }


def _finite_state_entry(data: xr.Dataset) -> dict[str, Any]:
    entry = {
        "mean_inflow": float(data["vpbfsm_mean_inflow"]),
        "ground_normal_velocity_rms": float(data["vpbfsm_ground_normal_velocity_rms"]),
    }
    if "free_wake_inflow" not in data:  # its own blade loads: what the free wake's entry holds otherwise
        entry |= _numbers(data, "CT", "CP_induced", "CP", "CP_profile")
    return entry


def _numbers(data: xr.Dataset, *names: str) -> dict[str, float]:
    return {name: float(data[name]) for name in names}
