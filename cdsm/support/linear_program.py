"""Linear programs, solved by HiGHS (Huangfu and Hall, Math. Prog. Comp. 10, 2018) of scipy."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from cdsm.support.values import Array

if TYPE_CHECKING:
    from scipy.optimize import OptimizeResult

OPTIMAL, INFEASIBLE, UNBOUNDED = 0, 2, 3
"""Status of a solved program; the others tell nothing of it."""

_TIGHT: Final = 1e-10
"""Violation of a constraint, of order one, that is none; HiGHS accepts 1e-7 unless told."""


def least(cost: Array, **constraints: Any) -> OptimizeResult:
    """Minimise cost · x under the constraints of scipy's ``linprog``.

    With some scipy (1.14), the simplex method ends undecided at this tolerance; interior points,
    with a crossover to a corner, then take its place.
    """
    from scipy.optimize import linprog  # slow to import

    names = "primal_feasibility_tolerance", "dual_feasibility_tolerance"
    tight = dict.fromkeys(names, _TIGHT)
    found = linprog(cost, **constraints, method="highs", options=tight)
    if found.status not in (OPTIMAL, INFEASIBLE, UNBOUNDED):
        found = linprog(cost, **constraints, method="highs-ipm", options=tight)
    return found
