"""The free wake calibrated against a measured rotor: fit to some quantities, verdict on those held out."""

import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float
from scipy.optimize import least_squares

from rotorjax.bench.settings import study_settings
from rotorjax.calibration.calibration_file import Calibration, fit_entry
from rotorjax.calibration.drivers import FitProgress
from rotorjax.calibration.fit import Fit, conclude, judge
from rotorjax.calibration.measured import (
    COLLECTIVE_DEG,
    MARGINS,
    PARAMETERS,
    ROTOR,
    Measurements,
    measurements,
    sensitivities,
    with_values,
)
from rotorjax.calibration.parameters import ParameterSet
from rotorjax.errors import InputError
from rotorjax.wake.model import FreeWake, free_wake
from rotorjax.wake.preconditioner import harmonic_inverse
from rotorjax.wake.solution import Solution, solve

FREE = ("release",)
"""What is fitted by default: where the wake rolls up. Cores, and the decay of the inner sheet, run to their bounds
beside it, and what is held out gets worse."""
FITTED = ("CT", "z")
"""What is fitted to by default; section lift and the vortex's radius are held out."""
TOLERANCE = 1e-9  # of the wakes, so that the fit sees no noise
LOST = 1e3  # residual where a wake did not converge: the step is taken back


@dataclass(frozen=True)
class MeasuredRun:
    """Data, fit and what it does. taught (N,): rows that were fitted. before, after (N,): the wake's numbers."""

    data: Measurements
    taught: np.ndarray
    fit: Fit
    before: np.ndarray
    after: np.ndarray
    solution: Solution

    def rms(self, numbers: Float[np.ndarray, " N"], taught: bool) -> float:
        """Rms difference from the measurement over the allowed one, of what was fitted or held out; NaN for none."""
        rows = self.taught == taught
        apart = (numbers - self.data.target) / self.data.margin
        return float(np.sqrt(np.mean(apart[rows] ** 2))) if rows.any() else float("nan")


class _Wake:
    """The wake as a function of its parameters, each solved from the last one that converged."""

    def __init__(self, base: FreeWake, data: Measurements, names: tuple[str, ...], rows: np.ndarray):
        self.base, self.data, self.names, self.rows = base, data, names, rows
        self.solution: Solution | None = None
        self.numbers = np.full(len(data.names), np.nan)
        self.slopes = np.zeros((len(data.names), len(names)))
        self.history: list[float] = []
        self.progress: FitProgress | None = None
        self._at: tuple[float, ...] = ()

    def residual(self, values: Float[np.ndarray, " P"]) -> np.ndarray:
        """Differences over their margins, of the rows that are fitted."""
        found = solve(with_values(self.base, self.names, jnp.asarray(values)), self.solution, tol=TOLERANCE)
        if not found.converged:
            return np.full(int(self.rows.sum()), LOST)
        self.solution = found
        inverse = jnp.real(harmonic_inverse(found.model, found.unknowns, 1).inverse[0])
        self.numbers, self.slopes = map(np.asarray, sensitivities(self.names, found.model, found.unknowns, inverse))
        apart = ((self.numbers - self.data.target) / self.data.margin)[self.rows]
        self.history.append(float(np.sqrt(np.mean(apart**2))))
        if self.progress is not None:
            self.progress(len(self.history), self.history[-1])
        self._at = tuple(values)
        return apart

    def jacobian(self, values: Float[np.ndarray, " P"]) -> np.ndarray:
        """Its derivative, through the periodic wake."""
        if self._at != tuple(values):
            self.residual(values)
        return (self.slopes / self.data.margin[:, None])[self.rows]


def check(parameters: Sequence[str], fitted: Sequence[str]) -> tuple[ParameterSet, np.ndarray]:
    """The parameters, and which rows are fitted. Raises InputError where a name is unknown or data are too few."""
    chosen, rows = PARAMETERS.subset(parameters), measurements().rows(tuple(fitted))
    if len(chosen) > rows.sum():
        raise InputError(
            f"Argument `parameters` must be no more than the data, but there are {len(chosen)} and {rows.sum()} data"
        )
    return chosen, rows


def run(
    parameters: Sequence[str] = FREE,
    fitted: Sequence[str] = FITTED,
    quick: bool = False,
    max_steps: int = 40,
    progress: FitProgress | None = None,
) -> MeasuredRun:
    """Fit settings of the free wake to Caradonna and Tung's rotor by least squares (trust region, exact derivatives).

    parameters: of PARAMETERS. fitted: of MARGINS; the others are held out. quick: the coarser wake. Raises InputError
    as `check` does, and where the wake does not converge to begin with.
    """
    begun = time.perf_counter()
    chosen, rows = check(parameters, fitted)
    data = measurements()
    settings = study_settings(ROTOR, COLLECTIVE_DEG, quick=quick)
    wake = _Wake(free_wake(settings.rotor, settings.operating, None, settings.wake), data, chosen.names, rows)
    wake.progress = progress
    start = chosen.printed
    wake.residual(start)
    if wake.solution is None:
        raise InputError("Argument `parameters` must start from a wake that converges, but the default one does not")
    before, compiled = wake.numbers, time.perf_counter() - begun
    found = least_squares(
        wake.residual,
        start,
        wake.jacobian,  # type: ignore[arg-type]  (the stubs know the names of difference schemes only)
        (chosen.lower, chosen.upper),
        x_scale=chosen.upper - chosen.lower,
        max_nfev=max_steps,
        ftol=1e-10,
        xtol=1e-8,
        gtol=1e-10,
    )
    end = wake.residual(found.x)
    fit = _fit(chosen, found.x, end, wake.jacobian(found.x), wake.history, time.perf_counter() - begun, compiled)
    return MeasuredRun(data, rows, fit, before, wake.numbers, wake.solution)


def _fit(chosen: ParameterSet, values, end, jacobian, history, wall: float, compiled: float) -> Fit:
    """The verdict on a fit, from the residual and its derivative at the end."""
    verdict = judge(chosen, end, jacobian)
    converged, why = conclude(chosen, values, verdict)
    at_bound = chosen.at_bound(values)
    method = "trust region, exact derivatives"
    return Fit(
        chosen,
        values,
        verdict.rms,
        verdict.covariance,
        converged,
        why,
        at_bound,
        np.array(history),
        method,
        wall,
        compiled,
    )


def report(result: MeasuredRun) -> str:
    """What was fitted, as text for the screen."""
    fit = result.fit
    lines = [f"Free wake against {ROTOR} at {COLLECTIVE_DEG:g} deg: {int(result.taught.sum())} numbers fitted, "
             f"{int((~result.taught).sum())} held out", ""]  # fmt: skip
    lines += [
        f"{n:<22}{v:9.4g} ± {d:.2g}   (default {p:.4g})"
        for n, v, d, p in zip(fit.parameters.names, fit.values, fit.deviations, fit.parameters.printed, strict=True)
    ]
    lines += ["", f"{'':<40}{'measured':>10}{'default':>10}{'fitted':>10}"]
    for name, taught, target, before, after in zip(
        result.data.names, result.taught, result.data.target, result.before, result.after, strict=True
    ):
        lines.append(f"{name + ('' if taught else ' (held out)'):<40}{target:10.4f}{before:10.4f}{after:10.4f}")
    lines.append("")
    for taught, what in ((True, "fitted"), (False, "held out")):
        before, after = result.rms(result.before, taught), result.rms(result.after, taught)
        lines.append(f"rms difference over the allowed one, {what}: {before:.3f} before, {after:.3f} after")
    lines += [
        ("converged: " if fit.converged else "NOT CONVERGED: ") + fit.why,
        f"{len(fit.history)} wakes in {fit.wall_time_s:.0f} s, of which {fit.compile_time_s:.0f} s to the first",
    ]
    return "\n".join(lines)


def record(result: MeasuredRun) -> dict[str, Any]:
    """Content of calibration.json."""
    numbers = zip(
        result.data.names, result.data.groups, result.taught, result.data.target, result.data.margin, result.before,
        result.after, strict=True,
    )  # fmt: skip
    rows = [
        {"quantity": n, "group": g, "fitted": bool(t), "measured": float(m), "margin": float(w),
         "default": float(b), "calibrated": float(a)}
        for n, g, t, m, w, b, a in numbers
    ]  # fmt: skip
    verdict = {
        what: {"before": result.rms(result.before, taught), "after": result.rms(result.after, taught)}
        for taught, what in ((True, "fitted"), (False, "held_out"))
    }
    return fit_entry(result.fit, "wake", result.rms(result.before, True)) | {"rows": rows, "rms_over_margin": verdict}


def calibration_of(result: MeasuredRun) -> Calibration:
    """The fit as a file keeps it."""
    values = {p.name: p.printed for p in PARAMETERS.parameters} | result.fit.parameters.table(result.fit.values)
    about = {
        "rotor": ROTOR,
        "collective_deg": COLLECTIVE_DEG,
        "fitted": [g for g in MARGINS if result.taught[list(result.data.groups).index(g)]],
        "free": list(result.fit.parameters.names),
    }
    return Calibration("wake", values, result.fit.converged, result.fit.rms, about)
