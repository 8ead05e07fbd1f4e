"""Compute derivatives by extrapolated central differences, with error estimates.

This module is used instead of SciPy's ``hessian``, which is slower: for a function of ten joints
(the virtual prototype) SciPy at order 4 needs 22 500 evaluations and 2.7 s. This module needs 1 200
evaluations and 0.2 s for three functions at once. The errors are similar: 1.5e-9 of the largest
entry, with SciPy 1.7e-9. SciPy also ignores the rounding errors of the function, and does not
reduce a step that leaves the domain of the function.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from cdsm.errors import CdsmError
from cdsm.support.values import Array

Estimates = tuple[Array, Array]
"""Derivatives (T, …) of T functions, and for each function (T,) one error bound of all entries."""

Sampled = Callable[[Array], Array]
"""Function from points (P, n) to the values (P, T, ...) of T functions."""

Noise = Callable[[float], Array]
"""Function from the step h to the rounding error of each function (T,)."""

_LEVELS = 16  # maximum number of step sizes; each is half the previous one
_CONVERGING = 0.05  # two extrapolations have not converged if their relative difference is larger

_AMPLIFIED = np.array([6.7, 99.0])
"""Rounding errors of an extrapolated first derivative, in noise/h, and of a second, in noise/h².

The noise is the rounding error of the function f. The extrapolation uses differences with the steps
h, h/2 and h/4. The difference with h/4 has the weight 64/45, that with h/2 the weight −20/45. The
numerator of a second difference, f(h) − 2 f(0) + f(−h), has an error of up to four times the noise.
"""


def gradients(f: Sampled, size: int, first: float, noise: Noise) -> Estimates:
    """Compute first derivatives (T, ..., n) of T functions at zero, and their error bounds (T,).

    ``f`` computes the functions of n = ``size`` variables, and ``noise`` their rounding errors.
    ``first`` is the largest step of the differences.
    """
    corners = np.vstack([np.eye(size), -np.eye(size)])

    def level(h: float) -> Array:
        values = f(h * corners)
        return np.moveaxis(values[:size] - values[size:], 0, -1) / (2.0 * h)

    return _extrapolated(level, first, noise, 1)


def hessians(f: Sampled, size: int, first: float, noise: Noise) -> Estimates:
    """Compute Hessians (T, n, n) and their error bounds (T,); see :func:`gradients`."""
    unit = np.eye(size)
    i, j = np.triu_indices(size, 1)
    pairs = (s * unit[i] + t * unit[j] for s in (1.0, -1.0) for t in (1.0, -1.0))
    corners = np.vstack([np.zeros((1, size)), unit, -unit, *pairs])

    def level(h: float) -> Array:
        values = f(h * corners)
        centre, ahead, behind = values[0], values[1 : size + 1], values[size + 1 : 2 * size + 1]
        both, right, left, neither = values[2 * size + 1 :].reshape(4, i.size, values.shape[1])
        second = np.zeros((values.shape[1], size, size))
        second[:, i, j] = second[:, j, i] = (both - right - left + neither).T / (4.0 * h * h)
        second[:, range(size), range(size)] = (ahead - 2.0 * centre + behind).T / (h * h)
        return second

    return _extrapolated(level, first, noise, 2)


def _extrapolated(
    level: Callable[[float], Array], first: float, noise: Noise, order: int
) -> Estimates:
    """Extrapolate difference quotients to the step zero, and bound their errors.

    ``level(h)`` computes the difference quotients of the ``order`` 1 or 2 with the step h. The step
    begins at ``first`` and is halved until rounding dominates. The error bound is a bound of the
    rounding errors plus twice the difference between two extrapolations, one from the steps 4h and
    2h, one from 2h and h. This is valid even where a derivative is discontinuous, so that the error
    falls only in proportion to h.
    """
    found: list[Array] = []
    best, error = np.zeros(0), np.full(noise(first).shape, np.inf)
    failure: CdsmError | None = None
    for k in range(_LEVELS):
        h = first / 2.0**k
        try:
            found.append(level(h))
        except CdsmError as reason:  # outside a domain, or two sites meet: a smaller step may work
            failure, found = reason, []
            continue
        if len(found) < 3:
            continue
        a, b, c = found[-3:]
        coarse, fine = (4.0 * b - a) / 3.0, (4.0 * c - b) / 3.0
        extrapolated = (16.0 * fine - coarse) / 15.0
        inner = tuple(range(1, a.ndim))
        left = 2.0 * abs(fine - coarse).max(axis=inner)
        rounding = _AMPLIFIED[order - 1] * noise(4.0 * h) / (4.0 * h) ** order
        usable = left <= _CONVERGING * abs(fine).max(axis=inner) + rounding
        better = usable & (left + rounding < error)
        if not best.size:
            best = extrapolated
        best = np.where(better.reshape(-1, *(1,) * len(inner)), extrapolated, best)
        error = np.where(better, left + rounding, error)
        if (left <= rounding).all():  # false for NaN
            break
    if failure is not None and not best.size:
        raise failure
    return best, error
