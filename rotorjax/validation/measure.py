"""What the cases read off a solved wake."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from rotorjax.bench.record import annulus_shares
from rotorjax.frames import disk_points
from rotorjax.reference.published import Path
from rotorjax.wake.equilibrium import evaluated
from rotorjax.wake.field import velocity
from rotorjax.wake.segments import tip_vortex
from rotorjax.wake.solution import Solution


def tip_path(solution: Solution) -> Path:
    """Path of an axisymmetric wake's tip vortex from the blade on, in the blade's frame.

    Within the near wake, where it is not rolled up yet, it is the lattice at the span station of its release.
    """
    settings, state = solution.model.settings, solution.state
    nodes = np.asarray(tip_vortex(solution.model, jnp.asarray(state.near[0]), jnp.asarray(state.far[0])))
    return Path(settings.tip_ages, np.hypot(nodes[:, 0], nodes[:, 1]), nodes[:, 2])


def far_pitch(path: Path, blades: int) -> float:
    """Slope of z over R a radian, least squares over the turn that follows the first blade passage at 2π/B."""
    start = 2 * np.pi / blades
    inside = (path.age >= start - 1e-9) & (path.age <= start + 2 * np.pi + 1e-9)
    return float(np.polyfit(path.age[inside], path.z[inside], 1)[0])


def section_lift(solution: Solution, r: Float[np.ndarray, " N"]) -> Float[np.ndarray, " N"]:
    """Section lift coefficient at stations r (over R), linear between control points."""
    loads = evaluated(solution.model, solution.unknowns).loads
    return np.interp(r, solution.r, np.asarray(loads.cl)[0])


def disk_inflow(solution: Solution, azimuths: int = 48) -> float:
    """Mean inflow over ΩR of an axisymmetric wake in hover, over the area and over all azimuths between two blades.

    `Solution.mean_inflow` is the mean at the blades, where the inflow is larger than between them. azimuths: in a
    blade's passage, equally spaced and none on a blade. The root cut-out counts with the flow through it.
    """
    model, count = solution.model, azimuths
    psi = 2 * np.pi / model.rotor.blades * (np.arange(count) + 0.5) / count
    edges = np.asarray(model.edges)
    within = edges[0] * np.sqrt(np.arange(9) / 8)  # rings of equal area
    r = np.concatenate([np.sqrt((within[1:] ** 2 + within[:-1] ** 2) / 2), np.asarray(model.stations)])
    points = disk_points(jnp.asarray(np.tile(r, count)), jnp.asarray(np.repeat(psi, r.size)))
    inflow = -np.asarray(_velocity(solution.state, points, model))[0, :, 2].reshape(count, r.size)
    return float(inflow.mean(axis=0) @ np.diff(np.concatenate([within[:-1], edges]) ** 2))


def first_harmonic(
    solution: Solution, values: Float[np.ndarray, "K R"], inner: float = 0.3, outer: float = 0.9
) -> complex:
    """First harmonic over azimuth of what is given at the blades, area mean over r from `inner` to `outer`.

    Twice the mean of values · exp(iψ): the real part goes with cos ψ, the imaginary one with sin ψ.
    """
    over_azimuth = 2 * np.mean(values * np.exp(1j * solution.psi)[:, None], axis=0)
    return complex(over_azimuth @ annulus_shares(solution.widths, (inner, outer)))


_velocity = eqx.filter_jit(velocity)
