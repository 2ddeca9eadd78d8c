"""Hayden's ground effect as a target: the factor b^{η^p} fitted so that the mean inflow follows it over height.

Hayden, J. S., "The Effect of the Ground on Helicopter Hovering Power Required", AHS 32nd Annual Forum, 1976: at
constant thrust the induced power in ground effect is k_G times that out of it, k_G = 1/(0.9926 + 0.0379 (2R/z)²). With
the same thrust the induced power falls as the inflow does, so k_G is compared with the ratio of area-weighted mean
inflows.

The loading is axisymmetric and the ground level, so one azimuth of the quadrature is exact.
"""

from collections.abc import Sequence
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
from rotorjax.potential.ground_source import DiskQuadrature
from rotorjax.potential.model import FiniteStateModel, finite_state_model, mean_inflow, steady_state
from rotorjax.reference.published import hayden_factor

HEIGHTS = (0.5, 0.75, 1.0, 1.5, 2.0, 3.0)
LOWEST, HIGHEST = 0.3, 4.53  # over R; Hayden's factor reaches 1 at the upper end and was not measured below the lower
SHORT = 0.02  # a target that the model cannot come this close to with any b is refused
CT = 0.006  # of the given loadings; ratios do not depend on it

PARAMETERS = ParameterSet(
    "hayden",
    (
        Parameter("b", 1e-3, 1.0, float(np.pi / 7), "base of the factor b^(η^p) on the r = j terms"),
        Parameter("p", 0.1, 4.0, 2.0, "exponent of η in the factor b^(η^p)"),
    ),
)
Loading = Literal["elliptic", "uniform", "triangular"]
_SHAPES = {"elliptic": lambda r: r * np.sqrt(1 - r * r), "uniform": lambda r: r, "triangular": lambda r: r**2}


class HaydenData(eqx.Module):
    """What a fit to Hayden needs, H heights.

    model: over ground, its height and correction replaced during the fit. fixed (2,): b and p where they are not
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
    parameters: Sequence[str] = ("b", "p"),
    shape: Loading = "elliptic",
    tau: tuple[np.ndarray, np.ndarray] | None = None,
    source_terms: int = 5,
    b: float = float(np.pi / 7),
    p: float = 2.0,
) -> tuple[HaydenData, ParameterSet]:
    """Make the data of a fit and the parameters to fit.

    shape: the loading dC_T/dr̄: "elliptic" ∝ r√(1−r²) (τ₁ alone, the mean inflow is momentum theory's), "uniform" ∝ r
    (constant pressure) or "triangular" ∝ r² (constant lift coefficient), both in three terms. tau: pressure
    coefficients (H, M) at each height and (M,) out of ground effect instead, of a free wake for example; those at
    each height are scaled to the thrust out of ground effect. b, p: what is not fitted. Raises InputError where a
    height, a name or a shape is not allowed, or a target is out of the model's reach.
    """
    chosen = PARAMETERS.subset(parameters)
    height = _heights(heights)
    loads, free_loads = _given(shape, len(height)) if tau is None else _measured(*tau, len(height))
    model = finite_state_model(
        plane(1.0),
        radial_terms=loads.shape[1],
        ground_radial_terms=source_terms,
        b=b,
        p=p,
        quadrature=DiskQuadrature(32, 1),
    )
    alone = eqx.tree_at(lambda m: m.ground, model, None)
    mean = mean_inflow(steady_state(alone, free_loads), alone)
    fixed = jnp.asarray([b, p], float)
    data = HaydenData(model, fixed, chosen.names, height, hayden_factor(height), loads, mean)
    _check_reach(data)
    return data, chosen


@eqx.filter_jit
def inflow_ratio(data: HaydenData, b: Float[Array, ""], p: Float[Array, ""]) -> Float[Array, " H"]:
    """Return the mean inflow at each height over that out of ground effect, at the same thrust."""

    def one(height, tau):
        model = eqx.tree_at(lambda m: (m.ground.height, m.correction.b, m.correction.p), data.model, (height, b, p))
        return mean_inflow(steady_state(model, tau), model) / data.alone

    return jax.vmap(one)(data.heights, data.tau)


def residual(values: Float[Array, " P"], data: HaydenData) -> Float[Array, " H"]:
    """Return inflow ratio minus Hayden's factor at each height, with the free parameters at `values`."""
    b, p = PARAMETERS.complete(values, data.free, data.fixed)
    return inflow_ratio(data, b, p) - data.targets


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
    """Raise InputError where a target lies outside what any b gives at its height, by more than SHORT."""
    low, high = (np.asarray(_ratio_at(data, b)) for b in (PARAMETERS.upper[0], 1e-12))
    for h, target, lower, upper in zip(data.heights, data.targets, low, high, strict=True):
        if not lower - SHORT <= target <= upper + SHORT:
            raise InputError(
                f"Argument `heights` must hold heights where the model can reach Hayden's factor, but at {h:g} this is "
                f"{target:.3f} and the model gives {lower:.3f} to {upper:.3f}"
            )


@eqx.filter_jit
def _ratio_at(data: HaydenData, b: float) -> Float[Array, " H"]:
    return inflow_ratio(data, jnp.asarray(b, float), jnp.asarray(1.0))
