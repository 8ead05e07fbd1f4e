"""The search for the least tensions that hit a target, from several starts."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import replace

import numpy as np
from scipy.optimize import brentq

from cdsm._checks import Array
from cdsm.errors import UnreachableStiffness
from cdsm.planning.attainable import attainable
from cdsm.planning.field import Point, Reading, Sight, drawn_back
from cdsm.planning.problem import Problem
from cdsm.planning.search import EFFORT, MET, NEAREST, Found, Task, search
from cdsm.planning.starts import Ground, beyond_jumps, settled

_CORNERS = 1e3
"""Unbounded tensions are begun from as far as this many times the least."""

_RANGE_STARTS = 24
"""From how many tensions the range is searched before a target is refused."""

_NEAREST_STARTS = 8
"""Corners from which targets that cannot all be hit are approached, too."""

_NEARLY = 0.1
"""Relative miss with which a point tells how large the tensions will be."""

_EDGE = 1e-9
"""A target this part beyond an end of the range is at the end."""


class Planner:
    """Searches for one reading, and the record of them.

    Args:
        question: The arm and what limits its tensions.
        reading: What is to be zero.
        starts: From how many tensions to search.
        seed: Of the random ones.

    Attributes:
        efforts: ‖F‖ [N] where each search ended that hit the target, rising.
        iterations: Steps of all searches so far.
    """

    def __init__(self, question: Problem, reading: Reading, starts: int, seed: int) -> None:
        region = question.region
        bounded = region
        if not np.isfinite(region.high).all():
            bounded = region.capped(_CORNERS * region.scale)
        self.question = question
        self.reading = reading
        self.starts = starts
        self.seed = seed
        self.ground = Ground(bounded, question.field, 0, seed)
        self.task = Task(region, question.field, self.ground.anchor, reading, EFFORT, region.scale)
        self.iterations = 0
        self.efforts: list[float] = []

    def least(self) -> Found | None:
        """The least tensions that hit the target, if any start leads to some."""
        return self._best(self._begin())

    def within_range(self, u: Array, target: float) -> Found:
        """The same of one target [N/m] along u (3,), begun anew from the ends of the range.

        Raises:
            UnreachableStiffness: It is not in the range, or in a gap of it.
        """
        ends = attainable(self.question, u, _RANGE_STARTS, self.seed)
        self.iterations += ends.iterations
        low = 0.0 if ends.low.open else float(ends.low.values[0])
        high = math.inf if ends.high.open else float(ends.high.values[0])
        if not low * (1.0 - _EDGE) <= target <= high * (1.0 + _EDGE):
            raise UnreachableStiffness(u, target, low, high, [low if target < low else high])
        both = [ends.low.point, ends.high.point]
        points = [*self._crossings(both[0], both), *self._crossings(both[1], both)] or both
        found = self._best(points)
        if found is None:
            raise UnreachableStiffness(u, target, low, high, self._beside(target, points))
        return found

    def nearest(self) -> Found:
        """The tensions with the least misses in the sum of squares, and of these the least."""
        task = replace(self.task, goal=NEAREST)

        def misses(sight: Sight) -> float:
            return task.merit(sight, 0.0)

        corners = sorted(self.ground.points, key=lambda point: misses(task.look(point)))
        points = [*self._begin(), *corners[:_NEAREST_STARTS]]
        found = [self._settled(self._search(task, point), task) for point in points]
        best = min(found, key=lambda each: misses(each.sight))
        as_near = Reading(self.reading.parts, self.reading.wanted + best.sight.values)
        least = self._search(replace(self.task, reading=as_near), best.sight.point)
        kept = misses(task.look(least.sight.point)) <= misses(best.sight) + MET**2
        return least if kept else best

    def _nearly(self, point: Point) -> bool:
        """Whether a point almost hits the target."""
        return bool((abs(self.reading.of(point).values) <= _NEARLY).all())

    def _beside(self, target: float, points: list[Point]) -> tuple[float, float]:
        """The nearest found to be attainable below and above one target [N/m] in a gap."""
        task = replace(self.task, goal=NEAREST)
        sights = [task.look(point) for point in points]
        for point in points:
            end = self._search(task, point).sight
            beyond = beyond_jumps(self.question.region, end.point.F)
            drawn = (drawn_back(self.question.field, F, self.ground.anchor) for F in beyond)
            sights += [end, *(task.look(there) for there in drawn if there is not None)]
        found = target * (1.0 + np.array([sight.values[0] for sight in sights]))
        return float(found[found < target].max()), float(found[found > target].min())

    def _best(self, points: Iterable[Point]) -> Found | None:
        """The least tensions that hit the target, if any of some points leads to them."""
        begin = list(points)
        near = [point.F.max() for point in begin if self._nearly(point)]
        task = replace(self.task, unit=float(min(near, default=self.task.unit)))
        found = [self._settled(self._search(task, point), task) for point in begin]
        met = [each for each in found if task.met(each.sight)]
        if not met:
            return None
        met.sort(key=lambda each: float(np.linalg.norm(each.sight.point.F)))
        met[0] = self._settled(met[0], task, near=math.inf)
        self.efforts = [float(np.linalg.norm(each.sight.point.F)) for each in met]
        return met[0]

    def _begin(self) -> Iterator[Point]:
        """Where to begin: least tensions, where one target is hit between corners, and anywhere."""
        anchor = self.ground.anchor
        least = drawn_back(self.question.field, self.question.region.least.values, anchor)
        points = [] if least is None else [least]
        if self.reading.wanted.size == 1:
            points += self._crossings(anchor, self.ground.points)[: max(self.starts - 2, 1)]
        points = [*points, anchor][: self.starts]
        yield from points
        yield from self.ground.between(self.starts - len(points), self.seed)

    def _crossings(self, hub: Point, others: list[Point]) -> list[Point]:
        """Stable points on the way from one to others where the one target is hit, least first."""
        field = self.question.field

        def miss(point: Point) -> float:
            if point.reserve < 0.0:
                return -1.0  # on the way through buckling, where there is no stiffness
            return float(self.reading.of(point).values[0])

        here, guesses = miss(hub), []
        for other in others:
            there = miss(other)
            if here * there < 0.0:
                guess = hub.F + here / (here - there) * (other.F - hub.F)
                guesses.append((float(guess @ guess), other.F - hub.F))
        found = []
        for _, way in sorted(guesses, key=lambda pair: pair[0])[: self.starts]:
            part = brentq(
                lambda part, way=way: miss(field.at(hub.F + part * way)),
                0,
                1,
                xtol=1e-15,
                rtol=1e-2,
            )
            point = field.at(hub.F + part * way)
            if point.reserve >= 0.0:
                found.append(point)
        return sorted(found, key=lambda point: float(point.F @ point.F))

    def _search(self, task: Task, point: Point) -> Found:
        found = search(task, point)
        self.iterations += found.iterations
        return found

    def _settled(self, found: Found, task: Task, near: float | None = None) -> Found:
        better = settled(task, found) if near is None else settled(task, found, near=near)
        self.iterations += better.iterations - found.iterations
        return better
