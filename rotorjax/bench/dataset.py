"""All finished cases in one labelled data set, cases.nc: everything that figures, report and summary read."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import xarray as xr

from rotorjax.bench import finite_state
from rotorjax.bench.cases import Case
from rotorjax.bench.record import inflow_rms_difference, stations_at
from rotorjax.bench.settings import StudySettings
from rotorjax.bench.wake_file import STATE, case_of

TERMS = (1, 2, 3, 4, 5)  # pressure terms compared out of ground effect (Fig. 8a)


def combine(cases: Sequence[xr.Dataset], settings: StudySettings) -> xr.Dataset:
    """One data set with the dimension `case`, with `height` and `slope_deg` along it; missing values are NaN.

    Axisymmetric cases are repeated over the azimuths of the cases on a slope. Adds the rms differences, with all
    inflow over the free wake's mean out of ground effect (`reference_inflow`), and the inflow for one to five pressure
    terms where the case out of ground effect is among them.
    """
    reference = reference_inflow(cases)
    count = max(data.sizes["azimuth"] for data in cases)
    alike = [_uniform(data, count, reference) for data in cases]
    merged = xr.concat(alike, "case", join="outer", data_vars="all", coords="minimal", compat="override")
    labels = [case_of(data).name for data in cases]
    merged = (
        merged.assign_coords(case=("case", labels))
        .set_coords(["height", "slope_deg"])
        .assign(reference_inflow=((), reference, {"units": "1", "long_name": "free wake's mean inflow OGE over ΩR"}))
    )
    for data in cases:
        if case_of(data).height is None and "vpbfsm_inflow" in data:
            merged = merged.assign(terms_study(data, settings))
    merged.attrs = {"title": "Rotor inflow in ground effect", **cases[0].attrs}
    for name in ("case", "why"):
        merged.attrs.pop(name, None)
    return merged


def reference_inflow(cases: Sequence[xr.Dataset]) -> float:
    """The free wake's mean inflow out of ground effect, over ΩR; NaN where that case is missing."""
    found = [float(d["free_wake_mean_inflow"]) for d in cases if case_of(d).height is None]
    return found[0] if found else float("nan")


def select(merged: xr.Dataset, case: Case) -> xr.Dataset | None:
    """One case of the merged data set, or None where it is missing or lacks a sound solution of both models."""
    if case.name not in merged["case"].to_numpy() or "vpbfsm_inflow" not in merged:
        return None
    data = merged.sel(case=case.name)
    return data if bool(np.all(np.isfinite(data["vpbfsm_inflow"]))) else None


def present(merged: xr.Dataset) -> list[Case]:
    """The cases of the merged data set, in its order."""
    return [
        Case(None if np.isnan(h) else float(h), float(s))
        for h, s in zip(merged["height"].to_numpy(), merged["slope_deg"].to_numpy(), strict=True)
    ]


def terms_study(data: xr.Dataset, settings: StudySettings) -> dict[str, xr.Variable]:
    """Inflow out of ground effect for several numbers of pressure terms, and its rms difference to the free wake."""
    stations = stations_at(data, data["station_azimuth"].to_numpy())
    limited = replace(settings, radial_terms=max(TERMS))
    full = finite_state.from_loads(Case(), limited, data["free_wake_dct_dr"].to_numpy(), stations)
    modes = finite_state.model_of(Case(), limited).modes
    inflow, difference = [], {"vpbfsm": [], "printed": []}
    for terms in TERMS:
        tau = np.where(modes.n < 2 * terms + modes.m, np.asarray(full.tau), 0.0)  # each τ is what it is without others
        result = finite_state.of_pressure(Case(), limited, tau, stations)
        inflow.append(np.asarray(result.inflow_grid)[0])
        for model, field in (("vpbfsm", result.inflow), ("printed", result.printed_inflow)):
            shown = data.assign({f"{model}_inflow": (("station_azimuth", "radius"), np.asarray(field))})
            difference[model].append(inflow_rms_difference(shown, float(data["free_wake_mean_inflow"]), model))
    about = "VPBFSM out of ground effect by number of pressure terms: inflow over ΩR"
    rms = "rms difference to the free wake by number of pressure terms, over its mean inflow"
    return {
        "terms": xr.Variable("terms", np.array(TERMS), {"units": "1"}),
        "vpbfsm_inflow_by_terms": xr.Variable(("terms", "grid_radius"), inflow, {"units": "1", "long_name": about}),
    } | {
        f"{model}_rms_difference_by_terms": xr.Variable("terms", values, {"units": "1", "long_name": rms})
        for model, values in difference.items()
    }


def _uniform(data: xr.Dataset, count: int, reference: float) -> xr.Dataset:
    """One case on `count` azimuths, without the wake's state, with its differences."""
    for model in ("vpbfsm", "printed", "exact_image", *(["calibrated"] if "calibrated_inflow" in data else [])):
        value = inflow_rms_difference(data, reference, model)
        about = f"rms difference of the {model} inflow and the free wake's, 0.25 <= r/R <= 0.95, both over the OGE mean"
        data = data.assign(
            {
                f"{model}_inflow_rms_difference": (
                    (),
                    np.nan if value is None else value,
                    {"units": "1", "long_name": about},
                )
            }
        )
    data = data.drop_vars([n for n in data.variables if str(n).startswith(STATE)])
    data = data.assign(why=((), data.attrs["why"], {"long_name": "why the free wake's solver stopped"}))
    if data.sizes["azimuth"] < count:
        data = _repeat(data, count)
    return data


def _repeat(data: xr.Dataset, count: int) -> xr.Dataset:
    """An axisymmetric case at `count` azimuths: scalars repeated, tip vortices turned."""
    psi = 2 * np.pi / count * np.arange(count)
    attrs = data["azimuth"].attrs
    turned = _turned(data["tip_vortex"].to_numpy()[0], psi)
    data = data.isel(azimuth=np.zeros(count, int)).assign_coords(azimuth=("azimuth", psi, attrs))
    return data.assign(tip_vortex=(data["tip_vortex"].dims, turned, data["tip_vortex"].attrs))


def _turned(path: np.ndarray, psi: np.ndarray) -> np.ndarray:
    """Path (A, 3) turned about the shaft to each psi, (K, A, 3)."""
    c, s = np.cos(psi)[:, None], np.sin(psi)[:, None]
    x, y, z = np.moveaxis(path, -1, 0)
    return np.stack([c * x - s * y, s * x + c * y, np.broadcast_to(z, (psi.size, z.size))], axis=-1)
