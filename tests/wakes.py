"""The settings of the tests' wakes, and a wake made up in closed form: plausible loads in no time, no physics."""

import jax.numpy as jnp
import numpy as np

from rotorjax.wake.model import FreeWake, WakeState
from rotorjax.wake.solution import Solution

COARSE = {"panels": 8, "age_step_deg": 20.0, "near_wake_deg": 100.0, "closure_turns": 1, "closure_bundles": 2}
"""Settings that the tests and a notebook share, so that their programs are compiled once."""


def state_shapes(settings) -> dict[str, tuple[int, ...]]:
    """Of one slice's state, by name."""
    panels, strands = settings.panels, (settings.filaments, settings.far_ages)
    near = {"near": (panels + 1, settings.near_ages, 3), "gamma_near": (panels, settings.near_ages)}
    return near | {"far": (*strands, 3), "gamma_far": strands, "gamma_bound": (panels,)}


class MadeUp(Solution):
    """A solution whose wake state is made up too, so that nothing can be read off it."""

    @property
    def ground_normal_velocity_rms(self) -> float | None:
        return None if self.model.ground is None else 1e-15


def made_up(model: FreeWake, start: Solution | None = None, progress=None, *, converged: bool = True) -> Solution:
    """Loads that rise and inflow that falls as the ground comes near, more so on the side where it is nearer."""
    if progress is not None:
        progress("made up", 1e-4)
    ground = model.ground
    slope, height = (0.0, np.inf) if ground is None else (float(ground.slope), float(ground.height))
    count = model.settings.azimuths if slope else 1
    r, widths = np.asarray(model.stations), np.asarray(model.widths)
    psi = 2 * np.pi / count * np.arange(count)
    clearance = np.maximum(height - np.tan(slope) * r * np.cos(psi)[:, None], 0.1)
    relief = 1 / (1 + (4 * clearance) ** -2)
    shape = np.sqrt(1 - r**16) * np.tanh(30 * (r - 0.15))
    dct_dr = 0.0142 * r**1.6 * shape / np.sqrt(relief)
    inflow = 0.05 * relief * (0.6 + 0.8 * r**3) * shape
    thrust = float(np.mean(dct_dr @ widths))
    ages = np.linspace(0, 4 * np.pi, 25)
    path = np.stack([np.cos(psi[:, None] - ages), np.sin(psi[:, None] - ages), np.tile(-0.05 * ages, (count, 1))], -1)
    value, shapes = 0.5 + height if slope else 0.5, state_shapes(model.settings)
    state = WakeState(**{k: jnp.full((count, *v), value) for k, v in shapes.items()})
    numbers = {
        "converged": converged,
        "why": "made up" if converged else "made up to fail",
        "residual": 1e-6 if converged else 0.2,
        "load_change": 1e-6,
        "iterations": 7 if start is None else 3,
        "wall_time_s": 0.25,
        "compile_time_s": 0.125,
        "CT": thrust,
        "CP": 1.2 * thrust**1.5,
        "CP_induced": thrust**1.5,
        "CP_profile": 0.2 * thrust**1.5,
        "mean_inflow": float(np.mean(inflow @ (r * widths)) / np.sum(r * widths)),
    }
    arrays = {"r": r, "widths": widths, "psi": psi, "dct_dr": dct_dr, "inflow": inflow, "circulation": 0.1 * inflow}
    arrays |= {"tip_vortex": path, "tip_vortex_age": ages}
    fields = {"model": model, "state": state, **numbers, **{k: np.array(v) for k, v in arrays.items()}}
    return MadeUp(**fields)


def fails_at(*names: str):
    """A solver that makes up everything and does not converge at the named cases (height, slope in degrees)."""

    def solver(model: FreeWake, start: Solution | None = None, progress=None) -> Solution:
        ground = model.ground
        place = None if ground is None else (round(float(ground.height), 6), round(float(np.rad2deg(ground.slope)), 6))
        return made_up(model, start, progress, converged=place not in names)

    return solver
