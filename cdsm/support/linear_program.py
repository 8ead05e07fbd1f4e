"""Solve linear programs by scipy with HiGHS (Huangfu and Hall, Math. Prog. Comp. 10, 2018)."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from cdsm.support.values import Array

if TYPE_CHECKING:
    from scipy.optimize import OptimizeResult

OPTIMAL, INFEASIBLE, UNBOUNDED = 0, 2, 3
"""Status numbers of scipy that decide a program; all others leave it undecided."""

_TIGHT: Final = 1e-10
"""Allowed violation of a constraint of order one; the default of HiGHS is 1e-7."""


def least(cost: Array, **constraints: Any) -> OptimizeResult:
    """Minimise cost · x by scipy's ``linprog``, whose keywords are ``constraints``."""
    from scipy.optimize import linprog  # slow to import

    names = "primal_feasibility_tolerance", "dual_feasibility_tolerance"
    return linprog(cost, **constraints, method="highs", options=dict.fromkeys(names, _TIGHT))


def proved_largest(
    cost: Array, G: Any, h: Array, A: Any, b: Array, low: Array, high: Array, rounding: float = 0.0
) -> tuple[OptimizeResult, float]:
    """Maximise cost · x with G x ≤ h, A x = b and low ≤ x ≤ high, and prove an upper bound.

    By weak duality the maximum is at most y·b + z·h + Σ max(r low, r high), r = cost − Aᵀ y − Gᵀ z,
    for all multipliers y of the equations and z ≥ 0 of the inequalities. So the bound holds even if
    the solver's y and z are inexact. Magnitudes of r below ``rounding`` are taken as 0. Returns
    scipy's result and the bound, which is NaN if the solver finds no optimum.
    """
    from scipy.optimize import linprog  # slow to import

    found = linprog(-cost, G, h, A, b, np.c_[low, high], method="highs-ds")
    if found.status != OPTIMAL:
        return found, math.nan
    y, z = -found.eqlin.marginals, np.maximum(-found.ineqlin.marginals, 0.0)
    r = cost - A.T @ y - G.T @ z
    r[abs(r) < rounding] = 0.0
    return found, float(y @ b + z @ h + np.maximum(r * low, r * high).sum())
