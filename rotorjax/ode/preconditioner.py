"""The linear part of a periodic problem, inverted once: (d/dt − L)⁻¹, harmonic by harmonic."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Complex, Float

from rotorjax.errors import InputError


class PeriodicInverse(eqx.Module):
    """Solves dx/dt = L x + f(t) for the periodic x at K equally spaced times, along the second axis of f.

    inverse: (H, A, A), (ikω − L)⁻¹ for the harmonics 0..K/2. nodes: K.

    With the linear part of a right-hand side taken out, x' = L x + N(t, x), the orbit is the fixed point of x ↦
    PeriodicInverse(N(t, x)): a far better start for Anderson or Newton-Krylov than x' − rhs, whose stiffness L is
    gone.
    """

    inverse: Complex[Array, "H A A"]
    nodes: int = eqx.field(static=True)

    def __call__(self, f: Float[Array, "K A *s"]) -> Float[Array, "K A *s"]:
        """Periodic x for the forcing f at the K times; further axes are carried along."""
        spectrum = jnp.fft.rfft(f, axis=0)
        return jnp.fft.irfft(jnp.einsum("hab,hb...->ha...", self.inverse, spectrum), self.nodes, axis=0).astype(f.dtype)


def periodic_inverse(linear: Float[np.ndarray, "A A"], nodes: int, period: float) -> PeriodicInverse:
    """Factorise d/dt − L for L (A, A) at `nodes` equally spaced times, d/dt being `fourier_differentiation`.

    Raises InputError where L is not square or has an eigenvalue that the period resonates with (an undamped harmonic).
    """
    linear = np.asarray(linear, float)
    if linear.ndim != 2 or linear.shape[0] != linear.shape[1]:
        raise InputError(f"Argument `linear` must be square, but has shape {linear.shape}")
    harmonics = np.arange(nodes // 2 + 1) * 2j * np.pi / period
    if nodes % 2 == 0:
        harmonics[-1] = 0  # the sawtooth has no slope at the nodes
    matrices = harmonics[:, None, None] * np.eye(linear.shape[0]) - linear
    if np.linalg.cond(matrices).max() > 1e13:
        worst = int(np.argmax(np.linalg.cond(matrices)))
        raise InputError(f"Argument `linear` must damp every harmonic, but harmonic {worst} has no unique answer")
    return PeriodicInverse(jnp.asarray(np.linalg.inv(matrices)), nodes)
