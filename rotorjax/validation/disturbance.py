"""A small disturbance of a hovering wake, marched with the nonlinear equations and read mode by mode.

The march is the paper's: all blades' wakes, Runge-Kutta of fifth order. What it makes of the disturbance is set beside
the fastest mode of the linear wake (linearisation/waves.py), whose share of the disturbance the left eigenvector picks
out: that share grows like e^{λψ} from the start, while the norm first shows a transient of all the other modes.
"""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import scipy.linalg
from jax.flatten_util import ravel_pytree
from jaxtyping import Array, Complex, Float

from rotorjax.linearisation.system import outputs
from rotorjax.linearisation.waves import Pairing, WaveMode, spectrum, wave_matrix
from rotorjax.ode.fourier import fourier_coefficients
from rotorjax.ode.trajectory import march
from rotorjax.wake.dynamics import inputs_of, rhs
from rotorjax.wake.model import FreeWake, WakeState
from rotorjax.wake.solution import Solution

STABLE = 3.0
"""|λ|Δψ of the fastest decay that is marched; the method holds 3.3 on the negative real axis."""


class Fastest(NamedTuple):
    """The most amplified mode. left (n,): its left eigenvector over one slice's state, as `ravel_pytree` lays it out.
    decay: largest |λ| of its wave number, which the step of a march has to hold. pairing: the rate beside it.
    """

    mode: WaveMode
    left: Complex[np.ndarray, " n"]
    decay: float
    pairing: Pairing


class Disturbed(NamedTuple):
    """A marched disturbance at N instants. psi (N,): rad. displacement (N, B): rms of all nodes over R, by wave number
    p = 0 … B−1. share (N,): of the fastest mode, complex, 1 at the start. states: of all blades, leading axis N.
    """

    psi: Float[np.ndarray, " N"]
    displacement: Float[np.ndarray, "N B"]
    share: Complex[np.ndarray, " N"]
    states: WakeState

    @property
    def total(self) -> Float[np.ndarray, " N"]:
        """Rms displacement of all nodes over R."""
        return np.sqrt(np.sum(self.displacement**2, axis=1))

    def exponent(self, linear: float) -> complex:
        """Exponent of the fastest mode's share while nodes are displaced by less than `linear` (rms over R), by least
        squares: growth + i frequency per radian of azimuth.
        """
        end = self._small(linear)
        psi, share = self.psi[:end], self.share[:end]
        return complex(*(np.polyfit(psi, v, 1)[0] for v in (np.log(np.abs(share)), np.unwrap(np.angle(share)))))

    def steepest(self, linear: float, window: float = np.pi) -> float:
        """Largest growth of the displacement of all nodes, per radian, over any `window` (rad) while it is small."""
        end, width = self._small(linear), round(window / (self.psi[1] - self.psi[0]))
        size = np.log(self.total[:end])
        return float(np.max((size[width:] - size[:-width]) / window)) if end > width else float("nan")

    def _small(self, linear: float) -> int:
        """Number of instants before the displacement first exceeds `linear`."""
        large = np.flatnonzero(self.total > linear)
        return int(large[0]) if large.size else len(self.psi)


def fastest(solution: Solution) -> Fastest:
    """The most amplified mode of an axisymmetric wake. Raises InputError where there is no such wake."""
    found = spectrum(solution, 1)
    mode = found.modes[0]
    left = left_vector(wave_matrix(solution, mode.wave), mode.exponent)
    return Fastest(mode, left, float(np.abs(found.exponents[mode.wave]).max()), found.pairing)


def left_vector(matrix: Complex[np.ndarray, "n n"], value: complex) -> Complex[np.ndarray, " n"]:
    """Left eigenvector w of a known eigenvalue, wᴴA = λwᴴ, by inverse iteration; of unit length."""
    n = len(matrix)
    shift = value + 1e-10 * np.linalg.norm(matrix) / n  # off the eigenvalue, or there is nothing to divide by
    lu = scipy.linalg.lu_factor(matrix - shift * np.eye(n))
    left = np.ones(n, complex)
    for _ in range(3):
        left = scipy.linalg.lu_solve(lu, left, trans=2)
        left /= np.linalg.norm(left)
    return left


def disturbed(
    solution: Solution, along: Fastest, size: float, turns: float, *, samples: int = 24, progress: bool = True
) -> Disturbed:
    """March the wake from its periodic state with all nodes moved at random by `size` (rms over R, one seed).

    turns: revolutions; samples: in each, at which the march is read. A march that leaves the finite numbers ends there.
    """
    model, blades = solution.model, solution.model.rotor.blades
    rest = jax.tree.map(lambda a: jnp.repeat(jnp.asarray(a), blades, axis=0), solution.state)
    random = np.random.default_rng(0)

    def moved(nodes):
        return nodes + size / np.sqrt(3) * jnp.asarray(random.normal(size=nodes.shape))

    start = eqx.tree_at(lambda s: (s.near, s.far), rest, (moved(rest.near), moved(rest.far)))
    steps = int(np.ceil(2 * np.pi / samples * along.decay / STABLE))
    count = round(turns * samples) * steps
    step = 2 * np.pi / (samples * steps)
    path = march(rhs, start, 0.0, step, count, inputs_of(model), model, save_every=steps, progress=progress)
    displacement, flat = jax.tree.map(np.asarray, _by_wave(path.x, rest))
    share = flat[:, along.mode.wave] @ along.left.conj()
    return Disturbed(np.asarray(path.t), displacement, share / share[0], path.x)


@eqx.filter_jit
def thrust(psi: Float[Array, " N"], states: WakeState, model: FreeWake) -> Float[Array, " N"]:
    """C_T of marched states (leading axis N), slice 0 at azimuths psi."""
    return jax.lax.map(lambda at: outputs(at[0], at[1], inputs_of(model), model).CT, (psi, states))


@eqx.filter_jit
def _by_wave(states: WakeState, rest: WakeState):
    """Rms displacement (N, B) and flat deviation (N, B, n) of every wave number: Fourier sums over the blades."""

    def one(state):
        apart = jax.tree.map(lambda a, b: fourier_coefficients(a - b) / len(a), state, rest)
        nodes = jnp.concatenate([apart.near.reshape(apart.near.shape[0], -1), apart.far.reshape(len(apart.far), -1)], 1)
        rms = jnp.sqrt(3 * jnp.mean(jnp.abs(nodes) ** 2, axis=1))
        return rms, jax.vmap(lambda a: ravel_pytree(a)[0])(apart)

    return jax.lax.map(one, states)
