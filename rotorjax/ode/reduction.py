"""Smaller linear models: residualised fast modes, balanced truncation (everywhere or in a band), measured error."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, cast

import numpy as np
import scipy.linalg
from jaxtyping import Complex, Float

from rotorjax.errors import InputError
from rotorjax.ode.labels import NO_UNIT
from rotorjax.ode.models import LinearModel
from rotorjax.ode.threads import one_thread


@dataclass(frozen=True)
class Reduced:
    """A reduced model. bound: guaranteed error of the transfer matrix over all frequencies (H∞), or None.

    singular: (k,) Hankel singular values (of the stable part, or of the band), the largest first; empty for
    residualisation.
    """

    model: LinearModel
    bound: float | None
    singular: Float[np.ndarray, " k"]


def _require_order(model: LinearModel, order: int, least: int = 1, what: str = "unstable modes are kept") -> None:
    if not least <= order <= model.order:
        why = "" if least == 1 else f" ({least} {what})"
        raise InputError(f"Argument `order` must lie in [{least}, {model.order}]{why}, but is {order}")


def _split(a: np.ndarray, first: Callable[[float, float], bool]) -> tuple[np.ndarray, np.ndarray, int]:
    """Coordinates x = V z in which the modes with first(re λ, im λ) come first and are decoupled from the rest.

    Returns V, V⁻¹ and the number of modes that come first. Ordered real Schur form and a Sylvester equation: no
    eigenvectors, which a non-normal A has hardly any good ones of.
    """
    schur, q, count = cast(Any, scipy.linalg.schur)(a, sort=first)
    n = a.shape[0]
    mix = np.eye(n)
    if 0 < count < n:
        t11, t12, t22 = schur[:count, :count], schur[:count, count:], schur[count:, count:]
        mix[:count, count:] = scipy.linalg.solve_sylvester(t11, -t22, -t12)
    back = 2 * np.eye(n) - mix
    return q @ mix, back @ q.T, int(count)


def _fold(model: LinearModel, keep: int, name: str) -> LinearModel:
    """Keep the first states and let the others follow at once: 0 = A₂₁ x₁ + A₂₂ x₂ + B₂ u. Exact at frequency 0."""
    a, b, c = model.a, model.b, model.c
    follow = np.linalg.solve(a[keep:, keep:], np.concatenate([a[keep:, :keep], b[keep:]], axis=1))
    fx, fu = follow[:, :keep], follow[:, keep:]
    return replace(
        model,
        a=a[:keep, :keep] - a[:keep, keep:] @ fx,
        b=b[:keep] - a[:keep, keep:] @ fu,
        c=c[:, :keep] - c[:, keep:] @ fx,
        d=model.d - c[:, keep:] @ fu,
        states=tuple(f"{name}[{i}]" for i in range(keep)),
        state_units=(),
        x=model.x[:keep],
    )


def _transform(model: LinearModel, v: np.ndarray, w: np.ndarray, name: str) -> LinearModel:
    """Model in coordinates z, x = V z, z = W x (fewer of them project)."""
    names = tuple(f"{name}[{i}]" for i in range(v.shape[1]))
    moved = {"a": w @ model.a @ v, "b": w @ model.b, "c": model.c @ v, "x": w @ model.x}
    return replace(model, **moved, states=names, state_units=())


@one_thread
def residualise(model: LinearModel, order: int) -> Reduced:
    """Keep the `order` slowest modes (least |λ|) and let the faster ones follow at once; exact at frequency 0.

    One mode fewer is kept where `order` would part a complex pair.

    Raises InputError where `order` is not between 1 and the model's.
    """
    _require_order(model, order)
    size = np.sort(np.abs(np.linalg.eigvals(model.a)))
    keep = order
    while 0 < keep < model.order and size[keep] - size[keep - 1] <= 1e-9 * size[keep]:
        keep -= 1
    if keep == 0:
        raise InputError(f"Argument `order` must not part the slowest complex pair, but is {order}: ask for one more")
    if keep == model.order:
        return Reduced(model, None, np.zeros(0))
    cut = (size[keep - 1] + size[keep]) / 2
    # Counted again: eigenvalues of a non-normal A move with rounding, and only those of this Schur form are parted.
    v, w, keep = _split(model.a, lambda re, im: bool(np.hypot(re, im) <= cut))
    return Reduced(_fold(_transform(model, v, w, "slow"), keep, "slow"), None, np.zeros(0))


def _root(gramian: np.ndarray) -> np.ndarray:
    """L with L Lᵀ = gramian, robust where rounding makes it indefinite."""
    values, vectors = scipy.linalg.eigh(gramian)
    return vectors * np.sqrt(np.clip(values, 0, None))


def _balance(reach: np.ndarray, see: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Balancing V, W and the singular values from roots of the two Gramians, directions lost in rounding left out."""
    u, s, vt = scipy.linalg.svd(see.T @ reach, full_matrices=False)
    kept = s > 1e-13 * s[0] if s.size and s[0] > 0 else np.zeros(s.size, bool)
    scale = 1 / np.sqrt(s[kept])
    return reach @ vt[kept].T * scale, (see @ u[:, kept] * scale).T, s[kept]


@one_thread
def balance(model: LinearModel, order: int, *, steady: bool = True) -> Reduced:
    """Balanced truncation (Moore 1981, doi:10.1109/TAC.1981.1102568); unstable modes are kept as they are.

    steady: let the states left out follow at once, which keeps the response at frequency 0, instead of dropping them,
    which keeps that at infinity. Either way the error over all frequencies is at most `bound` = 2 Σ of the singular
    values left out.

    Raises InputError where `order` is above the model's or below the number of unstable modes.
    """
    v, w, count = _split(model.a, lambda re, im: bool(re >= 0))
    _require_order(model, order, max(count, 1))
    if order == model.order:
        return Reduced(model, 0.0, np.zeros(0))
    whole = _transform(model, v, w, "mode")
    a, b, c = whole.a[count:, count:], whole.b[count:], whole.c[:, count:]
    reach = _root(scipy.linalg.solve_continuous_lyapunov(a, -b @ b.T))
    see = _root(scipy.linalg.solve_continuous_lyapunov(a.T, -c.T @ c))
    right, left, singular = _balance(reach, see)
    v2 = np.asarray(scipy.linalg.block_diag(np.eye(count), right))
    w2 = np.asarray(scipy.linalg.block_diag(np.eye(count), left))
    balanced = _transform(whole, v2, w2, "balanced")
    keep = min(order, balanced.order)
    bound = 2 * float(np.sum(singular[keep - count :]))
    if steady and keep < balanced.order:
        return Reduced(_fold(balanced, keep, "balanced"), bound, singular)
    return Reduced(_transform(whole, v2[:, :keep], w2[:keep], "balanced"), bound, singular)


def even(gains: Float[np.ndarray, "q m"]) -> tuple[np.ndarray, np.ndarray]:
    """Scales of outputs (q,) and inputs (m,) that bring the largest gain of each to 1, so that units do not decide."""
    columns = gains.max(axis=0)
    columns = np.where(columns > 0, columns, 1.0)
    rows = (gains / columns).max(axis=1)
    return np.where(rows > 0, rows, 1.0), columns


def sample(highest: float, points: int, tail: float) -> list[tuple[float, float]]:
    """Frequencies and weights: Gauss-Legendre in the band, and in 1/ω above it with the weight of the tail."""
    nodes, weights = np.polynomial.legendre.leggauss(points)
    inside, half = (nodes + 1) / 2, weights / 2
    band = list(zip(highest * inside, half * highest / np.pi, strict=True))
    return band + list(zip(highest / inside, tail**2 * half * highest / inside**2 / np.pi, strict=True))


@one_thread
def balance_in_band(
    model: LinearModel, order: int, highest: float, *, points: int = 30, tail: float = 0.1, growth: float = 0.0
) -> Reduced:
    """Balanced truncation for frequencies up to `highest` (rad per unit of time) only, from sampled Gramians.

    (1/π) ∫ (iω − A)⁻¹ B Bᵀ (iω − A)⁻ᴴ dω by quadrature, `points` in the band and as many above it (Phillips & Silveira
    2005, doi:10.1109/TCAD.2004.839472). tail: weight of what is above, 1 for plain balancing, 0 for the band alone; a
    little of it keeps reduced poles from straying into the right half plane, which nothing guarantees: look at
    `model.poles()`, and ask for a lower order where one did. growth: sample on growth + iω instead, for inputs that
    grow like e^(growth t); right of all poles that is what a march from rest needs. Needs no stable A and one
    factorisation for all points, so it suits thousands of states. No bound: measure with `bode_error_db`. The order
    may come out lower than asked for.

    Raises InputError where `order` or `highest` is out of range.
    """
    _require_order(model, order)
    if not highest > 0:
        raise InputError(f"Argument `highest` must be a positive frequency, but is {highest}")
    right, left, singular = _balance(*_sampled(model, sample(highest, points, tail), growth))
    keep = min(order, singular.size)
    return Reduced(_transform(model, right[:, :keep], left[:keep], "band"), None, singular)


def _sampled(
    model: LinearModel, points: list[tuple[float, float]], growth: float
) -> tuple[Float[np.ndarray, "n S"], Float[np.ndarray, "n T"]]:
    """Roots of both Gramians by quadrature on growth + iω, inputs and outputs evened."""
    reach, see, gains = [], [], []
    for omega, weight in points:
        s = growth + 1j * omega
        x = model.resolvent.solve(s, model.b)
        y = model.resolvent.solve(s, model.c.T, adjoint=True)
        gains.append(np.abs(model.c @ x + model.d))
        reach += [np.real(x) * np.sqrt(weight), np.imag(x) * np.sqrt(weight)]
        see += [np.real(y) * np.sqrt(weight), np.imag(y) * np.sqrt(weight)]
    rows, columns = even(np.max(gains, axis=0))
    return np.concatenate(reach / columns, axis=1), np.concatenate(see / rows, axis=1)


@one_thread
def balance_beside(
    model: LinearModel, kept: Sequence[int], order: int, highest: float, *, points: int = 30, tail: float = 0.1
) -> Reduced:
    """Keep some states as they are, first in the result, and those directions of the others that the inputs reach and
    the outputs see most in the whole model, up to the frequency `highest`.

    The whole's sampled Gramians (as in `balance_in_band`), of which each part is balanced by itself (Vandendorpe & Van
    Dooren 2008, doi:10.1007/978-3-540-78841-6_14): what grows by itself and is damped in the whole is no trouble, which
    it is to `balance_rest`. Where the whole grows, they are sampled as far right of its fastest mode as that is of the
    axis. States left out are dropped: nothing is exact, neither at frequency 0, and nothing bounds the error; measure
    it. Raises InputError where `order` does not leave one of the others.
    """
    _require_order(model, order, len(kept) + 1, "states are kept as they are, and one of the others")
    model, count = _first(model, kept), len(kept)
    growth = 2 * max(0.0, float(np.real(model.resolvent.poles).max()))
    reach, see = _sampled(model, sample(highest, points, tail), growth)
    right, left, singular = _balance(reach[count:], see[count:])
    free = min(order - count, singular.size)
    v = np.asarray(scipy.linalg.block_diag(np.eye(count), right[:, :free]))
    w = np.asarray(scipy.linalg.block_diag(np.eye(count), left[:free]))
    return Reduced(_named_rest(_transform(model, v, w, "rest"), model, count), None, singular)


def _first(model: LinearModel, kept: Sequence[int]) -> LinearModel:
    """The model with the kept states before the others."""
    first = [*kept, *np.setdiff1d(np.arange(model.order), kept)]
    return replace(
        model, a=model.a[np.ix_(first, first)], b=model.b[first], c=model.c[:, first], x=model.x[first],
        states=tuple(model.states[i] for i in first), state_units=tuple(model.state_units[i] for i in first),
    )  # fmt: skip


def _named_rest(small: LinearModel, model: LinearModel, count: int) -> LinearModel:
    """A reduced model whose first states are the model's own."""
    free = small.order - count
    names = model.states[:count] + tuple(f"rest[{i}]" for i in range(free))
    return replace(small, states=names, state_units=model.state_units[:count] + (NO_UNIT,) * free)


@one_thread
def balance_rest(
    model: LinearModel, kept: Sequence[int], order: int, highest: float, horizon: float = 2 * np.pi
) -> Reduced:
    """Keep some states as they are, first in the result, and balance the others as a system of their own.

    Its inputs are the kept states and the model's own, its outputs what it does to both; each is weighted by how far
    the whole model moves it up to the frequency `highest`, so that what comes back through the kept states counts. What
    nothing moves drops out. order: of the whole. States left out follow at once, which keeps the response at frequency
    0. Nothing bounds the error of the whole: measure it. Where the others alone grow, they are balanced on σ + iω, σ as
    far right of their fastest mode as a disturbance grows that takes `horizon` for a factor e more: the result is for
    about that long, and may grow too.

    Raises InputError where `order` does not leave one of the others.
    """
    _require_order(model, order, len(kept) + 1, "states are kept as they are, and one of the others")
    model, count = _first(model, kept), len(kept)
    a = model.a[count:, count:]
    growth = float(np.linalg.eigvals(a).real.max())
    sigma = 0.0 if growth < 0 else growth + 1 / horizon
    a = a - sigma * np.eye(len(a))
    reach, see, columns, rows = _sizes(model, highest, sigma)
    b = np.concatenate([model.a[count:, :count] * reach[:count], model.b[count:] / columns], axis=1)
    c = np.concatenate([model.a[:count, count:] * see[:count, None], model.c[:, count:] / rows[:, None]])
    right, left, singular = _balance(
        _root(scipy.linalg.solve_continuous_lyapunov(a, -b @ b.T)),
        _root(scipy.linalg.solve_continuous_lyapunov(a.T, -c.T @ c)),
    )
    v, w = (np.asarray(scipy.linalg.block_diag(np.eye(count), part)) for part in (right, left))
    small = _transform(model, v, w, "rest")
    small = small if order >= small.order else _fold(small, order, "rest")
    return Reduced(_named_rest(small, model, count), None, singular)


def _sizes(model: LinearModel, highest: float, sigma: float) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """The most that evened inputs move each state (n,), and a push on its rate the evened outputs (n,), on σ + iω up
    to a frequency; and the scales of inputs (m,) and outputs (q,) that even them.
    """
    points = sigma + 1j * np.geomspace(0.01, 1.0, 20) * highest
    moved = [model.resolvent.solve(s, model.b) for s in points]
    seen = [model.resolvent.solve(s, model.c.T, adjoint=True) for s in points]
    rows, columns = even(np.max([np.abs(model.c @ x + model.d) for x in moved], axis=0))
    reach = np.max([np.abs(x / columns).max(axis=1) for x in moved], axis=0)
    see = np.max([np.abs(y / rows).max(axis=1) for y in seen], axis=0)
    return reach, see, columns, rows


def bode_error_db(
    full: LinearModel, reduced: LinearModel, frequencies: Float[np.ndarray, " W"]
) -> Float[np.ndarray, "q m"]:
    """Largest difference of magnitude (dB) of each response over the frequencies (rad per unit of time).

    A response below 1e-12 of the model's largest is rounding and counts as absent; absent in both is no difference.
    """
    return magnitude_gap_db(full.response(frequencies), reduced.response(frequencies))


def magnitude_gap_db(one: Complex[np.ndarray, "W q m"], two: Complex[np.ndarray, "W q m"]) -> Float[np.ndarray, "q m"]:
    """`bode_error_db` of two frequency responses, the first being the reference."""
    one, two = np.abs(one), np.abs(two)
    with np.errstate(divide="ignore", invalid="ignore"):
        gap = np.abs(20 * np.log10(two / one))
    absent = np.maximum(one, two) <= 1e-12 * one.max()
    return np.where(absent, 0.0, gap).max(axis=0)


def step_error(full: LinearModel, reduced: LinearModel, times: Float[np.ndarray, " N"]) -> Float[np.ndarray, "q m"]:
    """Largest difference of each unit step response, over the largest value of the full one."""
    return history_gap(full.step(times), reduced.step(times))


def history_gap(one: Float[np.ndarray, "N q m"], two: Float[np.ndarray, "N q m"]) -> Float[np.ndarray, "q m"]:
    """Largest difference of each history, over the largest value of the first, the reference."""
    top = np.abs(one).max(axis=0)
    return np.abs(two - one).max(axis=0) / np.where(top > 0, top, 1.0)
