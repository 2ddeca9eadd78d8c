"""Fit bounded parameters to data: one residual function, three drivers, one verdict.

    fit = calibrate(residual, parameters, data)                    # Levenberg–Marquardt
    fit = calibrate(residual, parameters, data, method="lbfgs")    # or "adam"
    many = calibrate_many(residual, parameters, data, starts)      # one least-squares fit for each start

residual(values, data) → (N,) holds weighted differences of model and target, N ≥ P. Every driver is judged alike, from
the Jacobian at its end: one more Gauss–Newton step must not move a parameter by more than 1e-5 of its range, the data
must determine every parameter, and no parameter may sit at a bound.
"""

import time
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from jaxtyping import ArrayLike, Float, PyTree

from rotorjax.calibration.drivers import DRIVERS, Descent, FitProgress, Method, Residual
from rotorjax.calibration.parameters import ParameterSet
from rotorjax.errors import InputError

STEP_LEFT = 1e-5  # of a parameter's range
UNDETERMINED = 1e-9  # smallest over largest singular value of the scaled Jacobian


class FitQuality(NamedTuple):
    """What the Jacobian says at the end of a fit.

    rms: √(Σr²/N). left (): the largest Gauss–Newton step left, over the range of its parameter. rank (): smallest over
    largest singular value of the Jacobian with respect to parameters over their ranges. covariance (P, P):
    s²(JᵀJ)⁻¹ with s² = Σr²/(N − P), NaN where N = P or the data do not determine a parameter. It takes the
    differences for independent; where neighbours miss the target together, as stations of one inflow do, it is a lower
    bound.
    """

    rms: float
    left: float
    rank: float
    covariance: Float[np.ndarray, "P P"]


@dataclass(frozen=True)
class Fit:
    """The end of a fit, converged or not.

    values (P,): of `parameters`, in order. rms, covariance: see `FitQuality`. history: rms after every step, the start
    included. converged, why: the verdict and one sentence. at_bound: names of parameters held by a bound. wall_time_s:
    of the whole fit; compile_time_s: what of it went before the first evaluation was done.
    """

    parameters: ParameterSet
    values: np.ndarray
    rms: float
    covariance: np.ndarray
    converged: bool
    why: str
    at_bound: tuple[str, ...]
    history: np.ndarray
    method: str
    wall_time_s: float
    compile_time_s: float

    @property
    def deviations(self) -> np.ndarray:
        """Standard deviations, (P,)."""
        return np.sqrt(np.diag(self.covariance))


@dataclass(frozen=True)
class Many:
    """Least-squares fits from S starts. values (S, P); rms (S,); converged (S,): bool; wall_time_s: of all."""

    values: np.ndarray
    rms: np.ndarray
    converged: np.ndarray
    wall_time_s: float

    @property
    def best(self) -> int:
        """Index of the fit with the smallest rms, converged ones first."""
        return int(np.argmin(np.where(self.converged, self.rms, self.rms + 1e9)))


def calibrate(
    residual: Residual,
    parameters: ParameterSet,
    data: PyTree,
    start: ArrayLike | None = None,
    method: Method = "least_squares",
    max_steps: int | None = None,
    progress: FitProgress | None = None,
) -> Fit:
    """Fit parameters so that Σ residual² is least.

    start: inside the ranges (default: the printed values where these are inside, else the middle). max_steps: default
    200 of least squares or L-BFGS, 4000 of Adam. progress(step, rms): called after every step. Raises InputError where
    the method is unknown, the start is outside, there are fewer data than parameters, or the residual is not finite
    there.
    """
    if method not in DRIVERS:
        raise InputError(f"Argument `method` must be one of {', '.join(DRIVERS)}, but is {method!r}")
    begun = time.perf_counter()
    descent = Descent(residual, parameters, data, progress)
    z, verdict = _descend(descent, _start(parameters, start), method, max_steps)
    values = np.asarray(parameters.bounded(z))
    converged, why = conclude(parameters, values, verdict)
    return Fit(
        parameters,
        values,
        verdict.rms,
        verdict.covariance,
        converged,
        why,
        parameters.at_bound(values),
        np.array(descent.history),
        method,
        time.perf_counter() - begun,
        descent.compile_time_s,
    )


def calibrate_many(
    residual: Residual,
    parameters: ParameterSet,
    data: PyTree,
    starts: ArrayLike,
    max_steps: int = 200,
) -> Many:
    """Fit from every start. Raises InputError as `calibrate` does."""
    begun = time.perf_counter()
    values, rms, converged = [], [], []
    for start in parameters.check(starts, "starts"):
        z, verdict = _descend(Descent(residual, parameters, data), start, "least_squares", max_steps)
        values.append(np.asarray(parameters.bounded(z)))
        rms.append(verdict.rms)
        converged.append(conclude(parameters, values[-1], verdict)[0])
    return Many(np.array(values), np.array(rms), np.array(converged), time.perf_counter() - begun)


def _descend(
    descent: Descent, start: Float[np.ndarray, " P"], method: Method, steps: int | None
) -> tuple[np.ndarray, FitQuality]:
    """Where a driver ends, in the unbounded coordinates, and the verdict on it."""
    z = descent.parameters.unbounded(start)
    _check(descent, z)
    descent.note(z)
    driver, usual = DRIVERS[method]
    z = driver(descent, z, steps or usual)
    return z, judge(descent.parameters, *descent.at(z))


def even_starts(parameters: ParameterSet, count: int) -> np.ndarray:
    """Starts (count, P) that fill the ranges evenly, from 5 % to 95 % of each: a low-discrepancy (R_P) sequence.

    One parameter gets equal steps, ends included. Source: Roberts (2018), "The unreasonable effectiveness of
    quasirandom sequences".
    """
    p = len(parameters)
    if p == 1:
        share = np.linspace(0.0, 1.0, count)[:, None]
    else:
        ratio = np.max(np.roots([1.0, *[0.0] * (p - 1), -1.0, -1.0]).real)  # x^{P+1} = x + 1
        share = (0.5 + np.arange(1, count + 1)[:, None] * ratio ** -np.arange(1, p + 1)) % 1.0
    return parameters.lower + (parameters.upper - parameters.lower) * (0.05 + 0.9 * share)


def judge(parameters: ParameterSet, r: Float[np.ndarray, " N"], jacobian: Float[np.ndarray, "N P"]) -> FitQuality:
    """Read the verdict off the residual and its Jacobian with respect to the values."""
    if not np.all(np.isfinite(r)) or not np.all(np.isfinite(jacobian)):
        return FitQuality(np.nan, np.nan, np.nan, np.full((len(parameters), len(parameters)), np.nan))
    width = parameters.upper - parameters.lower
    u, s, vt = np.linalg.svd(jacobian * width, full_matrices=False)
    rank = float(s[-1] / s[0]) if s[0] else 0.0
    inverse = 1 / s if rank > UNDETERMINED else np.full_like(s, np.nan)
    step = vt.T @ (inverse * (u.T @ r))
    spare = r.size - len(parameters)
    variance = r @ r / spare if spare else np.nan
    covariance = variance * (vt.T * inverse**2) @ vt * np.outer(width, width)
    return FitQuality(float(np.sqrt(np.mean(r * r))), float(np.max(np.abs(step))), rank, covariance)


def conclude(parameters: ParameterSet, values: Float[np.ndarray, " P"], verdict: FitQuality) -> tuple[bool, str]:
    """Whether a fit converged, and why in one sentence."""
    if not np.isfinite(verdict.rms):
        return False, "the residual is not finite at the end"
    if held := parameters.at_bound(values):
        return False, f"held by a bound: {', '.join(held)}; widen the range or take fewer parameters"
    if not verdict.rank > UNDETERMINED:
        return False, "the data do not determine every parameter; take fewer or more data"
    left = f"one more Gauss-Newton step would move a parameter by {verdict.left:.1e} of its range"
    return verdict.left <= STEP_LEFT, left


def _start(parameters: ParameterSet, start: ArrayLike | None) -> Float[np.ndarray, " P"]:
    if start is not None:
        return parameters.check(start)
    inside = (parameters.printed > parameters.lower) & (parameters.printed < parameters.upper)
    return parameters.check(np.where(inside, parameters.printed, (parameters.lower + parameters.upper) / 2))


def _check(descent: Descent, z: Float[np.ndarray, " P"]) -> None:
    """Raise InputError where the fit cannot begin."""
    r, parameters = descent.residual(z), descent.parameters
    if r.size < len(parameters):
        raise InputError(
            f"Argument `parameters` must be no more than the data, but there are {len(parameters)} "
            f"({', '.join(parameters.names)}) and {r.size} data: take fewer parameters or more cases"
        )
    if not np.all(np.isfinite(r)):
        raise InputError("Argument `start` must give a finite residual, but it does not")
