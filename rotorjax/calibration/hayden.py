"""Hayden's ground effect as a target: how the wake contracts, fitted so that the mean inflow follows it over height.

Hayden, J. S., "The Effect of the Ground on Helicopter Hovering Power Required", AHS 32nd Annual Forum, 1976: at
constant thrust the induced power in ground effect is k_G times that out of it, k_G = 1/(0.9926 + 0.0379 (2R/z)²). With
the same thrust the induced power falls as the inflow does, so k_G is compared with the ratio of area-weighted mean
inflows.

The two numbers that decide it are the contracted wake's radius, which says how much of the flow reaches the ground, and
the clearance at which the ground halves the contraction. The loading is axisymmetric and the ground level, so one
azimuth of the quadrature is exact.
"""

from collections.abc import Sequence
from itertools import product
from typing import Literal, get_args

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from rotorjax.calibration.parameters import Parameter, ParameterSet
from rotorjax.errors import InputError
from rotorjax.ground import plane
from rotorjax.potential import loading
from rotorjax.potential.contraction import CLEARANCE, MOMENTUM, contraction
from rotorjax.potential.ground_source import DiskQuadrature
from rotorjax.potential.model import FiniteStateModel, finite_state_model, mean_inflow, steady_state
from rotorjax.reference.published import hayden_factor

HEIGHTS = (0.5, 0.75, 1.0, 1.5, 2.0, 3.0)
LOWEST, HIGHEST = 0.3, 4.53  # over R; Hayden's factor reaches 1 at the upper end and was not measured below the lower
SHORT = 0.02  # a target that the model cannot come this close to with any values is refused
CT = 0.006  # of the given loadings; ratios do not depend on it

PARAMETERS = ParameterSet(
    "hayden",
    (
        Parameter("radius", 0.5, 1.0, MOMENTUM, "radius of the contracted wake far below, over R"),
        Parameter("clearance", 0.02, 4.0, CLEARANCE, "height over ground at which it contracts half as much, over R"),
    ),
)
Loading = Literal["elliptic", "uniform", "triangular"]
_SHAPES = {"elliptic": lambda r: r * np.sqrt(1 - r * r), "uniform": lambda r: r, "triangular": lambda r: r**2}


class HaydenData(eqx.Module):
    """What a fit to Hayden needs, H heights.

    model: over ground, its height and wake replaced during the fit. fixed (2,): radius and clearance where they are not
    fitted; free (static): names of those that are. heights (H,): over R. targets (H,): k_G. tau (H, M): pressure
    coefficients at each height, all of one thrust. alone (): mean inflow out of ground effect at that thrust, over ΩR.
    """

    model: FiniteStateModel
    fixed: Float[Array, "2"]
    free: tuple[str, ...] = eqx.field(static=True)
    heights: Float[Array, " H"]
    targets: Float[Array, " H"]
    tau: Float[Array, "H M"]
    alone: Float[Array, ""]


def hayden_data(
    heights: Sequence[float] = HEIGHTS,
    parameters: Sequence[str] = PARAMETERS.names,
    shape: Loading = "elliptic",
    tau: tuple[np.ndarray, np.ndarray] | None = None,
    source_terms: int = 5,
) -> tuple[HaydenData, ParameterSet]:
    """Make the data of a fit and the parameters to fit.

    shape: the loading dC_T/dr̄: "elliptic" ∝ r√(1−r²) (τ₁ alone, the mean inflow is momentum theory's), "uniform" ∝ r
    (constant pressure) or "triangular" ∝ r² (constant lift coefficient), both in three terms. tau: pressure
    coefficients (H, M) at each height and (M,) out of ground effect instead, of a free wake for example; those at
    each height are scaled to the thrust out of ground effect. What is not fitted is the default. Raises InputError
    where a height, a name or a shape is not allowed, or a target is out of the model's reach.
    """
    chosen = PARAMETERS.subset(parameters)
    height = _heights(heights)
    loads, free_loads = _given(shape, len(height)) if tau is None else _measured(*tau, len(height))
    model = finite_state_model(
        plane(1.0),
        radial_terms=loads.shape[1],
        ground_radial_terms=source_terms,
        slope="sheared",  # level, the same
        quadrature=DiskQuadrature(32, 1),
    )
    alone = eqx.tree_at(lambda m: m.ground, model, None)
    mean = mean_inflow(steady_state(alone, free_loads), alone)
    data = HaydenData(model, jnp.asarray(PARAMETERS.printed), chosen.names, height, hayden_factor(height), loads, mean)
    _check_reach(data)
    return data, chosen


@eqx.filter_jit
def inflow_ratio(data: HaydenData, radius: Float[Array, ""], clearance: Float[Array, ""]) -> Float[Array, " H"]:
    """Return the mean inflow at each height over that out of ground effect, at the same thrust."""
    fitted = with_wake(data.model, jnp.stack([radius, clearance]))

    def one(height, tau):
        model = eqx.tree_at(lambda m: m.ground.height, fitted, height)
        return mean_inflow(steady_state(model, tau), model) / data.alone

    return jax.vmap(one)(data.heights, data.tau)


def with_wake(model: FiniteStateModel, values: Float[Array, "2"]) -> FiniteStateModel:
    """Return the model with the wake's radius and clearance; one whose wake is a cylinder gets the default length."""
    wake = contraction() if model.wake is None else model.wake
    wake = eqx.tree_at(lambda w: (w.radius, w.clearance), wake, (values[0], values[1]))
    return eqx.tree_at(lambda m: m.wake, model, wake, is_leaf=lambda w: w is None)


def residual(values: Float[Array, " P"], data: HaydenData) -> Float[Array, " H"]:
    """Return inflow ratio minus Hayden's factor at each height, with the free parameters at `values`."""
    return inflow_ratio(data, *PARAMETERS.complete(values, data.free, data.fixed)) - data.targets


def _heights(heights: Sequence[float]) -> Float[Array, " H"]:
    array = np.asarray(list(heights), float)
    if not array.size:
        raise InputError("Argument `heights` must hold at least one height, but is empty")
    for h in array:
        if not LOWEST <= h <= HIGHEST:
            raise InputError(
                f"Argument `heights` must lie in [{LOWEST:g}, {HIGHEST:g}] (over R), where Hayden's factor holds, "
                f"but holds {h:g}"
            )
    if len(set(array)) < array.size:
        raise InputError("Argument `heights` must not repeat a height")
    return jnp.asarray(array)


def _given(shape: Loading, count: int) -> tuple[Float[Array, "H M"], Float[Array, " M"]]:
    if shape not in get_args(Loading):
        raise InputError(f"Argument `shape` must be one of {', '.join(get_args(Loading))}, but is {shape!r}")
    modes = finite_state_model(radial_terms=1 if shape == "elliptic" else 3).modes
    node, weight = np.polynomial.legendre.leggauss(128)
    r = (node + 1) / 2
    tau = loading.from_axisymmetric(jnp.asarray(_SHAPES[shape](r)), jnp.asarray(r), jnp.asarray(weight / 2), modes)
    tau = tau * CT / loading.thrust_coefficient(tau, modes)
    return jnp.broadcast_to(tau, (count, tau.size)), tau


def _measured(near: np.ndarray, alone: np.ndarray, count: int) -> tuple[Float[Array, "H M"], Float[Array, " M"]]:
    tau, free = jnp.asarray(near, float), jnp.asarray(alone, float)
    if tau.shape != (count, free.size):
        raise InputError(f"Argument `tau` must have shapes ({count}, M) and (M,), but has {tau.shape}, {free.shape}")
    if not bool(jnp.all(tau[:, 0] > 0) & (free[0] > 0)):
        raise InputError("Argument `tau` must carry a positive thrust at every height, but does not")
    return tau * (free[0] / tau[:, :1]), free


def _check_reach(data: HaydenData) -> None:
    """Raise InputError where a target lies outside what the ends of the ranges give at its height, by over SHORT."""
    ends = [inflow_ratio(data, *pair) for pair in product(*zip(PARAMETERS.lower, PARAMETERS.upper, strict=True))]
    low, high = np.min(ends, axis=0), np.max(ends, axis=0)
    for h, target, lower, upper in zip(data.heights, data.targets, low, high, strict=True):
        if not lower - SHORT <= target <= upper + SHORT:
            raise InputError(
                f"Argument `heights` must hold heights where the model can reach Hayden's factor, but at {h:g} this is "
                f"{target:.3f} and the model gives {lower:.3f} to {upper:.3f}"
            )
