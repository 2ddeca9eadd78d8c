"""An inflow of three states in Pitt and Peters' form whose constants come from the free wake: small enough to fly with.

    M λ̇ + K λ = (δC_T, δC_c, δC_s),   λ = (λ_0, λ_1c, λ_1s)
    M = diag(m_0, m_1, m_1),   K = [[k_0, 0, 0], [0, k_1, c], [0, −c, k_1]]

about a hover: deviations per radian of azimuth, in rotor units. Pitt and Peters have m_0 = 8/3π, m_1 = 16/45π, c = 0
and, of a hover's λ, k_0 = 4λ and k_1 = λ. What thrust and moments do to the blades, and the blades and the inflow to
them, is the rotor's own linear model with Pitt and Peters' inflow, in which only M and K are changed. They are fitted
to steps of the linear rotor in its free wake over one revolution, thrust, flapping and hub moments together, by
Levenberg and Marquardt's method with exact derivatives through the matrix exponential.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import optimistix
import xarray as xr
from jax.scipy.linalg import expm
from jaxtyping import Array, Float

from rotorjax.errors import InputError
from rotorjax.inflow.momentum import APPARENT_MASS
from rotorjax.inflow.pitt_peters import GRADIENT_MASS
from rotorjax.linearisation.hover import HoverModel
from rotorjax.ode.models import LinearModel

INPUTS = ("theta_0", "theta_1c", "w", "q")
"""Whose steps are fitted: what θ₁s and p do is the same a quarter turn further."""
OUTPUTS = ("CT", "beta_0", "beta_1c", "beta_1s", "L", "M")
INFLOW = ("lambda_0", "lambda_1c", "lambda_1s")
TIMES = np.linspace(0, 2 * np.pi, 49)
"""Of the steps, rad."""
FLOOR = 0.05
"""Share of an output's largest response, over the inputs, below which one counts as absent."""


class Constants(NamedTuple):
    """m_0, k_0, m_1, k_1, c of the module's equation, each ()."""

    m_0: Array | float
    k_0: Array | float
    m_1: Array | float
    k_1: Array | float
    c: Array | float


@dataclass(frozen=True)
class Identified:
    """Constants fitted and Pitt and Peters' own, with their errors (`error_of`). height: over R, infinite out of ground
    effect.
    """

    constants: Constants
    error: float
    pitt_peters: Constants
    pitt_peters_error: float
    height: float


def identified(model: HoverModel, rotor: LinearModel, height: float = np.inf) -> Identified:
    """Fit the constants. rotor: linear model of the same hover with Pitt and Peters' inflow, all states.

    Raises InputError where one of the models lacks a name of INPUTS, OUTPUTS or INFLOW.
    """
    target, start = target_of(model, rotor), own_constants(rotor)

    def left(z: Array, target: Target) -> Array:
        return ((steps(rotor, _constants(z, start)) - target.steps) * target.weight).ravel()

    solver = optimistix.LevenbergMarquardt(rtol=1e-6, atol=1e-8)
    found = _constants(optimistix.least_squares(left, solver, jnp.zeros(5), target, max_steps=200).value, start)
    found = Constants(*map(float, found))
    return Identified(found, error_of(found, target, rotor), start, error_of(start, target, rotor), height)


class Target(NamedTuple):
    """Steps (N, q, m) to be met, and weight (q, m): one over their largest values, zero where there is no response."""

    steps: Array
    weight: Array


def target_of(model: HoverModel, rotor: LinearModel) -> Target:
    """Steps of a free wake's model. Raises InputError where a name is missing."""
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
    top = np.abs(truth).max(axis=0)
    there = top > FLOOR * top.max(axis=1, keepdims=True)
    return Target(jnp.asarray(truth), jnp.asarray(np.where(there, 1 / np.where(there, top, 1.0), 0.0)))


def error_of(constants: Constants, target: Target, rotor: LinearModel) -> float:
    """Rms of a step over the revolution, over its largest value, mean over the responses that are there."""
    rms = jnp.sqrt(jnp.mean(((steps(rotor, constants) - target.steps) * target.weight) ** 2, axis=0))
    return float(jnp.sum(rms) / jnp.sum(target.weight > 0))


def interpolated(one: Identified, other: Identified, height: float) -> Constants:
    """Constants at a height between two others, linear in 1/h: what a simulator does with the table."""
    here, there, at = 1 / one.height, 1 / other.height, 1 / height
    share = (at - here) / (there - here)
    pairs = zip(one.constants, other.constants, strict=True)
    return Constants(*((1 - share) * float(a) + share * float(b) for a, b in pairs))


def own_constants(rotor: LinearModel) -> Constants:
    """Pitt and Peters' own of a linear model: M as they have it, K of the mean inflow that it was linearised about."""
    row = [rotor.states.index(name) for name in INFLOW]
    flow = float(rotor.x[row[0]])
    return Constants(APPARENT_MASS, 4 * flow, GRADIENT_MASS, flow, 0.0)


def _constants(z: Array, start: Constants) -> Constants:
    """Positive masses and gains, by their logarithms over the start's."""
    m_0, k_0, m_1, k_1 = jnp.asarray(start[:4]) * jnp.exp(z[:4])
    return Constants(m_0, k_0, m_1, k_1, start.k_1 * z[4])


def changed(rotor: LinearModel, constants: Constants) -> tuple[Array, Array]:
    """A and B of a linear rotor whose inflow has other constants; its loads stay."""
    own, row = own_constants(rotor), np.array([rotor.states.index(name) for name in INFLOW])
    mass, stiff = _matrices(own)
    loads, direct = mass @ rotor.a[row], mass @ rotor.b[row]  # M λ̇ = loads − K λ
    mass, new = _matrices(constants)
    loads = jnp.asarray(loads).at[:, row].add(stiff - new)
    back = jnp.diag(1 / jnp.diagonal(mass))
    return jnp.asarray(rotor.a).at[row].set(back @ loads), jnp.asarray(rotor.b).at[row].set(back @ direct)


def _matrices(v: Constants) -> tuple[Array, Array]:
    mass, zero = jnp.diag(jnp.stack([jnp.asarray(m) for m in (v.m_0, v.m_1, v.m_1)])), jnp.zeros(())
    rows = ((v.k_0, zero, zero), (zero, v.k_1, v.c), (zero, -jnp.asarray(v.c), v.k_1))
    return mass, jnp.stack([jnp.stack([jnp.asarray(entry) for entry in row]) for row in rows])


def steps(rotor: LinearModel, constants: Constants) -> Float[Array, "N q m"]:
    """OUTPUTS at TIMES after unit steps of INPUTS, of a rotor whose inflow has these constants."""
    a, b = changed(rotor, constants)
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
    """Constants and errors over height, infinite out of ground effect: what a flight simulator interpolates in."""
    columns = {name: [getattr(one.constants, name) for one in found] for name in Constants._fields}
    columns |= {f"pitt_peters_{name}": [getattr(one.pitt_peters, name) for one in found] for name in Constants._fields}
    columns["tau_0"] = [one.constants.m_0 / one.constants.k_0 for one in found]
    columns["tau_1"] = [one.constants.m_1 / one.constants.k_1 for one in found]
    columns |= {"error": [one.error for one in found], "pitt_peters_error": [one.pitt_peters_error for one in found]}
    data = xr.Dataset({name: ("height", np.asarray(values, float)) for name, values in columns.items()})
    equation = (
        "M dλ/dψ + K λ = (δC_T, δC_c, δC_s), M = diag(m_0, m_1, m_1), K = [[k_0, 0, 0], [0, k_1, c], [0, -c, k_1]]"
    )
    return data.assign_coords(height=("height", [one.height for one in found], {"units": "R"})).assign_attrs(
        equation=equation, units="time: azimuth (rad), velocity: ΩR, loads: ρA(ΩR)² and ρA(ΩR)²R"
    )


def text(data: xr.Dataset) -> str:
    """The table in columns."""
    names = ["height", *map(str, data.data_vars)]
    rows = [" ".join(f"{name:>28}" for name in names)]
    rows += [" ".join(f"{float(data[name][k]):>28.6g}" for name in names) for k in range(data.sizes["height"])]
    return f"# {data.attrs['equation']}\n# {data.attrs['units']}\n" + "\n".join(rows) + "\n"
