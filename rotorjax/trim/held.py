"""Blades left to flap at held controls over a fixed hub: wake and flapping as one periodic problem.

Their lag hinges are held: a steady lag turns each blade and its wake about the hinge, and leaves the loads as they are
but for the blade's tip, which comes closer to the shaft by e(1 − cos ζ), under 1e-3 R.
It starts from the wake of rigid blades, which has its own continuation (wake/solution.py). Where that is too far from
the wake of coned blades, as near the ground, the blades' place in the wake is moved there in steps.
"""

from dataclasses import dataclass, replace
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from rotorjax.ode.continuation import Steps, continuation
from rotorjax.ode.linear import Krylov
from rotorjax.ode.newton import newton
from rotorjax.rotor.flap_lag import blade_of
from rotorjax.rotor.hub import rotor_inputs
from rotorjax.trim.free_wake import InWake, WakeTrim, blade_defect, flown, harmonic, loads_of
from rotorjax.trim.in_wake import TrimmedInWake
from rotorjax.trim.means import means
from rotorjax.wake.clock import Clock
from rotorjax.wake.equilibrium import Unknowns, evaluate, evaluated, transported
from rotorjax.wake.model import FreeWake
from rotorjax.wake.performance import disk_mean
from rotorjax.wake.preconditioner import HarmonicInverse
from rotorjax.wake.search import Progress, Search
from rotorjax.wake.solution import Solution, read

SMALLEST = 0.05
"""Least step on the way from rigid to flapping blades, over the whole way."""


class Flapping(NamedTuple):
    """Unknowns. wake: K slices. flap (K,): rad."""

    wake: Unknowns
    flap: Float[Array, " K"]


@dataclass(frozen=True)
class Flapped:
    """The rotor with flapping blades. solution: its inflow is normal to the blades. flap (K,): rad."""

    solution: Solution
    flap: np.ndarray

    @property
    def harmonics(self) -> np.ndarray:
        """β₀, β₁c, β₁s (rad)."""
        return np.asarray(harmonic(jnp.asarray(self.flap)))


def residual(x: Flapping, p: WakeTrim, share: Float[Array, ""]) -> Flapping:
    """How far one pass moves wake and blades; zero in the periodic state. The thrust of p is not asked for.

    share: of the flap angle that the wake and the loads get to see; 1 but on the way there.
    """
    model = flown(_with_controls(x._replace(flap=share * x.flap), p), p)
    found = evaluate(model, x.wake)
    wake = jax.tree.map(lambda new, old: new - old, transported(model, found), x.wake)
    return Flapping(wake, blade_defect(x.flap, 0 * x.flap, loads_of(model, found), p)[:, 0])


def let_flap(rigid: Solution, progress: Progress | None = None, tol: float = 1e-7) -> Flapped:
    """Free the blades of a converged solution in flap, at its collective.

    progress(stage, residual) is called after each step. A search that does not converge comes back with `converged`
    False and the reason. Raises InputError where the rotor has no hinge data.
    """
    clock, model = Clock(), rigid.model
    blade = blade_of(model.rotor, model.operating)
    p = WakeTrim(model, blade, rotor_inputs(), jnp.zeros(()))
    search = Search(tol, progress)
    search.prepare(model, rigid.unknowns)
    inverse = None if search.inverse is None else _Inverse(search.inverse)
    guess = Flapping(rigid.unknowns, jnp.zeros(rigid.state.near.shape[0]))
    # with none of it in the wake, flapping follows from the rigid blades' loads outright
    guess = guess._replace(flap=_residual(guess, p, jnp.zeros(())).flap)
    linear = Krylov(forcing=0.03, precondition=inverse, restart=120, restarts=1)

    def step(x, share, memory):
        goal = tol if share == 1 else max(tol, 1e-5)
        found = newton(residual, x, p, jnp.asarray(share, float), linear=linear, tol=goal, max_iterations=12)
        search.note(f"flapping {share:.2f}", found)
        return found

    branch = continuation(step, guess, 0.0, 1.0, steps=Steps(1.0, SMALLEST, 1.0), jump=1.0)
    outcome = branch.last if branch.reached else branch.failed
    assert outcome is not None
    search.ok, search.why = branch.reached, f"flapping blades: {outcome.why if branch.reached else branch.why}"
    z = _with_controls(outcome.x, p)
    solution = read(flown(z, p), outcome.x.wake, search, clock)
    flown_means = means(TrimmedInWake(z, p, outcome, outcome.iterations))
    inflow = _through_the_blades(flown(z, p), outcome.x)
    solution = replace(
        solution,
        CT=flown_means.CT,
        CP=flown_means.CQ,
        CP_profile=flown_means.CP_profile,
        CP_induced=flown_means.CQ - flown_means.CP_profile,
        inflow=np.asarray(inflow),
        mean_inflow=float(disk_mean(model, inflow)),
        iterations=rigid.iterations + solution.iterations,
        wall_time_s=rigid.wall_time_s + solution.wall_time_s,
        compile_time_s=rigid.compile_time_s + solution.compile_time_s,
    )
    return Flapped(solution, np.asarray(outcome.x.flap))


_residual = eqx.filter_jit(residual)


class _Inverse(eqx.Module):
    """Preconditioner: the wake's own, and the flapping's nearly −1."""

    wake: HarmonicInverse

    def __call__(self, v: Flapping, x: Flapping, p: WakeTrim, share: Float[Array, ""]) -> Flapping:
        return Flapping(self.wake(v.wake, x.wake, p.model), -v.flap)


def _with_controls(x: Flapping, p: WakeTrim) -> InWake:
    collective = p.model.operating.collective
    return InWake(x.wake, x.flap, 0 * x.flap, jnp.stack([collective, *jnp.zeros((2,))]))


def _through_the_blades(model: FreeWake, x: Flapping) -> Float[Array, "K R"]:
    """Inflow normal to the blades, over ΩR, positive down: what a disk that cones with them takes in."""
    control, flap = evaluated(model, x.wake).velocities.control, x.flap[:, None]
    return control[..., 0] * jnp.sin(flap) - control[..., 2] * jnp.cos(flap)
