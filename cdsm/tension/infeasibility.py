"""Find why no tensions balance an arm: the missing torque, and how far bounds must widen."""

from __future__ import annotations

import math
from typing import NoReturn

import numpy as np
from numpy.typing import NDArray

from cdsm.errors import InfeasibleTension, SolverError
from cdsm.kernels.tension import OPTIMALITY, Scaled
from cdsm.posture import Posture
from cdsm.support.linear_program import OPTIMAL, least
from cdsm.support.values import frozen


def explain(
    pose: Posture, problem: Scaled, solver: str, fault: str, free: NDArray[np.bool_]
) -> NoReturn:
    """Find by linear programs why ``solver`` did not solve ``problem``; raise that as an error.

    ``free`` (C,) marks the cables without a fixed tension; only their bounds may widen. ``fault``
    says in words what the solver returned.

    Raises:
        InfeasibleTension: No tensions within the bounds balance the arm.
        SolverError: Tensions exist, though the solver found none.
    """
    A, b, lower, upper, arm_scale, force_scale = problem
    nv, count = A.shape
    # variables: F, then the positive and the negative part of the missing torque
    identity = np.eye(nv)
    # HiGHS drops entries below 1e-9, so each cable is scaled by its own largest moment arm
    lever = abs(A).max(axis=0)
    lever = np.where(lever > 0.0, lever, 1.0)
    nearest = least(
        np.concatenate([np.zeros(count), np.ones(2 * nv)]),
        A_eq=np.hstack([A / lever, identity, -identity]),
        b_eq=b,
        bounds=[*zip(lower * lever, upper * lever, strict=True), *[(0.0, None)] * (2 * nv)],
    )
    if nearest.status != OPTIMAL:  # it is feasible and bounded by construction
        raise SolverError("highs", f"cannot tell whether tensions exist: {nearest.message}")
    values = nearest.x[:count] / lever
    if nearest.fun <= OPTIMALITY:
        raise SolverError(
            solver,
            f"{fault}, though one exists with tensions of up to {values.max() * force_scale:.2g} N:"
            f" the arm is at the edge of what its cables can balance. {instead(solver)}",
        )

    widening = _widening(problem, free)
    blocking = False  # whether the fixed tensions make the problem infeasible
    if math.isinf(widening) and not free.all():
        blocking = math.isfinite(_widening(problem, np.ones_like(free)))
    missing = (b - A @ values) * arm_scale * force_scale
    tight = free & (np.minimum(values - lower, upper - values) <= OPTIMALITY)
    worst = int(abs(missing).argmax())
    raise InfeasibleTension(
        missing=frozen(missing),
        joint=pose.arm.joint_names[worst],
        relaxation=widening,
        binding=[pose.arm.cables[c].name for c in np.flatnonzero(tight)],
        fixed=[pose.arm.cables[c].name for c in np.flatnonzero(~free)] if blocking else (),
        units=(pose.arm.torque_unit(), pose.arm.torque_unit(worst)),
    )


def _widening(problem: Scaled, free: NDArray[np.bool_]) -> float:
    """Compute how far bounds must widen [N] until tensions balance the arm; inf if they never do.

    Only the bounds of the cables that ``free`` (C,) marks widen, all by the same force.
    """
    A, b, lower, upper, _, force_scale = problem
    nv, count = A.shape
    # variables: F, then the widening t: low − t <= F <= high + t, and F >= 0; a fixed
    # tension does not widen
    rows = np.vstack([-np.eye(count), np.eye(count)])
    sides = np.concatenate([-lower, upper])
    finite = np.isfinite(sides)
    found = least(
        np.concatenate([np.zeros(count), [1.0]]),
        A_ub=np.hstack([rows, -1.0 * np.tile(free, 2)[:, None]])[finite],
        b_ub=sides[finite],
        A_eq=np.hstack([A, np.zeros((nv, 1))]),
        b_eq=b,
        bounds=(0.0, None),
    )
    return float(found.x[-1]) * force_scale if found.status == OPTIMAL else math.inf


def instead(solver: str) -> str:
    """Return a sentence that says what to do if ``solver`` fails."""
    if solver == "daqp":
        return "Change the posture, the load or the bounds a little, or try another solver."
    return "Use solver='daqp'."
