"""Linear state-space models with names and units: periodic in time, and time-invariant."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, cast

import numpy as np
import scipy.linalg
from jaxtyping import Complex, Float

from rotorjax.errors import InputError
from rotorjax.ode.fourier import fourier_interpolation
from rotorjax.ode.labels import NO_UNIT
from rotorjax.ode.threads import one_thread

Notes = Mapping[str, float | str]
AZIMUTH = "azimuth (rad)"


@dataclass(frozen=True)
class PeriodicModel:
    """dx/dt = A(t) x + B(t) u, y = C(t) x + D(t) u about a periodic orbit, at K equally spaced times of one period.

    t: (K,). period: time. a (K, n, n), b (K, n, m), c (K, q, n), d (K, q, m). states, inputs, outputs: names, with
    units in state_units, input_units, output_units. x (K, n), u (m,), y (K, q): what the model's deviations are
    counted from. time: what t counts. notes: what else a reader should know, by name.
    """

    t: Float[np.ndarray, " K"]
    period: float
    a: Float[np.ndarray, "K n n"]
    b: Float[np.ndarray, "K n m"]
    c: Float[np.ndarray, "K q n"]
    d: Float[np.ndarray, "K q m"]
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    state_units: tuple[str, ...]
    input_units: tuple[str, ...]
    output_units: tuple[str, ...]
    x: Float[np.ndarray, "K n"]
    u: Float[np.ndarray, " m"]
    y: Float[np.ndarray, "K q"]
    time: str = AZIMUTH
    notes: Notes = field(default_factory=dict)

    @property
    def order(self) -> int:
        """Number of states."""
        return self.a.shape[-1]

    def refined(self, nodes: int) -> "PeriodicModel":
        """The model at another number of times from t[0] on, by trigonometric interpolation."""
        angles = 2 * np.pi * np.arange(nodes) / nodes
        table = fourier_interpolation(self.t.size, angles)
        held = {name: np.tensordot(table, getattr(self, name), axes=1) for name in ("a", "b", "c", "d", "x", "y")}
        return replace(self, t=self.t[0] + self.period * angles / (2 * np.pi), **held)

    def step(self, u: Float[np.ndarray, " m"], periods: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
        """Times (N,) and output deviations (N, q) after the inputs step by u at t[0], over a number of periods.

        Classical Runge-Kutta over two of the model's intervals a step, which takes A and B at its times only: order 4
        in period/K. Outputs are at every second time.

        Raises InputError where the number of times is odd, or too small to hold the fastest mode (unstable march).
        """
        if self.t.size % 2:
            raise InputError(f"Argument `t` must hold an even number of times for a march, but holds {self.t.size}")
        dt, nodes = 2 * self.period / self.t.size, self.t.size
        x, times, outputs = np.zeros(self.order), [], []
        for k in range(round(periods * nodes / 2) + 1):
            first, middle, last = 2 * k % nodes, (2 * k + 1) % nodes, (2 * k + 2) % nodes
            times.append(self.t[0] + k * dt)
            outputs.append(self.c[first] @ x + self.d[first] @ u)
            k1 = self.a[first] @ x + self.b[first] @ u
            k2 = self.a[middle] @ (x + dt / 2 * k1) + self.b[middle] @ u
            k3 = self.a[middle] @ (x + dt / 2 * k2) + self.b[middle] @ u
            k4 = self.a[last] @ (x + dt * k3) + self.b[last] @ u
            x = x + dt / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
            if not np.all(np.isfinite(x)):
                raise InputError(f"Argument `t` must hold more times: the march at {nodes} a period is not stable")
        return np.array(times), np.array(outputs)


class Resolvent:
    """(s − A)⁻¹ at any s from one Schur form A = Q T Qᴴ: each s then costs a triangular solve, no factorisation."""

    @one_thread
    def __init__(self, a: Float[np.ndarray, "n n"]):
        """Factorise A (n, n)."""
        t, q = cast(Any, scipy.linalg.schur)(a)
        self._t, self._q = scipy.linalg.rsf2csf(t, q)

    @property
    def poles(self) -> Complex[np.ndarray, " n"]:
        """Eigenvalues of A."""
        return np.diagonal(self._t)

    @one_thread
    def solve(self, s: complex, b: Float[np.ndarray, "n m"], *, adjoint: bool = False) -> Complex[np.ndarray, "n m"]:
        """(s − A)⁻¹ b, or (s − A)⁻ᴴ b where adjoint."""
        shifted = -self._t
        np.fill_diagonal(shifted, s - self.poles)
        side = self._q.conj().T @ b
        return self._q @ scipy.linalg.solve_triangular(shifted, side, trans=2 if adjoint else 0, check_finite=False)


@dataclass(frozen=True)
class LinearModel:
    """dx/dt = A x + B u, y = C x + D u.

    a (n, n), b (n, m), c (q, n), d (q, m). states, inputs, outputs: names, with units in state_units, input_units,
    output_units. x (n,), u (m,), y (q,): what deviations are counted from, zero where it is not given. time: what t
    counts. notes: what else a reader should know, by name.

    Raises InputError where shapes or names do not fit together.
    """

    a: Float[np.ndarray, "n n"]
    b: Float[np.ndarray, "n m"]
    c: Float[np.ndarray, "q n"]
    d: Float[np.ndarray, "q m"]
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    input_units: tuple[str, ...]
    output_units: tuple[str, ...]
    state_units: tuple[str, ...] = ()
    x: Float[np.ndarray, " n"] = None  # type: ignore[assignment]  (zeros from here on)
    u: Float[np.ndarray, " m"] = None  # type: ignore[assignment]
    y: Float[np.ndarray, " q"] = None  # type: ignore[assignment]
    time: str = AZIMUTH
    notes: Notes = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Check that matrices and names fit together, and fill in what was not given."""
        n, m, q = len(self.states), len(self.inputs), len(self.outputs)
        for name, size in {"x": n, "u": m, "y": q}.items():
            if getattr(self, name) is None:
                object.__setattr__(self, name, np.zeros(size))
        if not self.state_units:
            object.__setattr__(self, "state_units", (NO_UNIT,) * n)
        for name, shape in {"a": (n, n), "b": (n, m), "c": (q, n), "d": (q, m)}.items():
            if getattr(self, name).shape != shape:
                raise InputError(f"Argument `{name}` must have shape {shape}, but has {getattr(self, name).shape}")
        if len(self.input_units) != m or len(self.output_units) != q:
            raise InputError(f"Arguments must give one unit a name, but {m} inputs and {q} outputs have other numbers")

    @property
    def order(self) -> int:
        """Number of states."""
        return self.a.shape[0]

    @cached_property
    def resolvent(self) -> Resolvent:
        """(s − A)⁻¹, factorised once for all frequencies."""
        return Resolvent(self.a)

    def poles(self) -> Complex[np.ndarray, " n"]:
        """Eigenvalues of A, the slowest first."""
        values = self.resolvent.poles
        return values[np.argsort(np.abs(values))]

    def response(self, frequencies: Float[np.ndarray, " W"]) -> Complex[np.ndarray, "W q m"]:
        """Transfer matrix C (iω − A)⁻¹ B + D at angular frequencies ω (rad per unit of time)."""
        return np.array([self.c @ self.resolvent.solve(1j * w, self.b) + self.d for w in frequencies])

    @one_thread
    def step(self, times: Float[np.ndarray, " N"]) -> Float[np.ndarray, "N q m"]:
        """Outputs at equally spaced times from 0 after a unit step of each input at time 0, exact at those times."""
        n, m = self.b.shape
        dt = times[1] - times[0]
        if abs(times[0]) > 1e-12 * abs(dt) or not np.allclose(np.diff(times), dt, rtol=1e-9):
            raise InputError("Argument `times` must start at 0 and be equally spaced")
        joint = np.block([[self.a, self.b], [np.zeros((m, n + m))]])
        leap = scipy.linalg.expm(joint * dt)
        x, out = np.zeros((n, m)), []
        for _ in times:
            out.append(self.c @ x + self.d)
            x = leap[:n, :n] @ x + leap[:n, n:]
        return np.array(out)
