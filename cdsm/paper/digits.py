"""Laws that round to the printed digits of Eq. 19: their bounds and the most level law.

A printed coefficient stands for all numbers that round to it: c = c_printed + h ∘ d with |d| ≤ 1,
where h is half a unit of the last digit. The rigidity EA(F) = Σ c_i Fⁱ is linear in d. Therefore
linear programs find the bounds of EA and the most level law.
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
"""Tension at which the two branches of Eq. 19 meet [N]."""

LEVEL: Final = (400.0, 810.0)
"""Range of tension [N] over which the paper calls the rigidity near-constant (Section IV-C)."""

HALF_UNITS: Final = (
    frozen(np.array([5e-3, 5e-3, 5e-3, 5e-3, 5e-3, 5e-5, 5e-5])),
    frozen(np.array([5e-2, 5e-3, 5e-3, 5e-5, 5e-9, 5e-12, 5e-15])),
)
"""Half a unit of the last printed digit of each coefficient, lowest power first."""

_INSIDE = 0.99
"""Largest |d| of the most level law. Below 1, its coefficients round to the printed ones."""

_SAMPLES = 200
"""Number of tensions at which a range is sampled."""

_FORCE = 1e4
"""Unit of rigidity [N] inside the linear programs; it scales them for the solver's tolerances."""

Coefficients = tuple[tuple[float, ...], tuple[float, ...]]


def most_level() -> Coefficients:
    """Find the coefficients of the printed digits whose law is continuous and most level.

    Upper branch: minimise max |EA(F) − c| on :data:`LEVEL` over d and a level c. EA rises up to
    this range. Lower branch: minimise Σ|d| so that EA is continuous at :data:`JOIN` and rises from
    the low end of the domain. Only the coefficient of F⁶ moves there, which the paper misprints.
    """
    level = np.linspace(*LEVEL, 2 * _SAMPLES)
    values, ones = _powers(level), np.ones((level.size, 1))
    printed, half = np.array(EQ19_PRINTED[1]), HALF_UNITS[1]
    climb = _powers(np.linspace(JOIN, LEVEL[0], _SAMPLES), slope=True)
    none = np.zeros((_SAMPLES, 2))
    # variables: d (7,), the level c, and the largest distance of EA from c
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
        # the constant term only shifts the level, so it stays as printed
        bounds=[(0.0, 0.0)] + [(-_INSIDE, _INSIDE)] * 6 + [(None, None), (0.0, None)],
    )[:7]
    upper = printed + half * d

    printed, half = np.array(EQ19_PRINTED[0]), HALF_UNITS[0]
    meet = _powers(JOIN)[0]
    climb = _powers(np.linspace(presets.STRAND_1X19.low, JOIN, _SAMPLES), slope=True) * half
    both = np.concatenate([half, -half])
    # variables (14,): increase and decrease of each coefficient
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
    """Return dEA/dF [-] below and above 31 N of the continuous law whose slope changes least there.

    The slopes differ even with a free coefficient of F⁶: no law of these digits is smooth at 31 N.
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
    """Find least and largest EA [N] of all laws of the printed digits, shape of ``tension`` [N].

    The laws are continuous at 31 N and positive over the domain.

    Raises:
        InvalidInput: ``tension`` is not finite numbers.
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
    """Return a row of powers Fⁱ, i = 0 to 6, for each tension, or of derivatives i Fⁱ⁻¹."""
    F, i = np.atleast_1d(np.asarray(tension, dtype=np.float64))[:, None], np.arange(7)
    return np.asarray(i * F ** np.maximum(i - 1, 0) if slope else F**i)


def _solve(
    cost: Array,
    A: Array,
    b: Array,
    bounds: Sequence[tuple[float | None, float | None]],
    equation: tuple[Array, ArrayLike] | None = None,
) -> Array:
    """Minimise cost·x so that A x ≤ b, within bounds and one equation. A solution exists here."""
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
