"""From a periodic linear model to a time-invariant one: harmonic decomposition, averaging as its simplest case.

States are written x(t) = Σ φ_h(t) x_h(t) with φ = 1, cos ωt, sin ωt, cos 2ωt, ... and slowly changing x_h; Galerkin
projection on the same functions gives constant matrices (Wereley & Hall 1990, doi:10.1109/CDC.1990.203516, in real
form).
"""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from rotorjax.errors import InputError
from rotorjax.ode.models import LinearModel, PeriodicModel


def _basis(harmonics: Sequence[int], model: PeriodicModel) -> tuple[np.ndarray, np.ndarray, tuple[str, ...]]:
    """Functions φ (K, H) and their rates at the model's times, with a suffix for names."""
    omega = 2 * np.pi / model.period
    functions, rates, suffixes = [], [], []
    for k in sorted(set(harmonics)):
        angle = k * omega * model.t
        functions += [np.cos(angle)] if k == 0 else [np.cos(angle), np.sin(angle)]
        rates += [0 * angle] if k == 0 else [-k * omega * np.sin(angle), k * omega * np.cos(angle)]
        suffixes += [""] if k == 0 else [f"|{k}c", f"|{k}s"]
    return np.stack(functions, axis=1), np.stack(rates, axis=1), tuple(suffixes)


def _project(left: np.ndarray, right: np.ndarray, matrix: Float[np.ndarray, "K i j"]) -> np.ndarray:
    """⟨φ_h M φ_k⟩ / ⟨φ_h²⟩ as one matrix, blocks by harmonic."""
    weights = left[:, :, None] * right[:, None, :] / (left.shape[0] * np.mean(left**2, axis=0)[:, None])
    blocks = np.tensordot(weights, matrix, axes=(0, 0))
    h, k, i, j = blocks.shape
    return blocks.transpose(0, 2, 1, 3).reshape(h * i, k * j)


def _name(names: tuple[str, ...], suffixes: tuple[str, ...]) -> tuple[str, ...]:
    return tuple(name + suffix for suffix in suffixes for name in names)


def harmonic_model(
    model: PeriodicModel,
    harmonics: Sequence[int] = (0,),
    input_harmonics: Sequence[int] = (0,),
    output_harmonics: Sequence[int] = (0,),
) -> LinearModel:
    """Time-invariant model of the chosen harmonics of states, inputs and outputs; (0,) alone is averaging.

    Harmonic k of a name appears as `name|kc` and `name|ks`, the coefficients of cos kωt and sin kωt with ω = 2π/period
    and t absolute. Exact where the motion has no other harmonics. The order is n (1 + 2 × number of harmonics above
    0).

    Raises InputError where a harmonic is negative, or higher than the model's times can tell apart (4 k < K).
    """
    highest, nodes = max(*harmonics, *input_harmonics, *output_harmonics, 0), model.t.size
    if min(*harmonics, *input_harmonics, *output_harmonics, 0) < 0 or (highest > 0 and 4 * highest >= nodes):
        raise InputError(
            f"Argument `harmonics` must lie in [0, {(nodes - 1) // 4}] for {nodes} times a period, but reach "
            f"{highest}: linearise at {4 * highest + 1} times or more"
        )
    x, x_rate, x_names = _basis(harmonics, model)
    u, _, u_names = _basis(input_harmonics, model)
    y, _, y_names = _basis(output_harmonics, model)
    at_rest = {"x": (x, model.x), "u": (u, np.broadcast_to(model.u, (nodes, model.u.size))), "y": (y, model.y)}
    turning = _project(x, x_rate, np.broadcast_to(np.eye(model.order), model.a.shape))
    return LinearModel(
        a=_project(x, x, model.a) - turning,
        b=_project(x, u, model.b),
        c=_project(y, x, model.c),
        d=_project(y, u, model.d),
        states=_name(model.states, x_names),
        inputs=_name(model.inputs, u_names),
        outputs=_name(model.outputs, y_names),
        input_units=model.input_units * len(u_names),
        output_units=model.output_units * len(y_names),
        state_units=model.state_units * len(x_names),
        **{
            name: _project(basis, np.ones((nodes, 1)), value[:, :, None])[:, 0]
            for name, (basis, value) in at_rest.items()
        },
        time=model.time,
        notes=model.notes,
    )


def average(model: PeriodicModel) -> LinearModel:
    """Time-invariant model from the matrices' means over the period."""
    return harmonic_model(model)
