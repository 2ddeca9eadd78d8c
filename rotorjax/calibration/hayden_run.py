"""The whole calibration against Hayden: fits by three drivers, many starts, and what they leave behind."""

import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import jax.numpy as jnp
import numpy as np

from rotorjax.bench.cases import Case
from rotorjax.bench.dataset import select
from rotorjax.calibration import hayden
from rotorjax.calibration.calibration_file import Calibration, fit_entry
from rotorjax.calibration.drivers import FitProgress, Method
from rotorjax.calibration.fit import Fit, Many, calibrate, calibrate_many, even_starts
from rotorjax.calibration.hayden import HaydenData
from rotorjax.errors import InputError

STARTS = 8
DRIVERS = ("least_squares", "lbfgs", "adam")
STEPS = {"adam": 2000}  # enough to end within 1e-6 of least squares; the others' own numbers


@dataclass(frozen=True)
class HaydenRun:
    """Data and fits. fits: by driver, "least_squares" first; many: least squares from STARTS starts.

    wall_time_s: of all drivers and starts, compiled; compile_time_s: what the first evaluation took.
    """

    data: HaydenData
    loading: str
    fits: dict[str, Fit]
    many: Many
    wall_time_s: float
    compile_time_s: float

    @property
    def fit(self) -> Fit:
        """The least-squares fit."""
        return self.fits["least_squares"]

    @property
    def spread(self) -> float:
        """Largest difference of any start's end from the fit, over the parameters."""
        return float(np.max(np.abs(self.many.values - self.fit.values)))

    @property
    def disagreement(self) -> float:
        """Largest difference of another driver's values from least squares'."""
        return max(float(np.max(np.abs(f.values - self.fit.values))) for f in self.fits.values())

    def ratios(self, printed: bool = False) -> np.ndarray:
        """Inflow ratio at each height, fitted or with the default wake, (H,)."""
        values = hayden.PARAMETERS.printed if printed else self.all_values
        return np.asarray(hayden.inflow_ratio(self.data, *(jnp.asarray(v) for v in values)))

    @property
    def all_values(self) -> np.ndarray:
        """Radius and clearance, fitted or fixed."""
        return np.asarray(hayden.PARAMETERS.complete(jnp.asarray(self.fit.values), self.data.free, self.data.fixed))

    @property
    def printed_rms(self) -> float:
        """Rms of the default wake."""
        return float(np.sqrt(np.mean((self.ratios(printed=True) - np.asarray(self.data.targets)) ** 2)))


def run(
    heights: Sequence[float] = hayden.HEIGHTS,
    parameters: Sequence[str] = hayden.PARAMETERS.names,
    loading: hayden.Loading = "elliptic",
    tau: tuple[np.ndarray, np.ndarray] | None = None,
    progress: FitProgress | None = None,
    drivers: Sequence[Method] = DRIVERS,
    starts: int = STARTS,
) -> HaydenRun:
    """Fit with some drivers, "least_squares" among them, and from many starts.

    Other arguments and errors: as `hayden.hayden_data`.
    """
    data, chosen = hayden.hayden_data(heights, parameters, loading, tau)
    begun = time.perf_counter()
    fits = {n: calibrate(hayden.residual, chosen, data, None, n, STEPS.get(n), progress) for n in drivers}
    many = calibrate_many(hayden.residual, chosen, data, even_starts(chosen, starts))
    compiled = fits[drivers[0]].compile_time_s
    spent = time.perf_counter() - begun - compiled
    return HaydenRun(data, "free wake" if tau is not None else loading, fits, many, spent, compiled)


def loads_of(merged: Any, heights: Sequence[float]) -> tuple[np.ndarray, np.ndarray]:
    """Axisymmetric pressure coefficients of a study's level cases (H, M) and of the one out of ground effect (M,).

    Raises InputError where one of them is missing or did not converge.
    """
    rows = []
    for case in (*(Case(h) for h in heights), Case()):
        data = select(merged, case)
        if data is None or not bool(data["converged"]):
            raise InputError(f"Argument `heights` must be among the study's converged cases, but {case.name} is not")
        rows.append(data["vpbfsm_tau"].to_numpy()[:3])  # m = 0 comes first
    return np.array(rows[:-1]), rows[-1]


def record(result: HaydenRun) -> dict[str, Any]:
    """Content of calibration.json."""
    fit = result.fit
    return fit_entry(fit, "hayden", result.printed_rms) | {
        **hayden.PARAMETERS.table(result.all_values),
        "loading": result.loading,
        "heights": result.data.heights,
        "targets": result.data.targets,
        "inflow_ratio": result.ratios(),
        "inflow_ratio_default": result.ratios(printed=True),
        "drivers": {n: {"parameters": f.parameters.table(f.values), "rms_error": f.rms, "converged": f.converged}
                    for n, f in result.fits.items()},
        "largest_difference_of_drivers": result.disagreement,
        "starts": {"count": result.many.converged.size, "converged": int(result.many.converged.sum()),
                   "spread": result.spread, "wall_time_s": result.many.wall_time_s},
        "wall_time_s": result.wall_time_s,
        "compile_time_s": result.compile_time_s,
    }  # fmt: skip


def calibration_of(result: HaydenRun) -> Calibration:
    """The fit as a file keeps it."""
    values = hayden.PARAMETERS.table(result.all_values)
    about = {"loading": result.loading, "heights": [float(h) for h in result.data.heights], "free": result.data.free}
    return Calibration("hayden", values, result.fit.converged, result.fit.rms, about)


def report(result: HaydenRun) -> str:
    """What was fitted, as text for the screen."""
    fit, deviations = result.fit, result.fit.deviations
    lines = [f"Hayden's factor at constant thrust, {len(result.data.heights)} heights, loading: {result.loading}", ""]
    for name, value, deviation in zip(fit.parameters.names, fit.values, deviations, strict=True):
        lines.append(f"{name:<12}{value:.6f}" + (f" ± {deviation:.6f}" if np.isfinite(deviation) else ""))
    lines += ["", f"{'h/R':>6}{'Hayden':>10}{'fitted':>10}{'default':>16}"]
    rows = zip(result.data.heights, result.data.targets, result.ratios(), result.ratios(printed=True), strict=True)
    lines += [f"{h:6.2f}{t:10.4f}{ours:10.4f}{theirs:16.4f}" for h, t, ours, theirs in rows]
    lines += [
        f"{'rms':>6}{'':>10}{fit.rms:10.4f}{result.printed_rms:16.4f}",
        "",
        f"drivers agree to {result.disagreement:.1e}; {int(result.many.converged.sum())} of "
        f"{result.many.converged.size} starts converge, within {result.spread:.1e}",
        ("converged: " if fit.converged else "NOT CONVERGED: ") + fit.why,
        f"{result.wall_time_s:.1f} s, compiling {result.compile_time_s:.1f} s",
    ]
    return "\n".join(lines)
