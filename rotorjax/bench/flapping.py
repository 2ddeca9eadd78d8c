"""A case with blades that flap as a data set, beside the rigid blades it started from."""

from dataclasses import replace

import numpy as np
import xarray as xr

from rotorjax.bench import wake_file
from rotorjax.bench.cases import Case
from rotorjax.bench.settings import StudySettings
from rotorjax.wake.solution import Solution

RIGID = {
    "rigid_CT": ("CT", "rigid blades: thrust coefficient T/(ρA(ΩR)²)"),
    "rigid_CP_induced": ("CP_induced", "rigid blades: induced part of the power coefficient"),
    "rigid_mean_inflow": (
        "mean_inflow",
        "rigid blades: mean induced inflow over ΩR, by area over what the blades sweep",
    ),
}


def flapping_dataset(
    case: Case, rigid: Solution, freed: Solution, flap: np.ndarray, settings: StudySettings
) -> xr.Dataset:
    """Pack a solution with freed blades and their flap angles (K,) in rad; numbers of the rigid blades go along.

    The wake's state stays that of the rigid blades, from which a neighbouring case starts.
    """
    data = wake_file.to_dataset(case, replace(freed, state=rigid.state), settings)
    about = "flap angle of the blade at this azimuth in rad, up positive"
    data["flap"] = ("azimuth", flap, {"units": "rad", "long_name": about})
    climb = {"mean_inflow": settings.climb_ratio}
    for name, (attribute, about) in RIGID.items():
        value = getattr(rigid, attribute) - climb.get(attribute, 0.0)
        data[name] = ((), value, {"units": "1", "long_name": about})
    return data


def flap_harmonics_deg(data: xr.Dataset) -> tuple[float, float, float]:
    """β₀, β₁c, β₁s of a case in degrees."""
    flap, psi = np.rad2deg(data["flap"].to_numpy()), data["azimuth"].to_numpy()
    mean = float(flap.mean())
    left = flap - mean  # none where the case is axisymmetric
    return mean, float(2 * np.mean(left * np.cos(psi))), float(2 * np.mean(left * np.sin(psi)))
