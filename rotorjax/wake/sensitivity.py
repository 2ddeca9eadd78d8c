"""The periodic wake as a function of its model, for jax to differentiate, batch and compile.

The search for a wake runs on the host, with numbers (solution.py). What it finds moves with the model so that it stays
periodic (implicit function theorem, ode/implicit.py), and everything that is read off it moves along.
"""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.core import eval_context
from jaxtyping import Array, Float

from rotorjax.checks import known
from rotorjax.device import as_outside, host_threads, on_cpu
from rotorjax.errors import InputError
from rotorjax.ode.implicit import attach
from rotorjax.wake import solution as on_host
from rotorjax.wake.equilibrium import Unknowns, residual, spread
from rotorjax.wake.model import FreeWake
from rotorjax.wake.preconditioner import HarmonicInverse, harmonic_inverse
from rotorjax.wake.search import Progress
from rotorjax.wake.solution import Solution, readings
from rotorjax.wake.start import laid_level


def solve(
    model: FreeWake, start: Solution | None = None, progress: Progress | None = None, tol: float = 1e-7
) -> Solution:
    """Find the periodic wake of a model; `solution.solve`, under jax.grad, jacfwd, vmap and jit too.

    Arguments, and what comes back without tracing: as `solution.solve`. Under tracing every array of the solution has
    its derivative by every number of the model, at the cost of one linear solve for each direction (reverse: for each
    output); batches are solved one after the other; under jit the search is a call to the host.

    Raises InputError under tracing where the search does not converge, since then there is nothing to differentiate
    (under jit: a runtime error with the same words), and under jit with one thread for XLA (one core, or NPROC=1),
    which may wait for ever.
    """
    if known(model):
        return on_host.solve(model, start, progress, tol)
    fixed = jax.lax.stop_gradient(model)
    slices = 1 if model.axisymmetric else model.settings.azimuths
    if known(fixed):
        x = jax.tree.map(jnp.asarray, _found(fixed, start, progress, tol, slices))
    else:
        if on_cpu() and host_threads() < 2:
            raise InputError(
                "A free wake solved under jax.jit calls the host, whose programs may wait for ever for the only "
                "thread that XLA has on one core: set NPROC=2 in the environment before jax starts, or solve outside "
                "of jax.jit"
            )
        numbers, rest = eqx.partition(fixed, eqx.is_array)

        def search(numbers: FreeWake) -> Unknowns:
            plain = jax.tree.map(np.asarray, numbers)  # bound to no device
            with as_outside():
                return _found(eqx.combine(plain, rest), start, None, tol, slices)

        x = jax.pure_callback(search, _shapes(model, slices), numbers, vmap_method="sequential")
    return readings(model, _attached(x, model))


def periodic_wake(solution: Solution, model: FreeWake) -> Unknowns:
    """The converged wake, with its derivative by every number of the model (implicit function theorem).

    Its value is the solution's, whatever the model: give the solution's own. The derivative is one product with the
    inverse Jacobian, which is assembled once (preconditioner.py), in forward and in reverse mode; over a slope a few
    tens of preconditioned products. Raises InputError where the solution did not converge.
    """
    if not solution.converged:
        raise InputError(f"Argument `solution` must be converged to have a derivative, but: {solution.why}")
    x = jax.tree.map(jnp.asarray, solution.unknowns)
    if x.near.shape[0] > 1:
        return _attached(x, model)
    with jax.ensure_compile_time_eval():  # the solution is at hand: nothing of this belongs into the caller's program
        inverse = _axisymmetric(x, solution.model)
    return attach(residual, x, model, inverse=inverse, refinements=0)


def _attached(x: Unknowns, model: FreeWake) -> Unknowns:
    """Unknowns that move with the model."""
    if x.near.shape[0] == 1:
        return attach(residual, x, model, inverse=_axisymmetric, refinements=0)
    return attach(residual, x, model, method="gmres", precondition=_over_a_slope)


def _axisymmetric(x: Unknowns, model: FreeWake) -> Float[Array, "n n"]:
    """Inverse Jacobian of an axisymmetric wake."""
    return jnp.real(harmonic_inverse(model, x, 1).inverse[0])


def _over_a_slope(x: Unknowns, model: FreeWake) -> HarmonicInverse:
    """Inverse Jacobian of a wake over level ground like this one: with it GMRES needs a few tens of products."""
    return harmonic_inverse(model.levelled, laid_level(x, model.floor), x.near.shape[0])


def _found(model: FreeWake, start: Solution | None, progress: Progress | None, tol: float, slices: int) -> Unknowns:
    """The unknowns of a converged search, of K slices. Raises InputError where it does not converge."""
    with eval_context():  # numbers all the way, whatever traces are open around this
        found = on_host.solve(jax.tree.map(jnp.asarray, model), start, progress, tol)
    if not found.converged:
        raise InputError(
            f"Argument `model` must have a periodic wake that is found, to be traced, but the search ended: {found.why}"
        )
    return jax.tree.map(np.asarray, spread(found.unknowns, slices))


def _shapes(model: FreeWake, slices: int) -> Unknowns:
    """Shapes of the unknowns of K slices."""
    s, dtype = model.settings, jnp.result_type(float)
    near, far = (slices, s.panels + 1, s.near_ages, 3), (slices, s.filaments, s.far_ages, 3)
    shapes = (near, far, (slices, s.panels))
    return Unknowns(*(jax.ShapeDtypeStruct(shape, dtype) for shape in shapes))  # type: ignore[arg-type]
