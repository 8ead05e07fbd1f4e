"""Eq. 19 within its printed digits: what they leave open, and the most level law among them.

A printed coefficient stands for all numbers that round to it. With c = c_printed + h ∘ d, half a
unit of the last digit h and |d| ≤ 1, the rigidity EA(F) = Σ c_i Fⁱ is linear in d, so its
bounds and its most level member are solutions of linear programs.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import linprog

from cdsm import presets
from cdsm.support.validation import Array, frozen, number_array
from cdsm.wires.laws import EQ19_PRINTED

JOIN: Final = 31.0
"""Where the two branches meet [N]."""

LEVEL: Final = (400.0, 810.0)
"""Range of tension [N] over which the text calls the rigidity near-constant (Section IV-C)."""

HALF_UNITS: Final = (
    frozen(np.array([5e-3, 5e-3, 5e-3, 5e-3, 5e-3, 5e-5, 5e-5])),
    frozen(np.array([5e-2, 5e-3, 5e-3, 5e-5, 5e-9, 5e-12, 5e-15])),
)
"""Half a unit of the last printed digit of each coefficient, lowest power first."""

_INSIDE = 0.99
"""The most level law stays this far within the half units, so that its coefficients round back."""

_SAMPLES = 200
"""Tensions at which a range is looked at."""

_FORCE = 1e4
"""Rigidities are counted in this many newtons, for the solver's tolerances."""

Coefficients = tuple[tuple[float, ...], tuple[float, ...]]


def most_level() -> Coefficients:
    """Coefficients of the printed digits whose law is continuous and most level.

    First the upper branch: min over d and a level c of max |EA(F) − c| on :data:`LEVEL`, EA rising
    up to there. Then the lower one: min Σ|d| so that EA is continuous at :data:`JOIN` and rises
    from the low end of the domain on. Only the first coefficient moves, which the paper misprints.
    """
    level = np.linspace(*LEVEL, 2 * _SAMPLES)
    values, ones = _powers(level), np.ones((level.size, 1))
    printed, half = np.array(EQ19_PRINTED[1]), HALF_UNITS[1]
    climb = _powers(np.linspace(JOIN, LEVEL[0], _SAMPLES), slope=True)
    none = np.zeros((_SAMPLES, 2))
    # variables d (7,), the level c and the largest distance from it
    d = _solve(
        np.eye(9)[8],
        np.vstack(
            [
                np.hstack([values * half / _FORCE, -ones, -ones]),
                np.hstack([-values * half / _FORCE, ones, -ones]),
                np.hstack([-climb * half, none]),
            ]
        ),
        np.concatenate([-values @ printed / _FORCE, values @ printed / _FORCE, climb @ printed]),
        # the constant only shifts the level: it stays as printed
        bounds=[(0.0, 0.0)] + [(-_INSIDE, _INSIDE)] * 6 + [(None, None), (0.0, None)],
    )[:7]
    upper = printed + half * d

    printed, half = np.array(EQ19_PRINTED[0]), HALF_UNITS[0]
    meet = _powers(JOIN)[0]
    climb = _powers(np.linspace(presets.STRAND_1X19.low, JOIN, _SAMPLES), slope=True) * half
    both = np.concatenate([half, -half])
    # variables: by how much each coefficient is raised, and lowered (14,)
    d = _solve(
        np.ones(14),
        np.hstack([-climb, climb]),
        climb @ (printed / half),
        equation=(np.tile(meet, 2) * both / _FORCE, meet @ (upper - printed) / _FORCE),
        bounds=[(0.0, _INSIDE)] * 14,
    )
    lower = printed + half * (d[:7] - d[7:])
    return tuple(lower.tolist()), tuple(upper.tolist())


def least_bend() -> tuple[float, float]:
    """dEA/dF [-] below and above 31 N of the continuous law of these digits that bends least there.

    They differ: no law of the printed digits, whatever its first coefficient, has one slope there.
    """
    printed, half = np.concatenate(EQ19_PRINTED), np.concatenate(HALF_UNITS)
    meet, bend = _powers(JOIN)[0], _powers(JOIN, slope=True)[0]
    below, above = np.concatenate([bend, np.zeros(7)]), np.concatenate([np.zeros(7), bend])
    join, fall = np.concatenate([meet, -meet]), below - above
    free: list[tuple[float | None, float | None]] = [(-1.0, 1.0)] * 14
    free[6] = (None, None)
    d = _solve(
        fall * half,
        -(fall * half)[None],
        np.array([fall @ printed]),
        equation=(join * half / _FORCE, -join @ printed / _FORCE),
        bounds=free,
    )
    law = printed + half * d
    return float(below @ law), float(above @ law)


def band(tension: ArrayLike) -> tuple[Array, Array]:
    """Least and largest EA(F) [N] of all laws of the printed digits, same shape as F.

    Of those that are positive over the domain and continuous at 31 N.

    Args:
        tension: F [N], any shape.

    Raises:
        InvalidInput: Not finite numbers.
    """
    values = number_array("tension", tension)
    printed, half = np.concatenate(EQ19_PRINTED), np.concatenate(HALF_UNITS)
    meet = _powers(JOIN)[0]
    join = np.concatenate([meet, -meet])
    law = presets.STRAND_1X19
    lower = _powers(np.linspace(law.low, JOIN, _SAMPLES))
    positive = np.hstack([lower, np.zeros_like(lower)])
    ends = np.empty((values.size, 2))
    for i, F in enumerate(values.ravel()):
        power, none = _powers(F)[0], np.zeros(7)
        row = np.concatenate([power, none] if F <= JOIN else [none, power])
        for side, sign in enumerate((1.0, -1.0)):
            d = _solve(
                sign * row * half / _FORCE,
                -positive * half / _FORCE,
                positive @ printed / _FORCE,
                equation=(join * half / _FORCE, -join @ printed / _FORCE),
                bounds=[(-1.0, 1.0)] * 14,
            )
            ends[i, side] = row @ (printed + half * d)
    low, high = ends.T
    return frozen(low.reshape(values.shape)), frozen(high.reshape(values.shape))


def _powers(tension: ArrayLike, slope: bool = False) -> Array:
    """Rows Fⁱ (N, 7), or their derivatives i Fⁱ⁻¹."""
    F, i = np.atleast_1d(np.asarray(tension, dtype=np.float64))[:, None], np.arange(7)
    return np.asarray(i * F ** np.maximum(i - 1, 0) if slope else F**i)


def _solve(
    cost: Array,
    A: Array,
    b: Array,
    bounds: Sequence[tuple[float | None, float | None]],
    equation: tuple[Array, ArrayLike] | None = None,
) -> Array:
    """Min cost·x so that A x ≤ b, one equation and bounds; these programs have a solution."""
    row, value = equation if equation is not None else (None, None)
    solution = linprog(
        cost,
        A_ub=A,
        b_ub=b,
        A_eq=None if row is None else row[None],
        b_eq=None if value is None else [value],
        bounds=bounds,
    )
    return np.asarray(solution.x)
