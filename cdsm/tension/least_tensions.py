"""The least tensions that balance an arm, or the proof that there are none.

A non-negative least-squares problem proves most infeasible cases (Farkas), a linear program decides
the others.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np

from cdsm.status import Status
from cdsm.support.values import Array
from cdsm.tension.solvers import (
    DEFAULT_SOLVER,
    HINT,
    OPTIMALITY,
    Solution,
    TensionProblem,
    minimise,
    no_solution,
    solve,
)

_PROOF: Final = 1e-8  # least missing torque, per largest moment arm × force, that proves anything
_ROUNDING: Final = 1e-11  # a cable that pulls less than this against it does not pull


def least_tensions(problem: TensionProblem, solver: str, *, proof_first: bool = False) -> Solution:
    """Return the least tensions F (C,) [-] within the bounds that balance the arm.

    The status is INFEASIBLE if it is proved that no tensions do, and SOLVER_FAILED if the solver
    finds none although there are some, or nobody can tell. ``proof_first`` looks for the proof
    before it solves, which is faster if most problems are infeasible; the answer is the same.
    Raises InvalidInput if the solver is not installed.
    """
    count = problem.low.size
    if proof_first and is_proved_infeasible(problem):
        return no_solution(count, Status.INFEASIBLE)
    solution = solve(problem, solver)
    if solution.ok:
        return solution
    if not proof_first and is_proved_infeasible(problem):
        return no_solution(count, Status.INFEASIBLE)
    nearest = nearest_tensions(problem)
    if not nearest.ok:
        message = f"{solution.message}, and 'highs' cannot tell whether tensions exist"
        return no_solution(count, Status.SOLVER_FAILED, f"{message}: {nearest.message}")
    if missing_torque(problem, nearest.x) > OPTIMALITY:
        return no_solution(count, Status.INFEASIBLE)
    most = f"{nearest.x.max() * problem.force:.2g} N"
    exists = f"{solution.message}, though one exists with tensions of up to {most}"
    edge = f"{exists}: the problem is nearly infeasible. {HINT}"
    return no_solution(count, Status.SOLVER_FAILED, edge)


def nearest_balanced(
    problem: TensionProblem, F: Array, low: Array, high: Array, solver: str = DEFAULT_SOLVER
) -> Solution:
    """Return the tensions (C,) [N] in balance that are nearest to F (C,) [N].

    ``low`` and ``high`` (C,) [N] are their bounds; those of ``problem`` do not count.
    """
    A, b, *_, arm, force = problem
    shifted = TensionProblem(
        A, b - A @ (F / force), (low - F) / force, (high - F) / force, arm, force
    )
    change = solve(shifted, solver)
    return replace(change, x=np.clip(F + force * change.x, low, high))


def missing_torque(problem: TensionProblem, F: Array) -> float:
    """Return Σ|b − A F| [-]: the torque that the tensions F (C,) [-] miss."""
    return float(abs(problem.b - problem.A @ F).sum())


def is_proved_infeasible(problem: TensionProblem) -> bool:
    """Whether there is a quick proof that no tensions within the bounds balance the arm.

    With x = F − low ≥ 0, the residual r of min ‖A x − b‖ is a proof by Farkas: rᵀA ≤ 0 < rᵀb.
    Bounds above become equations x + s = high − low with slacks s ≥ 0.
    """
    from scipy.optimize import nnls  # slow to import

    A, b, low, high, *_ = problem
    b = b - A @ low
    upper = np.flatnonzero(high < np.inf)
    if upper.size:
        bounded = np.eye(low.size)[upper]
        none = np.zeros((b.size, upper.size))
        A = np.block([[A, none], [bounded, np.eye(upper.size)]])
        b = np.concatenate([b, (high - low)[upper]])
    try:
        x, missing = nnls(A, b)
    except RuntimeError:  # too many iterations
        return False
    r = b - A @ x
    work = r @ b
    most = abs(A).max(axis=0) * abs(r).max()
    proof = missing > _PROOF and work > _PROOF * (abs(r) @ abs(b))
    return bool(proof and ((r @ A) <= _ROUNDING * most).all())


def nearest_tensions(problem: TensionProblem) -> Solution:
    """Return the tensions F (C,) [-] within the bounds that miss the balance least, Σ|b − A F|."""
    A, b, low, high, *_ = problem
    nv, count = A.shape
    # variables: F, then the positive and the negative part of the missing torque; HiGHS drops
    # entries below 1e-9, so each cable is scaled by its own largest moment arm
    lever = abs(A).max(axis=0)
    lever[lever == 0.0] = 1.0
    nearest = minimise(
        np.repeat([0.0, 1.0], [count, 2 * nv]),
        A_eq=np.hstack([A / lever, np.eye(nv), -np.eye(nv)]),
        b_eq=b,
        bounds=[*zip(low * lever, high * lever, strict=True), *[(0.0, None)] * (2 * nv)],
    )
    return Solution(nearest.x[:count] / lever, nearest.status, nearest.message)
