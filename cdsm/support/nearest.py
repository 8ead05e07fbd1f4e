"""Nearest point q to a guess where residuals r(q) vanish, within limits.

    min ½‖q − guess‖²   subject to   r(q) = 0   and   lower ≤ q ≤ upper

It is the limit ε → 0 of min ½‖r‖² + ½ε‖q − guess‖², which scipy solves for decreasing ε. Newton's
method on the optimality conditions then removes what is left of ε:

    q − guess + (∂r/∂q)ᵀ λ = 0   and   r(q) = 0,   for the coordinates that are not at a limit.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from cdsm.support.values import Array

_WEIGHTS = (1e-2, 1e-4, 1e-6, 1e-8, 1e-14)  # decreasing ε
_STARTS = 12  # random postures to start from, if the search from the guess misses the target
_NEWTON_STEPS = 20
_CONVERGED = 1e-12  # violation of the optimality conditions that is rounding
_SHORTEST = 2.0**-6  # shortest part of a Newton step that is tried
_DIFFERENCE = 1e-6  # step [rad] or [m] of the differences of (∂r/∂q)ᵀ λ
_SINGULAR = 1e-10  # smaller singular values, over the largest, count as zero
_FARTHER = 1e-6  # by so much Newton's method may increase the distance from the guess

Residual = Callable[[Array], tuple[Array, Array]]
"""Function of q (n,): r (m,) and ∂r/∂q (m, n)."""


def nearest(
    residual: Residual, guess: Array, tolerance: float, lower: Array, upper: Array
) -> Array:
    """Find the q (n,) nearest to ``guess`` with ‖r(q)‖ ≤ tolerance, or else with the least ‖r‖.

    An infinite limit is none. Searches that miss the tolerance go on from a dozen random starts.
    """

    def fit(q: Array, *weights: float, method: str = "dogbox") -> tuple[Array, float]:
        for weight in weights:
            stop = 1e-4 if weight > weights[-1] else 1e-12
            pull = math.sqrt(weight) * np.eye(q.size)
            q = least_squares(
                lambda q, pull=pull: np.append(residual(q)[0], pull @ (q - guess)),
                np.clip(q, lower, upper),
                lambda q, pull=pull: np.vstack([residual(q)[1], pull]),
                bounds=(lower, upper),
                method=method,
                ftol=stop,
                xtol=1e-15,
                gtol=1e-15,
                max_nfev=200,
            ).x
        return q, float(np.linalg.norm(residual(q)[0]))

    best, misfit = fit(guess, *_WEIGHTS)
    random = np.random.default_rng(0)
    lowest, highest = _starts(lower, upper)
    for trial in range(_STARTS + 2):
        if misfit <= tolerance:
            break
        # where dogbox creeps along a limit, trf, which keeps off limits, may go on
        start = best if trial < 2 else random.uniform(lowest, highest)
        other, least = fit(start, _WEIGHTS[-1], method="dogbox" if trial else "trf")
        if least < (1.0 - 1e-6) * misfit:  # better by more than rounding
            best = other
            misfit = least
    return _optimal(residual, guess, best, lower, upper) if misfit <= tolerance else best


class _Optimality(NamedTuple):
    """Optimality conditions of the nearest point, at q, with the best multipliers λ."""

    q: Array
    residual: Array  # r (m,)
    jacobian: Array  # ∂r/∂q (m, n)
    multipliers: Array  # λ (m,)
    gradient: Array  # q − guess + (∂r/∂q)ᵀ λ (n,); 0 where a limit holds
    free: NDArray[np.bool_]  # coordinates that no limit holds (n,)

    @property
    def error(self) -> float:
        """Violation of the conditions."""
        return float(np.linalg.norm(np.append(self.gradient, self.residual)))


def _optimality(
    residual: Residual, guess: Array, q: Array, lower: Array, upper: Array
) -> _Optimality:
    r, J = residual(q)
    at_lower, at_upper = at_limits(q, lower, upper)
    free = ~(at_lower | at_upper)
    for _ in range(q.size):  # release what is pulled away from its limit
        away = (guess - q)[free]
        multipliers: Array = np.asarray(np.linalg.lstsq(J[:, free].T, away, rcond=_SINGULAR)[0])
        gradient = q - guess + J.T @ multipliers
        inward = ~free & np.where(at_lower, gradient < 0.0, gradient > 0.0) & (lower < upper)
        if not inward.any():
            break
        free[int((inward * abs(gradient)).argmax())] = True
    return _Optimality(q, r, J, multipliers, gradient * free, free)


def _optimal(residual: Residual, guess: Array, q: Array, lower: Array, upper: Array) -> Array:
    """Move q (n,), where r = 0, to the point nearest to ``guess``, by Newton's method."""
    here = _optimality(residual, guess, q, lower, upper)
    for _ in range(_NEWTON_STEPS):
        if here.error <= _CONVERGED:
            break
        step = _newton_step(residual, here)
        part = 1.0
        while part >= _SHORTEST:
            trial = np.clip(here.q + part * step, lower, upper)
            there = _optimality(residual, guess, trial, lower, upper)
            if there.error < here.error:
                break
            part /= 2.0
        else:
            break
        here = there
    farther = np.linalg.norm(here.q - guess) - np.linalg.norm(q - guess)
    return q if farther > _FARTHER else here.q


def _newton_step(residual: Residual, here: _Optimality) -> Array:
    """Solve the linearised optimality conditions for the step of the free coordinates."""
    free = np.flatnonzero(here.free)
    J = here.jacobian[:, free]
    H = np.eye(free.size)
    for column, i in enumerate(free.tolist()):
        ahead = here.q.copy()
        ahead[i] += _DIFFERENCE
        back = here.q.copy()
        back[i] -= _DIFFERENCE
        change = residual(ahead)[1] - residual(back)[1]
        H[:, column] += here.multipliers @ change[:, free] / (2.0 * _DIFFERENCE)
    zeros = np.zeros((len(J), len(J)))
    matrix = np.block([[(H + H.T) / 2.0, J.T], [J, zeros]])
    right = -np.append(here.gradient[free], here.residual)
    step = np.zeros(here.q.size)
    step[free] = np.linalg.lstsq(matrix, right, rcond=_SINGULAR)[0][: free.size]
    return step


def range_of(lower: Array, upper: Array) -> Array:
    """Return upper − lower (n,), or 0 where a limit is infinite."""
    return np.where(np.isfinite(upper - lower), upper - lower, 0.0)


def at_limits(
    q: Array, lower: Array, upper: Array, part: float = 0.0
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Return which coordinates (n,) are within ``part`` of their range from each limit."""
    margin = part * range_of(lower, upper)
    return q - lower <= margin, upper - q <= margin


def _starts(lower: Array, upper: Array) -> tuple[Array, Array]:
    """Return the ranges of random starts (n,): a turn, ±π, where there are no limits."""
    turn = 2.0 * math.pi
    lowest = np.where(np.isfinite(lower), lower, np.minimum(upper, math.pi) - turn)
    return lowest, np.where(np.isfinite(upper), upper, lowest + turn)
