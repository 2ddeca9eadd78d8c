"""Derivatives of a linear rotor by design parameters: of its exponents and frequency responses, the trim's part in it.

The trim follows the parameter by the implicit function theorem, the mean matrices by forward mode through their own
forward mode; a simple exponent moves by wᴴ A' v / wᴴ v with its right and left vectors, a response by the product rule.
No differences are taken.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import scipy.linalg
from jax.flatten_util import ravel_pytree
from jaxtyping import Array, Complex, Float

from rotorjax.coupled import CoupledRotor
from rotorjax.linearisation.drive import Drive, drive_of
from rotorjax.linearisation.rotor import SteadyState, rate_and_readings, signs, state_names
from rotorjax.ode.implicit import attach
from rotorjax.ode.orbit import make_orbit, require_converged
from rotorjax.trim.problem import SteadyFlight, inputs_at, node_azimuths
from rotorjax.trim.solve import Trimmed

Design = tuple[SteadyFlight, CoupledRotor]


class Matrices(NamedTuple):
    """Means of A (n, n), B (n, m), C (q, n), D (q, m) over a revolution."""

    a: Array | np.ndarray
    b: Array | np.ndarray
    c: Array | np.ndarray
    d: Array | np.ndarray


@dataclass(frozen=True)
class Sensitivity:
    """A rotor's mean linear model and its derivative by one parameter, time being azimuth. states: their names.

    exponents, exponents_by (n,): in the same order, the least damped first.
    """

    model: Matrices
    by: Matrices
    states: tuple[str, ...]
    exponents: Complex[np.ndarray, " n"]
    exponents_by: Complex[np.ndarray, " n"]

    def response(self, frequencies: Float[np.ndarray, " W"]) -> tuple[np.ndarray, np.ndarray]:
        """C (iω − A)⁻¹ B + D and its derivative, (W, q, m) each."""
        (a, b, c, d), by, one = self.model, self.by, np.eye(len(self.states))
        values, slopes = [], []
        for w in frequencies:
            x = np.linalg.solve(1j * w * one - a, b)
            moved = np.linalg.solve(1j * w * one - a, by.a @ x + by.b)
            values.append(c @ x + d)
            slopes.append(by.c @ x + c @ moved + by.d)
        return np.array(values), np.array(slopes)


def sensitivity(
    found: Trimmed,
    where: Callable[[Design], Array],
    inputs: Sequence[str] = ("theta_0",),
    outputs: Sequence[str] = ("CT",),
    way: Array | None = None,
) -> Sensitivity:
    """Differentiate the mean model of a trim with an inflow model by a parameter.

    where: picks it out of flight and rotor, as `lambda d: d[1].blade.offset`. way: how its values go together where it
    is an array, shaped like it, as radii for a linear twist; all alike by default. Raises InputError where the trim has
    not converged.
    """
    require_converged(make_orbit(0.0, (found.z.rotor, found.z.inflow), 2 * np.pi, found.outcome))
    design = (found.flight, found.p)
    numbers = jax.tree.map(jnp.zeros_like, eqx.filter(design, eqx.is_inexact_array))
    along = eqx.tree_at(where, numbers, jnp.ones_like(where(design)) if way is None else jnp.asarray(way))
    model, by = _matrices_along(design, along, found.residual, found.z, tuple(inputs), tuple(outputs))
    model, by = (Matrices(*map(np.asarray, part)) for part in (model, by))
    values, left, right = scipy.linalg.eig(model.a, left=True)  # type: ignore[misc]
    order = np.argsort(-np.real(values))
    slopes = np.einsum("ik,ij,jk->k", left.conj(), by.a, right) / np.einsum("ik,ik->k", left.conj(), right)
    start = jax.tree.map(lambda leaf: leaf[0], SteadyState(found.z.rotor, found.z.inflow))
    return Sensitivity(model, by, state_names(start, found.p)[0], values[order], slopes[order])


@eqx.filter_jit
def _matrices_along(design: Design, along: Design, residual, z, inputs, outputs) -> tuple[Matrices, Matrices]:
    return eqx.filter_jvp(lambda d: mean_matrices(d, residual, z, inputs, outputs), (design,), (along,))


def mean_matrices(design: Design, residual, z, inputs: tuple[str, ...], outputs: tuple[str, ...]) -> Matrices:
    """Matrices of a trim z as a function of flight and rotor, its own dependence on them included."""
    flight, p = design
    z = attach(residual, z, flight, p)
    u, states = drive_of(inputs_at(z.controls, flight), p), SteadyState(z.rotor, z.inflow)
    start = jax.tree.map(lambda leaf: leaf[0], states)
    unravel = ravel_pytree(start)[1]

    def instant(x: Array, v: Array, psi: Array) -> tuple[Array, Array]:
        moved: Drive = {**u, **dict(zip(inputs, v, strict=True))}
        rate, read = rate_and_readings(psi, unravel(x), moved, p)
        return ravel_pytree(rate)[0], jnp.stack([read[name] for name in outputs])

    flat = jax.vmap(lambda x: ravel_pytree(x)[0])(states)
    v = jnp.stack([u[name] for name in inputs])
    by = jax.vmap(lambda x, psi: jax.jacfwd(instant, argnums=(0, 1))(x, v, psi))(flat, node_azimuths(z, p.rotor.blades))
    (a, b), (c, d) = jax.tree.map(lambda m: jnp.mean(m, axis=0), by)
    # what turns a differential coordinate into another changes its sign from passage to passage
    s, o = signs(state_names(start, p)[0]), signs(outputs)
    return Matrices(a * (np.outer(s, s) > 0), b * (s > 0)[:, None], c * (np.outer(o, s) > 0), d * (o > 0)[:, None])
