"""Following a solution in a parameter: natural continuation with a secant predictor, pseudo-arclength round folds."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.flatten_util import ravel_pytree
from jaxtyping import Array, PyTree
from tqdm import tqdm

from rotorjax.errors import InputError
from rotorjax.ode.newton import newton
from rotorjax.ode.outcome import Outcome, flatten

Solve = Callable[[PyTree, float, Any], Outcome]


@dataclass(frozen=True)
class Steps:
    """Steps along a branch. first, smallest, largest: lengths, by default what the method says. easy: iterations up to
    which the next step is half as long again.
    """

    first: float | None = None
    smallest: float | None = None
    largest: float | None = None
    easy: int = 4

    def of(self, first: float, smallest: float, largest: float) -> "Steps":
        """These with the usual lengths where none is given. Raises InputError where one is not positive."""
        usual = {"first": first, "smallest": smallest, "largest": largest}
        found = {name: length if getattr(self, name) is None else getattr(self, name) for name, length in usual.items()}
        if min(found.values()) <= 0:
            raise InputError(
                "Argument `steps` must have positive lengths, and the two ends must differ, but has "
                + ", ".join(f"{name} {length:g}" for name, length in found.items())
            )
        return replace(self, **found)

    def after(self, step: float, iterations: int) -> float:
        """Length of the next step after one that took so many iterations."""
        return min(1.5 * step, self.largest or np.inf) if iterations <= self.easy else step


@dataclass(frozen=True)
class Branch:
    """Converged solutions along a parameter.

    parameters: values in the order they were reached. outcomes: one converged Outcome each. reached: whether the last
    parameter is the one asked for. why: one sentence. folds: numbers of the points at which the parameter turns back.
    failed: the last outcome that did not converge, for a look at what went wrong, or None.
    """

    parameters: tuple[float, ...]
    outcomes: tuple[Outcome, ...]
    reached: bool
    why: str
    folds: tuple[int, ...] = ()
    failed: Outcome | None = None

    @property
    def last(self) -> Outcome:
        """The outcome at the last parameter reached."""
        return self.outcomes[-1]


Carry = Callable[[PyTree, float, float], PyTree]


def _secant(outcomes: list[Outcome], parameters: list[float], target: float, carry: Carry) -> PyTree:
    """Linear extrapolation of the last two solutions to `target`, on top of what `carry` knows."""
    guess = carry(outcomes[-1].x, parameters[-1], target)
    if len(outcomes) < 2:
        return guess
    share = (target - parameters[-1]) / (parameters[-1] - parameters[-2])
    expected = carry(outcomes[-2].x, parameters[-2], parameters[-1])

    def ahead(moved, new, old):
        return np.asarray(moved) + share * (np.asarray(new) - np.asarray(old))

    return jax.tree.map(ahead, guess, outcomes[-1].x, expected)


def unchanged(x: PyTree, here: float, there: float) -> PyTree:
    """Return x: what `continuation` carries where nothing is known."""
    return x


def continuation(
    solve: Solve,
    x0: PyTree,
    start: float,
    stop: float,
    *,
    steps: Steps = Steps(),
    jump: float = 0.1,
    carry: Carry = unchanged,
    progress: bool = False,
) -> Branch:
    """Follow x(p) from p = start to stop in steps that adapt to how hard each one was.

    solve(x, p, memory): finds the solution at p from the guess x; `memory` is that of the last outcome (pass it on to
    `newton` to reuse a factorised Jacobian, or ignore it). steps: in p, by default 1/10, 1/1000 and 1/2 of the way. A
    step is halved where `solve` fails or lands on another branch: further from the guess than `jump` (relative rms) and
    than twice the step it was to correct. Guesses are extrapolated from the last two solutions; carry(x, p, p') moves a
    solution from p to p' where its main part is known (a wake with the ground), and only the rest is extrapolated.

    Where the step falls below the smallest the branch ends there, with `reached` False and the last failure kept: a
    fold (see `follow`), or a solver that needs help.

    Raises InputError where start equals stop or a step is not positive.
    """
    way = abs(stop - start)
    steps = steps.of(way / 10, way / 1000, way / 2)
    first = solve(x0, start, None)
    if not first.converged:
        return Branch((), (), False, f"no solution at the start, {start}: {first.why}", failed=first)
    with tqdm(total=way, desc="continuation", disable=not progress) as bar:
        return _walk(solve, first, (start, stop), steps, jump, carry, bar)


def _walk(
    solve: Solve, first: Outcome, ends: tuple[float, float], steps: Steps, jump: float, carry: Carry, bar: tqdm
) -> Branch:
    """The branch from the first solution on."""
    start, stop = ends
    parameters, outcomes, failed, why = [start], [first], None, f"reached {stop:.6g}"
    step = steps.first or 0.0
    while parameters[-1] != stop:
        left = stop - parameters[-1]
        # A sliver of a last step would only cost a solve: stretch this one over it.
        target = stop if abs(left) <= 1.2 * step else parameters[-1] + float(np.sign(left)) * step
        guess = _secant(outcomes, parameters, target, carry)
        found = solve(guess, target, outcomes[-1].memory)
        if found.converged and len(outcomes) > 1 and _jumped(found.x, guess, outcomes[-1].x, jump):
            found = replace(found, converged=False, why="the solver jumped to another branch")
        if found.converged:
            bar.update(abs(target - parameters[-1]))
            parameters.append(target)
            outcomes.append(found)
            step = steps.after(step, found.iterations)
            continue
        failed, step = found, min(step, abs(left)) / 2
        if step < (steps.smallest or 0.0) or found.interrupted:
            why = f"lost at {parameters[-1]:.6g} on the way to {stop:.6g}, step {step:.2g}: {found.why}"
            break
    return Branch(tuple(parameters), tuple(outcomes), parameters[-1] == stop, why, failed=failed)


def _jumped(found: PyTree, guess: PyTree, last: PyTree, jump: float) -> bool:
    found, guess, last = (np.concatenate([np.ravel(a) for a in jax.tree.leaves(x)]) for x in (found, guess, last))
    gone, allowed = np.linalg.norm(found - guess), 2 * np.linalg.norm(guess - last)
    return bool(gone > max(allowed, jump * np.linalg.norm(last)))


class _OnPlane(eqx.Module):
    """The residual and the plane across the branch, unknowns (x, parameter)."""

    residual: Callable

    def __call__(self, z: tuple, anchor: tuple, tangent: tuple, length: Array, args: tuple) -> tuple:
        x, parameter = z
        gone = _dot(tangent, jax.tree.map(jnp.subtract, z, anchor))
        return self.residual(x, parameter, *args), gone - length


def _dot(a: tuple, b: tuple) -> Array:
    """Inner product in which all of x together counts as much as the parameter: its mean plus the parameter's."""
    (x, p), (y, q) = (ravel_pytree(a[0])[0], a[1]), (ravel_pytree(b[0])[0], b[1])
    return jnp.mean(x * y) + p * q


def follow(
    residual: Callable[..., PyTree],
    first: tuple[PyTree, float],
    second: tuple[PyTree, float],
    *args: Any,
    points: int = 50,
    steps: Steps = Steps(),
    between: tuple[float, float] = (-np.inf, np.inf),
    progress: bool = False,
    **newton_settings: Any,
) -> Branch:
    """Follow residual(x, p, *args) = 0 through folds by pseudo-arclength (Keller 1977) from two solutions (x, p) on it.

    steps: arc lengths between points, in the norm √(mean square of x + p²), by default the distance of the two
    solutions, 1/1000 and 10 times of it. Ends after `points` points, or where p
    leaves `between`. Further settings go to `newton`.

    Raises InputError where the two solutions coincide.
    """
    for x, _ in (first, second):
        flatten(x)
    anchor, z = (_point(*first), _point(*second))
    distance = _distance(z, anchor)
    steps = steps.of(distance, distance / 1000, 10 * distance)
    step, smallest = steps.first or 0.0, steps.smallest or 0.0
    parameters, outcomes, failed = [], [], None
    reached, why = True, f"followed {points} points"
    for _ in tqdm(range(points), desc="branch", disable=not progress):
        found, step, failed = _correct(_OnPlane(residual), anchor, z, step, smallest, args, newton_settings)
        if found is None:
            reached, why = False, f"lost after {len(outcomes)} points at {float(z[1]):.6g}: {failed.why}"
            break
        anchor, z = z, found.x
        parameters.append(float(z[1]))
        outcomes.append(found)
        step = steps.after(step, found.iterations)
        if not between[0] <= parameters[-1] <= between[1]:
            why = f"left {between} at {parameters[-1]:.6g}"
            break
    return Branch(tuple(parameters), tuple(outcomes), reached, why, _turns(first[1], second[1], parameters), failed)


def _correct(
    on_plane: _OnPlane, anchor: tuple, z: tuple, step: float, smallest: float, args: tuple, settings: dict
) -> tuple[Outcome | None, float, Any]:
    """Next point at arc length `step` from z or less, the step that worked, and the last failure."""
    length, failed = _distance(z, anchor), None
    tangent = jax.tree.map(lambda new, old: (new - old) / length, z, anchor)
    while True:
        guess = jax.tree.map(lambda new, t, s=step: new + s * t, z, tangent)
        found = newton(on_plane, guess, z, tangent, step, args, **settings)
        if found.converged:
            return found, step, failed
        failed, step = found, step / 4
        if step < smallest or found.interrupted:
            return None, step, failed


def _point(x: PyTree, parameter: float) -> tuple:
    dtype = ravel_pytree(x)[0].dtype
    return jax.tree.map(jnp.asarray, x), jnp.asarray(parameter, dtype)


def _distance(a: tuple, b: tuple) -> float:
    gap = jax.tree.map(jnp.subtract, a, b)
    return float(jnp.sqrt(_dot(gap, gap)))


def _turns(before: float, start: float, parameters: list[float]) -> tuple[int, ...]:
    """Numbers of the points after which the parameter runs the other way."""
    moves = np.diff([before, start, *parameters])
    return tuple(int(i) - 1 for i in np.flatnonzero(moves[1:] * moves[:-1] < 0))


def critical_direction(jacobian: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
    """Least singular value of a Jacobian (n, n) with its right and left singular vectors (n,).

    Near a fold the value goes to zero; the right vector is the way in which the solution is about to run away, the
    left one says which equations cannot be met.
    """
    u, s, vt = np.linalg.svd(jacobian)
    return float(s[-1]), vt[-1], u[:, -1]
