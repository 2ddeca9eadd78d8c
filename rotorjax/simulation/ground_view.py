"""The ground along a flight as the hub sees it."""

import jax
import jax.numpy as jnp
import numpy as np
import xarray as xr

from rotorjax.ground import TurnedPlane
from rotorjax.rotor.hub import RotorInputs


def ground_arrays(u: RotorInputs, slope_deg: float) -> dict[str, xr.DataArray]:
    """Height, normal in the hub frame and the rim's clearance over time, of inputs with a leading axis T."""

    def at(u):
        ground = TurnedPlane(u.height, jnp.deg2rad(slope_deg), u.turn)
        return u.height, ground.normal, ground.clearance

    told = {
        "height": "hub above ground over R, straight down",
        "ground_normal": "up out of the ground, hub frame",
        "clearance": "disk's rim above ground over R",
    }
    dims = (("time",), ("time", "axis"), ("time",))
    found = zip(told.items(), dims, jax.vmap(at)(u), strict=True)
    return {name: xr.DataArray(np.asarray(v), dims=d, attrs={"long_name": words}) for (name, words), d, v in found}


def ground_line(x: np.ndarray, data: xr.Dataset, at: int) -> np.ndarray:
    """Height z (over R) of the ground x aft of the hub, in the plane of shaft and nose, at time step `at`."""
    normal, height = data["ground_normal"].values[at], float(data["height"].values[at])
    return -(height * np.cos(np.deg2rad(data.attrs["slope_deg"])) + normal[0] * x) / normal[2]
