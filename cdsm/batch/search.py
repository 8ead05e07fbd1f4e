"""Least tensions of the rows whose guess is not the optimum, or the proof that there are none."""

from __future__ import annotations

import numpy as np

from cdsm.errors import CdsmError
from cdsm.manipulator import Manipulator
from cdsm.support.status import Status
from cdsm.support.values import Array
from cdsm.tension import distribute_tension
from cdsm.tension.solvers import DEFAULT_SOLVER, Problem, nondimensional, solve

_PROOF = 1e-8  # least missing torque, per largest moment arm × force, that proves anything
_ROUNDING = 1e-11  # a cable that pulls less than this against the missing torque does not pull


def search(
    arm: Manipulator, J: Array, torque: Array, low: Array, high: Array
) -> tuple[Array, Status]:
    """Return least tensions F (C,) [N] of J_Lᵀ F = τ, and OK, or the reason why there are none.

    SOLVER_FAILED leaves open whether there are any.
    """
    problem = nondimensional(J, torque, low, high, arm.length)
    if _is_infeasible(problem):
        return low, Status.INFEASIBLE
    try:
        x = solve(problem, DEFAULT_SOLVER)
    except CdsmError:  # the solver broke down
        return low, Status.SOLVER_FAILED
    if isinstance(x, str):
        return low, Status.SOLVER_FAILED
    return x * problem.force, Status.OK


def explained(
    arm: Manipulator, q: Array, low: Array, high: Array, wrench: Array
) -> tuple[Array, Status]:
    """Solve one row as :func:`~cdsm.distribute_tension` does, with its linear programs."""
    try:
        F = distribute_tension(arm.at(q, check_limits=False), low, high, wrench).values
    except CdsmError as error:
        if not error.status:
            raise
        return low, Status[error.status]
    return F, Status.OK


def _is_infeasible(problem: Problem) -> bool:
    """Whether the residual of least squares with bounds proves that no tensions exist.

    With x = F − low ≥ 0, the residual r of min ‖A x − b‖ is a Farkas vector: rᵀA ≤ 0 < rᵀb.
    Bounds above become equations x + s = high − low with slacks s ≥ 0.
    """
    from scipy.optimize import nnls  # slow to import

    A, b, low, high, *_ = problem
    nv, C = A.shape
    b = b - A @ low
    upper = np.flatnonzero(high < np.inf)
    if upper.size:
        bounded = np.eye(C)[upper]
        A = np.block([[A, np.zeros((nv, len(upper)))], [bounded, np.eye(len(upper))]])
        b = np.concatenate([b, (high - low)[upper]])
    try:
        x, missing = nnls(A, b)
    except RuntimeError:  # too many iterations
        return False
    if not missing > _PROOF:
        return False
    r = b - A @ x
    work, most = r @ b, abs(A).max(axis=0) * abs(r).max()
    return bool(work > _PROOF * (abs(r) @ abs(b)) and ((r @ A) <= _ROUNDING * most).all())
