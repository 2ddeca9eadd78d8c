"""Fit bounded parameters to data: one residual function, three drivers, one verdict.

    fit = calibrate(residual, parameters, data)                    # Levenberg–Marquardt (optimistix)
    fit = calibrate(residual, parameters, data, method="lbfgs")    # or "adam" (optax)
    many = calibrate_many(residual, parameters, data, starts)      # one least-squares fit for each start, by vmap

residual(values, data) → (N,) holds weighted differences of model and target, N ≥ P. Every driver is judged alike, from
the Jacobian at its end: one more Gauss–Newton step must not move a parameter by more than 1e-5 of its range, the data
must determine every parameter, and no parameter may sit at a bound.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple, get_args

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import optimistix as optx
from jaxtyping import Array, ArrayLike, Float, PyTree

from rotorjax.calibration.descent import descend
from rotorjax.calibration.parameters import ParameterSet
from rotorjax.errors import InputError

Residual = Callable[[Float[Array, " P"], Any], Float[Array, " N"]]
Progress = Callable[[int, float], None]
Method = Literal["least_squares", "lbfgs", "adam"]

STEP_LEFT = 1e-5  # of a parameter's range
UNDETERMINED = 1e-9  # smallest over largest singular value of the scaled Jacobian
_TOLERANCE = 1e-8  # of a step in the unbounded coordinates; the verdict is taken from the Jacobian all the same


class Verdict(NamedTuple):
    """What the Jacobian says at the end of a fit.

    rms: √(Σr²/N). left (): the largest Gauss–Newton step left, over the range of its parameter. rank (): smallest over
    largest singular value of the Jacobian with respect to parameters over their ranges. covariance (P, P):
    s²(JᵀJ)⁻¹ with s² = Σr²/(N − P), NaN where N = P or the data do not determine a parameter. It takes the
    differences for independent; where neighbours miss the target together, as stations of one inflow do, it is a lower
    bound.
    """

    rms: Float[Array, ""]
    left: Float[Array, ""]
    rank: Float[Array, ""]
    covariance: Float[Array, "P P"]


@dataclass(frozen=True)
class Fit:
    """The end of a fit, converged or not.

    values (P,): of `parameters`, in order. rms, covariance: see `Verdict`. history: rms after every step, the start
    included. converged, why: the verdict and one sentence. at_bound: names of parameters held by a bound. wall_time_s:
    of the whole fit; compile_time_s: what of it went before the first step was done.
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
    progress: Progress | None = None,
) -> Fit:
    """Fit parameters so that Σ residual² is least.

    start: inside the ranges (default: the printed values where these are inside, else the middle). max_steps: default
    200 of least squares or L-BFGS, 4000 of Adam. progress(step, rms): called now and then. Raises InputError where the
    method is unknown, the start is outside, there are fewer data than parameters, or the residual is not finite there.
    """
    if method not in get_args(Method):
        raise InputError(f"Argument `method` must be one of {', '.join(get_args(Method))}, but is {method!r}")
    begun = time.perf_counter()
    z = parameters.unbounded(_start(parameters, start))
    first = _check(residual, parameters, data, z)
    unknown = _InCoordinates(residual, parameters)
    if method == "least_squares":
        z, history, compiled = _levenberg_marquardt(unknown, data, z, max_steps or 200, progress)
    else:
        z, history, compiled = descend(
            unknown, data, z, method, max_steps or (200 if method == "lbfgs" else 4000), progress
        )
    values = parameters.bounded(z)
    verdict = judge(residual, parameters, data, values)
    converged, why = conclude(parameters, values, verdict)
    return Fit(
        parameters,
        np.asarray(values),
        float(verdict.rms),
        np.asarray(verdict.covariance),
        converged,
        why,
        parameters.at_bound(values),
        np.array([first, *history]),
        method,
        time.perf_counter() - begun,
        compiled,
    )


def calibrate_many(
    residual: Residual,
    parameters: ParameterSet,
    data: PyTree,
    starts: ArrayLike,
    max_steps: int = 200,
) -> Many:
    """Fit from every start, in one program. Raises InputError as `calibrate` does."""
    begun = time.perf_counter()
    z = parameters.unbounded(parameters.check(starts, "starts"))
    _check(residual, parameters, data, z[0])
    values, good, verdict = jax.block_until_ready(_solve_many(_InCoordinates(residual, parameters), data, z, max_steps))
    held = np.array([bool(parameters.at_bound(row)) for row in np.asarray(values)])
    converged = np.asarray(good) & (np.asarray(verdict.left) <= STEP_LEFT) & ~held
    return Many(np.asarray(values), np.asarray(verdict.rms), converged, time.perf_counter() - begun)


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


@eqx.filter_jit
def judge(residual: Residual, parameters: ParameterSet, data: PyTree, values: Float[Array, " P"]) -> Verdict:
    """Read the verdict off the residual and its Jacobian at values (P,)."""
    width = jnp.asarray(parameters.upper - parameters.lower)
    r = residual(values, data)
    jacobian = jax.jacfwd(residual)(values, data) * width
    u, s, vt = jnp.linalg.svd(jacobian, full_matrices=False)
    rank = s[-1] / s[0]
    known = rank > UNDETERMINED
    inverse = jnp.where(known, 1 / jnp.where(known, s, 1.0), jnp.nan)
    step = vt.T @ (inverse * (u.T @ r))
    spare = r.size - values.size
    variance = jnp.sum(r * r) / spare if spare else jnp.nan
    covariance = variance * (vt.T * inverse**2) @ vt * jnp.outer(width, width)
    return Verdict(jnp.sqrt(jnp.mean(r * r)), jnp.max(jnp.abs(step)), rank, covariance)


def conclude(parameters: ParameterSet, values: Float[Array, " P"], verdict: Verdict) -> tuple[bool, str]:
    """Whether a fit converged, and why in one sentence."""
    if not np.isfinite(verdict.rms):
        return False, "the residual is not finite at the end"
    if held := parameters.at_bound(values):
        return False, f"held by a bound: {', '.join(held)}; widen the range or take fewer parameters"
    if not verdict.rank > UNDETERMINED:
        return False, "the data do not determine every parameter; take fewer or more data"
    left = f"one more Gauss-Newton step would move a parameter by {float(verdict.left):.1e} of its range"
    return bool(verdict.left <= STEP_LEFT), left


def _start(parameters: ParameterSet, start: ArrayLike | None) -> Float[Array, " P"]:
    if start is not None:
        return parameters.check(start)
    inside = (parameters.printed > parameters.lower) & (parameters.printed < parameters.upper)
    return parameters.check(np.where(inside, parameters.printed, (parameters.lower + parameters.upper) / 2))


def _check(residual: Residual, parameters: ParameterSet, data: PyTree, z: Float[Array, " P"]) -> float:
    """The rms at the start. Raises InputError where the fit cannot begin."""
    r = np.asarray(residual(parameters.bounded(z), data))
    if r.size < len(parameters):
        raise InputError(
            f"Argument `parameters` must be no more than the data, but there are {len(parameters)} "
            f"({', '.join(parameters.names)}) and {r.size} data: take fewer parameters or more cases"
        )
    if not np.all(np.isfinite(r)):
        raise InputError("Argument `start` must give a finite residual, but it does not")
    return float(np.sqrt(np.mean(r * r)))


class _InCoordinates(eqx.Module):
    """A residual as a function of the unbounded coordinates; equal ones share their compilation."""

    residual: Residual = eqx.field(static=True)
    parameters: ParameterSet = eqx.field(static=True)

    def __call__(self, z: Float[Array, " P"], data: Any) -> Float[Array, " N"]:
        return self.residual(self.parameters.bounded(z), data)


def _solver() -> optx.LevenbergMarquardt:
    return optx.LevenbergMarquardt(rtol=_TOLERANCE, atol=_TOLERANCE)


@eqx.filter_jit
def _solve_many(unknown: _InCoordinates, data, z, max_steps):
    def one(start):
        found = optx.least_squares(unknown, _solver(), start, data, max_steps=max_steps, throw=False)
        values = unknown.parameters.bounded(found.value)
        good = found.result == optx.RESULTS.successful
        return values, good, judge(unknown.residual, unknown.parameters, data, values)

    return jax.lax.map(one, z)  # side by side all would go on until the last is done, four times as long, and in GBs


@eqx.filter_jit
def _first_state(unknown: _InCoordinates, data, z):
    shape = jax.eval_shape(unknown, z, data)
    return _solver().init(lambda z, data: (unknown(z, data), None), z, data, {}, shape, None, frozenset())


@eqx.filter_jit
def _step(unknown: _InCoordinates, data, z, state):
    """One step: z, state, rms, and whether that was the last."""

    def function(z, data):
        return unknown(z, data), None

    z, state, _ = _solver().step(function, z, data, {}, state, frozenset())
    done, _ = _solver().terminate(function, z, data, {}, state, frozenset())
    return z, state, jnp.sqrt(jnp.mean(unknown(z, data) ** 2)), done


def _levenberg_marquardt(unknown: _InCoordinates, data, z, max_steps, progress):
    """Step by step, so that there is a history and someone can watch; returns z, rms after each step, compile time."""
    begun, compiled, history = time.perf_counter(), 0.0, []
    state = _first_state(unknown, data, z)
    for i in range(max_steps):
        z, state, rms, done = _step(unknown, data, z, state)
        history.append(float(rms))
        if i == 0:
            compiled = time.perf_counter() - begun
        if progress is not None:
            progress(i + 1, history[-1])
        if bool(done):
            break
    return z, history, compiled
