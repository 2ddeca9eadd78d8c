"""The whole calibration against the free wake: fit on some cases, verdict on others, and what it leaves behind."""

import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import xarray as xr

from rotorjax.calibration.calibration_file import Calibration, fit_entry
from rotorjax.calibration.drivers import FitProgress, Method
from rotorjax.calibration.fit import Fit, calibrate
from rotorjax.calibration.taught import PARAMETERS
from rotorjax.calibration.teacher import Lessons, default_held, inflow, lessons, residual, rms_difference

HALVED = 0.5


@dataclass(frozen=True)
class FreeWakeRun:
    """The lessons, the fit to those that were not held out, and the differences of all.

    data: all C cases. held: names of those held out. values (P,): all parameters. printed, taught (C,): rms difference
    from the free wake before and after. inflow_printed, inflow (C, K, R): over the reference. about: for the file.
    """

    data: Lessons
    held: tuple[str, ...]
    fit: Fit
    values: np.ndarray
    printed: np.ndarray
    taught: np.ndarray
    inflow_printed: np.ndarray
    inflow: np.ndarray
    about: dict[str, Any]

    @property
    def is_held(self) -> np.ndarray:
        """Which cases were held out, (C,)."""
        return np.isin(self.data.names, self.held)

    def mean(self, rms: np.ndarray, held: bool) -> float:
        """Mean rms difference over the held-out cases or the others; NaN where there are none."""
        rows = rms[self.is_held == held]
        return float(rows.mean()) if rows.size else float("nan")

    @property
    def halved(self) -> bool:
        """Whether the mean rms difference over the held-out cases is at most half of the default's."""
        return self.mean(self.taught, True) <= HALVED * self.mean(self.printed, True)


def run(
    merged: xr.Dataset,
    parameters: Sequence[str] = PARAMETERS.names,
    held: Sequence[str] | None = None,
    method: Method = "least_squares",
    progress: FitProgress | None = None,
) -> FreeWakeRun:
    """Fit the taught model to a study's cases but the held-out ones (default: `teacher.default_held`).

    Raises InputError where a name is unknown, no case is left, or there are more parameters than data.
    """
    data, chosen = lessons(merged, parameters)
    held = default_held(data.names) if held is None else tuple(dict.fromkeys(held))
    if held:
        data.choose(held)  # names the one that is missing
    taught = data.choose([n for n in data.names if n not in held])
    fit = calibrate(residual, chosen, taught, method=method, progress=progress)
    values = PARAMETERS.complete(jnp.asarray(fit.values), data.free, data.fixed)
    field_before, field_after = (np.asarray(inflow(v, data)) for v in (jnp.asarray(PARAMETERS.printed), values))
    before, after = (rms_difference(field, data) for field in (field_before, field_after))
    about = {
        "radial_terms": int((data.model.modes.m == 0).sum()),
        "source_terms": int((data.model.sources.m == 0).sum()),
        "cases": list(taught.names),
        "held": list(held),
        "study": str(merged.attrs.get("fingerprint", "")),
        "free": list(data.free),
    }
    return FreeWakeRun(data, held, fit, np.asarray(values), before, after, field_before, field_after, about)


def gradient_cost(data: Lessons, values: np.ndarray, repeats: int = 20) -> dict[str, float]:
    """Time in s of the objective over the level cases and of its reverse-mode gradient, and their ratio; compiled."""
    level = data.choose([n for n, slope in zip(data.names, data.slopes, strict=True) if not float(slope)])
    start = jnp.asarray(values)[np.array([PARAMETERS.names.index(n) for n in data.free])]
    times = {}
    for name, function in {"objective_s": _objective, "gradient_s": _gradient}.items():
        jax.block_until_ready(function(start, level))
        spent = []
        for _ in range(repeats):
            begun = time.perf_counter()
            jax.block_until_ready(function(start, level))
            spent.append(time.perf_counter() - begun)
        times[name] = min(spent)
    return times | {"ratio": times["gradient_s"] / times["objective_s"]}


def record(result: FreeWakeRun) -> dict[str, Any]:
    """Content of calibration.json."""
    fit = result.fit
    printed_rms = float(np.sqrt(np.mean(result.printed[~result.is_held] ** 2)))
    rows = zip(result.data.names, result.printed, result.taught, strict=True)
    return fit_entry(fit, "freewake", printed_rms) | {
        "cases": {
            name: {"inflow_rms_difference_printed_factor": before, "inflow_rms_difference": after,
                   "held_out": name in result.held}
            for name, before, after in rows
        },
        "held_out": {
            "cases": result.held,
            "inflow_rms_difference": result.mean(result.taught, True),
            "inflow_rms_difference_printed_factor": result.mean(result.printed, True),
            "halved": result.halved,
        },
        "gradient_cost": gradient_cost(result.data, result.values),
        "study": result.about["study"],
    }  # fmt: skip


def calibration_of(result: FreeWakeRun) -> Calibration:
    """The fit as a file keeps it."""
    return Calibration("freewake", PARAMETERS.table(result.values), result.fit.converged, result.fit.rms, result.about)


def report(result: FreeWakeRun) -> str:
    """What was fitted, as text for the screen."""
    fit = result.fit
    lines = [f"Free wake as teacher: {len(result.data.names)} cases, {len(result.held)} of them held out", ""]
    lines += [
        f"{n:<14}{v:9.4f} ± {d:.4f}   (printed {p:.4f})"
        for n, v, d, p in zip(fit.parameters.names, fit.values, fit.deviations, fit.parameters.printed, strict=True)
    ]
    lines += ["", f"{'rms difference of the inflow':<32}{'default':>16}{'calibrated':>12}"]
    for name, before, after in zip(result.data.names, result.printed, result.taught, strict=True):
        lines.append(f"{name + (' (held out)' if name in result.held else ''):<32}{before:16.4f}{after:12.4f}")
    for held, title in ((False, "mean of the taught cases"), (True, "mean of the held-out cases")):
        before, after = result.mean(result.printed, held), result.mean(result.taught, held)
        lines.append(f"{title:<32}{before:16.4f}{after:12.4f}")
    verdict = "at least halved" if result.halved else "NOT halved"
    lines += [
        "",
        f"held-out difference {verdict}" if result.held else "no case held out: no verdict",
        ("converged: " if fit.converged else "NOT CONVERGED: ") + fit.why,
        f"{fit.wall_time_s:.1f} s, of which compiling {fit.compile_time_s:.1f} s",
    ]
    return "\n".join(lines)


def _sum_of_squares(values, data):
    return jnp.sum(residual(values, data) ** 2)


_objective = eqx.filter_jit(_sum_of_squares)
_gradient = eqx.filter_jit(jax.value_and_grad(_sum_of_squares))
