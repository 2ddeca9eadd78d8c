"""A rotor's model for a controller: blades kept as they are, the inflow small and readable.

What the time-invariant model holds beside the harmonic-0 motion of the blades seen from the hub, which is the inflow,
the harmonics of everything and the differential coordinates that act through them alone, is balanced as a system of its
own. Where enough is left, its first three states are turned into the mean and the gradients of the inflow.

A wake in slow flight grows where the blades are held still, and is damped with them; and its harmonics move its mean.
Where the small model grows, a second one is taken from the harmonics of the motion, balanced as parts of the whole,
and the better one of both kept.
"""

from dataclasses import dataclass, replace

import numpy as np
import scipy.linalg
from jaxtyping import Complex, Float

from rotorjax.errors import InputError
from rotorjax.ode.harmonic import harmonic_model
from rotorjax.ode.hill import present
from rotorjax.ode.models import LinearModel, PeriodicModel
from rotorjax.ode.reduction import balance_beside, balance_rest

HIGHEST = 2.0
"""Highest frequency (1/rev) at which a reduced model is asked to be right."""
SMALL = 0.01
"""Share of a response's largest value in the band below which its error is not told."""
FAR_DB = 6.0
"""Difference of a response from which on more does not count where small models are compared."""
INFLOW = ("lambda_0", "lambda_1c", "lambda_1s")


@dataclass(frozen=True)
class Compact:
    """A reduced model. gap_db, gap_deg (q, m): largest differences of magnitude and phase up to HIGHEST, NaN where the
    response is absent. unstable: modes with Re λ ≥ 0.
    """

    model: LinearModel
    gap_db: Float[np.ndarray, "q m"]
    gap_deg: Float[np.ndarray, "q m"]
    unstable: int


def frequencies(points: int = 60) -> Float[np.ndarray, " W"]:
    """Where errors are measured, 1/rev."""
    return np.geomspace(0.01, HIGHEST, points)


def gaps(
    one: Complex[np.ndarray, "W q m"], two: Complex[np.ndarray, "W q m"]
) -> tuple[Float[np.ndarray, "q m"], Float[np.ndarray, "q m"]]:
    """Largest differences of magnitude in dB and of phase in degrees, the first response being the reference."""
    size = np.abs(one)
    top = size.max(axis=0)
    told = size > SMALL * top
    ratio = np.where(told, two, 1.0) / np.where(told, one, 1.0)
    ratio = np.where(ratio == 0, np.finfo(float).tiny, ratio)
    absent = top <= 1e-9 * top.max()
    found = (np.abs(20 * np.log10(np.abs(ratio))), np.abs(np.rad2deg(np.angle(ratio))))
    db, deg = (np.where(absent, np.nan, gap.max(axis=0)) for gap in found)
    return db, deg


def kept_states(states: tuple[str, ...]) -> tuple[int, ...]:
    """The blades' motion as the hub meets it: flap, lag and their rates but for harmonics and differential ones."""
    motions = tuple(k for k, name in enumerate(states) if name.startswith(("beta_", "lag_")) and "|" not in name)
    return tuple(k for k in motions if "_D" not in states[k])


def check_order(order: int, kept: int) -> None:
    """Raise InputError for an order that does not hold the blades' states and one of the inflow."""
    if order <= kept:
        raise InputError(
            f"Argument `order` must be at least {kept + 1} ({kept} states of the blades are kept as they are, and one "
            f"of the inflow), but is {order}"
        )


def compact(
    model: LinearModel, order: int, truth: Complex[np.ndarray, "W q m"], motion: LinearModel | None = None
) -> Compact:
    """Reduce a rotor's time-invariant model. truth: responses at `frequencies()` that it is measured against. motion:
    of `motion_of`, from which the small model is taken where one of the mean grows and this is better in the mean of
    all responses.

    Raises InputError where the order is below the kept states.
    """
    found = [measured(reduced(model, order), truth)]
    if found[0].unstable and motion is not None and order < min(model.order, motion.order):
        kept = kept_states(motion.states)
        small = readable(balance_beside(motion, kept, order, HIGHEST).model, len(kept))
        found.append(measured(small, truth))
    return min(found, key=lambda one: float(np.nanmean(np.minimum(one.gap_db, FAR_DB))))


def measured(small: LinearModel, truth: Complex[np.ndarray, "W q m"]) -> Compact:
    """A small model with its errors."""
    return Compact(small, *gaps(truth, small.response(frequencies())), int(np.sum(np.real(small.poles()) >= 0)))


def motion_of(model: PeriodicModel, copies: int = 2) -> LinearModel:
    """Time-invariant model of a motion's mean and its lowest harmonics, as many as `copies` that its times can hold."""
    step = present(model)
    return harmonic_model(model, [k * step for k in range(copies + 1) if 4 * k * step < model.t.size])


def reduced(model: LinearModel, order: int) -> LinearModel:
    """A rotor's time-invariant model with at most `order` states.

    Raises InputError where that is below the kept ones.
    """
    kept = kept_states(model.states)
    check_order(order, len(kept))
    if order >= model.order:
        return model
    return readable(balance_rest(model, kept, order, HIGHEST).model, len(kept))


def readable(model: LinearModel, kept: int) -> LinearModel:
    """The same model with the first states after the kept ones turned into λ_0, λ_1c, λ_1s, as far as the outputs hold
    them, less what the blades' motion and the inputs do to them at once; the others are called lags.
    """
    rows = [model.outputs.index(name) for name in INFLOW if name in model.outputs]
    see, free = model.c[rows, kept:], model.order - kept
    size = np.linalg.svd(see, compute_uv=False) if rows and free >= len(rows) else np.zeros(1)
    if size[-1] <= 1e-6 * size[0]:
        return replace(model, states=model.states[:kept] + tuple(f"inflow[{i}]" for i in range(free)))
    w = np.asarray(scipy.linalg.block_diag(np.eye(kept), np.concatenate([see, scipy.linalg.null_space(see).T])))
    v, lags = np.linalg.inv(w), range(free - len(rows))
    names = (*model.states[:kept], *(model.outputs[row] for row in rows), *(f"inflow_lag[{i}]" for i in lags))
    units = (*model.state_units[:kept], *(model.output_units[row] for row in rows), *("-" for _ in lags))
    moved = {"a": w @ model.a @ v, "b": w @ model.b, "c": model.c @ v, "x": w @ model.x}
    return replace(model, **moved, states=names, state_units=units)
