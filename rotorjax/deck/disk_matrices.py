"""What is linear on the disk of a rotor over ground: flow at the stations of the loads, their pressure, harmonics."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from rotorjax.deck.blades import Stations
from rotorjax.potential.field import disk_functions
from rotorjax.potential.ground_table import disk_modes
from rotorjax.potential.model import FiniteStateModel
from rotorjax.potential.modes import ModeTable


class DiskMatrices(eqx.Module):
    """What is linear on the disk, tabulated once.

    rotor_inflow (M, KR), ground_inflow (L, KR): inflow and upflow of unit states at the stations of the loads. pressure
    (M, KR): from dC_T/dr̄ there to τ. rotor_harmonics (3, M), ground_harmonics (3, L): λ₀, λ₁c, λ₁s of unit states.
    """

    rotor_inflow: Float[Array, "M KR"]
    ground_inflow: Float[Array, "L KR"]
    pressure: Float[Array, "M KR"]
    rotor_harmonics: Float[Array, "3 M"]
    ground_harmonics: Float[Array, "3 L"]


@eqx.filter_jit
def disk_matrices(rotor: FiniteStateModel, at: Stations) -> DiskMatrices:
    """Tabulate them for a rotor's modes and stations."""
    both = (rotor.modes, disk_modes(rotor))
    inflow, harmonics = [at.functions(modes) for modes in both], [_harmonics(modes, rotor) for modes in both]
    return DiskMatrices(inflow[0], inflow[1], at.pressure(rotor.modes), harmonics[0], harmonics[1])


def _harmonics(modes: ModeTable, model: FiniteStateModel) -> Float[Array, "3 M"]:
    """λ₀, λ₁c, λ₁s of unit states: area-weighted least squares over the disk."""
    x, y, nu, weights = (jnp.asarray(v) for v in model.quadrature.rule())
    area = 2 * nu * weights
    return jnp.stack([area, 4 * area * x, 4 * area * y]) @ disk_functions(modes, x, y).T
