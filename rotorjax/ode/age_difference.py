"""Fourth-order upwind differences in wake age (5PBU4), as dense tables built once in float64 numpy.

The flow runs towards growing index: node 0 carries the boundary (Dirichlet) value, nodes 1..A are the unknowns. With
spacing Δζ, df/dζ ≈ (matrix @ f + boundary * f0) / Δζ. The interior stencil leans on three nodes upstream and one
downstream.
"""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from rotorjax.errors import InputError

ORDER = 4
SMALLEST = 4

# Numerators over 12, on the five nodes starting at offset `first` from the differentiated node.
FIRST_NODE = (-1, (-3, -10, 18, -6, 1))
SECOND_NODE = (-2, (1, -8, 0, 8, -1))
INTERIOR = (-3, (-1, 6, -18, 10, 3))
LAST_NODE = (-4, (3, -16, 36, -48, 25))


def _weights(first: int, numerators: Sequence[int]) -> Float[np.ndarray, "5"]:
    """Stencil weights, after checking the moment conditions Σ w k^p = [p = 1] in integers, p = 0..4."""
    offsets = range(first, first + len(numerators))
    for power in range(ORDER + 1):
        moment = sum(w * k**power for k, w in zip(offsets, numerators, strict=True))
        if moment != (12 if power == 1 else 0):
            raise ValueError(f"stencil {numerators} at offset {first} fails the moment condition of power {power}")
    return np.array(numerators, float) / 12


def five_point_upwind(ages: int) -> tuple[Float[np.ndarray, "A A"], Float[np.ndarray, " A"]]:
    """Difference matrix and boundary column of 5PBU4 for unit spacing: df/dζ ≈ (matrix @ f + boundary * f0) / Δζ.

    ages: number A of nodes after the boundary node, at least 4. Returns numpy float64 tables of shapes (A, A) and (A,).
    Every row is of fourth order, the two at the inflow and the last one included.

    Raises InputError where there are too few ages for a stencil of five nodes.
    """
    if ages < SMALLEST:
        raise InputError(f"Argument `ages` must be at least {SMALLEST} (a stencil has five nodes), but is {ages}")
    table = np.zeros((ages, ages + 1))
    for node in range(1, ages + 1):
        special = {1: FIRST_NODE, 2: SECOND_NODE, ages: LAST_NODE}
        first, numerators = special.get(node, INTERIOR)
        table[node - 1, node + first : node + first + 5] = _weights(first, numerators)
    return table[:, 1:], table[:, 0]
