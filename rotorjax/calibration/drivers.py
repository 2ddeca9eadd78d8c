"""Three ways down the sum of squares of a residual, all from one compiled program: the residual with its Jacobian.

They move unbounded coordinates z (`ParameterSet.bounded`) and run on the host: a fit has a handful of parameters, so
that only the residual costs. The Jacobian is taken forward, one tangent a parameter.
"""

import time
from collections.abc import Callable
from typing import Any, Literal

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import optax
from jaxtyping import Array, Float
from scipy.optimize import least_squares, minimize

from rotorjax.calibration.parameters import ParameterSet

Residual = Callable[[Float[Array, " P"], Any], Float[Array, " N"]]
FitProgress = Callable[[int, float], None]
Method = Literal["least_squares", "lbfgs", "adam"]

_ADAM_STEP = 0.1
_STEP_LEFT = 1e-10  # of the coordinates, where Levenberg-Marquardt stops; the verdict is taken from the Jacobian
_NONE_LEFT = 1e-15  # of the sum of squares or its slope: as good as it gets


@eqx.filter_jit
def linearised(residual: Residual, values: Float[Array, " P"], data: Any) -> tuple[Array, Array]:
    """The residual (N,) at values, and its Jacobian (N, P)."""

    def twice(v: Array) -> tuple[Array, Array]:
        r = residual(v, data)
        return r, r

    jacobian, r = jax.jacfwd(twice, has_aux=True)(values)
    return r, jacobian


class Descent:
    """A residual seen from the unbounded coordinates, with the history of a fit.

    history: rms at the start and after every step. compile_time_s: of the first evaluation.
    """

    def __init__(self, residual: Residual, parameters: ParameterSet, data: Any, progress: FitProgress | None = None):
        """Compiles nothing yet."""
        self.parameters, self.progress = parameters, progress
        self.history: list[float] = []
        self.compile_time_s = 0.0
        self._program, self._last = lambda values: linearised(residual, values, data), None

    def at(self, z: Float[np.ndarray, " P"]) -> tuple[np.ndarray, np.ndarray]:
        """The residual and its Jacobian with respect to the values, at coordinates z."""
        if self._last is None or not np.array_equal(self._last[0], z):
            begun = time.perf_counter()
            r, jacobian = map(np.asarray, self._program(self.parameters.bounded(z)))
            self._last = np.array(z), r, jacobian
            self.compile_time_s = self.compile_time_s or time.perf_counter() - begun
        return self._last[1:]

    def residual(self, z: Float[np.ndarray, " P"]) -> np.ndarray:
        """The residual, (N,)."""
        return self.at(z)[0]

    def jacobian(self, z: Float[np.ndarray, " P"]) -> np.ndarray:
        """Its derivative by the coordinates, (N, P)."""
        return self.at(z)[1] * self.parameters.slopes(z)

    def mean_square(self, z: Float[np.ndarray, " P"]) -> tuple[float, np.ndarray]:
        """The mean square of the residual, and its gradient by the coordinates."""
        r = self.residual(z)
        return float(np.mean(r * r)), 2 / r.size * r @ self.jacobian(z)

    def note(self, z: Float[np.ndarray, " P"]) -> None:
        """Write the rms at the end of a step down, and tell who watches."""
        self.history.append(float(np.sqrt(self.mean_square(z)[0])))
        if self.progress is not None and len(self.history) > 1:
            self.progress(len(self.history) - 1, self.history[-1])


def levenberg_marquardt(descent: Descent, z: Float[np.ndarray, " P"], steps: int) -> np.ndarray:
    """Least squares by MINPACK, which asks for a Jacobian where a step has been taken."""

    def jacobian(z: np.ndarray) -> np.ndarray:
        if len(descent.history) > 1 or not np.array_equal(z, start):
            descent.note(z)
        return descent.jacobian(z)

    start, limits = z, {"xtol": _STEP_LEFT, "ftol": _NONE_LEFT, "gtol": _NONE_LEFT, "max_nfev": steps + 1}
    z = least_squares(descent.residual, z, jacobian, method="lm", **limits).x  # type: ignore[arg-type]
    descent.note(z)
    return z


def lbfgs(descent: Descent, z: Float[np.ndarray, " P"], steps: int) -> np.ndarray:
    """L-BFGS with ten corrections, on the mean square over that at the start."""
    scale = descent.mean_square(z)[0] or 1.0

    def loss(z: np.ndarray) -> tuple[float, np.ndarray]:
        value, slope = descent.mean_square(z)
        return value / scale, slope / scale

    limits = {"maxcor": 10, "maxiter": steps, "ftol": _NONE_LEFT, "gtol": _NONE_LEFT}
    return minimize(loss, z, jac=True, method="L-BFGS-B", callback=descent.note, options=limits).x


def adam(descent: Descent, z: Float[np.ndarray, " P"], steps: int) -> np.ndarray:
    """Adam along a cosine schedule that ends at zero, by optax; returns the best z met."""
    optimiser = optax.adam(optax.cosine_decay_schedule(_ADAM_STEP, steps))
    update, state = jax.jit(optimiser.update), optimiser.init(jnp.asarray(z))
    scale, best = descent.mean_square(z)[0] or 1.0, (np.inf, z)
    for _ in range(steps):
        value, slope = descent.mean_square(z)
        best = min(best, (value, z), key=lambda found: found[0])
        change, state = update(slope / scale, state)
        z = z + np.asarray(change)
        descent.note(z)
    return z if descent.mean_square(z)[0] < best[0] else best[1]


DRIVERS: dict[Method, tuple[Callable[[Descent, np.ndarray, int], np.ndarray], int]] = {
    "least_squares": (levenberg_marquardt, 200),
    "lbfgs": (lbfgs, 200),
    "adam": (adam, 4000),
}
"""By name: the driver, and its usual number of steps."""
