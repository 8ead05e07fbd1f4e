"""Programs of cable tensions, solved by qpsolvers, and linear ones by HiGHS.

:func:`solve` minimises ½‖x‖² subject to A x = b and low ≤ x ≤ high, and verifies the solution. The
problem is strictly convex, so x is its optimum exactly if A x = b and, for some multipliers y,
x = clip(−Aᵀ y, low, high). These are the Karush-Kuhn-Tucker conditions (stationarity, bounds and
complementarity) with the multipliers z = −x − Aᵀ y of the bounds eliminated.
"""

from __future__ import annotations

import math
import warnings
from contextlib import nullcontext, suppress
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from cdsm.errors import solver_failed
from cdsm.support.validation import one_of
from cdsm.support.values import Array

if TYPE_CHECKING:
    from scipy.optimize import OptimizeResult

OPTIMAL = 0
INFEASIBLE = 2
UNBOUNDED = 3
"""Status numbers of scipy that decide a program; all others leave it undecided."""

DEFAULT_SOLVER: Final = "daqp"  # exact, and the fastest in measurements
OPTIMALITY: Final = 1e-9  # largest accepted violation, relative to the largest force
HINT: Final = "Try 'daqp' or 'osqp', or change the posture, the load or the bounds a little."
_ROUNDING: Final = 1e-12  # a solution with a larger violation is corrected
_CURVATURE: Final = 1e-8  # ε that makes a linear program a quadratic one
_FARTHEST: Final = 1e4  # variables of a linear program beyond this may be unbounded
_FEASIBLE: Final = 1e-8  # largest accepted violation of A x = b by a linear program
_TIGHT: Final = 1e-10  # allowed violation of a constraint of order one; HiGHS's default is 1e-7
NO_ARM: Final = 1e-15  # moment arms below this part of the arm's length are rounding

# DAQP is three times as fast with 60 cables if it eliminates the balance first; OSQP misses bounds
# by newtons with its defaults, and its polishing can spoil a solution
_SETTINGS: Final[dict[str, dict[str, Any]]] = {
    "clarabel": {"tol_gap_abs": 1e-11, "tol_gap_rel": 1e-11, "tol_feas": 1e-11},
    "daqp": {"primal_tol": 1e-10, "eq_reduction": 1},
    "osqp": {"eps_abs": 1e-9, "eps_rel": 1e-9, "max_iter": 100_000, "polish": False},
}


class Problem(NamedTuple):
    """Balance of an arm, J_Lᵀ F = J_Xᵀ W − g with bounds of F, in dimensionless form."""

    A: Array  # J_Lᵀ / arm (nv, C)
    b: Array  # torque / (arm × force) (nv,)
    low: Array  # lower bounds / force (C,)
    high: Array  # upper bounds / force (C,)
    arm: float  # power of two above the largest moment arm [m]
    force: float  # power of two above all lower bounds and all torques / arm [N]


def nondimensional(J: Array, torque: Array, low: Array, high: Array, length: float) -> Problem:
    """Scale the balance ``J``ᵀ F = ``torque`` of an arm, without rounding; J_L is (C, nv)."""
    arm = 2.0 ** math.frexp(abs(J).max())[1]
    A = J.T / arm
    b = torque / arm
    A[abs(A) < NO_ARM * length / arm] = 0.0
    force = 2.0 ** math.frexp(max(abs(b).max(), low.max()))[1]
    return Problem(A, b / force, low / force, high / force, arm, force)


def installed_solvers() -> list[str]:
    """Return the names of the solvers that are installed."""
    import qpsolvers  # slow to import

    return sorted(qpsolvers.available_solvers)


def solve(problem: Problem, solver: str) -> Array | str:
    """Return the verified optimum x (C,) [-], or a text that says what the solver found instead.

    Raises InvalidInput if the solver is not installed, CdsmError if it breaks down.
    """
    import qpsolvers

    one_of("installed solver", solver, qpsolvers.available_solvers)
    A, b, low, high, *_ = problem
    basis = _independent(A)
    sides: dict[str, Array] = {"A": basis.T @ A, "b": basis.T @ b, "lb": low, "ub": high}
    qp = qpsolvers.Problem(np.eye(low.size), np.zeros(low.size), **sides)
    # others warn of dense matrices, and of failures that are reported below; this takes 20 µs
    quiet = nullcontext() if solver == DEFAULT_SOLVER else warnings.catch_warnings(action="ignore")
    try:
        with quiet:
            found = qpsolvers.solve_problem(qp, solver, **_SETTINGS.get(solver, {}))
    except Exception as error:  # each solver has its own error types
        raise solver_failed(solver, f"failed: {error}. {HINT}") from error
    if not found.found or found.x is None or found.y is None:
        return "found no solution with multipliers"
    x = np.asarray(found.x)
    y = basis @ found.y
    if not np.isfinite([x.sum(), y.sum()]).all():
        return "calls numbers optimal that are not finite"
    least = -(y @ A)  # the optimum but for the bounds
    x = np.where(least <= low, low, np.where(least >= high, high, x))
    missed = violation(problem, x, y)
    if missed > _ROUNDING:
        exact = _corrected(problem, x, y)
        x, missed = min((x, missed), (exact[0], violation(problem, *exact)), key=lambda e: e[1])
    if missed > OPTIMALITY:
        return f"calls a point optimal that misses it by {missed:.1e} ({OPTIMALITY:g} is allowed)"
    return np.asarray(np.minimum(np.maximum(x, low), high))


def _independent(A: Array) -> Array:
    """Return independent combinations of joints (nv, r): solvers fail at redundant ones."""
    if A.shape[0] < A.shape[1]:
        return np.eye(len(A))
    U, size, _ = np.linalg.svd(A, full_matrices=False)
    known = size > _ROUNDING * size[0]
    return np.asarray(U[:, known] / size[known])


def violation(problem: Problem, x: Array, y: Array) -> float:
    """Return the largest violation of A x = b and x = clip(−Aᵀ y, low, high), per largest force."""
    A, b, low, high, *_ = problem
    missed = np.concatenate((A @ x - b, np.minimum(np.maximum(-(y @ A), low), high) - x))
    return float(abs(missed).max() / max(1.0, abs(x).max()))


def _corrected(problem: Problem, x: Array, y: Array) -> tuple[Array, Array]:
    """Solve by least squares with the bounds that are active at x."""
    A, b, low, high, *_ = problem
    free = (low < x) & (x < high)
    x = np.where(free, 0.0, x)
    x[free] = np.linalg.lstsq(A[:, free], b - A @ x)[0]
    return x, y - np.linalg.lstsq(A[:, free].T, x[free] + y @ A[:, free])[0]


def least(cost: Array, **constraints: Any) -> OptimizeResult:
    """Minimise cost · x by scipy's ``linprog``, whose keywords are ``constraints``."""
    from scipy.optimize import linprog  # slow to import

    names = "primal_feasibility_tolerance", "dual_feasibility_tolerance"
    return linprog(cost, **constraints, method="highs", options=dict.fromkeys(names, _TIGHT))


def largest(cost: Array, A: Array, b: Array, low: Array, high: Array) -> tuple[float, Array] | None:
    """Maximise cost · x subject to A x = b and low ≤ x ≤ high; return the maximum and x (n,).

    DAQP solves the quadratic program −cost · x + ½ε ‖x‖², which for ε = 1e-8 ends in the vertex of
    the linear one; another ε moves it, or fails near straight postures. A, b, the finite bounds and
    x must be of order one. Where DAQP finds nothing, or beyond 1e4, HiGHS decides. The result is
    None if no x is feasible, and (inf, NaN) if cost · x is unbounded.
    """
    import qpsolvers

    lowest = np.maximum(low, -_FARTHEST)
    highest = np.minimum(high, _FARTHEST)
    unit = float(abs(cost).max()) or 1.0
    qp = qpsolvers.Problem(
        _CURVATURE * np.eye(cost.size), -cost / unit, A=A, b=b, lb=lowest, ub=highest
    )
    with suppress(qpsolvers.SolverError):
        found = qpsolvers.solve_problem(qp, DEFAULT_SOLVER, primal_tol=1e-11, dual_tol=1e-11)
        x = np.full_like(cost, np.nan) if found.x is None else np.asarray(found.x)
        if abs(A @ x - b).max() < _FEASIBLE and abs(x).max() < 0.9 * _FARTHEST:
            return float(cost @ x), x
    lever = abs(A).max(axis=0)  # HiGHS drops entries below 1e-9
    lever[lever == 0.0] = 1.0
    bounds = np.column_stack([low * lever, high * lever])
    program = least(-cost / lever, A_eq=A / lever, b_eq=b, bounds=bounds)
    if program.status == INFEASIBLE:
        return None
    if program.status == UNBOUNDED:
        return math.inf, np.full_like(cost, np.nan)
    if program.status != OPTIMAL:
        raise solver_failed("highs", f"finds no largest load: {program.message}")
    x = program.x / lever
    return float(cost @ x), x
