"""The periodic wake as a function of the model that can be differentiated.

solution = solve(model)
thrust = lambda m: performance(m, evaluate(m, periodic_wake(solution, m))).thrust
slope = equinox.filter_grad(thrust)(model)      # by every number of the model: pitch, twist, height, cores …
"""

import jax
import jax.numpy as jnp

from rotorjax.errors import InputError
from rotorjax.ode.implicit import attach
from rotorjax.wake.equilibrium import Unknowns, residual
from rotorjax.wake.model import FreeWake
from rotorjax.wake.preconditioner import harmonic_inverse
from rotorjax.wake.solution import Solution


def periodic_wake(solution: Solution, model: FreeWake) -> Unknowns:
    """The converged wake, with its derivative by every number of the model (implicit function theorem).

    Its value is the solution's, whatever the model: give the solution's own. The derivative is one product with the
    inverse Jacobian, which is assembled once (preconditioner.py), in forward and in reverse mode.

    Raises InputError where the solution did not converge, or its wake is not axisymmetric (a slope).
    """
    if not solution.converged:
        raise InputError(f"Argument `solution` must be converged to have a derivative, but: {solution.why}")
    x = solution.unknowns
    if x.near.shape[0] != 1:
        raise InputError(
            f"Argument `solution` must be axisymmetric (level ground or none), but has {x.near.shape[0]} azimuths: "
            "over a slope use rotorjax.ode.implicit.attach(residual, x, model, method='gmres')"
        )
    with jax.ensure_compile_time_eval():  # the solution is at hand: nothing of this belongs into the caller's program
        inverse = jnp.real(harmonic_inverse(solution.model, x, 1).inverse[0])
    return attach(residual, jax.tree.map(jnp.asarray, x), model, inverse=inverse, refinements=0)
