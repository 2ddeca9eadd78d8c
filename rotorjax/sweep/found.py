"""What is found at a point: numbers by name, one verdict, and what a neighbour can start from."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
from jaxtyping import Float

from rotorjax.inflow.balance import Balance
from rotorjax.operating import OperatingPoint
from rotorjax.rotor.geometry import Rotor
from rotorjax.sweep.keys import Quantity
from rotorjax.wake.search import Progress
from rotorjax.wake.solution import Solution

CONVERGED, STALLED, NONE = "converged", "stalled", "no solution"
STALLED_WITHIN = 0.02
"""Largest accuracy of the loads with which a point that stalled still stands in the table."""

QUANTITIES = {
    "CT": Quantity("1", "thrust coefficient T/(ρA(ΩR)²)"),
    "CP": Quantity("1", "power coefficient P/(ρA(ΩR)³), equal to C_Q"),
    "CP_induced": Quantity("1", "induced part of the power coefficient"),
    "CP_profile": Quantity("1", "profile part of the power coefficient"),
    "figure_of_merit": Quantity("1", "C_T^1.5/(√2 C_P), of a hover that takes power"),
    "lambda_0": Quantity("1", "induced inflow over ΩR, positive down: mean over the disk"),
    "lambda_1c": Quantity("1", "its gradient over r cos ψ, aft"),
    "lambda_1s": Quantity("1", "its gradient over r sin ψ, to starboard"),
    "thrust": Quantity("N", "thrust along the shaft"),
    "power": Quantity("W", "power of the shaft"),
    "collective_deg": Quantity("degree", "collective pitch that was found"),
    "theta_1c_deg": Quantity("degree", "cyclic pitch over cos ψ"),
    "theta_1s_deg": Quantity("degree", "cyclic pitch over sin ψ"),
    "tilt_deg": Quantity("degree", "shaft forward"),
    "beta_0_deg": Quantity("degree", "coning"),
    "beta_1c_deg": Quantity("degree", "flapping over cos ψ"),
    "beta_1s_deg": Quantity("degree", "flapping over sin ψ"),
    "CP_parasite": Quantity("1", "power coefficient of moving the hub through the air"),
    "CP_damper": Quantity("1", "power coefficient of the lag dampers"),
    "load_change": Quantity("1", "accuracy of the loads: relative change of C_T in one more pass through the wake"),
    "residual": Quantity("1", "what the solver left over (free wake: rms movement of nodes over R in a pass)"),
    "wall_time_s": Quantity("s", "wall-clock time, compilation included"),
}
"""In the order of tables."""


@dataclass(frozen=True)
class Found:
    """values: by the names of QUANTITIES; none where there is no solution. verdict: converged, stalled (accuracy of the
    loads) or no solution (why). state: arrays that a neighbour starts from, by name.
    """

    values: dict[str, float]
    verdict: str
    state: dict[str, np.ndarray] = field(default_factory=dict)

    @property
    def solved(self) -> bool:
        """Whether the point converged."""
        return self.verdict == CONVERGED


def refused(why: str) -> Found:
    """No solution, with its reason in one line."""
    return Found({}, f"{NONE} ({' '.join(why.split())})")


def of_hover(
    found: Balance | Solution, fit: Float[np.ndarray, "3"], climb: float, rotor: Rotor, operating: OperatingPoint
) -> dict[str, float]:
    """What a hover has in either model. fit: λ₀, λ₁c, λ₁s; climb: over ΩR."""
    numbers = {name: float(getattr(found, name)) for name in ("CT", "CP", "CP_induced", "CP_profile")}
    CT, CP = numbers["CT"], numbers["CP"]
    numbers["figure_of_merit"] = hover_figure(CT, CP, climb)
    inflow = dict(zip(("lambda_0", "lambda_1c", "lambda_1s"), map(float, fit), strict=True))
    return numbers | inflow | dimensional(CT, CP, rotor, operating)


def judged(
    values: dict[str, float], state: dict[str, np.ndarray], converged: bool, there: bool, accuracy: float, why: str
) -> Found:
    """One verdict. there: whether the numbers belong to the point. accuracy: of the loads, relative; NaN if unknown."""
    if converged:
        return Found(values, CONVERGED, state)
    if there and accuracy <= STALLED_WITHIN:
        return Found(values, f"{STALLED} (loads within {accuracy:.1g}: {' '.join(why.split())})")
    return refused(why)


@dataclass(frozen=True)
class Neighbour:
    """A solved neighbour: what it was solved for, and what was found."""

    prepared: Any
    found: Found


class PointSolver(Protocol):
    """Solves prepared points, several at once only where its problem has batches."""

    def __call__(
        self, prepared: Sequence[Any], start: Neighbour | None = None, progress: Progress | None = None
    ) -> list[Found]:
        """What is found at each."""
        ...


def dimensional(CT: float, CP: float, rotor: Any, operating: Any) -> dict[str, float]:
    """Thrust in N and power in W."""
    tip, force = float(operating.tip_speed(rotor.radius)), float(operating.force(rotor.radius))
    return {"thrust": force * CT, "power": force * tip * CP}


def hover_figure(CT: float, CP: float, climb: float = 0.0) -> float:
    """Figure of merit; NaN where the rotor does not hover or takes no power."""
    return CT**1.5 / (math.sqrt(2) * CP) if CT > 0 and CP > 0 and climb == 0 else math.nan
