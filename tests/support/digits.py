"""Bounds of all laws EA(F) whose coefficients round to the printed digits of Eq. 19.

A printed coefficient stands for all numbers that round to it: c_i = p_i + h_i d_i with |d_i| ≤ 1,
where p_i is printed and h_i is half a unit of its last digit. The rigidity EA(F) = Σ c_i Fⁱ is
linear in d. Therefore linear programs find the bounds of EA.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import linprog

from cdsm import presets
from cdsm.paper.strand import EQ19_PRINTED, HALF_UNITS, JOIN
from cdsm.support.values import Array

_SAMPLES: Final = 200  # number of tensions at which the lower branch is sampled
_FORCE: Final = 1e4  # unit of rigidity [N] inside the linear programs, for the solver's tolerances
_PRINTED, _HALF = np.concatenate(EQ19_PRINTED), np.concatenate(HALF_UNITS)


def least_bend() -> tuple[float, float]:
    """Return the slopes dEA/dF [-] just below and just above 31 N whose difference is smallest.

    All laws are searched that are continuous at 31 N and round to the printed digits of Eq. 19,
    except that the coefficient of F⁶ below 31 N may be any number.
    """
    below, above = _branches(powers(JOIN, slope=True)[0])
    free: list[tuple[float | None, float | None]] = [(-1.0, 1.0)] * 14
    free[6] = (None, None)
    law = _least(below - above, (below - above)[None], free)
    return float(below @ law), float(above @ law)


def band(tension: Array) -> tuple[Array, Array]:
    """Find the least and the largest EA (N,) [N] that the printed digits allow at N tensions [N].

    All laws are considered that round to the printed digits, are continuous at 31 N, and are not
    negative below 31 N.
    """
    lower, _ = _branches(powers(np.linspace(presets.STRAND_1X19.low, JOIN, _SAMPLES)))
    ends = []
    for F in tension:
        row = _branches(powers(F)[0])[0 if F <= JOIN else 1]
        ends.append([row @ _least(sign * row, lower, [(-1.0, 1.0)] * 14) for sign in (1.0, -1.0)])
    low, high = np.array(ends).T
    return low, high


def powers(tension: ArrayLike, slope: bool = False) -> Array:
    """Return the powers Fⁱ (N, 7), i = 0 to 6, of N tensions; if ``slope``, the derivatives i Fⁱ⁻¹.

    Multiplied by the coefficients of Eq. 19, they give EA, or dEA/dF.
    """
    F, i = np.atleast_1d(np.asarray(tension, dtype=np.float64))[:, None], np.arange(7)
    return np.asarray(i * F ** np.maximum(i - 1, 0) if slope else F**i)


def _branches(rows: Array) -> tuple[Array, Array]:
    """Extend ``rows`` (..., 7) by zeros, to (..., 14): for the lower and for the upper branch."""
    none = np.zeros_like(rows)
    return np.hstack([rows, none]), np.hstack([none, rows])


def _least(
    cost: Array, positive: Array, bounds: Sequence[tuple[float | None, float | None]]
) -> Array:
    """Find the coefficients c (14,) with the least cost·c, among laws continuous at 31 N.

    They satisfy positive·c ≥ 0. ``cost`` has the shape (14,), ``positive`` (n, 14). ``bounds`` has
    the least and largest value of each d_i (see the top of the module); None for no bound.
    """
    lower, upper = _branches(powers(JOIN)[0])
    join = lower - upper
    solution = linprog(
        cost * _HALF / _FORCE,
        A_ub=-positive * _HALF / _FORCE,
        b_ub=positive @ _PRINTED / _FORCE,
        A_eq=(join * _HALF / _FORCE)[None],
        b_eq=[-join @ _PRINTED / _FORCE],
        bounds=bounds,
    )
    return np.asarray(_PRINTED + _HALF * solution.x)
