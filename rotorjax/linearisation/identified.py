"""An inflow of three states in Pitt and Peters' form whose constants come from the free wake: small enough to fly with.

    M λ̇ + K λ = (δC_T, δC_c, δC_s),   λ = (λ_0, λ_1c, λ_1s),   M = diag(m_0, m_c, m_s)

about a hover or a flight: deviations per radian of azimuth, in rotor units. Pitt and Peters have m_0 = 8/3π, m_c = m_s
= 16/45π and, of a hover's λ, K = diag(4λ, λ, λ). What thrust and moments do to the blades, and the blades and the
inflow to them, is the rotor's own linear model with Pitt and Peters' inflow, in which only M and K are changed. They
are fitted to steps of the linear rotor in its free wake over one revolution, thrust, flapping and hub moments together,
by least squares in a trust region with exact derivatives through the matrix exponential. Over a revolution and not on
iω, because a hovering wake grows.
"""

import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol, cast

import jax
import jax.numpy as jnp
import numpy as np
import xarray as xr
from jax.scipy.linalg import expm
from jaxtyping import Array, Float
from scipy.optimize import least_squares

from rotorjax.errors import InputError
from rotorjax.inflow.interface import DiskLoads
from rotorjax.inflow.pitt_peters import PittPeters
from rotorjax.ode.models import LinearModel
from rotorjax.trim.problem import inputs_at
from rotorjax.trim.solve import Trimmed

INPUTS = ("theta_0", "theta_1c", "theta_1s", "w", "p", "q")
"""Whose steps are fitted."""
OUTPUTS = ("CT", "beta_0", "beta_1c", "beta_1s", "L", "M")
INFLOW = ("lambda_0", "lambda_1c", "lambda_1s")
NAMES = ("m_0", "m_c", "m_s", "k_00", "k_0c", "k_0s", "k_c0", "k_cc", "k_cs", "k_s0", "k_sc", "k_ss")
TIMES = np.linspace(0, 2 * np.pi, 49)
"""Of the steps, rad."""
MOST_FITS = 200
"""Inflows tried in a fit; a few tens are enough."""
FLOOR = 0.05
"""Share of an output's largest response, over the inputs, below which one counts as absent."""


class Stepped(Protocol):
    """A linear model, or a hover's by wave number."""

    @property
    def inputs(self) -> tuple[str, ...]:
        """Names."""
        ...

    @property
    def outputs(self) -> tuple[str, ...]:
        """Names."""
        ...

    def step(self, times: Float[np.ndarray, " N"]) -> Float[np.ndarray, "N q m"]:
        """Outputs after unit steps of the inputs."""
        ...


class Inflow(NamedTuple):
    """Diagonal of M (3,) and K (3, 3) of the module's equation."""

    mass: Float[Array, "3"]
    stiffness: Float[Array, "3 3"]


@dataclass(frozen=True)
class Identified:
    """The inflow fitted and Pitt and Peters' own, with their errors (`error_of`). advance: over ΩR; height: over R,
    infinite out of ground effect.
    """

    inflow: Inflow
    error: float
    pitt_peters: Inflow
    pitt_peters_error: float
    advance: float
    height: float


def identified(
    model: Stepped, rotor: LinearModel, start: Inflow, advance: float = 0.0, height: float = np.inf
) -> Identified:
    """Fit an inflow. rotor: linear model of the same flight with Pitt and Peters' inflow, all states. start: `own`.

    A search that does not come to its end gives the best that it met, with a warning.

    Raises InputError where one of the models lacks a name of INPUTS, OUTPUTS or INFLOW, or the model's steps are no
    numbers.
    """
    target = target_of(model, rotor)

    @jax.jit
    def left(z: Array) -> Array:
        return ((steps(rotor, start, _moved(z, start)) - target.steps) * target.weight).ravel()

    # cast: the checker takes the name of a difference formula, jac's default, for all that it may be
    value, slope = (cast(Any, lambda z, of=of: np.asarray(of(z))) for of in (left, jax.jit(jax.jacfwd(left))))
    fit = least_squares(value, np.zeros(12), slope, ftol=1e-10, gtol=1e-12, max_nfev=MOST_FITS)
    if not fit.success:
        warnings.warn(
            f"the inflow identified at advance ratio {advance:g}, height {height:g} is the best of {fit.nfev} that "
            "were tried, and the search had not come to its end: look at its error before you fly with it",
            stacklevel=2,
        )
    found = _moved(jnp.asarray(fit.x), start)
    errors = [error_of(inflow, start, target, rotor) for inflow in (found, start)]
    return Identified(found, errors[0], start, errors[1], advance, height)


def own(trimmed: Trimmed) -> Inflow:
    """Pitt and Peters' own, of the mean inflow of a trim with it. Raises InputError for one with another inflow."""
    model = trimmed.p.inflow
    if not isinstance(model, PittPeters):
        raise InputError("Argument `trimmed` must be a trim with inflow 'pitt-peters', but has another")
    still = DiskLoads(*(jnp.zeros(shape) for shape in ((1, 1), (1, 1, 3), (1,), (1,), (1,), ())))
    inputs = inputs_at(trimmed.z.controls, trimmed.flight)
    slope = jax.jacfwd(lambda state: model.rate(state, still, inputs))(jnp.mean(trimmed.z.inflow, axis=0))
    return Inflow(model.mass, -model.mass[:, None] * slope)


class Target(NamedTuple):
    """Steps (N, q, m) to be met, and weight (q, m): one over their largest values, zero where there is no response."""

    steps: Array
    weight: Array


def target_of(model: Stepped, rotor: LinearModel) -> Target:
    """Steps of a free wake's model. Raises InputError where a name is missing or a step is no number."""
    for what, names, owned in (
        ("inputs", INPUTS, (model.inputs, rotor.inputs)),
        ("outputs", OUTPUTS, (model.outputs, rotor.outputs)),
        ("states", INFLOW, (rotor.states,)),
    ):
        for missing in (name for name in names for have in owned if name not in have):
            raise InputError(
                f"Argument `{what}` must hold {', '.join(names)} for an inflow to be fitted, but has no {missing}"
            )
    rows, columns = [model.outputs.index(n) for n in OUTPUTS], [model.inputs.index(n) for n in INPUTS]
    truth = model.step(TIMES)[:, rows][:, :, columns]
    if not np.all(np.isfinite(truth)):
        raise InputError(
            "Argument `model` must have finite steps within a revolution, but has not: look for NaN in its matrices "
            "and for modes that outgrow the numbers"
        )
    top = np.abs(truth).max(axis=0)
    there = top > FLOOR * top.max(axis=1, keepdims=True)
    return Target(jnp.asarray(truth), jnp.asarray(np.where(there, 1 / np.where(there, top, 1.0), 0.0)))


def error_of(inflow: Inflow, start: Inflow, target: Target, rotor: LinearModel) -> float:
    """Rms of a step over the revolution, over its largest value, mean over the responses that are there."""
    rms = jnp.sqrt(jnp.mean(((steps(rotor, start, inflow) - target.steps) * target.weight) ** 2, axis=0))
    return float(jnp.sum(rms) / jnp.sum(target.weight > 0))


def _moved(z: Float[Array, "12"], start: Inflow) -> Inflow:
    """Positive masses by their logarithms over the start's, the rest in units of the start's diagonal."""
    size = jnp.sqrt(jnp.abs(jnp.diagonal(start.stiffness)))
    return Inflow(start.mass * jnp.exp(z[:3]), start.stiffness + size[:, None] * size * z[3:].reshape(3, 3))


def changed(rotor: LinearModel, start: Inflow, inflow: Inflow) -> tuple[Array, Array]:
    """A and B of a linear rotor whose inflow is another; its loads stay. start: the inflow that it has."""
    row = np.array([rotor.states.index(name) for name in INFLOW])
    loads, direct = start.mass[:, None] * rotor.a[row], start.mass[:, None] * rotor.b[row]  # M λ̇ = loads − K λ
    loads = loads.at[:, row].add(start.stiffness - inflow.stiffness)
    a, b = jnp.asarray(rotor.a), jnp.asarray(rotor.b)
    return a.at[row].set(loads / inflow.mass[:, None]), b.at[row].set(direct / inflow.mass[:, None])


def steps(rotor: LinearModel, start: Inflow, inflow: Inflow) -> Float[Array, "N q m"]:
    """OUTPUTS at TIMES after unit steps of INPUTS, of a rotor whose inflow is another than the one it has."""
    a, b = changed(rotor, start, inflow)
    m = np.array([rotor.inputs.index(name) for name in INPUTS])
    q = np.array([rotor.outputs.index(name) for name in OUTPUTS])
    n, b = rotor.order, b[:, m]
    joint = jnp.concatenate([jnp.concatenate([a, b], axis=1), jnp.zeros((m.size, n + m.size))])
    leap = expm(joint * (TIMES[1] - TIMES[0]))

    def one(x: Array, _: None) -> tuple[Array, Array]:
        return leap[:n, :n] @ x + leap[:n, n:], x

    states = jax.lax.scan(one, jnp.zeros((n, m.size)), None, length=TIMES.size)[1]
    return jnp.einsum("qn,tnm->tqm", rotor.c[q], states) + rotor.d[np.ix_(q, m)]


def table(found: Sequence[Identified]) -> xr.Dataset:
    """Constants and errors over advance ratio and height, infinite out of ground effect: what a flight simulator
    interpolates in. NaN where there is none.
    """
    speeds, heights = sorted({one.advance for one in found}), sorted({one.height for one in found})
    names = (
        *NAMES,
        *(f"pitt_peters_{name}" for name in NAMES),
        "tau_0",
        "tau_c",
        "tau_s",
        "error",
        "pitt_peters_error",
    )
    values = np.full((len(names), len(speeds), len(heights)), np.nan)
    for one in found:
        flat = [np.concatenate([np.ravel(part) for part in inflow]) for inflow in (one.inflow, one.pitt_peters)]
        times = one.inflow.mass / np.diagonal(one.inflow.stiffness)
        row = np.concatenate([*flat, times, [one.error, one.pitt_peters_error]])
        values[:, speeds.index(one.advance), heights.index(one.height)] = row
    data = xr.Dataset({name: (("advance_ratio", "height"), part) for name, part in zip(names, values, strict=True)})
    equation = "M dλ/dψ + K λ = (δC_T, δC_c, δC_s), M = diag(m_0, m_c, m_s), K = [[k_00, k_0c, k_0s], …]"
    return data.assign_coords(advance_ratio=speeds, height=("height", heights, {"units": "R"})).assign_attrs(
        equation=equation,
        units="time: azimuth (rad), velocity: ΩR, loads: ρA(ΩR)² and ρA(ΩR)²R",
        between="constants are linear in advance_ratio and in 1/height² (height over R; inf, where that is 0, out of "
        "ground effect)",
    )


def interpolated(data: xr.Dataset, advance: float, height: float = np.inf) -> Inflow:
    """The inflow between those of a full table, linear in speed and in 1/height², as which the ground's effect fades
    (Cheeseman & Bennett's 1/16h²): what a simulator does with it.

    Raises InputError for a flight outside the table.
    """
    near = data[list(NAMES)].assign_coords(height=data["height"] ** -2.0).sortby("height")
    for name, value in (("advance_ratio", advance), ("height", height**-2.0)):
        near = near.sel({name: value}) if value in near[name] else near.interp({name: value})
    flat = np.array([float(near[name]) for name in NAMES])
    if not np.all(np.isfinite(flat)):
        raise InputError(
            f"Arguments `advance` and `height` must lie within the table, but are {advance:g} and {height:g}"
        )
    return Inflow(jnp.asarray(flat[:3]), jnp.asarray(flat[3:].reshape(3, 3)))


def text(data: xr.Dataset) -> str:
    """The table in columns, a flight a row."""
    names = [str(name) for name in data.data_vars]
    places = [(mu, h) for mu in data["advance_ratio"].values for h in data["height"].values]
    rows = [" ".join(f"{name:>18}" for name in ("advance_ratio", "height", *names))]
    for mu, h in places:
        here = data.sel(advance_ratio=mu, height=h)
        rows.append(" ".join(f"{value:>18.6g}" for value in (mu, h, *(float(here[name]) for name in names))))
    head = "".join(f"# {data.attrs[name]}\n" for name in ("equation", "units", "between"))
    return head + "\n".join(rows) + "\n"
