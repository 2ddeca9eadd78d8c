"""Multi-blade coordinates: the motion of B turning blades as that of the rotor seen from the hub.

    q_b = q_0 + Σ_n (q_nc cos nψ_b + q_ns sin nψ_b) + (−1)^b q_D,   n = 1 … (B − 1)//2,   ψ_b = ψ + 2πb/B

with the differential coordinate q_D for an even number of blades only. The order is that of Eq. 10: collective, cosine
and sine of each n, differential last: (q_0, q_1c, q_1s, q_D) for four blades.

The transform turns with the rotor, T(ψ + δ) = T(ψ) e^{δJ} with a constant J, so that T' = TJ and no derivative of it
has to be written down:

    q_blades = T q,   q̇_blades = T (q̇ + ψ̇ J q),   q̈_blades = T (q̈ + 2ψ̇ J q̇ + (ψ̈ J + ψ̇² J²) q)

Johnson, Helicopter Theory (1980), section 8-4.
"""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float


def azimuths(psi: Float[Array, ""], blades: int) -> Float[Array, " B"]:
    """Azimuths of all blades (rad) when blade 0 stands at psi."""
    return psi + 2 * np.pi / blades * np.arange(blades)


def names(blades: int) -> tuple[str, ...]:
    """Suffixes of the coordinates in their order: 0, 1c, 1s, …, D."""
    cyclic = tuple(f"{n}{kind}" for n in range(1, (blades - 1) // 2 + 1) for kind in "cs")
    return ("0", *cyclic, *(("D",) if blades % 2 == 0 else ()))


def transform(psi: Float[Array, ""], blades: int) -> Float[Array, "B B"]:
    """T(ψ): blade motion = T @ multi-blade coordinates."""
    psi_b = azimuths(psi, blades)
    columns = [jnp.ones_like(psi_b)]
    for n in range(1, (blades - 1) // 2 + 1):
        columns += [jnp.cos(n * psi_b), jnp.sin(n * psi_b)]
    if blades % 2 == 0:
        columns.append((-1.0) ** jnp.arange(blades) * jnp.ones_like(psi_b))
    return jnp.stack(columns, axis=1)


def inverse(psi: Float[Array, ""], blades: int) -> Float[Array, "B B"]:
    """T⁻¹ = D Tᵀ: the columns of T are orthogonal, with squares of B (collective, differential) and B/2 (cyclic)."""
    squares = [blades if name in ("0", "D") else blades / 2 for name in names(blades)]
    return transform(psi, blades).T / np.array(squares)[:, None]


def generator(blades: int) -> Float[np.ndarray, "B B"]:
    """J of T' = TJ."""
    j = np.zeros((blades, blades))
    for n in range(1, (blades - 1) // 2 + 1):
        cosine, sine = 2 * n - 1, 2 * n
        j[sine, cosine], j[cosine, sine] = -n, n
    return j


def to_blades(
    q: Float[Array, " B"], q_dot: Float[Array, " B"], psi: Float[Array, ""], speed: Float[Array, ""]
) -> tuple[Float[Array, " B"], Float[Array, " B"]]:
    """Angles and rates of the blades, in their order, from multi-blade coordinates and their rates; speed: ψ̇."""
    t = transform(psi, q.size)
    return t @ q, t @ (q_dot + speed * generator(q.size) @ q)


def from_blades(
    angle: Float[Array, " B"], rate: Float[Array, " B"], psi: Float[Array, ""], speed: Float[Array, ""]
) -> tuple[Float[Array, " B"], Float[Array, " B"]]:
    """Multi-blade coordinates and their rates from those of the blades: undoes `to_blades`."""
    back = inverse(psi, angle.size)
    q = back @ angle
    return q, back @ rate - speed * generator(angle.size) @ q


def accelerations(
    blade_accelerations: Float[Array, " B"],
    q: Float[Array, " B"],
    q_dot: Float[Array, " B"],
    psi: Float[Array, ""],
    speed: Float[Array, ""],
    speed_rate: Float[Array, ""],
) -> Float[Array, " B"]:
    """q̈ of the multi-blade coordinates from those of the blades; speed, speed_rate: ψ̇ and ψ̈."""
    j = jnp.asarray(generator(q.size))
    turning = 2 * speed * j @ q_dot + (speed_rate * j + speed**2 * j @ j) @ q
    return inverse(psi, q.size) @ blade_accelerations - turning
