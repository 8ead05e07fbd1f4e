"""Compute confidence intervals by profile likelihood.

The profile of a parameter p_i is the rise Δχ² of the least χ² when p_i is fixed at another value
than the best one:

    Δχ²(p_i) = min over the other parameters of χ² − least χ²

The interval of p_i contains all values whose Δχ² is at most a quantile. It is the same whether the
search uses the parameter or its logarithm. Source: Bates and Watts, Nonlinear Regression Analysis,
1988, chapter 6.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple, final

import numpy as np
from scipy.interpolate import CubicHermiteSpline
from scipy.optimize import brentq

from cdsm.errors import InvalidInput
from cdsm.identification.least_squares import METHODS, Box, LeastSquares
from cdsm.support.values import Array, ReadOnlyState, frozen

RANK_TOLERANCE = 1e-6
"""Smaller singular values of J, with columns scaled to length 1, are zero; J is exact to 1e-10."""

NEGLIGIBLE = 1e-3
"""Difference of χ² that is neglected. A difference of 1 is one standard deviation."""

Side = Literal[-1, 1]

_LONGEST = 0.25  # step at most, as a share of the range of the parameter
_HALVINGS = 8  # of a step from which the model does not exist; then the profile ends

_NEAR, _REFINEMENTS = 0.25, 4
"""A knot counts as near a wanted Δχ² if it differs by less than this part of it; the second number
is the largest number of knots that are added to come so near."""

_TOLERANCES = (1e-4, 1e-6, 1e-8)
"""ftol, xtol and gtol of the fit at a knot: as accurate as the cubic between knots."""

_SEARCHED = 50  # largest number of evaluations of such a fit, without those of the differences


class LowerOptimumError(Exception):
    """A profile has found a ``point`` with a lower χ² than the supposed optimum."""

    def __init__(self, point: Array) -> None:
        self.point = point


@final
@dataclass(frozen=True, eq=False, kw_only=True)
class Profile(ReadOnlyState):
    """Profile of one parameter: least χ² with the parameter fixed, as a function of its value.

    Attributes:
        values: Fixed values of the parameter (n,) [m, N/m, …], ascending, in the unit of
            ``model_of``.
        rise: Δχ² (n,) [-]: least χ² with the parameter fixed, minus the least χ² of all.
        slope: Derivative of Δχ² with respect to the value (n,) [1/m, m/N, …].
        best: Index of the optimum in ``values``.
        ends: Reasons why the profile ends, downward and upward: ``""`` (Δχ² is large enough for all
            intervals), ``"bound"``, or the error of the model.
        bounds: Bounds of the parameter (2,) [m, N/m, …].
    """

    values: Array
    rise: Array
    slope: Array
    best: int
    ends: tuple[str, str]
    bounds: Array

    def crossing(self, rise: float, side: Side) -> float | None:
        """Find the farthest value of the parameter on one ``side`` where Δχ² is at most ``rise``.

        ``side`` is −1 for values below the best one, 1 for values above. Between two stored values,
        Δχ² is a cubic in the parameter, or in its logarithm if that was searched. If Δχ² stays
        below ``rise`` up to the bound, or as far as the model exists, the result is −inf or inf. It
        is None if the profile was computed only for values of Δχ² below ``rise``.
        """
        outward = slice(self.best, None, side)
        values, height = self.values[outward], self.rise[outward]
        last = int(np.flatnonzero(height <= rise)[-1])
        if last + 1 == height.size:
            return side * math.inf if self.ends[side > 0] else None
        box, pair = Box(self.bounds[None, :]), slice(last, last + 2)
        u = box.point(values[pair])
        slope = self.slope[outward][pair] * box.derivative(u)
        return float(box.parameters(np.array([_crossing(u, height[pair], slope, rise)]))[0])


def _crossing(u: Array, height: Array, slope: Array, rise: float) -> float:
    """Find u between u[0] and u[1] where the cubic of a profile equals ``rise``.

    ``height`` and ``slope`` (2,) are the values and slopes of the cubic at both ends.
    """
    width = u[1] - u[0]
    cubic = CubicHermiteSpline((0.0, 1.0), height - rise, width * slope)
    return float(u[0] + width * brentq(cubic, 0.0, 1.0, xtol=1e-12))


class _Knot(NamedTuple):
    """Point on the profile of a parameter, with the derivatives of Δχ².

    u is the fixed parameter, scaled to 0…1 between its bounds.
    """

    point: Array  # in the unit cube (P,)
    rise: float  # Δχ² [-]
    slope: float  # dΔχ²/du
    curvature: float  # d²Δχ²/du², by Gauss and Newton
    tangent: Array  # d point/du (P,)


@dataclass(frozen=True, eq=False)
class Profiler:
    """Compute the profile of parameter ``i``, knot by knot from the optimum outward."""

    problem: LeastSquares
    best: Array  # the optimum (P,), in the unit cube
    jacobian: Array  # ∂r/∂point (n, P) at the optimum
    i: int  # index of the fixed parameter
    others: list[int]  # indices of the parameters that are fitted again
    exact: Sequence[float]  # values of Δχ² where the profile must be exact, rising
    far: float  # largest Δχ² of the profile, above all values in ``exact``

    def profile(self) -> Profile:
        """Compute the profile on both sides; raise LowerOptimumError if it finds a lower χ²."""
        (down, first), (up, last) = self._follow(-1), self._follow(1)
        knots = [*reversed(down), *up[1:]]
        box = Box(self.problem.box.bounds[[self.i]])
        u = np.array([knot.point[self.i] for knot in knots])
        return Profile(
            values=frozen(box.parameters(u)),
            rise=frozen(np.array([knot.rise for knot in knots])),
            slope=frozen(np.array([knot.slope for knot in knots]) / box.derivative(u)),
            best=len(down) - 1,
            ends=(first, last),
            bounds=frozen(box.bounds[0]),
        )

    def _follow(self, side: Side) -> tuple[list[_Knot], str]:
        """Compute the profile on one side: its points from the optimum outward, and why they end.

        The reason is empty if Δχ² reaches ``far``.
        """
        knots = [self._knot(self.best, self.jacobian[:, self.i], self.jacobian[:, self.others])]
        for goal in (*self.exact, self.far):
            while knots[-1].rise < goal:
                knot = self._next(knots[-1], side, goal)
                if isinstance(knot, str):
                    return knots, knot
                knots.append(knot)
            if goal < self.far:
                self._refine(knots, goal)
        return knots, ""

    def _next(self, here: _Knot, side: Side, goal: float) -> _Knot | str:
        """Compute the next point of the profile, beyond ``here``, near where Δχ² reaches ``goal``.

        If there is no such point, return the reason as text.
        """
        u = float(here.point[self.i])
        room = 1.0 - u if side > 0 else u
        if room == 0.0:
            return "bound"
        # root of the parabola with this slope and curvature, a little beyond the goal
        need, slope = 1.05 * goal - here.rise, side * here.slope
        rate = slope + math.sqrt(max(slope**2 + 2.0 * here.curvature * need, 0.0))
        step = min(2.0 * need / rate if rate > 0.0 else math.inf, _LONGEST, room)
        for _ in range(_HALVINGS):
            knot = self._moved(here, side * step)
            if isinstance(knot, _Knot):
                break
            step /= 2.0
        return knot

    def _refine(self, knots: list[_Knot], goal: float) -> None:
        """Insert points into ``knots`` until one has nearly Δχ² = ``goal``.

        The cubic between the points is then accurate there.
        """
        for _ in range(_REFINEMENTS):
            last = max(k for k, knot in enumerate(knots) if knot.rise < goal)
            pair = knots[last : last + 2]
            near = min(pair, key=lambda knot: abs(knot.rise - goal))
            if abs(near.rise - goal) < _NEAR * goal:
                return
            u, height, slope = np.array([(k.point[self.i], k.rise, k.slope) for k in pair]).T
            place = _crossing(u, height, slope, goal)
            between = self._moved(near, place - float(near.point[self.i]))
            if isinstance(between, str):  # the model does not exist there
                return
            knots.insert(last + 1, between)

    def _moved(self, here: _Knot, step: float) -> _Knot | str:
        """Compute the point of the profile one ``step`` in u away from ``here``.

        u is the fixed parameter in 0…1. The search for the other parameters begins on the tangent.
        If the point cannot exist, return the reason as text. Raises LowerOptimumError if χ² is
        lower there than at the optimum.
        """
        problem, others = self.problem, self.others
        point = np.clip(here.point + step * here.tangent, 0.0, 1.0)
        if (failure := problem.failure(point)) is not None:
            return str(failure)
        try:
            beside = np.empty((problem.count, 0))
            if others:
                # dogbox alone may zigzag along a curved valley
                for method in METHODS:
                    point = problem.search(
                        point, method=method, tolerances=_TOLERANCES, most=_SEARCHED, over=others
                    )
                beside = problem.jacobian(point, others)
            along = problem.jacobian(point, [self.i])[:, 0]
        except InvalidInput as error:
            return str(error)
        knot = self._knot(point, along, beside)
        if knot.rise < -NEGLIGIBLE:
            raise LowerOptimumError(point)
        return knot

    def _knot(self, point: Array, along: Array, beside: Array) -> _Knot:
        r = self.problem.residuals(point)
        x = point[self.others]
        free = (x > 0.0) & (x < 1.0)
        follow = np.linalg.lstsq(beside[:, free], -along, rcond=RANK_TOLERANCE)[0]
        across = along + beside[:, free] @ follow
        tangent = np.zeros_like(point)
        tangent[self.i] = 1.0
        tangent[np.array(self.others, dtype=int)[free]] = follow
        return _Knot(
            point=point,
            rise=float(r @ r) - self.problem.cost(self.best),
            slope=2.0 * float(r @ across),
            curvature=2.0 * float(across @ across),
            tangent=tangent,
        )
