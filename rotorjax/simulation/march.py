"""The coupled rotor marched step by step at a fixed cost: for a simulator's loop, and what `rotorjax simulate` flies.

    march = rj.march(trimmed)                                   # compiles, once
    state = march.start
    while flying:
        state = march.step(state, replace(march.inputs, theta_0=...))

A step is one of Runge and Kutta's classical ones, with controls held over it. A free wake is marched on the solution of
its lifting line (wake/lifting_line.py), whose filter, too fast for a step of 15 degrees, is taken exactly
(ode/exponential.py), with sums by matrix products (wake/kernel_sweeps.py), and at choice in single precision and with
what its closure and the ground induce summed once a step, or every other step, and carried on along a straight line
through the sum before. Seen from the blades that changes slowly; it is four fifths of all pairs in hover over ground.
"""

from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, replace
from typing import Any, Generic, Literal, Protocol, TypeVar, get_args

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int, PyTree

from rotorjax.checks import check_whole, shown
from rotorjax.coupled import Coupled, CoupledState, Outputs, old_induced, rate_and_output
from rotorjax.coupled_wake import CoupledWake
from rotorjax.device import full_products, on_cpu
from rotorjax.errors import InputError
from rotorjax.ode import exponential, runge_kutta
from rotorjax.panels.surface import Panels, check_clear, solid
from rotorjax.rotor.hub import RotorInputs
from rotorjax.simulation.case import OldAge, Precision
from rotorjax.simulation.start import Start, from_result
from rotorjax.simulation.step import least_steps, stable_steps, usual_steps
from rotorjax.trim.run import Result

WIDE = {"xla_cpu_prefer_vector_width": 512} if jax.__version_info__ < (0, 11) else None
"""For XLA's CPU back end: registers as wide as the machine has; a quarter off the sums' time where it has 512 bits. Not
with jax 0.11.2, which then miscompiles (tests/canary.py `wide`): a fine wake's closure was NaN from the second call on.
"""


class Turned(Protocol):
    """Inputs that hold rotor speeds over the nominal one."""

    @property
    def omega(self) -> Any:
        """Ω/Ω_ref."""
        ...


X = TypeVar("X")  # state
Y = TypeVar("Y")  # outputs
U = TypeVar("U", bound=Turned)


class MarchState(eqx.Module, Generic[X, Y]):
    """Where a march stands. x: state, azimuth from 0 to 2π. y: outputs at the start of the step that led here, NaN
    before the first. steps: made so far. finite: whether all of x is. old (2, B, N, 3): what closure and ground induced
    when they were summed last and before, None where every stage does it; every (static): steps from one sum to the
    next. Arrays have a leading axis in a batch of marches.
    """

    x: X
    y: Y
    steps: Int[Array, ""]
    finite: Bool[Array, ""]
    old: Float[Array, "2 B N 3"] | None = None
    every: int = eqx.field(static=True, default=1)


def begun(x: CoupledState, u: RotorInputs, p: Coupled, old_age: OldAge) -> MarchState[CoupledState, Outputs]:
    """State of a march before its first step."""
    y = unknown(lambda: rate_and_output(jnp.zeros(()), x, u, p)[1])
    old = None
    if isinstance(p, CoupledWake) and old_age != "stage":
        old = unknown(lambda: jnp.stack([old_induced(x, u, p)] * 2))
    every = 2 if old_age == "two steps" else 1
    return MarchState(x, y, jnp.zeros((), jnp.int32), jnp.ones((), bool), old, every)


def unknown(made: Callable[[], Y]) -> Y:
    """NaN in place of every number that a function would make."""
    return jax.tree.map(lambda v: jnp.full(v.shape, jnp.nan, v.dtype), jax.eval_shape(made))


def all_finite(x: PyTree) -> Bool[Array, ""]:
    """Whether every number of a state is finite."""
    return jnp.stack([jnp.all(jnp.isfinite(leaf)) for leaf in jax.tree.leaves(x)]).all()


def advance(
    state: MarchState[CoupledState, Outputs],
    t: Float[Array, ""],
    dt: Float[Array, ""],
    inputs: Callable[[Array], RotorInputs],
    p: Coupled,
) -> MarchState[CoupledState, Outputs]:
    """One step of dt from Ω_ref t; inputs: of Ω_ref t, asked for at each stage."""
    sums = None if state.old is None else _summed(state, inputs(t), p)
    since = state.steps % state.every

    def rate(s: Array, x: CoupledState) -> tuple[CoupledState, Outputs]:
        old = None
        if sums is not None:
            old = sums[0] + (since + (s - t) / dt) / state.every * (sums[0] - sums[1])
        return rate_and_output(s, x, inputs(s), p, old)

    x, y = _told_step(rate, t, state.x, dt, p)
    finite = all_finite(x)
    x = eqx.tree_at(lambda x: x.psi, x, jnp.mod(x.psi, 2 * np.pi))
    return MarchState(x, y, state.steps + 1, finite, sums, state.every)


def _told_step(
    rate: Callable[[Array, CoupledState], tuple[CoupledState, Outputs]],
    t: Float[Array, ""],
    x: CoupledState,
    dt: Float[Array, ""],
    p: Coupled,
) -> tuple[CoupledState, Outputs]:
    """A step and the outputs at its start. The filter of a bound circulation that follows the solution of its line
    decays at 1/τ and no faster; what follows a pass has no rate that is known beforehand.
    """
    if not isinstance(p, CoupledWake) or p.settings.bound_filter == "pass":
        return runge_kutta.told_step(rate, t, x, dt, tableau=runge_kutta.RK4)
    still = jax.tree.map(lambda _: 0.0, x)
    decay = eqx.tree_at(lambda x: x.inflow.gamma_bound, still, 1 / p.settings.circulation_lag)
    return exponential.told_step(rate, t, x, dt, decay)


def _summed(state: MarchState, u: RotorInputs, p: Coupled) -> Float[Array, "2 B N 3"]:
    """The last two sums of what closure and ground induce, a new one made where it is due."""
    assert isinstance(p, CoupledWake)
    assert state.old is not None
    last = state.old[0]

    def anew() -> Array:
        now = old_induced(state.x, u, p)
        return jnp.stack([now, jnp.where(state.steps == 0, now, last)])

    if state.every == 1:
        return anew()
    return jax.lax.cond(state.steps % state.every == 0, anew, lambda: state.old)


def precision_of(precision: Precision) -> AbstractContextManager:
    """In which to trace, compile and make arrays: single precision is that of jax without x64, in this thread alone.

    Raises InputError for an unknown one, and for double precision that jax has not switched on.
    """
    if precision not in get_args(Precision):
        raise InputError(f"Argument `precision` must be one of {get_args(Precision)}, but is {shown(precision)}")
    if precision == "single":
        return jax.enable_x64(False)
    if not jax.config.jax_enable_x64:  # pyright: ignore[reportAttributeAccessIssue]
        raise InputError("Argument `precision` must be 'single' unless jax_enable_x64 is on, but is 'double'")
    return nullcontext()


def cast(tree: PyTree, precision: Precision) -> PyTree:
    """Arrays and numbers as arrays of a precision; whole numbers and everything else as they are."""
    dtype = np.float32 if precision == "single" else np.float64

    def one(leaf: Any) -> Any:
        inexact = isinstance(leaf, jax.Array | np.ndarray | float) and np.issubdtype(np.asarray(leaf).dtype, np.inexact)
        return np.asarray(leaf, dtype) if inexact else leaf

    return jax.tree.map(one, tree)


def _is_array(leaf: Any) -> bool:
    return isinstance(leaf, jax.Array | np.ndarray)


def on_device(tree: PyTree) -> PyTree:
    """Arrays as jax's own, in the precision of the context."""
    return jax.tree.map(lambda v: jnp.asarray(v) if _is_array(v) else v, tree)


def compiled(function: Callable, *args: Any, bound: tuple = ()) -> Callable:
    """A function's program for arguments of these shapes, static leaves bound; `bound`: last arguments, which the
    program keeps. To be made inside `precision_of`.

    It is handed a flat list of arrays: to take a rotor and its settings apart costs as much as a tenth of a step.
    """
    arrays, static = eqx.partition((*args, *bound), _is_array)
    tree, kept = jax.tree.structure(arrays), _arrays(bound)

    def flat(*leaves: Array) -> Any:
        return function(*eqx.combine(jax.tree.unflatten(tree, leaves), static))

    with full_products():
        lowered = jax.jit(flat, compiler_options=WIDE if on_cpu() else None).lower(*_arrays(args), *kept)
        made = lowered.compile()
    return lambda *args: made(*_arrays(args), *kept)


def _arrays(tree: PyTree) -> list[Array]:
    return [leaf for leaf in jax.tree.leaves(tree) if _is_array(leaf)]


def stretch(
    count: int, state: MarchState, t: Float[Array, ""], dt: Float[Array, ""], driver: PyTree, p: Coupled
) -> MarchState:
    """`count` steps of dt from Ω_ref t; driver: makes inputs of Ω_ref t."""

    def one(state: MarchState, i: Array) -> tuple[MarchState, None]:
        return advance(state, t + i.astype(t.dtype) * dt, dt, driver, p), None

    return jax.lax.scan(one, state, jnp.arange(count))[0]


@dataclass(frozen=True)
class March(Generic[X, Y, U]):
    """A compiled march. start: state to begin with. inputs: of the trim, to be changed from step to step; in a batch,
    with a leading axis as the states. seconds: that a step stands for, at the nominal rotor speed. fastest: rotor speed
    over that up to which the steps are enough for a free wake.
    """

    start: MarchState[X, Y]
    inputs: U
    steps_per_turn: int
    seconds: float
    precision: Precision
    fastest: float
    _program: Callable[[MarchState[X, Y], U], MarchState[X, Y]]

    def step(self, state: MarchState[X, Y], controls: U | None = None) -> MarchState[X, Y]:
        """The state after one step with controls held over it (None: the trim's). Waits for the result.

        Raises FloatingPointError where it is not finite; the state that was given is the last one that is. Raises
        InputError where the rotor is too fast for the steps, with the number that is enough, and for controls of
        another shape.
        """
        controls = self.inputs if controls is None else self._checked(controls)
        found = jax.block_until_ready(self._program(state, controls))
        if not np.all(found.finite):
            raise FloatingPointError(
                f"the march left the finite numbers in step {np.max(found.steps)}: the state before it is the last"
            )
        return found

    def _checked(self, controls: U) -> U:
        """Controls in the march's precision, of a rotor speed that the steps can follow."""
        given, wanted = ([np.shape(v) for v in jax.tree.leaves(tree)] for tree in (controls, self.inputs))
        if given != wanted:
            raise InputError(f"Argument `controls` must be made of `inputs`, arrays of {wanted}, but holds {given}")
        if (speed := float(np.max(controls.omega))) > self.fastest:
            steps = self.steps_per_turn
            raise InputError(
                f"Argument `controls` must have omega <= {self.fastest:.3g} with {steps} steps a revolution, but has "
                f"{speed:g}: march with steps_per_turn = {int(np.ceil(steps * speed / self.fastest))}"
            )
        return cast(controls, self.precision)


def marching(p: Coupled, **choices: Any) -> Coupled:
    """The coupled rotor as it is marched: a free wake on the solution of its lifting line, or as `choices` say."""
    if not isinstance(p, CoupledWake):
        return p
    return replace(p, settings=replace(p.settings, **{"bound_filter": "solution", "pair_sums": "products", **choices}))


def march(
    trimmed: Result | Start,
    steps_per_turn: int | None = None,
    *,
    precision: Precision = "single",
    old_age: OldAge = "step",
    batch: int | None = None,
    bound_filter: Literal["pass", "solution"] = "solution",
    surfaces: Panels | None = None,
) -> March[CoupledState, Outputs, RotorInputs]:
    """March a trim with any inflow, one step at a time (the module tells how).

    steps_per_turn: of a revolution, None for what the wake needs, at least 24, or 120 without one. old_age: what a free
    wake's closure and the ground induce is summed in "two steps", a "step" or a "stage" once. batch: so many marches at
    once, states and controls with a leading axis. bound_filter: "pass" for the paper's, which needs ten times the
    steps. surfaces: what the hub of a free wake flies past, in level axes; they stand in the air, and controls say
    where the hub is among them (`place`, over R, zero at the start).

    Raises InputError where the steps are too few for the wake, with the number that is enough.
    """
    if batch is not None:
        check_whole("batch", batch, 1, 100_000)
    if old_age not in get_args(OldAge):
        raise InputError(f"Argument `old_age` must be one of {get_args(OldAge)}, but is {shown(old_age)}")
    context = precision_of(precision)
    start = trimmed if isinstance(trimmed, Start) else from_result(trimmed)
    start = start if surfaces is None else _past(start, surfaces)
    start = replace(start, p=marching(start.p, bound_filter=bound_filter))
    steps = _steps(start, steps_per_turn)
    angle = 2 * np.pi / steps
    with context:
        x, u, p = on_device(cast((start.x, start.inputs, start.p), precision))
        first = begun(x, u, p, old_age)
        dt = jnp.asarray(angle)

        def one(state: MarchState, controls: RotorInputs, p: Coupled) -> MarchState:
            return advance(state, jnp.zeros_like(dt), dt, lambda _: controls, p)

        if batch is not None:
            first, u = jax.tree.map(lambda v: jnp.broadcast_to(v, (batch, *v.shape)), (first, u))
        run = one if batch is None else _several(one)
        program = compiled(run, first, u, bound=(p,))
    seconds = angle / float(start.p.operating.omega)
    needed = stable_steps(start)
    return March(first, u, steps, seconds, precision, steps / needed if needed else np.inf, program)


def _steps(start: Start, wanted: int | None) -> int:
    """Steps of a revolution, the usual ones where none are wanted. Raises InputError where those are too few."""
    if wanted is None:
        return usual_steps(start)
    steps = check_whole("steps_per_turn", wanted, 1, 100_000)
    if steps < (least := least_steps(start)):
        raise InputError(f"Argument `steps_per_turn` must be at least {least} for this wake, but is {steps}")
    return steps


def _past(start: Start, surfaces: Panels) -> Start:
    """The start with surfaces that the hub flies past. Raises InputError without a free wake, and as `solid` does."""
    if not isinstance(start.p, CoupledWake) or start.p.surfaces is not None:
        raise InputError("Argument `surfaces` must come with a trim in the free wake that has none of its own")
    check_clear(surfaces)
    closed = replace(solid(surfaces, start.p.ground), wind=jnp.zeros(3))
    return replace(start, p=replace(start.p, surfaces=closed), inputs=replace(start.inputs, place=jnp.zeros(3)))


def _several(one: Callable) -> Callable:
    """Of marches side by side: one after the other on a CPU, whose caches a single one fills, at once elsewhere."""

    def all_of(states: MarchState, controls: RotorInputs, p: Coupled) -> MarchState:
        if on_cpu():
            return jax.lax.map(lambda both: one(*both, p), (states, controls))
        return jax.vmap(lambda s, u: one(s, u, p))(states, controls)

    return all_of
