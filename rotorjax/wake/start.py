"""A prescribed wake to start from (after Landgrebe 1972): contraction, two pitches, spreading over ground."""

import jax.numpy as jnp
import numpy as np

from rotorjax.wake.equilibrium import Unknowns
from rotorjax.wake.model import FreeWake


def prescribed(model: FreeWake, inflow: float = 0.055) -> Unknowns:
    """Axisymmetric wake (K = 1) that goes down at `inflow` (over ΩR) and contracts to 0.78 R.

    Over ground it slows towards the plane and spreads so that the flow through it is conserved.
    """
    settings = model.settings
    step = settings.age_step
    edges, stations = np.asarray(model.edges), np.asarray(model.stations)
    near_age = step * np.arange(1, settings.near_ages + 1)
    narrowing = 0.8 + 0.2 * np.exp(-0.3 * near_age)
    near = np.stack(
        [
            np.outer(edges, narrowing * np.cos(near_age)),
            -np.outer(edges, narrowing * np.sin(near_age)),
            np.tile(-0.5 * inflow * near_age, (len(edges), 1)),
        ],
        axis=-1,
    )
    age = step * (settings.near_ages + np.arange(1, settings.far_ages + 1))
    passage = 2 * np.pi / model.rotor.blades
    depth = inflow * np.where(age < passage, 0.4 * age, 0.4 * passage + (age - passage))
    radius = 0.78 + 0.22 * np.exp(-0.3 * age)
    if model.ground is not None:
        height = float(model.ground.height)
        radius = radius * np.exp(0.5 * np.clip(inflow / height * age - 1, 0, None))
        depth = height * (1 - np.exp(-inflow / height * age))
    spans = [1.0, *(min(r, 0.85) for r in settings.inboard)]
    far = np.stack([np.stack([s * radius * np.cos(age), -s * radius * np.sin(age), -depth], axis=-1) for s in spans])
    gamma = 0.36 * model.chords * np.sqrt(np.clip(1 - ((stations - 0.65) / 0.37) ** 2, 0, 1))
    return Unknowns(*(jnp.asarray(a, float)[None] for a in (near, far, gamma)))
