"""Call quadratic-programming solvers with suitable settings, and check their solutions.

A solution is accepted only if it meets the optimality conditions.
"""

from __future__ import annotations

import math
import warnings
from typing import Any, Final

import numpy as np

from cdsm.errors import SolverError
from cdsm.kernels import tension as tension_kernels
from cdsm.kernels.compiling import compiled
from cdsm.kernels.tension import DISTANCE, OPTIMALITY
from cdsm.support.validation import one_of
from cdsm.support.values import Array
from cdsm.tension.infeasibility import instead

DEFAULT_SOLVER: Final = "daqp"
"""Default solver of all tension distributions: exact, and the fastest in measurements."""


# with qpsolvers' defaults, these solvers miss OPTIMALITY by orders of magnitude; OSQP's polishing
# step can spoil a solution and still report success
_SETTINGS: dict[str, dict[str, Any]] = {
    "clarabel": {"tol_gap_abs": 1e-11, "tol_gap_rel": 1e-11, "tol_feas": 1e-11},
    "daqp": {"primal_tol": 1e-10},
    "osqp": {
        "eps_abs": 1e-10,
        "eps_rel": 1e-10,
        "max_iter": 100_000,
        "polish": False,
        "raise_error": False,
    },
    "piqp": {"eps_abs": 1e-11, "eps_rel": 1e-11},
    "proxqp": {"eps_abs": 1e-11, "eps_rel": 0.0},
}


def installed_solvers() -> list[str]:
    """Return the names of the solvers that are installed."""
    import qpsolvers  # slow to import

    return sorted(qpsolvers.available_solvers)


def installed_solver(solver: str) -> str:
    """Return the name ``solver``; raise UnknownName if it is not installed."""
    return one_of("installed solver", solver, installed_solvers())


def solve(problem: tension_kernels.Scaled, solver: str) -> Array | str:
    """Minimise ½‖x‖² under balance and bounds of a dimensionless ``problem``; verify the optimum.

    Returns the optimum x (C,) [-], or a text that says why none was found. Raises UnknownName if
    the solver is not installed, and SolverError if it fails or gives no multipliers.
    """
    import qpsolvers
    from scipy.sparse import csc_matrix

    installed_solver(solver)
    A, b, low, high, *_ = problem
    sparse = csc_matrix if solver in qpsolvers.sparse_solvers else np.asarray
    identity, nothing = np.eye(low.size), np.zeros(low.size)
    qp = qpsolvers.Problem(sparse(identity), nothing, A=sparse(A), b=b, lb=low, ub=high)
    settings = _SETTINGS.get(solver, {})
    try:
        if solver == "daqp":
            solution = qpsolvers.solve_problem(qp, solver, **settings)
        else:  # other solvers also report failure as warnings
            with warnings.catch_warnings(action="ignore"):
                solution = qpsolvers.solve_problem(qp, solver, **settings)
    except Exception as error:  # each solver has its own error types
        raise SolverError(solver, f"failed: {error}. {instead(solver)}") from error
    x = solution.x
    if not solution.found or x is None:
        return "found no solution"
    if solution.y is None or solution.z_box is None:
        raise SolverError(solver, f"returns no multipliers to verify it by. {instead(solver)}")
    point = tuple(np.asarray(each, dtype=np.float64) for each in (x, solution.y, solution.z_box))
    if not np.isfinite(point[0]).all():
        raise SolverError(solver, f"calls {x.tolist()} optimal. {instead(solver)}")
    if _shortfall(problem, point):
        # first-order and interior-point solvers end near the optimum, with known active bounds
        point = _polished(problem, point)
        shortfall = _shortfall(problem, point)
        if shortfall:
            return f"calls a point optimal that is not: {shortfall}"
    # after the check: near infeasibility, large multipliers make the last bit of x matter
    x, _, z = point
    return onto_bounds(x, z, low, high, OPTIMALITY * max(1.0, float(abs(x).max())))


@compiled
def onto_bounds(x: Array, z: Array, low: Array, high: Array, rounding: float) -> Array:
    """Return x (n,) with each entry at or beyond a bound set exactly to this bound.

    The multipliers z (n,) mark the active bounds: negative at ``low``, positive at ``high``. A
    solver misses an active bound by up to ``rounding``. Without the correction, a tension could lie
    just outside the domain of its law, which is an error.
    """
    point = np.empty_like(x)
    for j in range(x.shape[0]):
        if x[j] - low[j] <= (rounding if z[j] < 0.0 else 0.0):
            point[j] = low[j]
        elif high[j] - x[j] <= (rounding if z[j] > 0.0 else 0.0):
            point[j] = high[j]
        else:
            point[j] = x[j]
    return point


def _shortfall(problem: tension_kernels.Scaled, point: tuple[Array, ...]) -> str:
    """Return a text that says why ``point`` is not the optimum of ``problem``; empty if it is.

    ``point`` is x (C,) with the multipliers y (nv,) of the balance and z (C,) of the bounds.
    """
    # equal to qpsolvers' primal_residual, dual_residual and duality_gap, ten times faster
    primal, dual, gap = tension_kernels.single_optimality(*problem[:4], *point)
    size = max(1.0, float(abs(point[0]).max()))
    distance = math.sqrt(2.0 * gap)  # ½‖x − x*‖² is at most the gap
    if max(primal, dual) <= OPTIMALITY * size and distance <= DISTANCE * size:
        return ""
    return (
        f"balance and bounds are missed by {primal / size:.1e}, stationarity by {dual / size:.1e} "
        f"({OPTIMALITY:g} is allowed), and the optimum may be {distance / size:.1e} away "
        f"({DISTANCE:g} is allowed; all dimensionless)"
    )


def _polished(problem: tension_kernels.Scaled, point: tuple[Array, ...]) -> tuple[Array, ...]:
    """Refine an approximate optimum ``point``: solve exactly with the same active bounds.

    ``point`` and the result are (x, y, z) as in :func:`_shortfall`. The result is the optimum if
    the bounds that are active at ``point`` are those active at the optimum.
    """
    A, b, low, high, *_ = problem
    x, _, z = point
    at_low, at_high = x - low < -z, high - x < z
    free = ~(at_low | at_high)
    x = np.where(at_low, low, np.where(at_high, high, 0.0))
    x[free] = np.linalg.lstsq(A[:, free], b - A @ x, rcond=None)[0]
    y = np.asarray(np.linalg.lstsq(A[:, free].T, -x[free], rcond=None)[0], dtype=np.float64)
    z = -x - y @ A
    z[free] = 0.0
    return x, y, z
