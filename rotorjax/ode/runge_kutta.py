"""Explicit Runge-Kutta steps on pytree states, with tableaus that check their own order conditions."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import jax
import jax.numpy as jnp
from jax.typing import ArrayLike
from jaxtyping import Array, PyTree

from rotorjax.ode.structure import require_like

Rhs = Callable[..., PyTree]
Row = tuple[Fraction, ...]


def _order_conditions(a: Sequence[Row], b: Row, c: Row) -> dict[int, list[tuple[Fraction, Fraction]]]:
    """Elementary weights of the rooted trees up to order 5 beside 1/density (Hairer, Nørsett & Wanner, II.2)."""

    def act(v: Sequence[Fraction]) -> Row:
        return tuple(sum((x * y for x, y in zip(row, v, strict=False)), Fraction(0)) for row in a)

    def times(*vs: Sequence[Fraction]) -> Row:
        out = [Fraction(1)] * len(b)
        for v in vs:
            out = [x * y for x, y in zip(out, v, strict=True)]
        return tuple(out)

    ac, acc = act(c), act(times(c, c))
    aac, accc = act(ac), act(times(c, c, c))
    trees: dict[int, list[tuple[Row, int]]] = {
        1: [(times(), 1)],
        2: [(c, 2)],
        3: [(times(c, c), 3), (ac, 6)],
        4: [(times(c, c, c), 4), (times(c, ac), 8), (acc, 12), (aac, 24)],
        5: [
            (times(c, c, c, c), 5),
            (times(c, c, ac), 10),
            (times(c, acc), 15),
            (times(c, aac), 30),
            (times(ac, ac), 20),
            (accc, 20),
            (act(times(c, ac)), 40),
            (act(acc), 60),
            (act(aac), 120),
        ],
    }
    weigh = {order: [(sum(times(b, v), Fraction(0)), Fraction(1, g)) for v, g in row] for order, row in trees.items()}
    return weigh


@dataclass(frozen=True)
class ButcherTableau:
    """An explicit Runge-Kutta method in exact fractions; refuses coefficients that miss the order they claim.

    a: rows of the strictly lower triangle, row i has i entries. b: weights. c: nodes. order: claimed order, 1 to 5.
    Static: hashable, fit for `static_argnames`.
    """

    name: str
    order: int
    a: tuple[Row, ...]
    b: Row
    c: Row

    def __post_init__(self) -> None:
        """Check shapes, row sums (c_i = Σ a_ij) and the order conditions, exactly."""
        if not 1 <= self.order <= 5:
            raise ValueError(f"{self.name}: order conditions are known here up to 5, but the order is {self.order}")
        if not len(self.a) == len(self.b) == len(self.c) or any(len(row) != i for i, row in enumerate(self.a)):
            raise ValueError(f"{self.name}: a must be strictly lower triangular with one row a stage")
        if any(sum(row, Fraction(0)) != c for row, c in zip(self.a, self.c, strict=True)):
            raise ValueError(f"{self.name}: row sums of a differ from c")
        conditions = _order_conditions(self.a, self.b, self.c)
        for order in range(1, self.order + 1):
            if any(found != wanted for found, wanted in conditions[order]):
                raise ValueError(f"{self.name}: an order condition of order {order} fails")

    @property
    def stages(self) -> int:
        """Number of evaluations of the right-hand side a step."""
        return len(self.b)

    def stability_polynomial(self) -> tuple[Fraction, ...]:
        """Coefficients r_k of R(z) = Σ r_k z^k, the growth over one step of x' = λx, z = λ dt."""
        v: Row = (Fraction(1),) * self.stages
        out = [Fraction(1)]
        for _ in range(self.stages):
            out.append(sum((b * x for b, x in zip(self.b, v, strict=True)), Fraction(0)))
            v = tuple(sum((x * y for x, y in zip(row, v, strict=False)), Fraction(0)) for row in self.a)
        return tuple(out)


def _tableau(name: str, order: int, a: Sequence[str], b: str) -> ButcherTableau:
    rows = tuple(tuple(Fraction(x) for x in row.split()) for row in a)
    weights = tuple(Fraction(x) for x in b.split())
    return ButcherTableau(name, order, rows, weights, tuple(sum(row, Fraction(0)) for row in rows))


# Dormand & Prince (1980), doi:10.1016/0771-050X(80)90013-3: the fifth-order weights alone, six stages, as `ode5` of
# Simulink.
RK5 = _tableau(
    "Dormand-Prince 5",
    5,
    (
        "",
        "1/5",
        "3/40 9/40",
        "44/45 -56/15 32/9",
        "19372/6561 -25360/2187 64448/6561 -212/729",
        "9017/3168 -355/33 46732/5247 49/176 -5103/18656",
    ),
    "35/384 0 500/1113 125/192 -2187/6784 11/84",
)
RK4 = _tableau("classical Runge-Kutta 4", 4, ("", "1/2", "0 1/2", "0 0 1"), "1/6 1/3 1/3 1/6")


def step(rhs: Rhs, t: ArrayLike, x: PyTree, dt: ArrayLike, *args: Any, tableau: ButcherTableau = RK5) -> PyTree:
    """State after one step of x' = rhs(t, x, *args) from (t, x) over dt.

    x: pytree of floating-point arrays of any shapes; the result has its structure, shapes and dtypes.

    The stages run in a scan, so that a long right-hand side is compiled once and not once a stage.

    Raises InputError where `rhs` returns something that is not shaped like `x`.
    """
    return told_step(lambda *at: (rhs(*at), ()), t, x, dt, *args, tableau=tableau)[0]


def told_step(
    rhs: Rhs, t: ArrayLike, x: PyTree, dt: ArrayLike, *args: Any, tableau: ButcherTableau = RK5
) -> tuple[PyTree, PyTree]:
    """`step` with an rhs that returns (rate, anything): the state after it, and anything at its start."""
    stages = tableau.stages
    lower = [[float(v) for v in row] + [0.0] * (stages - i) for i, row in enumerate(tableau.a)]

    def combine(weights: Array, k: PyTree) -> PyTree:
        def leaf(y: Array, ks: Array) -> Array:
            return y + jnp.asarray(dt, y.dtype) * jnp.tensordot(weights.astype(y.dtype), ks, axes=1)

        return jax.tree.map(leaf, x, k)

    def stage(k: PyTree, row: tuple[Array, Array, Array]) -> tuple[PyTree, PyTree]:
        i, weights, c = row
        slope, told = rhs(t + c * dt, combine(weights, k), *args)
        require_like(slope, x, "rhs(t, x, ...)")
        return jax.tree.map(lambda ks, s: ks.at[i].set(s), k, slope), told

    time = jnp.result_type(t, dt, float)
    rows = (jnp.arange(stages), jnp.array(lower), jnp.array([float(c) for c in tableau.c], time))
    empty = jax.tree.map(lambda y: jnp.zeros((stages, *jnp.shape(y)), jnp.result_type(y)), x)
    slopes, told = jax.lax.scan(stage, empty, rows)
    return combine(jnp.array([float(b) for b in tableau.b]), slopes), jax.tree.map(lambda v: v[0], told)
