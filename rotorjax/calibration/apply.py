"""A calibration at work: the calibrated model beside a solved case."""

from typing import Any

import jax.numpy as jnp
import numpy as np
import xarray as xr
from jaxtyping import Array, Float

from rotorjax.bench import finite_state
from rotorjax.bench.azimuth import valley_side
from rotorjax.bench.record import inflow_rms_difference, stations_at
from rotorjax.bench.settings import StudySettings
from rotorjax.bench.wake_file import case_of
from rotorjax.calibration.calibration_file import Calibration
from rotorjax.errors import InputError
from rotorjax.inflow.balance import Stations, blade_loads, self_consistent
from rotorjax.potential import loading
from rotorjax.potential.model import FiniteStateModel, disk_inflow, mean_inflow
from rotorjax.rotor.blade_element import rotor_coefficients


def add_calibrated(data: xr.Dataset, settings: StudySettings, calibration: Calibration) -> xr.Dataset:
    """Add the calibrated model to a solved case: `calibrated_inflow` at its stations and `calibrated_mean_inflow`.

    Where the case has a free wake, its blade loads drive the model; where it has none, those of the calibrated inflow
    itself, and `calibrated_CT` and `calibrated_CP_induced` are added too. Raises InputError where the case has no sound
    solution, the calibration is for another model, or no loading reproduces itself.
    """
    if "vpbfsm_tau" not in data:
        raise InputError("Argument `calibration` must be applied to a case that was solved, but this one was not")
    case = case_of(data)
    model = finite_state.model_of(case, settings)
    tau = jnp.asarray(data["vpbfsm_tau"].to_numpy())
    stations, numbers = _stations(data, settings), {}
    if "free_wake_inflow" not in data:
        tau, numbers = _self_consistent(tau, model, settings, stations, calibration)
    calibrated, state = calibration.apply(model, tau, settings.climb_ratio)
    field = disk_inflow(state, *stations.xy, calibrated)
    numbers |= {"mean_inflow": float(mean_inflow(state, calibrated))}
    about = f"VPBFSM calibrated ({calibration.set})"
    found: dict[str, Any] = {f"calibrated_{k}": ((), v, {"units": "1"}) for k, v in numbers.items()}
    long_name = {"units": "1", "long_name": f"{about}: inflow over ΩR, positive down"}
    found["calibrated_inflow"] = (("station_azimuth", "radius"), np.asarray(field), long_name)
    return data.assign(found)


def entry(data: xr.Dataset, reference: float | None, calibration: Calibration) -> dict[str, Any]:
    """What a calibration adds to the numbers of a case."""
    names = ("mean_inflow", "CT", "CP_induced")
    rms = None if reference is None else inflow_rms_difference(data, reference, "calibrated")
    numbers = {n: float(data[f"calibrated_{n}"]) for n in names if f"calibrated_{n}" in data}
    return {"set": calibration.set, "converged": calibration.converged, **numbers, "inflow_rms_difference": rms}


def table(data: xr.Dataset, reference: float | None, calibration: Calibration) -> str:
    """The calibrated model's numbers and inflow along the radius, as text."""
    found = entry(data, reference, calibration)
    lines = ["", f"VPBFSM calibrated: {calibration.set}, " + ", ".join(f"{k} {v:.4g}" for k, v in _values(calibration))]
    if not calibration.converged:
        lines.append("the calibration had NOT CONVERGED")
    shown = {"CT": "C_T", "CP_induced": "C_P, induced", "mean_inflow": "mean inflow/ΩR, calibrated",
             "inflow_rms_difference": "rms difference of the inflow, calibrated"}  # fmt: skip
    lines += [f"{text:<42}{found[name]:.5g}" for name, text in shown.items() if found.get(name) is not None]
    field = data["calibrated_inflow"].to_numpy()
    columns = {"mean": field.mean(axis=0)}
    if float(data["slope_deg"]):
        columns |= {"mountain": field[0], "valley": valley_side(field)}
    lines += ["", f"{'r/R':>8}" + "".join(f"{'calibrated ' + name:>22}" for name in columns)]
    for i, r in enumerate(data["radius"].to_numpy()):
        lines.append(f"{r:8.3f}" + "".join(f"{column[i]:22.5f}" for column in columns.values()))
    return "\n".join(lines)


def _values(calibration: Calibration) -> list[tuple[str, float]]:
    return [(k, float(v)) for k, v in calibration.parameters.items()]


def _stations(data: xr.Dataset, settings: StudySettings) -> Stations:
    if "panel_width" in data:
        return stations_at(data, data["station_azimuth"].to_numpy())
    r = data["radius"].to_numpy()
    width = (1 - float(settings.rotor.root_cutout)) / r.size  # equal panels of the VPBFSM alone
    return Stations(jnp.asarray(r), jnp.full(r.size, width), jnp.asarray(data["station_azimuth"].to_numpy()))


def _self_consistent(
    start: Float[Array, " M"],
    model: FiniteStateModel,
    settings: StudySettings,
    stations: Stations,
    calibration: Calibration,
) -> tuple[Float[Array, " M"], dict[str, float]]:
    """The pressure terms whose calibrated inflow gives them back, from those of the printed model."""
    rotor, operating, climb = settings.rotor, settings.operating, settings.climb_ratio

    def inflow_of(tau):
        return disk_inflow(calibration.apply(model, tau, climb)[1], *stations.xy, calibrated)

    calibrated = calibration.apply(model, start, climb)[0]
    tau, found = self_consistent(start, inflow_of, calibrated, rotor, operating, stations)
    if not bool(found) or not float(loading.thrust_coefficient(tau, model.modes)) > 0:
        raise InputError(
            "Argument `calibration` must let the rotor find a loading that thrusts upward, but with "
            + ", ".join(f"{k} = {v:.4g}" for k, v in _values(calibration))
            + " no steady one was found"
        )
    down = inflow_of(tau) + climb
    total = rotor_coefficients(rotor, blade_loads(down, rotor, operating, stations), stations.r, stations.widths)
    return tau, {"CT": float(total.thrust), "CP_induced": float(total.induced)}
