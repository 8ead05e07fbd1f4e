"""Programs of cable tensions, solved by qpsolvers, and linear ones by HiGHS.

Each function returns a :class:`Solution`: the solution with a status, or the reason why there is
none.

:func:`solve` minimises ½‖x‖² subject to A x = b and low ≤ x ≤ high, and verifies the solution. The
problem is strictly convex, so x is its optimum exactly if A x = b and, for some multipliers y,
x = clip(−Aᵀ y, low, high). These are the Karush-Kuhn-Tucker conditions (stationarity, bounds and
complementarity) with the multipliers z = −x − Aᵀ y of the bounds eliminated.
"""

from __future__ import annotations

import math
import threading
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass, replace
from typing import Any, Final, NamedTuple

import numpy as np

from cdsm.status import Status
from cdsm.support.validation import one_of
from cdsm.support.values import Array

DEFAULT_SOLVER: Final = "daqp"  # exact, and the fastest in measurements
OPTIMALITY: Final = 1e-9  # largest accepted violation, relative to the largest force
HINT: Final = "Try 'daqp' or 'osqp', or change the posture, the load or the bounds a little."
_ROUNDING: Final = 1e-12  # a solution with a larger violation is corrected
_CURVATURE: Final = 1e-8  # ε that makes a linear program a quadratic one
_FARTHEST: Final = 1e4  # variables of a linear program beyond this may be unbounded
_FEASIBLE: Final = 1e-8  # largest accepted violation of A x = b by a linear program
_TIGHT: Final = 1e-10  # allowed violation of a constraint of order one; HiGHS's default is 1e-7
_STATUS: Final = {0: Status.OK, 2: Status.INFEASIBLE, 3: Status.UNBOUNDED}  # by scipy's number
_WARNINGS: Final = threading.RLock()
NO_ARM: Final = 1e-15  # moment arms below this part of the arm's length are rounding

# DAQP is three times as fast with 60 cables if it eliminates the balance first; OSQP misses bounds
# by newtons with its defaults, and its polishing can spoil a solution
_SETTINGS: Final[dict[str, dict[str, Any]]] = {
    "clarabel": {"tol_gap_abs": 1e-11, "tol_gap_rel": 1e-11, "tol_feas": 1e-11},
    "daqp": {"primal_tol": 1e-10, "eq_reduction": 1},
    "osqp": {
        "eps_abs": 1e-9,
        "eps_rel": 1e-9,
        "max_iter": 100_000,
        "polish": False,
        "adaptive_rho_interval": 25,  # by default it depends on the time that the machine takes
    },
}


class TensionProblem(NamedTuple):
    """Balance of an arm, J_Lᵀ F = J_Xᵀ W − g with bounds of F, in dimensionless form."""

    A: Array  # J_Lᵀ / arm (nv, C)
    b: Array  # torque / (arm × force) (nv,)
    low: Array  # lower bounds / force (C,)
    high: Array  # upper bounds / force (C,)
    arm: float  # power of two above the largest moment arm [m]
    force: float  # power of two above all lower bounds and all torques / arm [N]


@dataclass(frozen=True, slots=True)
class Solution:
    """Solution of a program, or the reason why there is none.

    Attributes:
        x: The solution (n,); NaN unless the status is OK.
        status: OK, INFEASIBLE, UNBOUNDED or SOLVER_FAILED.
        message: What the solver found instead, with the remedy; empty if the status is OK.
    """

    x: Array
    status: Status = Status.OK
    message: str = ""

    @property
    def ok(self) -> bool:
        """Whether there is a solution."""
        return self.status is Status.OK


def no_solution(size: int, status: Status, message: str = "") -> Solution:
    """Return the record of a program with ``size`` variables that has no solution."""
    return Solution(np.full(size, np.nan), status, message or status.message)


@contextmanager
def without_warnings() -> Iterator[None]:
    """Ignore warnings of solvers; filters are of the process, so one thread at a time."""
    with _WARNINGS, warnings.catch_warnings(action="ignore"):
        yield


def nondimensional(
    J: Array, torque: Array, low: Array, high: Array, length: float
) -> TensionProblem:
    """Scale the balance ``J``ᵀ F = ``torque`` of an arm, without rounding; J_L is (C, nv)."""
    size = abs(J)
    arm = 2.0 ** math.frexp(size.max())[1]
    A = J.T / arm
    b = torque / arm
    A[NO_ARM * length > size.T] = 0.0
    force = 2.0 ** math.frexp(max(abs(b).max(), low.max()))[1]
    return TensionProblem(A, b / force, low / force, high / force, arm, force)


def solve(problem: TensionProblem, solver: str) -> Solution:
    """Return the verified optimum x (C,) [-]; SOLVER_FAILED if the solver finds none.

    Raises InvalidInput if the solver is not installed.
    """
    import qpsolvers

    one_of("installed solver", solver, qpsolvers.available_solvers)
    A, b, low, high, *_ = problem
    basis = _independent(A)

    def failed(message: str) -> Solution:
        return no_solution(low.size, Status.SOLVER_FAILED, message)

    sides: dict[str, Array] = {"A": A, "b": b, "lb": low, "ub": high}
    if basis is not None:
        sides |= {"A": basis.T @ A, "b": basis.T @ b}
    qp = qpsolvers.Problem(np.eye(low.size), np.zeros(low.size), **sides)
    # others warn of dense matrices, and of failures that are reported below; this takes 20 µs
    quiet = nullcontext() if solver == DEFAULT_SOLVER else without_warnings()
    try:
        with quiet:
            answer = qpsolvers.solve_problem(qp, solver, **_SETTINGS.get(solver, {}))
    except Exception as error:  # each solver has its own error types
        return failed(f"failed: {error}")
    if not answer.found or answer.x is None or answer.y is None:
        return failed("found no solution with multipliers")
    x = np.asarray(answer.x)
    y = np.asarray(answer.y if basis is None else basis @ answer.y)
    if not math.isfinite(x.sum() + y.sum()):
        return failed("calls numbers optimal that are not finite")
    least = -(y @ A)  # the optimum but for the bounds
    x = np.where(least <= low, low, np.where(least >= high, high, x))
    missed = violation(problem, x, y)
    if missed > _ROUNDING:
        corrected, multipliers = _corrected(problem, x, y)
        remaining = violation(problem, corrected, multipliers)
        if remaining < missed:
            x = corrected
            missed = remaining
    if missed > OPTIMALITY:
        allowed = f"{missed:.1e} ({OPTIMALITY:g} is allowed)"
        return failed(f"calls a point optimal that misses it by {allowed}")
    return Solution(np.asarray(np.minimum(np.maximum(x, low), high)))


def _independent(A: Array) -> Array | None:
    """Return independent combinations of joints (nv, r), since solvers fail at redundant ones.

    With more cables than joints all joints count as independent: None.
    """
    if A.shape[0] < A.shape[1]:
        return None
    U, size, _ = np.linalg.svd(A, full_matrices=False)
    known = size > _ROUNDING * size[0]
    return np.asarray(U[:, known] / size[known])


def violation(problem: TensionProblem, x: Array, y: Array) -> float:
    """Return the largest violation of A x = b and x = clip(−Aᵀ y, low, high), per largest force."""
    A, b, low, high, *_ = problem
    missed = np.concatenate((A @ x - b, np.minimum(np.maximum(-(y @ A), low), high) - x))
    return float(abs(missed).max() / max(1.0, abs(x).max()))


def _corrected(problem: TensionProblem, x: Array, y: Array) -> tuple[Array, Array]:
    """Solve by least squares with the bounds that are active at x."""
    A, b, low, high, *_ = problem
    free = (low < x) & (x < high)
    x = np.where(free, 0.0, x)
    x[free] = np.linalg.lstsq(A[:, free], b - A @ x)[0]
    return x, y - np.linalg.lstsq(A[:, free].T, x[free] + y @ A[:, free])[0]


def minimise(cost: Array, **constraints: Any) -> Solution:
    """Minimise cost · x by scipy's ``linprog``, whose keywords are ``constraints``."""
    from scipy.optimize import linprog  # slow to import

    names = "primal_feasibility_tolerance", "dual_feasibility_tolerance"
    answer = linprog(cost, **constraints, method="highs", options=dict.fromkeys(names, _TIGHT))
    status = _STATUS.get(answer.status, Status.SOLVER_FAILED)
    if status is not Status.OK:
        return no_solution(cost.size, status, str(answer.message))
    return Solution(np.asarray(answer.x, dtype=np.float64))


def maximise(cost: Array, A: Array, b: Array, low: Array, high: Array) -> Solution:
    """Maximise cost · x subject to A x = b and low ≤ x ≤ high, x (n,).

    DAQP solves the quadratic program −cost · x + ½ε ‖x‖², which for ε = 1e-8 ends in the vertex of
    the linear one; another ε moves it, or fails near straight postures. A, b, the finite bounds and
    x must be of order one. Where DAQP finds nothing, or beyond 1e4, HiGHS decides. The status is
    INFEASIBLE if no x is feasible, and UNBOUNDED if nothing bounds cost · x.
    """
    import qpsolvers

    lowest = np.maximum(low, -_FARTHEST)
    highest = np.minimum(high, _FARTHEST)
    unit = float(abs(cost).max()) or 1.0
    qp = qpsolvers.Problem(
        _CURVATURE * np.eye(cost.size), -cost / unit, A=A, b=b, lb=lowest, ub=highest
    )
    try:
        answer = qpsolvers.solve_problem(qp, DEFAULT_SOLVER, primal_tol=1e-11, dual_tol=1e-11)
    except qpsolvers.SolverError:
        x = None
    else:
        x = answer.x
    if x is not None and abs(A @ x - b).max() < _FEASIBLE and abs(x).max() < 0.9 * _FARTHEST:
        return Solution(np.asarray(x))
    lever = abs(A).max(axis=0)  # HiGHS drops entries below 1e-9
    lever[lever == 0.0] = 1.0
    bounds = np.column_stack([low * lever, high * lever])
    solution = minimise(-cost / lever, A_eq=A / lever, b_eq=b, bounds=bounds)
    return replace(solution, x=solution.x / lever)
