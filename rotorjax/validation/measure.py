"""What the cases read off a solved wake."""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from rotorjax.validation.reference import Path
from rotorjax.wake.equilibrium import evaluated
from rotorjax.wake.roll_up import at_span
from rotorjax.wake.segments import lattice_nodes
from rotorjax.wake.solution import Solution


def tip_path(solution: Solution) -> Path:
    """Path of an axisymmetric wake's tip vortex from the blade on, in the blade's frame.

    Within the near wake, where it is not rolled up yet, it is the lattice at the span station of its release.
    """
    settings, state = solution.model.settings, solution.state
    lattice = np.asarray(lattice_nodes(solution.model, state.near[0]))
    rows = [at_span(solution.model, jnp.asarray(lattice[:, k]), settings.release) for k in range(lattice.shape[1])]
    nodes = np.concatenate([np.asarray(rows), np.asarray(state.far[0, 0])])
    return Path(settings.age_step * np.arange(len(nodes)), np.hypot(nodes[:, 0], nodes[:, 1]), nodes[:, 2])


def far_pitch(path: Path, blades: int) -> float:
    """Slope of z over R a radian, least squares over the turn that follows the first blade passage at 2π/B."""
    start = 2 * np.pi / blades
    inside = (path.age >= start - 1e-9) & (path.age <= start + 2 * np.pi + 1e-9)
    return float(np.polyfit(path.age[inside], path.z[inside], 1)[0])


def section_lift(solution: Solution, r: Float[np.ndarray, " N"]) -> Float[np.ndarray, " N"]:
    """Section lift coefficient at stations r (over R), linear between control points."""
    loads = evaluated(solution.model, solution.unknowns).loads
    return np.interp(r, solution.r, np.asarray(loads.cl)[0])


def clearance(solution: Solution) -> float:
    """Height over R of the lowest wake node above the ground; inf without ground."""
    ground = solution.model.ground
    if ground is None:
        return float("inf")
    heights = [ground.distance(jnp.asarray(nodes)) for nodes in (solution.state.near, solution.state.far)]
    return float(min(jnp.min(h) for h in heights))
