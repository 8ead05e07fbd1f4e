"""Intervals of parameters, by profile likelihood.

Fix a parameter p_i at some value and fit all others. The least χ² is then higher than that of the
best fit by Δχ²(p_i). The interval has the values with Δχ² up to a quantile, whether the search uses
p_i or its logarithm. Source: Bates and Watts, Nonlinear Regression Analysis, 1988, chapter 6.
"""

from __future__ import annotations

import math
from functools import cache

import numpy as np
from scipy.optimize import brentq

from cdsm.errors import InvalidInput
from cdsm.identification.least_squares import LeastSquares
from cdsm.support.values import Array

_LOWER = 1e-2  # fall of χ² below that of the best fit that refutes it
_TRIALS = 20  # steps outward from the optimum
_EDGE = 1e-2  # distance from the end of the model, in half widths


def profile_interval(
    problem: LeastSquares, best: Array, jacobian: Array, i: int, rise: float
) -> tuple[float, float]:
    """Return the smallest and the largest value of parameter ``i`` with Δχ² ≤ ``rise``.

    ``best`` (P,) is the scaled optimum, ``jacobian`` (n, P) ∂r/∂x there. A limit is -inf or inf if
    there is none before the bound or the end of the model. Raises InvalidInput if the profile falls
    below the supposed optimum.
    """
    others = np.flatnonzero(np.arange(best.size) != i)
    least = problem.cost(best)
    beside = jacobian[:, others]
    tangent = np.linalg.lstsq(beside, -jacobian[:, i], rcond=1e-6)[0]
    width = math.sqrt(rise) / float(np.linalg.norm(jacobian[:, i] + beside @ tangent))

    precision = 3e-4 if problem.has_rests else 1e-6  # in half widths

    @cache
    def excess(u: float) -> float:
        """Return √Δχ² − √rise with x_i = u, almost linear in u; inf where there is no model."""
        x = best.copy()
        x[i] = u
        x[others] = np.clip(best[others] + (u - best[i]) * tangent, 0.0, 1.0)
        if not math.isfinite(problem.cost(x)):
            x[others] = best[others]
        if others.size and u != best[i]:
            x = problem.search(x, others, profile=True)
        if not math.isfinite(problem.cost(x)):
            return math.inf
        delta = problem.cost(x) - least
        if delta < -_LOWER:
            fault = f"χ² is {-delta:.3g} lower at {problem.describe(x)} than at this result."
            raise InvalidInput("start", f"{fault} Give identify() that as the start.")
        return math.sqrt(max(delta, 0.0)) - math.sqrt(rise)

    def limit(side: float) -> float:
        near = float(best[i])
        step = width
        end = math.inf
        for _ in range(_TRIALS):
            far = min(max(near + side * step, 0.0), 1.0)
            if far == near:
                return side * math.inf
            if excess(far) == math.inf:
                end = abs(far - near)  # the model ends in between
                step = step / 2.0
                if end < _EDGE * width:
                    break
            elif excess(far) >= 0.0:
                x = best.copy()
                x[i] = brentq(excess, near, far, xtol=precision * width, rtol=1e-12)
                return float(problem.values(x)[i])
            else:
                end -= abs(far - near)
                near = far
                step = min(1.6 * step, end / 2.0)
        return side * math.inf

    return limit(-1.0), limit(1.0)
