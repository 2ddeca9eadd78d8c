"""Steps of the inputs marched with the nonlinear wake: what a linear model has to reproduce."""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from rotorjax.errors import InputError
from rotorjax.linearisation.assembly import velocities_along
from rotorjax.linearisation.outputs import WakeOutputs, read
from rotorjax.ode.models import LinearModel
from rotorjax.ode.trajectory import march
from rotorjax.wake.dynamics import driven, inputs_of, rhs
from rotorjax.wake.loads import WakeInputs
from rotorjax.wake.model import FreeWake, WakeState, slices
from rotorjax.wake.solution import Solution

STEPS = {"collective": float(np.deg2rad(0.2)), "climb": 0.001, "height": 0.01}
"""Size of the step of each input: rad, ΩR, R."""


class Response(NamedTuple):
    """Deviation of the outputs after a step. psi (N,): azimuth since the step. outputs: fields (N, …)."""

    psi: Float[np.ndarray, " N"]
    outputs: WakeOutputs


def nonlinear_step(
    solution: Solution, name: str, size: float | None = None, *, turns: float = 1.0, samples: int = 24, steps: int = 16
) -> Response:
    """March the wake after a step of one input, by Runge-Kutta of fifth order, and give the outputs' deviations.

    size: STEPS[name] by default. samples: in a turn; steps: between two samples (`stable_steps`). Over a slope all
    blades are marched and the deviation is that from the undisturbed march.

    Raises InputError where the input is unknown, or the march leaves the finite numbers (more `steps`).
    """
    model, u = solution.model, inputs_of(solution.model)
    if getattr(u, name, None) is None:
        raise InputError(f"Argument `name` must be an input of the model, but is {name!r}")
    size = STEPS[name] if size is None else size
    moved = u._replace(**{name: getattr(u, name) + size})
    start = _instant(solution.state, model)
    psi, after = _march(start, moved, model, turns, samples, steps)
    before = _march(start, u, model, turns, samples, steps)[1] if slices(start) > 1 else None
    at_rest = _outputs(psi[:1], jax.tree.map(lambda a: a[None], start), u, model)
    rest = at_rest if before is None else _outputs(psi, before, u, model)
    change = jax.tree.map(lambda a, b: np.asarray(a) - np.asarray(b), _outputs(psi, after, moved, model), rest)
    return Response(psi, change)


def stable_steps(model: LinearModel, samples: int = 24) -> int:
    """Steps between two samples at which the march holds the model's fastest mode (the end of the blade is stiff).

    The method is stable to |λ|Δψ = 3.3 on the negative real axis (`runge_kutta.RK5`); 2.5 is left of that.
    """
    return int(np.ceil(2 * np.pi / samples * np.abs(model.poles()).max() / 2.5))


def _instant(state: WakeState, model: FreeWake) -> WakeState:
    """State at ψ = 0: one slice where the wake is axisymmetric, otherwise those of the B blades."""
    every = max(slices(state) // model.rotor.blades, 1)
    return jax.tree.map(lambda a: jnp.asarray(a)[::every], state)


def _march(
    start: WakeState, u: WakeInputs, model: FreeWake, turns: float, samples: int, steps: int
) -> tuple[np.ndarray, WakeState]:
    count = round(turns * samples)
    path = march(
        rhs, start, 0.0, 2 * np.pi / (samples * steps), count * steps, u, model, save_every=steps, progress=False
    )
    if not path.finished:
        raise InputError(f"Argument `steps` must be larger than {steps} for this wake: the march is {path.why}")
    return np.asarray(path.t), path.x


_read = eqx.filter_jit(lambda state, velocities, inputs, model: read(state, velocities, inputs, driven(model, inputs)))


def _outputs(psi: np.ndarray, states: WakeState, u: WakeInputs, model: FreeWake) -> WakeOutputs:
    """Outputs along a march, by the program that has made the velocities for the linear model too."""
    still = jax.tree.map(jnp.zeros_like, u)

    def at(k: int) -> WakeOutputs:
        state = jax.tree.map(lambda a: a[k], states)
        return _read(state, velocities_along(jnp.asarray(psi[k]), state, u, still, model)[0], u, model)

    return jax.tree.map(lambda *rows: np.stack([np.asarray(row) for row in rows]), *map(at, range(len(psi))))
