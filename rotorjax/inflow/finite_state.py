"""The finite-state potential flow (VPBFSM) as an inflow model: pressure coefficients of the blades' loads drive it.

The model knows a wind along the disk's x axis, and a ground that rises along it. A wind from elsewhere is one along x
in a frame turned to it: harmonics m of states and loads turn by m times its angle, and the rates turn back. In air at
rest there is no angle; there the rates of a wind along x and of one along y add up, which is exact to first order, so
that derivatives are right. Ground that a hub sees turned is handled likewise, but where it rises straight aft or ahead
it has no derivative by roll.
"""

from typing import Unpack

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from rotorjax.ground import Plane, TurnedPlane
from rotorjax.inflow.interface import DiskLoads, InflowModel
from rotorjax.inflow.momentum import downward, edgewise, hover_inflow
from rotorjax.potential import dynamics, loading
from rotorjax.potential.ground_source import DiskQuadrature
from rotorjax.potential.model import (
    FiniteStateModel,
    Settings,
    answer_means,
    disk_inflow,
    finite_state_model,
    with_ground,
)
from rotorjax.potential.modes import ModeTable
from rotorjax.rotor.hub import RotorInputs

STILL = 1e-12  # of a squared speed over ΩR: air at rest has a wake of hover, smoothly


class FiniteStateInflow(InflowModel):
    """The VPBFSM. State (M,): velocity states a; the ground's follow at once, c = G a. model: modes and ground."""

    model: FiniteStateModel

    def start(self, thrust: Float[Array, ""], inputs: RotorInputs) -> Float[Array, " M"]:
        """One pressure mode that carries the thrust, with momentum theory's mean inflow, less the ground's upflow."""
        first, count = self.model.modes.index(0, 1), len(self.model.modes)
        alone = jnp.zeros(count).at[first].set(jnp.sqrt(3.0) / 2 * hover_inflow(thrust, inputs))
        over, _ = self._over(alone, inputs)
        return alone / jnp.sqrt(1 - jnp.sqrt(3.0) / 2 * answer_means(over)[first])

    def velocity(
        self, state: Float[Array, " M"], points: Float[Array, "*n 3"], inputs: RotorInputs
    ) -> Float[Array, "*n 3"]:
        """Axial velocity of the disk, the ground's effect included."""
        over, uphill = self._over(state, inputs)
        x, y = points[..., 0], points[..., 1]
        if uphill is not None:
            cosine, sine = uphill
            state = _turn(self.model.modes, cosine, sine) @ state
            x, y = cosine * x + sine * y, cosine * y - sine * x
        return downward(disk_inflow(with_ground(state, over), x, y, over))

    def rate(self, state: Float[Array, " M"], loads: DiskLoads, inputs: RotorInputs) -> Float[Array, " M"]:
        """Eq. 1 under the blades' pressure coefficients (Eq. 2)."""
        tau = loading.from_blades(loads.lift, loads.r, loads.widths, loads.psi, self.model.modes)
        aft, starboard = edgewise(inputs)
        rest = (aft == 0) & (starboard == 0)
        speed = jnp.where(rest, aft, jnp.sqrt(jnp.where(rest, 1.0, aft**2 + starboard**2)))
        cosine = jnp.where(rest, 1.0, aft / jnp.where(rest, 1.0, speed))
        sine = jnp.where(rest, 0.0, starboard / jnp.where(rest, 1.0, speed))
        zero, one = jnp.zeros_like(speed), jnp.ones_like(speed)
        # along the wind, along y, and in no wind at all
        winds = jnp.stack([jnp.stack(w) for w in ((cosine, sine, speed), (zero, one, starboard), (one, zero, zero))])
        over, uphill = self._over(state, inputs)
        rising = state if uphill is None else _turn(self.model.modes, uphill[0], uphill[1]) @ state
        upflow = answer_means(over) @ rising

        def turned(wind: Array) -> Array:
            """Rate in a wind given by the cosine and sine of its direction, aft towards starboard, and its speed."""
            turn = _turn(self.model.modes, wind[0], wind[1])
            given = dynamics.InflowInputs(turn @ tau, wind[2], inputs.climb)
            return turn.T @ dynamics.rotor_rate(turn @ state, given, over, upflow)

        along, across, none = jax.vmap(turned)(winds)
        return jnp.where(rest, along + across - none, along)

    def _over(
        self, state: Float[Array, " M"], inputs: RotorInputs
    ) -> tuple[FiniteStateModel, Float[Array, "2"] | None]:
        """The model over the ground as the hub sees it, its wake as the wind leaves it, and the cosine and sine of the
        direction in which the ground rises; None where it rises along x.
        """
        model = self._in_wind(state, inputs)
        if model.ground is None or inputs.height is None:
            return model, None
        over = eqx.tree_at(lambda m: m.ground.height, model, inputs.height)
        if inputs.turn is None:
            return over, None
        normal = TurnedPlane(inputs.height, model.ground.slope, inputs.turn).normal
        # straight aft or ahead x will do, with either sign of the slope: smooth where the ground is level
        aside = normal[1] != 0
        across = jnp.sqrt(jnp.where(aside, normal[0] ** 2 + normal[1] ** 2, 1.0))
        uphill = jnp.where(aside, -normal[:2] / across, jnp.array([1.0, 0.0]))
        slope = jnp.arctan2(-normal[:2] @ uphill, normal[2])
        distance = inputs.height * jnp.cos(model.ground.slope)
        ground = Plane(distance / normal[2], slope)
        return eqx.tree_at(lambda m: m.ground, over, ground), uphill

    def _in_wind(self, state: Float[Array, " M"], inputs: RotorInputs) -> FiniteStateModel:
        """The model whose wake contracts as the wind along the disk lets it, by momentum theory, and leans with it."""
        wind, first = edgewise(inputs), 2 / jnp.sqrt(3.0) * state[self.model.modes.index(0, 1)]
        lean = jnp.sqrt((wind @ wind + STILL) / (first**2 + STILL))
        model = eqx.tree_at(lambda m: m.lean, self.model, lean)
        if model.wake is None:
            return model
        squares = jnp.stack([wind @ wind + (n * first) ** 2 + STILL for n in (1, 2)])  # of V_T at the disk, far below
        wake = model.wake.in_stream(jnp.sqrt(squares[0] / squares[1]))
        return eqx.tree_at(lambda m: m.wake, model, wake)


def _turn(modes: ModeTable, cosine: Float[Array, ""], sine: Float[Array, ""]) -> Float[Array, "M M"]:
    """Coefficients of cos mψ and sin mψ in a frame turned by an angle, from those in this one."""
    columns = {(mode.m, mode.n, mode.kind): k for k, mode in enumerate(modes.modes)}
    matrix = jnp.eye(len(modes), dtype=cosine.dtype)
    for (m, n, kind), k in columns.items():
        if m == 0 or kind == "sin":
            continue
        c, s = jnp.ones_like(cosine), jnp.zeros_like(sine)
        for _ in range(m):
            c, s = c * cosine - s * sine, s * cosine + c * sine
        other = columns[m, n, "sin"]
        matrix = matrix.at[k, k].set(c).at[k, other].set(s).at[other, k].set(-s).at[other, other].set(c)
    return matrix


def finite_state(
    ground: Plane | None = None, harmonics: int = 2, radial_terms: int = 3, **settings: Unpack[Settings]
) -> FiniteStateInflow:
    """Make the model. harmonics, radial_terms: of the inflow; over ground the sources have the same harmonics.
    settings: see `finite_state_model`.

    Raises InputError where a count is not allowed.
    """
    settings = {"quadrature": DiskQuadrature(16, 16), **settings}
    return FiniteStateInflow(
        finite_state_model(ground, harmonics, radial_terms, harmonics if ground is not None else 0, 5, **settings)
    )
