"""Small models of a rotor in its hovering free wake, for a horizon: blades kept, unstable wake modes dealt with openly.

A hovering wake's vortices pair: dozens of its modes grow, by up to twenty times a revolution, and a marched wake leaves
the linear one within two. A model that is right for all times would have to hold every one of them; one that leaves
them out is wrong from the first moment, because they and the damped ones come into being together. What is right for a
horizon T weighs responses by e^{−2σt} with σ of about 1/T: balanced on σ + iω (ode/reduction.py), each wave number by
itself so that the hub's symmetry is kept. The small model may grow too, and is not to be trusted beyond its horizon.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy.linalg
from jaxtyping import Complex, Float, Int

from rotorjax.linearisation.compact import HIGHEST, Compact, check_order, frequencies, gaps, readable
from rotorjax.linearisation.hover import HoverModel, Wave
from rotorjax.ode.models import LinearModel
from rotorjax.ode.reduction import even, history_gap, sample
from rotorjax.ode.threads import one_thread

HORIZON = 2 * np.pi
"""Radians of azimuth over which a small model's steps are compared: one revolution."""
SHARES = (0.0, 0.3, 0.6)
"""Candidates for σ, over the growth of the fastest mode."""
POINTS, TAIL = 20, 0.3
"""Frequencies up to HIGHEST and as many above it, and the weight of these."""
REST = "rest"


@dataclass(frozen=True)
class SmallHover(Compact):
    """A reduced model, gap_db and gap_deg on iω. step_error (q, m): largest difference of a step over `horizon`, over
    the full one's largest value. growth: σ.
    """

    step_error: Float[np.ndarray, "q m"]
    growth: float
    horizon: float = HORIZON


def kept_of(names: Sequence[str]) -> Int[np.ndarray, " k"]:
    """A blade's states: flap, lag and their rates."""
    return np.array([k for k, name in enumerate(names) if name.startswith(("beta_", "lag_"))])


def small_hover(model: HoverModel, order: int) -> SmallHover:
    """The model with `order` states at most, its blades' states first and as they are.

    The best of the candidates by the mean error of the steps over the horizon. Raises InputError where the order is
    below the kept states and one of each wave.
    """
    waves = model.reached
    kept, copies = kept_of(model.names), sum(len(wave.coordinates) for wave in waves)
    check_order(order, len(kept) * copies + copies - 1)
    times = np.linspace(0, HORIZON, 49)
    truth, growth = model.step(times), max(0.1, *(float(np.real(wave.resolvent.poles).max()) for wave in waves))

    def error(found: HoverModel) -> float:
        return float(np.mean(np.minimum(history_gap(truth, found.step(times)), 1.0)))

    candidates = {share: replace(model, waves=_shared(waves, kept, order, share * growth)) for share in SHARES}
    share, best = min(candidates.items(), key=lambda pair: error(pair[1]))
    joined = _readable(best, len(kept))
    freq = frequencies()
    gap = gaps(model.response(freq), best.response(freq))
    unstable = int(np.sum(np.real(np.linalg.eigvals(joined.a)) >= 0))
    return SmallHover(joined, *gap, unstable, history_gap(truth, best.step(times)), share * growth)


def _shared(waves: tuple[Wave, ...], kept: np.ndarray, order: int, sigma: float) -> tuple[Wave, ...]:
    """Every wave reduced, the states that are left shared out by coordinates."""
    copies = sum(len(wave.coordinates) for wave in waves)
    left = order - len(kept) * copies
    each = left // copies
    more = left - each * copies  # a pair of coordinates takes two or none
    return tuple(_reduced(w, kept, each + (more if w.real else 0), sigma) for w in waves)


@one_thread
def _reduced(wave: Wave, kept: np.ndarray, free: int, sigma: float) -> Wave:
    """One wave with the kept states and the `free` directions that the whole reaches and shows most, on σ + iω."""
    n = wave.a.shape[0]
    rest = np.setdiff1d(np.arange(n), kept)
    reach, see = (part[rest] for part in _snapshots(wave, sigma))
    u, size, vh = scipy.linalg.svd(see.conj().T @ reach, full_matrices=False)
    root = np.sqrt(size[:free])
    right = np.zeros((n, len(kept) + free), reach.dtype)
    left = np.zeros_like(right)
    right[kept, np.arange(len(kept))] = left[kept, np.arange(len(kept))] = 1
    right[rest, len(kept) :], left[rest, len(kept) :] = reach @ vh[:free].conj().T / root, see @ u[:, :free] / root
    back = left.conj().T
    return replace(wave, a=back @ wave.a @ right, b=back @ wave.b, c=wave.c @ right)


def _snapshots(wave: Wave, sigma: float) -> tuple[Complex[np.ndarray, "n S"], Complex[np.ndarray, "n T"]]:
    """Roots of both Gramians on σ + iω, inputs and outputs evened; a real wave's are real."""
    reach, see, gains = [], [], []
    for omega, weight in _both_ways(wave):
        x = wave.resolvent.solve(sigma + 1j * omega, wave.b)
        y = wave.resolvent.solve(sigma + 1j * omega, wave.c.conj().T, adjoint=True)
        gains.append(np.abs(wave.c @ x))
        reach.append(x * np.sqrt(weight))
        see.append(y * np.sqrt(weight))
    rows, columns = even(np.max(gains, axis=0))
    parts = (np.concatenate([x / columns for x in reach], axis=1), np.concatenate([y / rows for y in see], axis=1))
    if not wave.real:
        return parts
    one, two = (np.concatenate([np.real(part), np.imag(part)], axis=1) for part in parts)
    return one, two


def _both_ways(wave: Wave) -> list[tuple[float, float]]:
    """Frequencies and weights; a complex system is not the same at −ω."""
    points = sample(HIGHEST, POINTS, TAIL)
    return points if wave.real else points + [(-omega, weight) for omega, weight in points]


def _readable(model: HoverModel, kept: int) -> LinearModel:
    """The joined model, the blades' states first, then λ_0, λ_1c, λ_1s as far as the outputs hold them."""
    named = _joined(model, kept)
    blades = [k for k, name in enumerate(named.states) if name != REST]
    first = [*blades, *(k for k, name in enumerate(named.states) if name == REST)]
    moved = replace(
        named, a=named.a[np.ix_(first, first)], b=named.b[first], c=named.c[:, first], x=named.x[first],
        states=tuple(named.states[k] for k in first), state_units=tuple(named.state_units[k] for k in first),
    )  # fmt: skip
    return readable(moved, len(blades))


def _joined(model: HoverModel, kept: int) -> LinearModel:
    """All waves as one real model: unlike a full one's, they may have different orders."""
    states, units, x = [], [], []
    for wave in model.waves:
        free = len(wave.a) - kept
        for coordinate in wave.coordinates:
            states += [name.format(coordinate) for name in model.names[:kept]] + [REST] * free
            units += [*model.units[:kept], *("-" for _ in range(free))]
            x += [*model.x[coordinate][:kept], *np.zeros(free)]
    return model.joined(model.waves, tuple(states), tuple(units), np.array(x))
