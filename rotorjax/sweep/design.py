"""The points of a sweep, and the tree by which each starts from the nearest one that is solved before it."""

import hashlib
import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from rotorjax.sweep.case import Axis, SweepCase


@dataclass(frozen=True)
class DesignPoint:
    """One point. index: in the sweep's table. values: (name, value) of each axis."""

    index: int
    values: tuple[tuple[str, float], ...]

    @property
    def label(self) -> str:
        """For readers: height 0.6, slope_deg 15."""
        return ", ".join(f"{name} {value:.6g}" for name, value in self.values)

    @property
    def name(self) -> str:
        """Of its file: no two points share it, and it is the same in any sweep that has the point."""
        return hashlib.sha256(repr(sorted(self.values)).encode()).hexdigest()[:16]


def points_of(case: SweepCase) -> tuple[DesignPoint, ...]:
    """All points, the last axis fastest; of a random design in the order of their drawing."""
    names = [axis.name for axis in case.axes]
    rows = _drawn(case) if case.design.kind == "random" else itertools.product(*(axis.values for axis in case.axes))
    return tuple(DesignPoint(k, tuple(zip(names, map(float, row), strict=True))) for k, row in enumerate(rows))


def _drawn(case: SweepCase) -> list[list[float]]:
    """A Latin hypercube: every axis is cut into as many equal parts as there are points, each taken once.

    McKay, Beckman and Conover, Technometrics 21 (1979) 239.
    """
    count, rng = case.design.points, np.random.default_rng(case.design.seed)
    columns = [(rng.permutation(count) + rng.uniform(size=count)) / count for _ in case.axes]
    return [
        [_at(axis, share) for axis, share in zip(case.axes, row, strict=True)] for row in zip(*columns, strict=True)
    ]


def _at(axis: Axis, share: float) -> float:
    """A value of an axis, or a place between its ends, by its share of the way."""
    if axis.values:
        return axis.values[int(share * len(axis.values))]
    return axis.low + share * (axis.high - axis.low)


@dataclass(frozen=True)
class Plan:
    """Points in solving order, and the earlier point that each is nearest to: None for the first alone."""

    order: tuple[DesignPoint, ...]
    nearest: dict[DesignPoint, DesignPoint | None]


def plan(points: Sequence[DesignPoint]) -> Plan:
    """Grow a tree from the easiest point (high, level, slow), always by the point that is closest to it.

    Distances are over the axes' widths, heights as R/h, in which the ground's effect is even; free air is far from
    ground. The same points make the same plan, whatever is solved already.
    """
    if not points:
        return Plan((), {})
    places = _places(points)
    first = min(range(len(points)), key=lambda k: (tuple(places[k]), k))
    order = [first]
    parent: dict[int, int | None] = {first: None}
    distance = _distances(places, first)
    nearest = np.full(len(points), first)
    distance[first] = np.inf
    while len(order) < len(points):
        new = int(np.argmin(distance))
        order.append(new)
        parent[new] = int(nearest[new])
        others = _distances(places, new)
        closer = others < distance - 1e-12
        taken = np.isinf(distance)
        distance = np.where(closer & ~taken, others, distance)
        nearest = np.where(closer & ~taken, new, nearest)
        distance[new] = np.inf
    named = {points[k]: None if (p := parent[k]) is None else points[p] for k in order}
    return Plan(tuple(points[k] for k in order), named)


_GROUND = 0.5
"""How much farther free air is from any ground than its height says."""


def _places(points: Sequence[DesignPoint]) -> Float[np.ndarray, "N A"]:
    """Places of points, each axis over its width, the easy end lowest."""
    columns = []
    for k, (name, _) in enumerate(points[0].values):
        column = np.array([point.values[k][1] for point in points])
        if name == "height":
            column = np.where(np.isinf(column), -_GROUND, 1.0 / np.where(np.isinf(column), 1.0, column))
        width = np.ptp(column)
        columns.append((column - column.min()) / width if width else np.zeros(len(points)))
    return np.stack(columns, axis=-1)


def _distances(places: Float[np.ndarray, "N A"], k: int) -> Float[np.ndarray, " N"]:
    return np.sqrt(np.sum((places - places[k]) ** 2, axis=-1))


def grid_shape(case: SweepCase) -> tuple[int, ...]:
    """Lengths of the axes of a grid; of a random design the number of points."""
    if case.design.kind == "random":
        return (case.design.points,)
    return tuple(len(axis.values) for axis in case.axes)
