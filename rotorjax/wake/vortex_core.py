"""Vortex cores: swirl profiles and their growth with wake age.

In rotor units: lengths over R, circulation and viscosity over ΩR², time as azimuth (rad), so Ω = 1 by default.
"""

import jax.numpy as jnp
from jaxtyping import Array, Float

LAMB_OSEEN = 1.25643
"""α: the radius of greatest swirl of a Lamb–Oseen vortex of age t is sqrt(4 α ν t)."""


def core_radius(
    age: Float[Array, "*n"],
    initial: Float[Array, "*#n"],
    strength: Float[Array, "*#n"],
    viscosity: Float[Array, ""],
    turbulence: float | Float[Array, ""] = 2e-4,
    speed: float | Float[Array, ""] = 1.0,
) -> Float[Array, "*n"]:
    """Core radius at wake age ζ (rad): r_c = sqrt(r₀² + 4αδνζ/Ω) with δ = 1 + a₁|Γ|/ν (Eq. 16; Squire 1965).

    initial: r₀. strength: Γ. viscosity: ν. turbulence: a₁, between 5e-5 and 4e-4 (6.5e-5 and 2e-4 are in use).
    speed: Ω, 1 in rotor units. The radius at age 0 must be positive: sqrt has no derivative at 0.
    """
    # ν δ = ν + a₁|Γ|, written so that ν = 0 is allowed
    return jnp.sqrt(initial**2 + 4 * LAMB_OSEEN * (viscosity + turbulence * jnp.abs(strength)) * age / speed)


def vatistas_swirl(distance: Float[Array, "*n"], core: Float[Array, "*#n"], exponent: float = 1) -> Float[Array, "*n"]:
    """Swirl of an infinite straight vortex of unit circulation: h / (2π (h²ⁿ + r_c²ⁿ)^(1/n)) (Vatistas et al. 1991).

    n = 1 is Scully's core, n = 2 close to Lamb–Oseen's, n → ∞ Rankine's. core must be positive.
    """
    scaled = distance / core
    return scaled / (2 * jnp.pi * core * (1 + scaled ** (2 * exponent)) ** (1 / exponent))


def scully_swirl(distance: Float[Array, "*n"], core: Float[Array, "*#n"]) -> Float[Array, "*n"]:
    """Swirl of an infinite straight vortex of unit circulation with Scully's core: h / (2π (h² + r_c²))."""
    return vatistas_swirl(distance, core, 1)
