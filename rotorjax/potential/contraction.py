"""A wake that narrows: the rigid cylinder's flow, laid along a tube of radius ρ(s) = κ + (1 − κ) e^{−s/L}.

The paper's wake is a cylinder of the rotor's radius. A rotor's slipstream narrows, to κ = 1/√2 in momentum theory, and
within a fraction of the radius: that is what the cylinder lacks out of ground effect.

Near the disk the tube keeps its volume flux, so its strength per area grows as ρ⁻². Split where it narrows, it is the
cylinder, less the rest of the cylinder below each depth s, plus a narrower one from there on. With the velocity C(p) of
a unit state of the semi-infinite cylinder that begins at the disk,

    near(p) = A {C(p) + Σ_k [ρ_{k+1}⁻² C((p + s_k ẑ)/ρ_{k+1}) − ρ_k⁻² C((p + s_k ẑ)/ρ_k)]},

and A keeps the mean inflow of the first state, by which momentum theory holds: thrust fixes it, whatever the wake's
shape. Far below, the flow is momentum theory's slipstream, twice the first state's over κ²: far(p) = C(p/κ), of which a
contracted wake brings κ² of the cylinder's flux to the ground. Between them it passes with e^{−s/L}. That is a
description and no solution: between the two the flow loses flux.

Over ground the wake can contract less, since it has to run out along the plane: κ and L shrink together (the wake
leaves the disk at the same angle) by 1/(1 + (clearance/h)³). The cube is how an image's flow at the disk falls with
distance.
"""

from collections.abc import Callable
from functools import partial
from math import sqrt
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from rotorjax.errors import InputError
from rotorjax.potential.field import pressure_functions
from rotorjax.potential.modes import ModeTable, rotor_modes

NODES = 96  # along the radius, for means: the steps of the tube leave kinks
STEPS = 6  # in which the tube narrows: the inflow to 1e-3 of its mean
FIRST = rotor_modes(0, 1)
MOMENTUM, LENGTH, CLEARANCE = 1 / sqrt(2), 0.25, 0.9  # the defaults, see `contraction`
Functions = Callable[[ModeTable, Float[Array, "*N 3"]], Float[Array, "..."]]


class Contraction(eqx.Module):
    """radius (): κ, of the wake far below, over R. length (): L, the depth in which 1 − 1/e of the way there is done,
    over R. clearance (): height of the rotor over ground, over R, at which the wake contracts half as much.
    """

    radius: Float[Array, ""]
    length: Float[Array, ""]
    clearance: Float[Array, ""]

    def shared(self, share: Float[Array, ""]) -> "Contraction":
        """A wake that contracts by this share, in as much of the way."""
        return Contraction(1 - share * (1 - self.radius), share * self.length, self.clearance)

    def over(self, height: Float[Array, ""]) -> "Contraction":
        """The wake of a rotor that hovers at a height over ground, over R."""
        return self.shared(1 / (1 + (self.clearance / height) ** 3))

    def radii_down_to(self, depth: Float[Array, "*N"]) -> Float[Array, "*N"]:
        """∫ ds/ρ(s) from the disk down to a depth, over R: how many radii of its own the wake is long there."""
        length = self.length + 1e-12  # a wake that does not contract has none
        rho = self.radius + (1 - self.radius) * jnp.exp(-depth / length)
        return (depth + length * jnp.log(rho)) / self.radius

    def in_stream(self, ratio: Float[Array, ""]) -> "Contraction":
        """The wake in a stream. ratio: V_T of the disk over that of the slipstream, ½ in hover, 1 where the wind
        outruns the inflow: momentum theory's κ².
        """
        return self.shared((1 - jnp.sqrt(ratio)) / (1 - MOMENTUM))


def contraction(radius: float = MOMENTUM, length: float = LENGTH, clearance: float = CLEARANCE) -> Contraction:
    """Make a contraction; see `Contraction`.

    The far radius is momentum theory's (Landgrebe's tip vortex: 0.78), the length and the clearance are rounded from
    the free wake's inflow out of ground effect and at h = 1 (benchmarks/contraction.py). Raises InputError where the
    radius is not in (0, 1] or another number is not positive.
    """
    if not 0 < radius <= 1:
        raise InputError(f"Argument `radius` must lie in (0, 1] (of the wake far below, over R), but is {radius}")
    for name, value in {"length": length, "clearance": clearance}.items():
        if not (np.isfinite(value) and value > 0):
            raise InputError(f"Argument `{name}` must be positive and finite (over R), but is {value}")
    return Contraction(*(jnp.asarray(v, float) for v in (radius, length, clearance)))


class Copies(NamedTuple):
    """Cylinders that make up the near flow without A, K of them: scale, below: the k-th one's velocity at a point p is
    C((p + below ẑ)/scale); weight: of it.
    """

    scale: Float[Array, " K"]
    below: Float[Array, " K"]
    weight: Float[Array, " K"]


def _copies(wake: Contraction) -> Copies:
    """The cylinder itself, then what each step takes away and puts in its place."""
    done = np.arange(STEPS + 1) / STEPS  # share of the contraction
    rho, middle = 1 - (1 - wake.radius) * done, (done[1:] + done[:-1]) / 2
    depth, one = -wake.length * np.log1p(-middle), jnp.ones(1)
    return Copies(
        jnp.concatenate([one, rho[1:], rho[:-1]]),
        jnp.concatenate([0 * one, depth, depth]),
        jnp.concatenate([one, rho[1:] ** -2, -(rho[:-1] ** -2)]),
    )


def _each(
    functions: Functions, modes: ModeTable, points: Float[Array, "*N 3"], copies: Copies
) -> Float[Array, "... K"]:
    """Flow of each copy without its weight, the copies last, behind the points."""
    shape = (-1,) + (1,) * points.ndim
    moved = (points + copies.below.reshape(shape) * np.array([0.0, 0.0, 1.0])) / copies.scale.reshape(shape)
    return jnp.moveaxis(functions(modes, moved), -points.ndim, -1)


def _summed(parts: Float[Array, "... K"], modes: ModeTable, points: Array, weight: Array) -> Float[Array, "..."]:
    """Odd modes as the copies make them up; even ones, which bear no load, as in the cylinder, which comes first."""
    odd = jnp.asarray(modes.odd).reshape((-1,) + (1,) * (points.ndim - 1))
    return jnp.where(odd, jnp.sum(parts * weight, axis=-1), parts[..., 0])


def _tube(
    functions: Functions, modes: ModeTable, points: Float[Array, "*N 3"], wake: Contraction
) -> Float[Array, "..."]:
    """The near flow without A."""
    copies = _copies(wake)
    return _summed(_each(functions, modes, points, copies), modes, points, copies.weight)


def _means(modes: ModeTable, wake: Contraction) -> Float[Array, " M"]:
    """Area-weighted mean over the disk of the near flow of each mode without A; zero for harmonics."""
    node, weight = np.polynomial.legendre.leggauss(NODES)
    nu = (node + 1) / 2
    points = np.stack([np.sqrt(1 - nu**2), 0 * nu, 0 * nu], axis=-1)
    return jnp.where(modes.m == 0, _tube(pressure_functions, modes, jnp.asarray(points), wake) @ (nu * weight), 0.0)


@jax.jit
def disk_means(modes: ModeTable, wake: Contraction) -> Float[Array, " M"]:
    """Return the area-weighted mean inflow of each mode's unit state: 2/√3 of the first, as in the cylinder."""
    means = _means(modes, wake)
    first = means[modes.index(0, 1)] if FIRST.modes[0] in modes.modes else _means(FIRST, wake)[0]
    return 2 / sqrt(3) / first * means


@jax.jit
def disk_flow(
    modes: ModeTable, x: Float[Array, "*N"], y: Float[Array, "*N"], wake: Contraction
) -> Float[Array, "M ..."]:
    """Return the inflow of each mode's unit state, positive down, at stations (x, y) of the disk, over R."""
    points = jnp.stack([x, y, jnp.zeros_like(x)], axis=-1)
    return near_flow(pressure_functions, modes, points, wake)


@partial(jax.jit, static_argnames="functions")
def near_flow(
    functions: Functions, modes: ModeTable, points: Float[Array, "*N 3"], wake: Contraction
) -> Float[Array, "..."]:
    """Return near(p) of each mode's unit state. functions(modes, points): C, with the points' axes last."""
    amplitude = jnp.where(modes.odd, 2 / sqrt(3) / _means(FIRST, wake)[0], 1.0)
    return amplitude.reshape((-1,) + (1,) * (points.ndim - 1)) * _tube(functions, modes, points, wake)


@partial(jax.jit, static_argnames="functions")
def far_flow(
    functions: Functions, modes: ModeTable, points: Float[Array, "*N 3"], wake: Contraction
) -> Float[Array, "..."]:
    """Return far(p) of each mode's unit state: C of a cylinder of the contracted wake's radius."""
    narrow = functions(modes, points / wake.radius)
    if modes.parity == "odd":
        return narrow
    odd = jnp.asarray(modes.odd).reshape((-1,) + (1,) * (points.ndim - 1))
    return jnp.where(odd, narrow, functions(modes, points))


@partial(jax.jit, static_argnames="functions")
def wake_flow(
    functions: Functions, modes: ModeTable, points: Float[Array, "*N 3"], wake: Contraction
) -> Float[Array, "..."]:
    """Return the velocity of each mode's unit state at any hub-frame points, over R: near above, far deep below."""
    depth = jnp.maximum(-points[..., 2], 0.0)
    near = jnp.exp(-depth / (wake.length + 1e-12))  # a wake that does not contract has no length
    copies, amplitude = _copies(wake), 2 / sqrt(3) / _means(FIRST, wake)[0]
    whole = Copies(*(jnp.append(v, w) for v, w in zip(copies, (wake.radius, 0.0, 1.0), strict=True)))
    weight = jnp.append(near[..., None] * amplitude * copies.weight, 1 - near[..., None], axis=-1)
    return _summed(_each(functions, modes, points, whole), modes, points, weight)
