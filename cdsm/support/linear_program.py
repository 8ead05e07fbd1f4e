"""Linear programs, solved by HiGHS (Huangfu and Hall, Math. Prog. Comp. 10, 2018) of scipy."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from cdsm.support.values import Array

if TYPE_CHECKING:
    from scipy.optimize import OptimizeResult

OPTIMAL, INFEASIBLE, UNBOUNDED = 0, 2, 3
"""Status numbers of scipy that decide a program; all others leave it undecided."""

_TIGHT: Final = 1e-10
"""Allowed violation of a constraint of order one; the default of HiGHS is 1e-7."""


def least(cost: Array, **constraints: Any) -> OptimizeResult:
    """Minimise cost · x under the constraints of scipy's ``linprog``; return its result.

    If the simplex method ends undecided at the tolerance :data:`_TIGHT` (e.g. in scipy 1.14), the
    interior-point method with crossover to a vertex solves the program again.
    """
    from scipy.optimize import linprog  # slow to import

    names = "primal_feasibility_tolerance", "dual_feasibility_tolerance"
    tight = dict.fromkeys(names, _TIGHT)
    found = linprog(cost, **constraints, method="highs", options=tight)
    if found.status not in (OPTIMAL, INFEASIBLE, UNBOUNDED):
        found = linprog(cost, **constraints, method="highs-ipm", options=tight)
    return found
