"""Search from several starts for the least tensions that hit a target stiffness.

The search is local, so the tensions found may exceed the least ones;
:func:`~cdsm.planning.plan.plan_stiffness` says by how much.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import replace
from typing import Final

import numpy as np
from scipy.optimize import brentq

from cdsm.errors import UnreachableStiffness
from cdsm.planning.range import range_ends
from cdsm.planning.sqp import EFFORT, MET, NEAREST, Program, search
from cdsm.planning.starts import StartPoints
from cdsm.planning.stiffness_model import Constraints, ConstraintValues, Evaluation, StiffnessModel
from cdsm.support.progress import track
from cdsm.support.values import Array

REACHED: Final = 1e-6
"""Largest relative miss with which a target counts as hit; most searches come much nearer."""

_CORNERS = 1e3  # bound of otherwise unbounded starting tensions, over the least tensions
_RANGE_STARTS = 24  # number of starts of the range search before a target is rejected
_NEAREST_STARTS = 8  # number of additional corner starts for targets that cannot all be hit
_NEARLY = 0.1  # starts with at most this relative miss show how large the solution will be
_SIDES = 6  # number of nearest points on either side of a target that are connected
_EDGE = 1e-9  # a target beyond an end of the range by up to this part counts as at the end
_AS_NEAR = 1e-8  # misses up to this count as zero: next to buckling a search may come no nearer


class Planner:
    """Search, from several starts, for the tensions F of least ‖F‖ with constraints c(F) = 0.

    A result is a point: :class:`ConstraintValues`, with the tensions in ``evaluation.F``. c are the
    relative misses of the targets.
    """

    def __init__(
        self, model: StiffnessModel, constraints: Constraints, starts: int, seed: int
    ) -> None:
        region = bounded = model.region
        if not np.isfinite(region.high).all():
            bounded = replace(region, high=np.minimum(region.high, _CORNERS * region.scale))
        self.model, self.constraints, self.starts, self.seed = model, constraints, starts, seed
        self.begin = StartPoints(model, bounded, 0, seed)
        self.program = Program(region, self.begin.anchor, constraints, EFFORT, region.scale)
        self._ends: list[ConstraintValues] = []

    def least(self) -> ConstraintValues | None:
        """Return the point of least ‖F‖ that hits all targets.

        If there is none, return None for several targets, and raise UnreachableStiffness for one.
        """
        found = self._best(self._starts())
        if found is None and self.constraints.single is not None:
            return self._within_range(*self.constraints.single)
        return found

    def nearest(self) -> ConstraintValues:
        """Return the point with the least sum of squared misses c that the searches find.

        Of the points with this sum, it is the one of least ‖F‖.
        """
        program = replace(self.program, objective=NEAREST)

        def misses(place: ConstraintValues) -> float:
            return program.merit(place, 0.0)

        corners = sorted(self.begin.points, key=lambda point: misses(self.constraints.at(point)))
        points = [*self._starts(), *corners[:_NEAREST_STARTS]]
        best = min((self._search(program, point) for point in points), key=misses)
        as_near = replace(self.constraints, targets=self.constraints.targets + best.values)
        least = self._search(replace(self.program, constraints=as_near), best.evaluation)
        smaller = misses(self.constraints.at(least.evaluation)) <= misses(best) + MET**2
        return least if smaller else best

    def _within_range(self, u: Array, target: float) -> ConstraintValues:
        """Return the point of least ‖F‖ with ``target`` [N/m] along u (3,), from a second attempt.

        The planner makes this attempt if the searches from the usual starts fail. It finds the
        softest and the stiffest arm, and searches from the points between them that hit the target.
        Raises UnreachableStiffness if the target is outside the range of stiffness that searches
        find, or if no search hits it.
        """
        softest, stiffest = range_ends(self.model, u, _RANGE_STARTS, self.seed)
        low = 0.0 if softest.open else softest.value
        high = math.inf if stiffest.open else stiffest.value
        at = self.constraints.at
        balanced = [at(self.model.at(end.tension.values)) for end in (softest, stiffest)]
        seen = [*balanced, *self._ends, *map(at, self.begin.points)]
        # a stiffness that a search met beyond the range, by more than rounding, is attainable too
        met = [target * (1.0 + float(place.values[0])) for place in seen]
        low = min(met) if min(met) < low * (1.0 - REACHED) else low
        high = max(met) if max(met) > high * (1.0 + REACHED) else high
        if not low * (1.0 - _EDGE) <= target <= high * (1.0 + _EDGE):
            raise UnreachableStiffness(u, target, low, high, [low if target < low else high])
        ends = [softest.evaluation, stiffest.evaluation]
        crossings = [place for end in ends for place in self._crossings(end, ends)]
        found = self._best(crossings or ends)
        if found is None:  # near buckling the straight line may leave the range
            seen += [*map(at, ends), *self._ends]
            bridges = self._bridges(seen)
            found = self._best(bridges) or self._nearly_hit([*map(at, bridges), *seen])
        if found is None:
            below = max((value for value in met if value < target), default=low)
            above = min((value for value in met if value > target), default=high)
            raise UnreachableStiffness(u, target, low, high, (below, above))
        return found

    def _best(self, points: Iterable[Evaluation]) -> ConstraintValues | None:
        """Search from each of ``points``; return the best point that hits all targets, or None.

        The best point has the least ‖F‖.
        """
        begin = list(points)
        near = [
            float(point.F.max())
            for point in begin
            if (abs(self.constraints.at(point).values) <= _NEARLY).all()
        ]
        program = replace(self.program, unit=min(near, default=self.program.unit))
        found = [
            self._search(program, point) for point in track(begin, "searching the least tensions")
        ]
        return min((each for each in found if program.met(each)), key=_effort, default=None)

    def _nearly_hit(self, seen: list[ConstraintValues]) -> ConstraintValues | None:
        """Return the point of ``seen`` nearest to a single target; None if the miss exceeds 1e-6.

        Misses are relative. Of the points that miss by at most 1e-8, the one of least ‖F‖ is taken.
        """
        least = min(float(abs(place.values[0])) for place in seen)
        if least > REACHED:
            return None
        hits = [place for place in seen if abs(place.values[0]) <= max(least, _AS_NEAR)]
        return min(hits, key=_effort)

    def _starts(self) -> Iterator[Evaluation]:
        """Yield up to ``starts`` stable points from which searches begin.

        They are the least tensions; points that hit the target, if it is a single one; the anchor
        of :class:`StartPoints`, which is well inside the admissible tensions; and random points.
        """
        anchor = self.begin.anchor
        least = anchor.backtracked(self.model.region.least.values)
        points = [] if least is None else [least]
        if self.constraints.targets.size == 1:
            points += self._crossings(anchor, self.begin.points)[: max(self.starts - 2, 1)]
        points = [*points, anchor][: self.starts]
        yield from points
        yield from self.begin.between(self.starts - len(points))

    def _crossings(
        self, hub: Evaluation, others: list[Evaluation], precision: float = 1e-2
    ) -> list[Evaluation]:
        """Find stable points that hit a single target, on the lines from ``hub`` to ``others``.

        The point of least ‖F‖ is first. ``precision`` is the largest relative error of the distance
        of a point from ``hub``.
        """
        at_hub, guesses = self._miss(hub), []
        for other in others:
            at_other, step = self._miss(other), other.F - hub.F
            if at_hub * at_other < 0.0:
                guess = hub.F + at_hub / (at_hub - at_other) * step
                # reuse the values at the ends: rounding of F there could change the sign
                guesses.append((float(guess @ guess), step, {0.0: at_hub, 1.0: at_other}))

        def miss(part: float, step: Array, known: dict[float, float]) -> float:
            return known[part] if part in known else self._miss(self.model.at(hub.F + part * step))

        found = []
        for _, step, known in sorted(guesses, key=lambda guess: guess[0])[: self.starts]:
            part = brentq(miss, 0.0, 1.0, args=(step, known), xtol=1e-15, rtol=precision)
            found.append(self.model.at(hub.F + part * step))
        stable = (point for point in found if point.reserve >= 0.0)
        return sorted(stable, key=lambda point: float(point.F @ point.F))

    def _bridges(self, seen: list[ConstraintValues]) -> list[Evaluation]:
        """Find stable points that hit a single target, on lines between points of ``seen``.

        Each line connects one of the 6 points whose stiffness is closest below the target with one
        of the 6 whose stiffness is closest above it.
        """
        order = sorted(seen, key=lambda place: float(abs(place.values[0])))
        below = [place.evaluation for place in order if place.values[0] < 0.0][:_SIDES]
        above = [place.evaluation for place in order if place.values[0] > 0.0][:_SIDES]
        return [place for one in below for place in self._crossings(one, above, 1e-15)]

    def _miss(self, point: Evaluation) -> float:
        """Return c = along/target − 1 [-] for a single target; −1 if the arm is unstable."""
        return float(self.constraints.at(point).values[0]) if point.reserve >= 0.0 else -1.0

    def _search(self, program: Program, point: Evaluation) -> ConstraintValues:
        self._ends.append(search(program, point))
        return self._ends[-1]


def _effort(place: ConstraintValues) -> float:
    return float(np.linalg.norm(place.evaluation.F))
