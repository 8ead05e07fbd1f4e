"""Search for the least tensions, or those nearest to others, that give a wanted stiffness."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.optimize import brentq

from cdsm.errors import UnreachableStiffness
from cdsm.planning.range import AT_END, End, downhill, ends, farther
from cdsm.planning.tension_space import TensionLimits, TensionSpace
from cdsm.support.values import Array
from cdsm.tension import advice

REACHED: Final = 1e-6
"""Largest relative miss with which a target counts as hit; most searches come much nearer."""

_CORNERS = 12  # number of random directions in which corners are sought
_CROSSINGS = 2  # number of lines beyond the corners that hit the target
_STARTS = 5  # number of starts on lines, if the search from the anchor fails
_LEAST = 2  # number of starts at the corners with the least tensions
_SEARCHES = 3  # largest number of searches from each start


@dataclass(frozen=True, eq=False)
class Goal:
    """Wanted stiffness along each direction of a space: the targets, or at least these."""

    space: TensionSpace
    targets: Array  # (n,) [N/m]
    at_least: bool = False

    def misses(self, F: Array) -> tuple[Array, Array]:
        """Return along/target − 1 (n,) [-] under F (C,) [N], and its gradient (n, C) [1/N]."""
        s, slopes = self.space.at(F).along
        return s / self.targets - 1.0, slopes / self.targets[:, None]

    def misfit(self, F: Array) -> float:
        """Return the norm of the misses [-] under F (C,) [N]; with ``at_least``, of what lacks."""
        values = self.misses(F)[0]
        return float(np.linalg.norm(np.minimum(values, 0.0) if self.at_least else values))

    def met(self, F: Array | None) -> bool:
        """Return whether the arm is stable under F (C,) [N], and as stiff as wanted."""
        return F is not None and self.space.reserve(F) > -REACHED and self.misfit(F) <= REACHED

    def search(
        self, start: Array, bounds: TensionLimits | None = None, centre: Array | float = 0.0
    ) -> Array | None:
        """Search from ``start`` for the tensions nearest to ``centre`` that meet the goal, locally.

        All are (C,) [N]; ``centre`` 0 gives the least ones. The search is repeated from its end
        while that is missed, or still comes nearer. Return None if it misses at last.
        """
        unit = max(self.space.unit, float(start.max()))

        def effort(F: Array) -> tuple[float, Array]:
            way = (F - centre) / unit
            return float(way @ way) / 2.0, way / unit

        rule = "ineq" if self.at_least else "eq", self.misses
        best = None
        least_effort = math.inf
        misfit = math.inf
        for _ in range(_SEARCHES):
            F = self.space.search(start, effort, rule, bounds=bounds)
            if F is None or (self.met(F) and effort(F)[0] > (1.0 - REACHED) * least_effort):
                break
            if self.met(F):
                best = F
                least_effort = effort(F)[0]
            elif self.misfit(F) > misfit / 2.0:  # it hardly comes nearer
                break
            start = F
            misfit = self.misfit(F)
        return best

    def least(self) -> Array:
        """Search for the least tensions (C,) [N] that meet the goal, from the anchor at first.

        If that fails, searches begin where lines from the anchor to corners hit the target, or to
        what searches from there find, or to an end of the range; and from the least corners.
        Several directions that no search hits together have the tensions with the least sum of
        squared misses that was found; a single one raises UnreachableStiffness. SingularStiffness
        is raised if the arm is stable nowhere.
        """
        space = self.space
        # 1. one local search from the anchor, which is enough for most targets
        optimum = self.search(space.anchor)
        if optimum is not None:
            return optimum
        corners = sorted(space.corners(_CORNERS), key=self.misfit)
        if self.targets.size > 1:
            return self._nearest_to_all([space.anchor, *corners[:_STARTS]])
        # 2. tensions that hit the target exactly, on lines from the anchor, are feasible starts
        crossings = self._crossings(space.anchor, corners) or self._crossings_beyond(corners)
        optimum = self._least_of([*crossings[:_STARTS], *sorted(corners, key=_effort)[:_LEAST]])
        if optimum is not None:
            return optimum
        # 3. the ends of the range tell whether the target can be reached at all
        softest, stiffest = ends(space)
        if (1.0 - REACHED) * softest.value <= self.targets[0] <= (1.0 + REACHED) * stiffest.value:
            range_ends = [softest.F, stiffest.F]
            crossings = self._crossings(softest.F, corners)
            crossings += self._crossings(space.anchor, range_ends)
            optimum = self._least_of([*range_ends, *crossings])
        if optimum is None:
            raise self._unreachable(softest, stiffest)
        return optimum

    def _nearest_to_all(self, starts: list[Array]) -> Array:
        """Return the tensions with the least sum of squared misses of several targets."""
        fits = [F for F in map(self.nearest, starts) if F is not None]
        best = min([*starts, *fits], key=self.misfit)
        least = self.search(best) if self.met(best) else None
        return best if least is None else least

    def _crossings_beyond(self, corners: list[Array]) -> list[Array]:
        """Return where lines from the anchor to what searches from corners find hit the target."""
        sign = -float(np.sign(self.misses(self.space.anchor)[0][0]))
        crossings = list[Array]()
        for corner in corners:
            start = downhill(self.space, corner) if sign < 0.0 else corner
            optimum = farther(self.space, -sign, start)
            crossings += self._crossings(self.space.anchor, [optimum])
            if len(crossings) == _CROSSINGS:
                break
        return crossings

    def _unreachable(self, low: End, high: End) -> UnreachableStiffness:
        space = self.space
        target = float(self.targets[0])
        end = low if target < low.value else high
        hint = advice(space.pose.arm, end.F, *space.bounds)
        if space.reserve(end.F) < AT_END:
            hint = "take stiffer cables, since the arm is about to buckle there"
        first = low.value
        last = high.value
        u = space.directions[0]
        nearest = [first, last] if first <= target <= last else [end.value]
        return UnreachableStiffness(u, target, first, last, nearest, hint)

    def nearest(self, start: Array, bounds: TensionLimits | None = None) -> Array | None:
        """Search once for the tensions (C,) [N] with the least sum of squared misses, if any."""

        def miss(F: Array) -> tuple[float, Array]:
            values, slopes = self.misses(F)
            values = np.minimum(values, 0.0) if self.at_least else values
            return float(values @ values) / 2.0, values @ slopes

        F = self.space.search(start, miss, bounds=bounds)
        return None if F is None else self.space.pulled_back(F)

    def _least_of(self, starts: list[Array]) -> Array | None:
        """Return the least tensions that searches find, until two find the same, or the starts."""
        optima: list[Array] = []
        for start in starts:
            candidates = [F for F in (self.search(start), start) if F is not None and self.met(F)]
            optima = sorted([*optima, *sorted(candidates, key=_effort)[:1]], key=_effort)
            if len(optima) > 1 and _effort(optima[1]) < (1.0 + REACHED) * _effort(optima[0]):
                break
        return optima[0] if optima else None

    def _crossings(self, hub: Array, points: list[Array]) -> list[Array]:
        """Return where the lines from ``hub`` to ``points`` hit the only target, least first."""
        crossings = []

        def miss(part: float, way: Array) -> float:
            return float(self.misses(hub + part * way)[0][0])

        for way in points - hub:
            if miss(0.0, way) * miss(1.0, way) < 0.0:
                crossings.append(hub + brentq(miss, 0.0, 1.0, args=(way,), xtol=1e-12) * way)
        return sorted(crossings, key=_effort)


def _effort(F: Array) -> float:
    return float(np.linalg.norm(F))
