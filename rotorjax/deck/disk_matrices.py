"""What is linear on the disk of a rotor over ground: flow at the stations of the loads, their pressure, harmonics."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from rotorjax.deck.blades import Stations
from rotorjax.potential.contraction import NODES
from rotorjax.potential.field import disk_functions
from rotorjax.potential.ground_source import DiskQuadrature
from rotorjax.potential.ground_table import disk_modes
from rotorjax.potential.model import FiniteStateModel, rotor_flow


class DiskMatrices(eqx.Module):
    """What is linear on the disk, tabulated once.

    rotor_inflow (M, KR), ground_inflow (L, KR): inflow far from ground and upflow of unit states at the stations of the
    loads. pressure (M, KR): from dC_T/dr̄ there to τ. rotor_harmonics (3, M), ground_harmonics (3, L): λ₀, λ₁c, λ₁s of
    unit states.
    """

    rotor_inflow: Float[Array, "M KR"]
    ground_inflow: Float[Array, "L KR"]
    pressure: Float[Array, "M KR"]
    rotor_harmonics: Float[Array, "3 M"]
    ground_harmonics: Float[Array, "3 L"]


@eqx.filter_jit
def disk_matrices(rotor: FiniteStateModel, at: Stations) -> DiskMatrices:
    """Tabulate them for a rotor's modes and stations."""
    fine = DiskQuadrature(NODES, rotor.quadrature.nodes_psi)
    x, y, nu, weights = (jnp.asarray(v) for v in fine.rule())
    area, modes = 2 * nu * weights, disk_modes(rotor)
    harmonics = jnp.stack([area, 4 * area * x, 4 * area * y])  # λ₀, λ₁c, λ₁s by least squares over the disk's area
    inflow = rotor_flow(rotor, None, *at.xy).reshape(len(rotor.modes), -1)
    return DiskMatrices(
        inflow,
        at.functions(modes),
        at.pressure(rotor.modes),
        harmonics @ rotor_flow(rotor, None, x, y).T,
        harmonics @ disk_functions(modes, x, y).T,
    )
