"""The periodic flight of the marched equations next to a trim in the free wake.

A trim holds the harmonics that its azimuths tell apart; what is marched has others too, and leaves the trim's wake by a
few hundredths of R. In flight the wind carries disturbances away, so that a passage of the march is nearly a fixed
point's own iteration; Anderson's finds the state that comes back after it.
"""

from collections.abc import Callable
from dataclasses import replace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import PyTree

from rotorjax.coupled import Coupled
from rotorjax.linearisation.drive import Drive
from rotorjax.linearisation.rotor import Base, SteadyState, rates
from rotorjax.ode.anderson import anderson
from rotorjax.ode.orbit import make_orbit
from rotorjax.ode.outcome import relative_rms
from rotorjax.ode.runge_kutta import RK4
from rotorjax.ode.trajectory import integrate, march

TOL = 1e-7
"""Relative rms by which the state may miss itself after a passage."""
MOST = 120
"""Passages at most."""


def mirrored(x: PyTree, blades: int) -> PyTree:
    """Multi-blade coordinates (leading axes of B) as they are called a B-th of a revolution later: differential ones
    change their sign.
    """
    if blades % 2:
        return x
    sign = np.append(np.ones(blades - 1), -1.0)
    return jax.tree.map(lambda v: v * jnp.asarray(sign, v.dtype).reshape(-1, *[1] * (v.ndim - 1)), x)


class Passage(eqx.Module):
    """State a passage later, called as at its start; steps of the march in it."""

    steps: int = eqx.field(static=True)

    def __call__(self, x: SteadyState, u: Drive, p: Coupled) -> SteadyState:
        """March and turn."""
        dt = 2 * np.pi / p.rotor.blades / self.steps
        end = integrate(rates, x, 0.0, dt, self.steps, u, p, save_every=self.steps, tableau=RK4).last
        return mirrored(end, p.rotor.blades)


def settled(base: Base, steps: int, progress: Callable[[str, float], None] | None = None) -> Base:
    """The trim with an orbit of the marched equations, at `steps` azimuths of a passage; not converged where none is
    found.
    """
    last = {"size": np.inf}

    def measure(f: np.ndarray, x: np.ndarray) -> float:
        last["size"] = relative_rms(f, x)
        if progress is not None:
            progress("periodic flight", last["size"])
        return last["size"]

    found = anderson(
        Passage(steps),
        base.orbit.start,
        base.u,
        base.p,
        window=12,
        mixing=1.0,
        tol=TOL,
        max_iterations=MOST,
        measure=measure,
    )
    why = found.why if found.converged else f"no periodic flight of the march is found near the trim: {found.why}"
    dt = 2 * np.pi / base.p.rotor.blades / steps  # step by step, by the program that marches the inputs' steps too
    path = march(rates, found.x, 0.0, dt, steps, base.u, base.p, progress=False, tableau=RK4)
    states = jax.tree.map(lambda v: v[:steps], path.x)
    return base._replace(orbit=make_orbit(0.0, states, base.orbit.period, replace(found, why=why)))
