"""Large periodic linear models by products alone: marched forwards and back, their leading Floquet exponents.

A(t) of thousands of states is kept at a few times; no matrix of a whole part is formed. A block of vectors is marched
through it, which costs hardly more than one, and block Arnoldi (Golub & Van Loan 2013, §10.3.6) finds the eigenvalues
that lead, from both sides, so that each state's participation is known.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from typing import NamedTuple

import numpy as np
from jaxtyping import Complex, Float

from rotorjax.errors import InputError
from rotorjax.ode.models import PeriodicModel

Block = Float[np.ndarray, "n m"]
WIDTH, DEPTH = 8, 36
"""Vectors of a block and blocks of the Krylov space; a wake is swept out in about ten parts, which come first."""


class Leading(NamedTuple):
    """The least damped exponents (k,) first, their frequencies those of the harmonic in which a mode has most of its
    weight. multipliers (k,): over a part. residuals (k,): |M v − μ v| of unit vectors. shares (n, k): of each state in
    each mode's own harmonic, complex, columns adding up to what that harmonic has of the whole, 1 at most as a rule.
    """

    values: Complex[np.ndarray, " k"]
    multipliers: Complex[np.ndarray, " k"]
    residuals: Float[np.ndarray, " k"]
    shares: Complex[np.ndarray, "n k"]


@dataclass(frozen=True)
class Repeated:
    """A periodic model that repeats after a part of its period, some states and outputs with the other sign.

    part: the model over that, at an even number of times K. signs (n,), output_signs (q,): ±1. Steps are classical
    Runge-Kutta ones over two of the times, as in `PeriodicModel.step`.
    """

    part: PeriodicModel
    signs: Float[np.ndarray, " n"]
    output_signs: Float[np.ndarray, " q"]

    def __post_init__(self) -> None:
        """Refuse an odd number of times."""
        if self.part.t.size % 2:
            raise InputError(f"Argument `part` must hold an even number of times, but holds {self.part.t.size}")

    @property
    def steps(self) -> int:
        """Steps of a part."""
        return self.part.t.size // 2

    @property
    def dt(self) -> float:
        """Their length."""
        return self.part.period / self.steps

    def _rate(self, j: int, x: Block, u: np.ndarray | None) -> Block:
        """A x + B u at time j; that after the last is the first of the next part."""
        if j == self.part.t.size:
            return self._turned(self._rate(0, self._turned(x), u))
        rate = self.part.a[j] @ x
        return rate if u is None else rate + self.part.b[j] @ u

    def _turned(self, x: Block) -> Block:
        return self.signs[:, None] * x

    def leap(self, k: int, x: Block, u: np.ndarray | None = None) -> Block:
        """States (n, m) after step k of a part with inputs held."""
        first, middle, last = (partial(self._rate, j, u=u) for j in (2 * k, 2 * k + 1, 2 * k + 2))
        return _runge_kutta(first, middle, last, x, self.dt)

    def _transposed(self) -> "Repeated":
        """With Aᵀ for A, for `leap_back`."""
        return replace(self, part=replace(self.part, a=np.swapaxes(self.part.a, 1, 2)))

    def leap_back(self, k: int, y: Block) -> Block:
        """Of the transposed model: the transpose of this one's free step k, by the same method from its end."""
        first, middle, last = (partial(self._rate, j, u=None) for j in (2 * k + 2, 2 * k + 1, 2 * k))
        return _runge_kutta(first, middle, last, y, self.dt)

    def across(self, x: Block) -> Block:
        """Free states a part later, called as at its start."""
        for k in range(self.steps):
            x = self.leap(k, x)
        return self._turned(x)

    def across_back(self, y: Block) -> Block:
        """Its transpose."""
        y, turned = self._turned(y), self._transposed()
        for k in reversed(range(self.steps)):
            y = turned.leap_back(k, y)
        return y

    def step(self, parts: int) -> Float[np.ndarray, "N q m"]:
        """Outputs at the start and after every step, after unit steps of all inputs at t[0]."""
        x, out, all_ = np.zeros(self.part.b.shape[1:]), [], np.eye(self.part.b.shape[2])
        for j in range(parts):
            sign = self.output_signs[:, None] ** j
            for k in range(self.steps):
                out.append(sign * (self.part.c[2 * k] @ x + self.part.d[2 * k]))
                x = self.leap(k, x, all_)
            x = self._turned(x)
        return np.array([*out, self.output_signs[:, None] ** parts * (self.part.c[0] @ x + self.part.d[0])])

    def halved(self) -> "Repeated":
        """The same at every second time, for what is slow; half as much work."""
        names = ("t", "a", "b", "c", "d", "x", "y")
        return replace(self, part=replace(self.part, **{name: getattr(self.part, name)[::2] for name in names}))

    def pulses(self, parts: int, scale: Float[np.ndarray, " m"], every: int = 1) -> Iterator[Block]:
        """States after `every` steps, called as in the first part, of pulses of every input as long, all through it."""
        m, phases = scale.size, self.steps // every
        x = np.zeros((self.part.order, m * phases))
        for j in range(parts):
            for k in range(self.steps):
                inputs = np.zeros((m, m * phases)) if j == 0 else None
                if inputs is not None and k // every < phases:
                    inputs[:, m * (k // every) : m * (k // every + 1)] = np.diag(scale)
                x = self.leap(k, x, inputs)
                if (k + 1) % every == 0:
                    yield x
            x = self._turned(x)

    def readings_back(self, parts: int, mix: Float[np.ndarray, "H q m"], every: int = 1) -> Iterator[Block]:
        """Adjoint states `every` steps apart, of mixtures of the outputs, H = steps // every of them read all through
        the last part.
        """
        m, turned = mix.shape[2], self._transposed()
        y = np.zeros((self.part.order, m * len(mix)))
        for j in range(parts):
            y = self._turned(y)
            for k in reversed(range(self.steps)):
                y = turned.leap_back(k, y)
                phase = k // every
                if j == 0 and k % every == 0 and phase < len(mix):
                    y[:, phase * m : (phase + 1) * m] += self.part.c[2 * k].T @ mix[phase]
                if k % every == 0:
                    yield y.copy()


def _runge_kutta(first: Callable, middle: Callable, last: Callable, x: Block, dt: float) -> Block:
    k1 = first(x)
    k2 = middle(x + dt / 2 * k1)
    k3 = middle(x + dt / 2 * k2)
    return x + dt / 6 * (k1 + 2 * k2 + 2 * k3 + last(x + dt * k3))


def leading(model: Repeated, count: int, width: int = WIDTH, depth: int = DEPTH) -> Leading:
    """The `count` leading exponents; one product of a block costs a march over a part.

    Raises InputError for a count that the Krylov space does not hold twice.
    """
    depth = min(depth, model.part.order // width)
    if not 1 <= count <= width * depth // 2:
        raise InputError(f"Argument `count` must lie in [1, {width * depth // 2}] for this model, but is {count}")
    values, right, sizes = _ritz(model.across, model.part.order, width, depth)
    others, left, _ = _ritz(model.across_back, model.part.order, width, depth)
    order = np.argsort(-np.abs(values))
    last = order[count - 1]
    if np.imag(values[last]) and np.abs(np.conj(values[last]) - values[order[:count]]).min() > 1e-9:
        count += 1  # the other one of the last pair
    order = order[:count]
    near = [int(np.argmin(np.abs(others - values[k]))) for k in order]
    exponents, shares = _seen(model, values[order], right[:, order], left[:, near])
    first = np.argsort(-np.real(exponents))
    return Leading(exponents[first], values[order][first], sizes[order][first], shares[:, first])


def _ritz(
    product: Callable[[Block], Block], n: int, width: int, depth: int
) -> tuple[Complex[np.ndarray, " N"], Complex[np.ndarray, "n N"], Float[np.ndarray, " N"]]:
    """Ritz values, unit vectors and residuals of a linear map by block Arnoldi."""
    rng = np.random.default_rng(0)
    basis = np.linalg.qr(rng.normal(size=(n, width)))[0]
    images = np.zeros((n, 0))
    for _ in range(depth):
        images = np.concatenate([images, product(basis[:, -width:])], axis=1)
        if basis.shape[1] == width * depth:
            break
        new = images[:, -width:]
        for _ in range(2):  # once more for what rounding leaves
            new = new - basis @ (basis.T @ new)
        basis = np.concatenate([basis, np.linalg.qr(new)[0]], axis=1)
    small = basis.T @ images
    values, vectors = np.linalg.eig(small)
    return values, basis @ vectors, np.linalg.norm((images - basis @ small) @ vectors, axis=0)


def _seen(
    model: Repeated, values: np.ndarray, right: np.ndarray, left: np.ndarray
) -> tuple[Complex[np.ndarray, " k"], Complex[np.ndarray, "n k"]]:
    """Exponents with their frequencies as the states see them, and the states' shares in that harmonic.

    x = e^{λt} p and its adjoint e^{−λt} q have the same inner product at all times. After two parts all signs are back,
    so that p and q are sums of multiples of half a part's frequency; λ may take any of them from p.
    """
    length, steps = model.part.period, model.steps
    slow = np.log(values) / length
    ahead, behind = [right], [_both(model._turned, left) / values]
    for k in range(steps - 1):
        ahead.append(_both(partial(model.leap, k), ahead[-1]))
    for k in reversed(range(steps)):
        behind.append(_both(partial(model._transposed().leap_back, k), behind[-1]))
    growth = np.exp(np.multiply.outer(model.dt * np.arange(steps), slow))[:, None]
    p, q = np.array(ahead) / growth, np.array(behind[:0:-1]) * growth
    two = model.signs[:, None]
    p, q = (np.fft.fft(np.concatenate([v, two * v]), axis=0) / (2 * steps) for v in (p, q))
    weight = p * np.roll(q[::-1], 1, axis=0) / np.einsum("nk,nk->k", right, left)
    harmonic = np.argmax(np.abs(weight.sum(axis=1)), axis=0)
    numbers = np.fft.fftfreq(2 * steps, 1 / (2 * steps))[harmonic]
    return slow + 1j * np.pi / length * numbers, weight[harmonic, :, np.arange(values.size)].T


def _both(real_map: Callable[[Block], Block], x: Complex[np.ndarray, "n k"]) -> Complex[np.ndarray, "n k"]:
    """A real map of complex vectors."""
    real, imaginary = np.split(real_map(np.concatenate([np.real(x), np.imag(x)], axis=1)), 2, axis=1)
    return real + 1j * imaginary
