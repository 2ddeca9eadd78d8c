"""Wakes that cases ask for: each is solved once, from the nearest one before it."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

from rotorjax.bench.settings import StudySettings, study_settings
from rotorjax.ground import plane
from rotorjax.rotor import catalogue
from rotorjax.wake.model import FreeWake, free_wake
from rotorjax.wake.settings import MARCHED, hover_settings

AS_MARCHED = tuple(sorted(MARCHED.items()))
DEFAULT_TURNS = hover_settings().free_turns


@dataclass(frozen=True)
class Point:
    """One wake in hover. rotor: name or file. collective_deg. height: over R, None out of ground effect. slope_deg: of
    the ground.

    changes: settings of the wake that differ from the default, as (name, value).
    """

    rotor: str
    collective_deg: float
    height: float | None = None
    changes: tuple[tuple[str, Any], ...] = ()
    slope_deg: float = 0.0

    @property
    def label(self) -> str:
        """Name for readers."""
        place = "OGE" if self.height is None else f"h = {self.height:g}"
        place += f", {self.slope_deg:g}° of slope" if self.slope_deg else ""
        marched = set(AS_MARCHED) <= set(self.changes)
        others = [c for c in self.changes if not (marched and c in AS_MARCHED)]
        more = (", as marched" if marched else "") + "".join(f", {name} {value:g}" for name, value in others)
        return f"{self.rotor} {self.collective_deg:g}°, {place}{more}"

    @property
    def length(self) -> float:
        """About how long it takes to solve, over a wake above level ground with the default settings."""
        turns = dict(self.changes).get("free_turns", DEFAULT_TURNS) / DEFAULT_TURNS
        return turns**2 * (6.0 if self.slope_deg else 1.0)

    def settings(self, quick: bool) -> StudySettings:
        """Rotor, operating point and settings of the wake. Raises InputError where one is not allowed."""
        return study_settings(self.rotor, self.collective_deg, quick=quick, **dict(self.changes))

    def model(self, quick: bool) -> FreeWake:
        """The free wake to solve. Raises InputError where a setting is not allowed."""
        settings = self.settings(quick)
        ground = None if self.height is None else plane(self.height, self.slope_deg)
        return free_wake(settings.rotor, settings.operating, ground, settings.wake)


def point(rotor: str, collective_deg: float | None = None, height: float | None = None, **changes: Any) -> Point:
    """Make a point; a collective of None is the rotor file's. Raises InputError for an unknown rotor."""
    if collective_deg is None:
        collective_deg = round(study_settings(rotor).collective_deg, 9)
    return Point(rotor, collective_deg, height, tuple(sorted(changes.items())))


def as_marched(at: Point, quick: bool) -> Point:
    """The wake with the free part that a march and its linear wake have; the quick one has it anyway."""
    return at if quick else replace(at, changes=tuple(sorted({**dict(at.changes), **MARCHED}.items())))


def needed(task: Point, tasks: Sequence[Point]) -> Point | None:
    """The wake that `task` starts from: among those before it with its rotor and settings, the nearest.

    Over level ground one with other free turns than most starts from the same with as many as most.
    """
    earlier = tasks[: tasks.index(task)]
    usual = replace(task, changes=tuple(change for change in task.changes if change[0] != "free_turns"))
    if not task.slope_deg and usual != task and usual in earlier:
        return usual
    before = [p for p in earlier if p.rotor == task.rotor and p.changes == task.changes]
    before = [p for p in before if p.height is None or _is_further(p, task)]

    def distance(p: Point) -> tuple[float, float]:
        far = 10.0 if p.height is None and task.height is not None else abs((p.height or 0) - (task.height or 0))
        return abs(p.collective_deg - task.collective_deg), far + (task.slope_deg - p.slope_deg) / 90

    return min(before, key=distance, default=None)


def _is_further(p: Point, task: Point) -> bool:
    """Whether p's ground is at least as far away as the task's, and no steeper."""
    return None not in (p.height, task.height) and p.height >= task.height and p.slope_deg <= task.slope_deg  # type: ignore[operator]


def twist_of(rotor: str) -> float:
    """Twist from axis to tip in degrees that a straight line through root cut-out and 0.9 R has (negative: washout)."""
    import jax.numpy as jnp
    import numpy as np

    from rotorjax.rotor.geometry import twist

    body, _ = catalogue.load(rotor)
    r = np.linspace(float(body.root_cutout), 0.9, 50)
    return float(np.rad2deg(np.polyfit(r, np.asarray(twist(body, jnp.asarray(r))), 1)[0]))
