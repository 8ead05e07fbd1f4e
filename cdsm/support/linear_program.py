"""Solve linear programs by scipy with HiGHS (Huangfu and Hall, Math. Prog. Comp. 10, 2018)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from cdsm.support.values import Array

if TYPE_CHECKING:
    from scipy.optimize import OptimizeResult

OPTIMAL, INFEASIBLE, UNBOUNDED = 0, 2, 3
"""Status numbers of scipy that decide a program; all others leave it undecided."""

_TIGHT: Final = 1e-10  # allowed violation of a constraint of order one; HiGHS's default is 1e-7


def least(cost: Array, **constraints: Any) -> OptimizeResult:
    """Minimise cost · x by scipy's ``linprog``, whose keywords are ``constraints``."""
    from scipy.optimize import linprog  # slow to import

    names = "primal_feasibility_tolerance", "dual_feasibility_tolerance"
    return linprog(cost, **constraints, method="highs", options=dict.fromkeys(names, _TIGHT))
