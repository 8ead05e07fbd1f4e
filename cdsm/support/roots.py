"""Newton's method inside a bracket, for arrays."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from cdsm.support.values import Array


def rising_root(
    wanted: Array,
    guess: Array,
    lower: Array,
    upper: Array,
    stretch: Callable[[Array], Array],
    slope: Callable[[Array], Array],
) -> tuple[Array, Array]:
    """Solve stretch(F) = wanted for tensions F [N]; stretch must increase with F.

    The function ``slope`` is the derivative of ``stretch``. The search begins at ``guess`` and
    stays between ``lower`` and ``upper``, which may be inf. Returns F and slope(F). All arrays have
    the same shape. Newton's method runs inside a shrinking bracket, so it converges for every
    increasing function. scipy's ``find_root`` and ``brentq`` take ten times as long.
    """
    first, last, previous = lower, upper, np.full(np.shape(wanted), math.inf)
    guess = np.minimum(np.maximum(guess, first), last)
    for _ in range(200):  # bisection alone needs 60
        error, rise = np.asarray(stretch(guess)) - wanted, slope(guess)
        step = error / rise
        converged = abs(step) <= 1e-13 * np.maximum(guess, 1.0)  # close to rounding
        if converged.all():
            break
        lower = np.where(error <= 0.0, guess, lower)
        upper = np.where(error >= 0.0, guess, upper)
        newton = guess - step
        # where the law is very steep, Newton's method may cycle inside the bracket
        cycling = ~converged & (abs(step) > previous / 2.0) & np.isfinite(upper)
        halve = cycling | (newton < lower) | (newton > upper)
        following = np.where(halve, (lower + upper) / 2.0, newton)
        previous = abs(following - guess)
        guess = np.minimum(np.maximum(following, first), last)
    return np.asarray(guess), np.asarray(rise)
