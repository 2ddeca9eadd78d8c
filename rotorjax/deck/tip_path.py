"""Flapping of a rotor of many blades, as the motion of its tip-path plane: β = β₀ + β₁c cos ψ + β₁s sin ψ.

The three are the multi-blade coordinates of `rotor/multiblade.py`, the same at every instant however many blades there
are: loads are taken over the whole disk, so a blade is everywhere and higher harmonics are left out. Each azimuth's
blade obeys the equation of `rotor/flap_lag.py`, nonlinear in β, on a hub that turns steadily and climbs; its lag is
held. Its air load is the section's lift, across the blade.

Flapping reaches the sections by their own velocity, u_P = λ + (r − e)β̇ + μ β cos ψ (first order in β), and by the
pitch, −tan δ₃ (β − β_p). A tilted tip-path plane turns the thrust; wake, ground and inflow stay those of the disk in
the hub's plane.
"""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from rotorjax.inflow.balance import Stations
from rotorjax.operating import OperatingPoint
from rotorjax.rotor.flap_lag import Blade, accelerations, blade_of
from rotorjax.rotor.geometry import Rotor
from rotorjax.rotor.hub import TurningFrame
from rotorjax.rotor.multiblade import generator

_TURN = generator(3)  # of the coordinates 0, 1c, 1s


class TipPath(eqx.Module):
    """A rotor's flapping. blade: inertia and hinge. share (): π/B, of the disk's loading that one blade bears."""

    blade: Blade
    share: Float[Array, ""]

    def arm(self, at: Stations) -> Float[Array, " R"]:
        """Return the stations' distances from the hinge, over R; inboard of it nothing flaps."""
        return jnp.maximum(at.r - self.blade.offset, 0.0)

    def pitch(self, angle: Float[Array, " K"]) -> Float[Array, " K"]:
        """Return what the pitch-flap coupling adds to the pitch of blades at angles β (rad)."""
        return -self.blade.coupling * (angle - self.blade.precone)

    def downwash(
        self, angle: Float[Array, " K"], rate: Float[Array, " K"], mu: Float[Array, ""], at: Stations
    ) -> Float[Array, "K R"]:
        """Return what flapping adds to u_P at the stations, over ΩR; mu: wind blowing aft."""
        return rate[:, None] * self.arm(at) + (mu * angle * jnp.cos(at.psi))[:, None]

    def acceleration(
        self,
        flap: Float[Array, "3"],
        flap_rate: Float[Array, "3"],
        loading: Float[Array, "K R"],
        climb_rate: Float[Array, ""],
        at: Stations,
    ) -> Float[Array, "3"]:
        """Return the second derivatives of β₀, β₁c, β₁s (rad per rad²) under dC_T/dr̄ at the stations.

        climb_rate: acceleration of the hub along the shaft, over Ω²R; gravity comes on top.
        """
        angle, rate = blades_at(flap, flap_rate, at.psi)
        moment = self.share * loading @ (at.widths * self.arm(at))
        zero, one = jnp.zeros_like(climb_rate), jnp.ones_like(climb_rate)
        still, up = jnp.stack([zero, zero, zero]), jnp.stack([zero, zero, one])
        frame = TurningFrame(still, (self.blade.gravity + climb_rate) * up, up, still)

        def of_blade(angle: Array, rate: Array, moment: Array) -> Array:
            across = jnp.stack([-jnp.sin(angle), zero, jnp.cos(angle)])
            q, q_dot = jnp.stack([angle, zero]), jnp.stack([rate, zero])
            return accelerations(self.blade, frame, q, q_dot, moment * across)[0]

        found = jax.vmap(of_blade)(angle, rate, moment)
        mean = _harmonics(at.psi).T @ found * np.array([1.0, 2.0, 2.0]) / at.psi.size
        return mean - 2 * _TURN @ flap_rate - _TURN @ _TURN @ flap


def tip_path(rotor: Rotor, operating: OperatingPoint) -> TipPath:
    """Make a rotor's flapping. Raises InputError where it has no hinge data."""
    return TipPath(blade_of(rotor, operating), jnp.asarray(np.pi / rotor.blades))


def blades_at(
    flap: Float[Array, "3"], flap_rate: Float[Array, "3"], psi: Float[Array, " K"]
) -> tuple[Float[Array, " K"], Float[Array, " K"]]:
    """Return angle (rad) and rate (per rad of azimuth) of the blades at azimuths psi."""
    shape = _harmonics(psi)
    return shape @ flap, shape @ (flap_rate + _TURN @ flap)


def _harmonics(psi: Float[Array, " K"]) -> Float[Array, "K 3"]:
    return jnp.stack([jnp.ones_like(psi), jnp.cos(psi), jnp.sin(psi)], axis=1)
