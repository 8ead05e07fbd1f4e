"""The search for the least tensions that hit a target, from several starts.

It is local: :func:`~cdsm.planning.plan.plan_stiffness` says how far above the least it has ended.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from itertools import product
from typing import Final

import numpy as np
from scipy.optimize import brentq

from cdsm.errors import UnreachableStiffness
from cdsm.planning.objectives import Problem
from cdsm.planning.range import attainable
from cdsm.planning.sqp import EFFORT, HIGHEST, LOWEST, MET, NEAREST, Found, Task, search
from cdsm.planning.starts import Ground, beyond_jumps, settled, stretches
from cdsm.planning.stiffness_model import Point, Reading, Sight, drawn_back
from cdsm.support.validation import Array

REACHED: Final = 1e-6
"""Largest relative miss with which a target counts as hit; what is found is mostly at rounding."""

Bounds = tuple[Array, Array]
"""Lowest and highest tensions (C,) [N]."""

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

_AS_NEAR = 1e-8
"""Misses up to this are as good as none: next to buckling a search may come no nearer."""

_SIDES = 6
"""How many of the places nearest to a target on either side are joined, to find it in between."""


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
        self._ended: list[Sight] = []

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
        low = 0.0 if ends.low.open else ends.low.value
        high = math.inf if ends.high.open else ends.high.value
        balanced = [self.question.field.at(end.tension.values) for end in (ends.low, ends.high)]
        begun = (self.task.look(point) for point in self.ground.points)
        sights = [*map(self.task.look, balanced), *self._ended, *begun]
        # what was met on the way beyond the range, by more than rounding, is attainable, too
        met = [target * (1.0 + float(sight.values[0])) for sight in sights]
        low = min([low, *(value for value in met if value < low * (1.0 - REACHED))])
        high = max([high, *(value for value in met if value > high * (1.0 + REACHED))])
        if not low * (1.0 - _EDGE) <= target <= high * (1.0 + _EDGE):
            raise UnreachableStiffness(u, target, low, high, [low if target < low else high])
        both = [ends.low.point, ends.high.point]
        points = [*self._crossings(both[0], both), *self._crossings(both[1], both)] or both
        found = self._best(points)
        if found is not None:
            return found
        sights += self._beside([*points, *both])
        points = self._bridges(sights)
        if not points:
            sights += self._extremes(sights)
            points = self._bridges(sights)
        found = self._best(points) or self._hit(
            [*map(self.task.look, points), *sights, *self._ended]
        )
        if found is None:
            met = [target * (1.0 + float(sight.values[0])) for sight in sights]
            below = max((value for value in met if value < target), default=low)
            above = min((value for value in met if value > target), default=high)
            raise UnreachableStiffness(u, target, low, high, (below, above))
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

    def _hit(self, sights: list[Sight]) -> Found | None:
        """The least tensions among what was seen to hit the one target, or counts as that."""
        misses = [float(abs(sight.values[0])) for sight in sights]
        if min(misses) > REACHED:
            return None
        as_near = max(min(misses), _AS_NEAR)
        hits = [sight for sight, miss in zip(sights, misses, strict=True) if miss <= as_near]
        best = min(hits, key=lambda sight: float(np.linalg.norm(sight.point.F)))
        self.efforts = [float(np.linalg.norm(best.point.F))]
        return Found(best, 0)

    def _beside(self, points: list[Point]) -> list[Sight]:
        """What is near one target on either side, on the way from some points."""
        task = replace(self.task, goal=NEAREST)
        sights = [task.look(point) for point in points]
        for point in points:
            end = self._search(task, point).sight
            beyond = beyond_jumps(self.question.region, end.point.F)
            drawn = (drawn_back(self.question.field, F, self.ground.anchor) for F in beyond)
            sights += [end, *(task.look(there) for there in drawn if there is not None)]
        return sights

    def _extremes(self, sights: list[Sight]) -> list[Sight]:
        """How far towards the one target each piece leads that something was seen in."""
        found: dict[tuple[bytes, bool], Sight] = {}
        for sight in sorted(sights, key=lambda sight: float(abs(sight.values[0]))):
            below = bool(sight.values[0] < 0.0)
            key = self.question.region.piece(sight.point.F)[0].tobytes(), below
            if key not in found:
                task = replace(self.task, goal=HIGHEST if below else LOWEST)
                found[key] = self._search(task, sight.point, confined=True).sight
        return list(found.values())

    def _bridges(self, sights: list[Sight]) -> list[Point]:
        """Points that hit the one target between some on either side, where no rigidity jumps."""
        field, found = self.question.field, []
        order = sorted(sights, key=lambda sight: float(abs(sight.values[0])))
        below = [sight.point.F for sight in order if sight.values[0] < 0.0][:_SIDES]
        above = [sight.point.F for sight in order if sight.values[0] > 0.0][:_SIDES]
        for one, other in product(below, above):
            for a, b, piece in stretches(self.question.region, one, other):

                def at(
                    part: float, one: Array = one, way: Array = other - one, piece: Bounds = piece
                ) -> Point:
                    return field.at(np.clip(one + part * way, *piece))

                misses = self._miss(at(a)), self._miss(at(b))
                if misses[0] * misses[1] < 0.0:
                    point = self._root(at, (a, b), misses)
                    # buckling in between is no hit
                    if point.reserve >= 0.0 and abs(self._miss(point)) <= REACHED:
                        found.append(point)
        return sorted(found, key=lambda point: float(point.F @ point.F))[: self.starts]

    def _miss(self, point: Point) -> float:
        """By how much a point is off the one target; -1 where it has buckled, for no stiffness."""
        return float(self.reading.of(point).values[0]) if point.reserve >= 0.0 else -1.0

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
        here, guesses = self._miss(hub), []
        for other in others:
            there = self._miss(other)
            if here * there < 0.0:
                guess = hub.F + here / (here - there) * (other.F - hub.F)
                guesses.append((float(guess @ guess), there, other.F - hub.F))
        found = []
        for _, there, way in sorted(guesses, key=lambda guess: guess[0])[: self.starts]:

            def at(part: float, way: Array = way) -> Point:
                return field.at(hub.F + part * way)

            point = self._root(at, (0.0, 1.0), (here, there), 1e-2)
            if point.reserve >= 0.0:
                found.append(point)
        return sorted(found, key=lambda point: float(point.F @ point.F))

    def _root(
        self,
        at: Callable[[float], Point],
        between: tuple[float, float],
        misses: tuple[float, float],
        precision: float = 1e-15,
    ) -> Point:
        """Where the miss changes its sign between two parts of a way, at which it is known.

        It is not asked for there again: on the way an end differs by its rounding, and where the
        end hits the target that is enough to change the sign.
        """
        known = dict(zip(between, misses, strict=True))

        def miss(part: float) -> float:
            return known[part] if part in known else self._miss(at(part))

        return at(float(brentq(miss, *between, xtol=1e-15, rtol=precision)))

    def _search(self, task: Task, point: Point, *, confined: bool = False) -> Found:
        found = search(task, point, confined=confined)
        self.iterations += found.iterations
        self._ended.append(found.sight)
        return found

    def _settled(self, found: Found, task: Task, near: float | None = None) -> Found:
        better = settled(task, found) if near is None else settled(task, found, near=near)
        self.iterations += better.iterations - found.iterations
        return better
