"""A small study whose free wake is the finite-state model itself with known corrections: the fit must find them."""

import json
from functools import cache

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import xarray as xr

from rotorjax.bench.cases import study_cases
from rotorjax.calibration.taught import PARAMETERS, taught_model, taught_state
from rotorjax.potential.model import disk_inflow, finite_state_model

TRUTH = {
    "radius": 0.82,
    "length": 0.3,
    "clearance": 0.5,
    "mean_gain": 1.13,
    "third_gain": 0.9,
    "slope_share": 0.4,
}
REFERENCE = 0.06
R, PSI = np.linspace(0.2, 0.98, 9), 2 * np.pi / 8 * np.arange(8)


@eqx.filter_jit
def field_of(model, tau, values, x, y):
    """Inflow of a corrected model."""
    model = taught_model(model, values)
    return disk_inflow(taught_state(model, tau, values), x, y, model)


@cache  # not to be written into
def known_study(noise: float = 0.0) -> xr.Dataset:
    """cases.nc as a study writes it, as far as a calibration reads it."""
    if noise:
        known = known_study()
        field = known["free_wake_inflow"]
        wobble = noise * np.random.default_rng(0).standard_normal(field.shape)
        return known.assign(free_wake_inflow=field + REFERENCE * wobble)
    cases = study_cases((0.5, 0.75, 1.0, 1.5, 2.0), (10.0, 20.0, 30.0))
    values, fields, taus = PARAMETERS.vector(TRUTH), [], []
    x, y = jnp.asarray(R * np.cos(PSI)[:, None]), jnp.asarray(R * np.sin(PSI)[:, None])
    for i, case in enumerate(cases):
        model = finite_state_model(case.ground, harmonics=1, ground_harmonics=1, ground_radial_terms=4)
        tau = jnp.zeros(9).at[:4].set(jnp.array([2.6e-3, -9e-4 + 2e-5 * i, 3e-4 - 2e-5 * i, 1e-5 * i]))
        fields.append(np.asarray(field_of(model, tau, values, x, y)))
        taus.append(np.asarray(tau))
    heights = [np.nan if c.height is None else c.height for c in cases]
    grid, count = ("case", "station_azimuth", "radius"), len(cases)
    data = xr.Dataset(
        {
            "free_wake_inflow": (("case", "azimuth", "radius"), np.array(fields)),
            "vpbfsm_inflow": (grid, np.array(fields)),
            "vpbfsm_tau": (("case", "mode"), np.array(taus)),
            "panel_width": (("case", "radius"), np.full((count, R.size), 0.0975)),
            "height": ("case", heights),
            "slope_deg": ("case", [c.slope_deg for c in cases]),
            "converged": ("case", np.ones(count)),
            "reference_inflow": ((), REFERENCE),
        },
        coords={"case": [c.name for c in cases], "radius": R, "station_azimuth": PSI, "azimuth": PSI},
    )
    settings = {"vpbfsm.radial_terms": 3, "vpbfsm.harmonics": 1, "vpbfsm.source_terms": 4}
    data.attrs = {"settings": json.dumps(settings), "fingerprint": "made up"}
    return data
