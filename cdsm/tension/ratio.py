"""Find how even tensions without joint torque can be: the ratio of the smallest to the largest."""

from __future__ import annotations

import numpy as np

from cdsm.errors import SolverError
from cdsm.support.linear_program import OPTIMAL, least
from cdsm.support.values import Array

_CLOSED = 1e-9  # smaller ratios are rounding of the linear program


def tension_ratio(J: Array) -> float:
    """Compute the largest min(F)/max(F) [-] of tensions F ≥ 0 with J_Lᵀ F = 0; 0 if none exist.

    ``J`` is J_L (C, nv). Raises SolverError if the linear program fails.
    """
    count, nv = J.shape
    lever = abs(J).max()
    found = least(  # variables: F, then the smallest entry of F
        np.concatenate([np.zeros(count), [-1.0]]),
        A_eq=np.hstack([J.T / (lever or 1.0), np.zeros((nv, 1))]),
        b_eq=np.zeros(nv),
        A_ub=np.hstack([-np.eye(count), np.ones((count, 1))]),
        b_ub=np.zeros(count),
        bounds=(0.0, 1.0),
    )
    if found.status != OPTIMAL:
        raise SolverError("highs", f"finds no tension factor: {found.message}")
    ratio = float(found.x[-1])
    return ratio if ratio > _CLOSED else 0.0
