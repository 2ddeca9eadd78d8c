"""A hovering rotor's measurements as data for the free wake's own parameters, with their exact sensitivities.

The rotor is Caradonna and Tung's at 8°, measured more fully than any other: thrust, section lift, path of the tip
vortex. What the free wake makes of them is differentiated through the periodic wake: the wake moves with a parameter so
that it stays periodic (implicit function theorem, `ode.implicit.attach`), and one inverse Jacobian serves all.
"""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from rotorjax.calibration.parameters import Parameter, ParameterSet
from rotorjax.errors import InputError
from rotorjax.ode.implicit import attach
from rotorjax.reference import published as reference
from rotorjax.wake.equilibrium import Unknowns, evaluate, residual
from rotorjax.wake.model import FreeWake
from rotorjax.wake.performance import performance
from rotorjax.wake.segments import tip_vortex
from rotorjax.wake.settings import wake_settings

ROTOR, COLLECTIVE_DEG = "caradonna_tung", 8.0
AGES_DEG = (60, 120, 180, 240, 300, 360)
MARGINS = {"CT": 0.03, "lift": 0.08, "r": 0.03, "z": 0.03}
"""What may lie between wake and measurement (a share of C_T and lift, a length over R): the weights of the fit."""


def _parameter(name: str, lower: float, upper: float, meaning: str) -> Parameter:
    return Parameter(name, lower, upper, float(getattr(wake_settings(), name)), meaning)


PARAMETERS = ParameterSet(
    "wake",
    (
        _parameter("release", 0.85, 0.999, "span station at which the tip vortex leaves the near wake, over R"),
        _parameter("tip_core", 0.005, 0.1, "core of the tip vortex at its start, over R"),
        _parameter("turbulence", 0.0, 2e-3, "growth of the cores, a1 of Eq. 16"),
        _parameter("self_induction_core", 0.002, 0.06, "core in the tip vortex's own curvature term, over R"),
        _parameter("inboard_core", 0.02, 0.4, "core of the inboard filament, over R"),
        _parameter("inboard_decay", 0.0, 3.0, "decay of the inboard filament, per turn"),
        _parameter("bound_core_chords", 0.1, 1.5, "core of the bound vortex, over the chord"),
    ),
)


class Measurements(NamedTuple):
    """N numbers. names, groups (N,): of MARGINS. target, margin (N,)."""

    names: tuple[str, ...]
    groups: tuple[str, ...]
    target: Float[np.ndarray, " N"]
    margin: Float[np.ndarray, " N"]

    def rows(self, groups: tuple[str, ...]) -> np.ndarray:
        """Which numbers belong to these groups, (N,). Raises InputError for an unknown group, or where none is left."""
        if unknown := [g for g in groups if g not in MARGINS]:
            raise InputError(f"Argument `fit` must be among {', '.join(MARGINS)}, but holds {unknown[0]!r}")
        if not groups:
            raise InputError(f"Argument `fit` must hold at least one of {', '.join(MARGINS)}, but is empty")
        return np.isin(self.groups, groups)


def measurements() -> Measurements:
    """Caradonna and Tung's rotor at 8° (NASA TM-81232), in the order of `outputs`."""
    hover, path = reference.caradonna_tung(), reference.caradonna_tung_path()
    ages = np.deg2rad(AGES_DEG)
    parts = {
        "CT": [("C_T", hover.thrust)],
        "lift": [(f"c_l at r/R = {r:.2f}", c) for r, c in zip(hover.r, hover.lift, strict=True)],
        "r": [(f"tip vortex r/R at {a}°", v) for a, v in zip(AGES_DEG, np.interp(ages, path.age, path.r), strict=True)],
        "z": [(f"tip vortex z/R at {a}°", v) for a, v in zip(AGES_DEG, np.interp(ages, path.age, path.z), strict=True)],
    }
    rows = [(name, group, float(v)) for group, part in parts.items() for name, v in part]
    names, groups, target = zip(*rows, strict=True)
    share = [abs(v) if g in ("CT", "lift") else 1.0 for v, g in zip(target, groups, strict=True)]
    margin = np.array([MARGINS[g] for g in groups]) * share
    return Measurements(names, groups, np.array(target), margin)


def outputs(model: FreeWake, x: Unknowns) -> Float[Array, " N"]:
    """What the free wake makes of each number of `measurements`."""
    found = evaluate(model, x)
    lift = jnp.interp(jnp.asarray(reference.caradonna_tung().r), model.stations, found.loads.cl[0])
    path, ages = tip_vortex(model, x.near[0], x.far[0]), jnp.asarray(model.settings.tip_ages)
    r, z = (jnp.interp(jnp.deg2rad(jnp.asarray(AGES_DEG)), ages, v) for v in (_radius(path), path[:, 2]))
    return jnp.concatenate([performance(model, found).thrust[None], lift, r, z])


def with_values(model: FreeWake, names: tuple[str, ...], values: Float[Array, " P"]) -> FreeWake:
    """The model with these settings of the wake."""
    return eqx.tree_at(lambda m: [getattr(m.settings, n) for n in names], model, [values[i] for i in range(len(names))])


@eqx.filter_jit
def sensitivities(
    names: tuple[str, ...], model: FreeWake, x: Unknowns, inverse: Float[Array, "n n"]
) -> tuple[Float[Array, " N"], Float[Array, "N P"]]:
    """Outputs at a periodic wake, and their derivatives by the named settings along periodic wakes.

    inverse: of the residual's Jacobian there (`preconditioner.harmonic_inverse`).
    """

    def of(values):
        moved = with_values(model, names, values)
        return outputs(moved, attach(residual, x, moved, inverse=inverse))

    values = jnp.stack([getattr(model.settings, n) for n in names])
    return of(values), jax.jacfwd(of)(values)


def _radius(path: Float[Array, "A 3"]) -> Float[Array, " A"]:
    return jnp.sqrt(path[:, 0] ** 2 + path[:, 1] ** 2)
