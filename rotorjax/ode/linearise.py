"""Linear models about a periodic orbit: A(t), B(t), C(t), D(t) by forward mode, a few columns at a time."""

from collections.abc import Callable, Mapping, Sequence

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.flatten_util import ravel_pytree
from jaxtyping import Array, Float, PyTree
from tqdm import tqdm

from rotorjax.ode.jacobian import CHUNK, value_and_jacobian
from rotorjax.ode.labels import labels, select, units_of
from rotorjax.ode.models import PeriodicModel
from rotorjax.ode.orbit import Orbit, require_converged
from rotorjax.ode.outcome import flatten, traceable
from rotorjax.ode.structure import require_like

Output = Callable[[Array, PyTree, PyTree, PyTree], PyTree]
Derivative = Callable[[Array, PyTree], tuple[np.ndarray, np.ndarray]]


class _Joint(eqx.Module):
    """(x, chosen u) ↦ (rhs, output) between flat vectors: one Jacobian holds A, B, C and D."""

    rhs: Callable
    output: Output
    of_state: Callable = eqx.field(static=True)
    of_input: Callable = eqx.field(static=True)
    chosen: tuple[int, ...] = eqx.field(static=True)

    def __call__(self, z: Float[Array, " n+m"], t: Array, inputs: Float[Array, " M"], p: PyTree) -> Array:
        n = z.size - len(self.chosen)
        x = self.of_state(z[:n])
        u = self.of_input(inputs.at[jnp.array(self.chosen, int)].set(z[n:].astype(inputs.dtype)))
        parts = (ravel_pytree(self.rhs(t, x, u, p))[0], ravel_pytree(self.output(t, x, u, p))[0])
        return jnp.concatenate([part.astype(z.dtype) for part in parts])


def linearise(
    rhs: Callable[[Array, PyTree, PyTree, PyTree], PyTree],
    output: Output,
    orbit: Orbit,
    u: PyTree,
    p: PyTree = None,
    *,
    inputs: Sequence[str] | None = None,
    outputs: Sequence[str] | None = None,
    units: Mapping[str, str] | None = None,
    nodes: int | None = None,
    chunk: int = CHUNK,
    progress: bool = False,
    derivative: Derivative | None = None,
) -> PeriodicModel:
    """Linearise x' = rhs(t, x, u, p), y = output(t, x, u, p) about an orbit, at equally spaced times of the period.

    u: constant inputs, pytree of floating-point arrays. inputs, outputs: names to keep (`collective`, `inflow[2]`, or
    a group without index), all by default; they come from the pytrees' own keys. units: by name or group, kept with
    the model. nodes: number of times, the orbit's own by default, otherwise by trigonometric interpolation of the
    orbit. chunk: columns a pass: memory is that of `chunk` evaluations beside the result, K (n + q)(n + m) numbers.
    derivative(t, x): value (n + q,) of rhs and output and its Jacobian (n + q, n + m) by x and u, none left out, in
    the order of `ravel_pytree`: where the caller has a cheaper way to it than forward mode column by column.

    Raises InputError where the orbit has not converged, a name is unknown, or rhs returns another structure than the
    state's.
    """
    times, states = _sampled(orbit, nodes)
    start = jax.tree.map(lambda leaf: np.asarray(leaf)[0], states)
    u, p = traceable((u, p))
    slope, result = eqx.filter_eval_shape(lambda *a: (rhs(*a), output(*a)), times[0], start, u, p)
    require_like(slope, start, "rhs(t, x, u, p)")
    x_names, u_names, y_names = labels(start, "x"), labels(u, "u"), labels(result, "y")
    chosen, kept = select(u_names, inputs, "inputs"), select(y_names, outputs, "outputs")
    flat_u, of_input = flatten(u, "u")
    of_state = ravel_pytree(start)[1]
    joint = _Joint(rhs, output, of_state, of_input, tuple(map(int, chosen)))
    flat_x = np.concatenate([np.asarray(leaf).reshape(times.size, -1) for leaf in jax.tree.leaves(states)], axis=1)
    n, rows = len(x_names), np.concatenate([np.arange(len(x_names)), len(x_names) + kept])
    z = np.concatenate([flat_x, np.tile(np.asarray(flat_u, flat_x.dtype)[chosen], (times.size, 1))], axis=1)
    if derivative is None:
        whole, values = _sweep(joint, z, times, (flat_u, p), rows, chunk, progress)
    else:
        whole, values = _given(derivative, times, states, rows, np.concatenate([np.arange(n), n + chosen]))
    names = (x_names, tuple(u_names[i] for i in chosen), tuple(y_names[i] for i in kept))
    about = (flat_x, np.asarray(flat_u)[chosen], values[:, n:])
    return _model(np.asarray(times), float(orbit.period), whole, about, names, units)


def _model(
    times: np.ndarray,
    period: float,
    whole: np.ndarray,
    about: tuple[np.ndarray, np.ndarray, np.ndarray],
    names: tuple[tuple[str, ...], tuple[str, ...], tuple[str, ...]],
    units: Mapping[str, str] | None,
) -> PeriodicModel:
    """The model of [[A, B], [C, D]] at the times (K, n + q, n + m), about (x, u, y) with these names."""
    n = len(names[0])
    states, inputs, outputs = names
    x, u, y = about
    return PeriodicModel(
        t=times,
        period=period,
        a=whole[:, :n, :n],
        b=whole[:, :n, n:],
        c=whole[:, n:, :n],
        d=whole[:, n:, n:],
        states=states,
        inputs=inputs,
        outputs=outputs,
        state_units=units_of(states, units),
        input_units=units_of(inputs, units),
        output_units=units_of(outputs, units),
        x=x,
        u=u,
        y=y,
    )


def _sampled(orbit: Orbit, nodes: int | None) -> tuple[Array, PyTree]:
    """Times and states of a converged orbit, its own or interpolated."""
    require_converged(orbit)
    if nodes is None:
        return orbit.t, orbit.x
    times = orbit.t[0] + orbit.period * jnp.linspace(0, 1, nodes, endpoint=False)
    return times, orbit.at(times)


def _given(
    derivative: Derivative, times: Array, states: PyTree, rows: np.ndarray, columns: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Chosen rows and columns of the caller's Jacobian, and of its value, at every time."""
    pairs = [derivative(t, jax.tree.map(lambda leaf, k=k: leaf[k], states)) for k, t in enumerate(times)]
    whole = np.stack([jacobian[np.ix_(rows, columns)] for _, jacobian in pairs])
    return whole, np.stack([value[rows] for value, _ in pairs])


def _sweep(
    joint: _Joint, z: np.ndarray, times: Array, args: tuple, rows: np.ndarray, chunk: int, progress: bool
) -> tuple[np.ndarray, np.ndarray]:
    """Chosen rows of the Jacobian and of the value at every time."""
    whole = np.empty((times.size, rows.size, z.shape[1]), z.dtype)
    values = np.empty((times.size, rows.size), z.dtype)
    for k in tqdm(range(times.size), desc="linearise", disable=not progress):
        value, jacobian = value_and_jacobian(joint, z[k], times[k], *args, chunk=chunk, progress=progress)
        whole[k], values[k] = jacobian[rows], value[rows]
    return whole, values
