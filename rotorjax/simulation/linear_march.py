"""A linear model stepped as the rotor is that it was made of: the same calls, a few microseconds a step.

    marched = rj.march(rj.linearise(trimmed, order=20))
    state = marched.step(marched.start, replace(marched.inputs, theta_0=...))

Inputs are held over a step. With them the state obeys z' = M z, M = [[A, B], [0, 0]], z = (x, u), whose transition over
a step is exp(dt M) where M is constant, and where it is periodic the exponential of Magnus' series to fourth order, on
Gauss' two nodes (Blanes, Casas, Oteo & Ros 2009, doi:10.1016/j.physrep.2008.11.001).
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, make_dataclass
from types import SimpleNamespace
from typing import Any

import numpy as np
import scipy.linalg
from jaxtyping import Float

from rotorjax.checks import check_whole, shown
from rotorjax.errors import InputError
from rotorjax.ode.fourier import fourier_interpolation
from rotorjax.ode.models import LinearModel, PeriodicModel
from rotorjax.ode.threads import one_thread

USUAL_STEPS = 120
SPEED = "omega_rad_s"


@dataclass(frozen=True)
class LinearState:
    """Where a march stands. x (n,): deviation from the trim. y: outputs by name, those with numbers (`CT[0]`) as an
    array (`y.CT`), the trim's included, at the start of the step that led here, NaN before the first. steps: made so
    far.
    """

    x: Float[np.ndarray, " n"]
    y: Any
    steps: int


@dataclass(frozen=True)
class LinearMarch:
    """A linear model in steps. start: the trim. inputs: the trim's, by name, those with numbers as an array, to be
    changed by `dataclasses.replace`. seconds: that a step stands for.
    """

    start: LinearState
    inputs: Any
    steps_per_turn: int
    seconds: float
    _model: LinearModel | PeriodicModel = field(repr=False)
    _moved: Float[np.ndarray, "K n n+m"] = field(repr=False)
    _read: Float[np.ndarray, "K q n+m"] = field(repr=False)
    _base: Float[np.ndarray, "K q"] = field(repr=False)

    def step(self, state: LinearState, controls: Any = None) -> LinearState:
        """The state after one step with controls held over it (None: the trim's).

        Raises InputError for controls that are not made of `inputs`, FloatingPointError where a model that grows has
        left the finite numbers.
        """
        controls = self.inputs if controls is None else controls
        if type(controls) is not type(self.inputs):
            raise InputError(
                f"Argument `controls` must be made of this march's inputs, dataclasses.replace(march.inputs, "
                f"{self._model.inputs[0]}=...), but is {type(controls).__name__}"
            )
        u = _ordered(self._model.inputs, vars(controls)) - self._model.u
        z, k = np.concatenate([state.x, u]), state.steps % len(self._moved)
        x = self._moved[k] @ z
        if not np.all(np.isfinite(x)):
            raise FloatingPointError(
                f"the march left the finite numbers in step {state.steps + 1}: the state before it is the last"
            )
        return LinearState(x, _named(self._model, self._base[k] + self._read[k] @ z), state.steps + 1)


def linear_march(model: LinearModel | PeriodicModel, steps_per_turn: int | None = None) -> LinearMarch:
    """Make a linear model a march. steps_per_turn: of a revolution, None for 120.

    Raises InputError for a model that does not know its rotor speed (those of `rj.linearise` do), or has no inputs.
    """
    steps = USUAL_STEPS if steps_per_turn is None else check_whole("steps_per_turn", steps_per_turn, 1, 100_000)
    if not model.inputs or SPEED not in model.notes:
        raise InputError(
            f"Argument `model` must have inputs and the rotor's speed among its notes ('{SPEED}'), as models of "
            f"rj.linearise do, but has inputs {shown(model.inputs)} and notes {shown(sorted(model.notes))}"
        )
    seconds = 2 * np.pi / float(model.notes[SPEED]) / steps
    dt = seconds if model.time == "seconds" else 2 * np.pi / steps
    start = _by_name(model.inputs, model.u)
    inputs = make_dataclass("Inputs", [(name, Any) for name in start], frozen=True)(**start)
    count = steps if isinstance(model, PeriodicModel) else 1
    return LinearMarch(
        start=LinearState(np.zeros(model.order), _named(model, np.full(len(model.outputs), np.nan)), 0),
        inputs=inputs,
        steps_per_turn=steps,
        seconds=seconds,
        _model=model,
        _moved=_transitions(_beside(model.a, model.b), count, dt),
        _read=_sampled(_beside(model.c, model.d), count),
        _base=_sampled(model.y, count, rank=1),
    )


def _named(model: LinearModel | PeriodicModel, y: Float[np.ndarray, " q"]) -> SimpleNamespace:
    return SimpleNamespace(**_by_name(model.outputs, y))


def _by_name(names: Sequence[str], values: np.ndarray) -> dict[str, float | np.ndarray]:
    """Numbers by name; those of one name with numbers in brackets as an array, in the order in which they come."""
    places = _places(names)
    return {name: values[at] if names[at[0]] != name else float(values[at[0]]) for name, at in places.items()}


def _ordered(names: Sequence[str], found: dict[str, Any]) -> Float[np.ndarray, " m"]:
    """The numbers that `_by_name` was given. Raises InputError where there are more or fewer."""
    values = np.empty(len(names))
    for name, at in _places(names).items():
        given = np.ravel(np.asarray(found[name], float))
        if given.size != len(at):
            raise InputError(f"Argument `controls` must hold {len(at)} of `{name}`, but holds {given.size}")
        values[at] = given
    return values


def _places(names: Sequence[str]) -> dict[str, list[int]]:
    """Where the numbers of each name stand, its brackets left out."""
    found: dict[str, list[int]] = {}
    for i, name in enumerate(names):
        found.setdefault(name.partition("[")[0], []).append(i)
    return found


def _beside(of_state: np.ndarray, of_input: np.ndarray) -> np.ndarray:
    return np.concatenate([of_state, of_input], axis=-1)


def _sampled(table: np.ndarray, count: int, share: float = 0.0, rank: int = 2) -> np.ndarray:
    """What is constant, or given over a revolution, at `count` times of it, each a share of a step late."""
    if table.ndim == rank:
        return table[None]
    angles = 2 * np.pi * (np.arange(count) + share) / count
    return np.tensordot(fourier_interpolation(len(table), angles), table, axes=1)


@one_thread
def _transitions(ab: np.ndarray, count: int, dt: float) -> Float[np.ndarray, "K n n+m"]:
    """What takes (x, u) to x a step later."""
    early, late = (_square(_sampled(ab, count, 0.5 + node)) for node in (-np.sqrt(3) / 6, np.sqrt(3) / 6))
    series = 0.5 * dt * (early + late) + np.sqrt(3) / 12 * dt**2 * (late @ early - early @ late)
    return scipy.linalg.expm(series)[:, : ab.shape[-2]]


def _square(ab: np.ndarray) -> np.ndarray:
    """[[A, B], [0, 0]] of [A, B]."""
    return np.concatenate([ab, np.zeros((len(ab), ab.shape[-1] - ab.shape[-2], ab.shape[-1]))], axis=1)
