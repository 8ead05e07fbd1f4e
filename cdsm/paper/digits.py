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
from cdsm.support.validation import number_array
from cdsm.support.values import Array, frozen
from cdsm.wires.laws import EQ19_PRINTED

JOIN: Final = 31.0
"""Tension at which the two branches of Eq. 19 meet [N]."""

LEVEL: Final = (400.0, 810.0)
"""Range of tension [N] over which the paper calls the rigidity near-constant (Section IV-C)."""

HALF_UNITS: Final = (
    frozen(np.array([5e-3, 5e-3, 5e-3, 5e-3, 5e-3, 5e-5, 5e-5])),
    frozen(np.array([5e-2, 5e-3, 5e-3, 5e-5, 5e-9, 5e-12, 5e-15])),
)
"""Half a unit of the last printed digit of each coefficient, lowest power first.

The first array belongs to the lower branch of Eq. 19, the second to the upper branch.
"""

_SAMPLES = 200  # number of tensions at which the lower branch is sampled

_FORCE = 1e4
"""Unit of rigidity [N] inside the linear programs; it scales them for the solver's tolerances."""

_PRINTED, _HALF = np.concatenate(EQ19_PRINTED), np.concatenate(HALF_UNITS)


def least_bend() -> tuple[float, float]:
    """Return the slopes dEA/dF [-] just below and just above 31 N whose difference is smallest.

    All laws are searched that are continuous at 31 N and round to the printed digits of Eq. 19,
    except that the coefficient of F⁶ below 31 N may be any number. Even so, the slopes differ: no
    such law is without a kink.
    """
    below, above = _branches(powers(JOIN, slope=True)[0])
    free: list[tuple[float | None, float | None]] = [(-1.0, 1.0)] * 14
    free[6] = (None, None)
    law = _least(below - above, (below - above)[None], free)
    return float(below @ law), float(above @ law)


def band(tension: ArrayLike) -> tuple[Array, Array]:
    """Find the least and the largest EA [N] that the printed digits allow at each ``tension`` [N].

    Both results have the shape of ``tension``. All laws are considered that round to the printed
    digits, are continuous at 31 N, and are not negative below 31 N.

    Raises:
        InvalidInput: ``tension`` is not finite numbers.
    """
    values = number_array("tension", tension)
    lower, _ = _branches(powers(np.linspace(presets.STRAND_1X19.low, JOIN, _SAMPLES)))
    ends = []
    for F in values.ravel():
        row = _branches(powers(F)[0])[0 if F <= JOIN else 1]
        ends.append([row @ _least(sign * row, lower, [(-1.0, 1.0)] * 14) for sign in (1.0, -1.0)])
    low, high = np.array(ends).reshape(-1, 2).T
    return frozen(low.reshape(values.shape)), frozen(high.reshape(values.shape))


def powers(tension: ArrayLike, slope: bool = False) -> Array:
    """Return the powers Fⁱ (N, 7), i = 0 to 6, of N tensions; if ``slope``, the derivatives i Fⁱ⁻¹.

    Multiplied by the coefficients of Eq. 19, they give EA, or dEA/dF.
    """
    F, i = np.atleast_1d(np.asarray(tension, dtype=np.float64))[:, None], np.arange(7)
    return np.asarray(i * F ** np.maximum(i - 1, 0) if slope else F**i)


def _branches(rows: Array) -> tuple[Array, Array]:
    """Extend ``rows`` (..., 7) by zeros, to (..., 14): first for the lower, then the upper branch.

    A result multiplies all coefficients of Eq. 19: columns 0 to 6 those of the lower branch,
    columns 7 to 13 those of the upper branch. The columns of the other branch are zero.
    """
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
