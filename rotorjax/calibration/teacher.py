"""The free wake as teacher: its inflow over heights and slopes, and the finite-state model's difference from it.

The lessons are the cases of a finished study (`rotorjax study`, cases.nc), computed once: each holds the free wake's
inflow and the pressure coefficients of its blade loads. Some cases are held out of the fit, for the verdict.
"""

import os
from collections.abc import Sequence
from dataclasses import replace
from json import loads
from pathlib import Path

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import xarray as xr
from jaxtyping import Array, Float

from rotorjax.bench.cases import SLOPE_HEIGHT, Case
from rotorjax.bench.dataset import present, select
from rotorjax.bench.record import annulus_shares
from rotorjax.calibration.parameters import ParameterSet
from rotorjax.calibration.taught import PARAMETERS, taught_model, taught_state
from rotorjax.errors import InputError
from rotorjax.ground import Plane
from rotorjax.io import netcdf
from rotorjax.potential.ground_source import DiskQuadrature
from rotorjax.potential.model import FiniteStateModel, disk_inflow, finite_state_model

FAR = 1e4  # a stand-in height where there is no ground; its effect is masked


class Lessons(eqx.Module):
    """C cases on one grid of K azimuths and R radii.

    names (static). model: a level model, its ground replaced in each case. fixed (P,): values of parameters that are
    not fitted; free (static): names of those that are. heights, slopes, over_ground (C,): over R, rad, 1 or 0 (out of
    ground effect). tau (C, M): pressure coefficients of the free wake's loads. inflow (C, K, R): the free wake's, over
    `reference`, its mean out of ground effect (over ΩR). r (R,), psi (K,): stations. weights (R,): area, summing to 1/K
    over the annulus that is compared, 0 elsewhere.
    """

    names: tuple[str, ...] = eqx.field(static=True)
    model: FiniteStateModel
    fixed: Float[Array, " P"]
    free: tuple[str, ...] = eqx.field(static=True)
    heights: Float[Array, " C"]
    slopes: Float[Array, " C"]
    over_ground: Float[Array, " C"]
    tau: Float[Array, "C M"]
    inflow: Float[Array, "C K R"]
    reference: Float[Array, ""]
    r: Float[Array, " R"]
    psi: Float[Array, " K"]
    weights: Float[Array, " R"]

    def choose(self, names: Sequence[str]) -> "Lessons":
        """The cases of these names. Raises InputError where one is missing, or there are none."""
        if missing := [n for n in names if n not in self.names]:
            raise InputError(f"Argument `held` must name cases among {', '.join(self.names)}, but holds {missing[0]!r}")
        if not names:
            raise InputError("Argument `held` must leave at least one case to each side, but leaves none")
        rows = np.array([self.names.index(n) for n in names])
        return replace(
            self,
            names=tuple(names),
            heights=self.heights[rows],
            slopes=self.slopes[rows],
            over_ground=self.over_ground[rows],
            tau=self.tau[rows],
            inflow=self.inflow[rows],
        )


def find_cases(path: str | Path) -> xr.Dataset:
    """Read cases.nc, or the one in a study's folder. Raises InputError where it is not there or not a study's."""
    path = Path(path)
    merged = netcdf.read(path / "cases.nc" if os.path.isdir(path) else path)
    needed = ("free_wake_inflow", "vpbfsm_tau", "reference_inflow", "converged", "height", "slope_deg", "panel_width")
    if lacking := [n for n in needed if n not in merged]:
        raise InputError(f"{path}: the file must be the cases.nc of a study, but lacks {lacking[0]}")
    return merged


def lessons(merged: xr.Dataset, parameters: Sequence[str] = PARAMETERS.names) -> tuple[Lessons, ParameterSet]:
    """Make the lessons of a study's merged data set, and the parameters to fit.

    Cases that did not converge teach nothing and are left out. Raises InputError where no case is left, there is none
    out of ground effect (the reference), or a parameter's name is unknown.
    """
    chosen = PARAMETERS.subset(parameters)
    reference = float(merged["reference_inflow"])
    if not np.isfinite(reference):
        raise InputError("Argument `cases` must hold the case out of ground effect, but it is missing")
    cases = [c for c in present(merged) if _usable(merged, c)]
    if not cases:
        raise InputError("Argument `cases` must hold at least one converged case, but none did converge")
    rows = merged.sel(case=[c.name for c in cases])
    r, widths = rows["radius"].to_numpy(), rows["panel_width"].to_numpy()[0]
    psi = rows["station_azimuth"].to_numpy()
    data = Lessons(
        names=tuple(c.name for c in cases),
        model=_model(merged),
        fixed=jnp.asarray(PARAMETERS.printed),
        free=chosen.names,
        heights=jnp.asarray([c.height or FAR for c in cases]),
        slopes=jnp.deg2rad(jnp.asarray([c.slope_deg for c in cases])),
        over_ground=jnp.asarray([float(c.height is not None) for c in cases]),
        tau=jnp.asarray(rows["vpbfsm_tau"].to_numpy()),
        inflow=jnp.asarray(rows["free_wake_inflow"].to_numpy() / reference),
        reference=jnp.asarray(reference),
        r=jnp.asarray(r),
        psi=jnp.asarray(psi),
        weights=jnp.asarray(annulus_shares(widths) / psi.size),
    )
    return data, chosen


def default_held(names: Sequence[str]) -> tuple[str, ...]:
    """Cases to hold out: every second height and every second slope at h = 1 but the last, and all other slopes.

    Ordered from the ground up and from level to steep; what is left spans the range, so that the held-out cases are
    asked of what lies between, and of slopes at heights that were not taught.
    """
    level = sorted((n for n in names if n.startswith("h") and "slope" not in n), key=lambda n: float(n[1:]))
    start = f"h{SLOPE_HEIGHT:g}-slope"
    slopes = sorted((n for n in names if n.startswith(start)), key=lambda n: float(n[len(start) :]))
    others = [n for n in names if "slope" in n and n not in slopes]
    return (*level[1:-1:2], *slopes[1:-1:2], *others)


@eqx.filter_jit
def inflow(values: Float[Array, " P"], data: Lessons) -> Float[Array, "C K R"]:
    """Return the taught model's inflow of every case, over the reference; values: all of PARAMETERS, in order."""
    x, y = data.r * jnp.cos(data.psi)[:, None], data.r * jnp.sin(data.psi)[:, None]

    def one(height, slope, over_ground, tau):
        model = taught_model(eqx.tree_at(lambda m: m.ground, data.model, Plane(height, slope)), values)
        state = taught_state(model, tau, values)
        state = eqx.tree_at(lambda s: s.c, state, over_ground * state.c)
        return disk_inflow(state, x, y, model) / data.reference

    return jax.vmap(one)(data.heights, data.slopes, data.over_ground, data.tau)


def rms_difference(found: Float[np.ndarray, "C K R"], data: Lessons) -> Float[np.ndarray, " C"]:
    """Return each case's area-weighted rms difference from the free wake, as the study's inflow_rms_difference.

    found: as `inflow` returns it.
    """
    return np.sqrt(np.einsum("ckr,r->c", (found - np.asarray(data.inflow)) ** 2, np.asarray(data.weights)))


@eqx.filter_jit
def residual(values: Float[Array, " F"], data: Lessons) -> Float[Array, " N"]:
    """Return weighted differences whose rms is that of `rms_difference` over the cases; values: of data.free."""
    difference = inflow(PARAMETERS.complete(values, data.free, data.fixed), data) - data.inflow
    return (difference * jnp.sqrt(data.weights * data.r.size * data.psi.size)).ravel()


def _usable(merged: xr.Dataset, case: Case) -> bool:
    data = select(merged, case)
    return data is not None and bool(data["converged"]) and bool(np.all(np.isfinite(data["free_wake_inflow"])))


def _model(merged: xr.Dataset) -> FiniteStateModel:
    """The study's VPBFSM over level ground; 16 azimuths of the quadrature are exact to 1e-9 for two harmonics."""
    settings = loads(merged.attrs.get("settings", "{}"))
    try:
        radial, harmonics, sources = (
            int(settings[f"vpbfsm.{n}"]) for n in ("radial_terms", "harmonics", "source_terms")
        )
    except KeyError as error:
        raise InputError(f"Argument `cases` must carry the study's settings, but lacks {error.args[0]}") from None
    return finite_state_model(
        Plane(jnp.asarray(1.0), jnp.asarray(0.0)),
        harmonics=harmonics,
        radial_terms=radial,
        ground_harmonics=harmonics,
        ground_radial_terms=sources,
        quadrature=DiskQuadrature(24, max(16, 4 * harmonics + 4)),
    )
