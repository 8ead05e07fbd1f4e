"""Numba kernels that verify what others have found of min ½‖F‖² so that J_Lᵀ F = b, l ≤ F ≤ u.

Whoever guessed it, a point that meets the conditions of Karush, Kuhn and Tucker is the optimum,
since the problem is strictly convex; and a vector of Farkas proves that there is no point at all.
"""

from __future__ import annotations

import math

from cdsm.kernels.compiling import compiled
from cdsm.support.validation import Array

OPTIMALITY = 1e-11
"""Largest accepted violation of balance, bounds and multipliers, relative to the largest force."""

_PROOF = 1e-8
"""What a proof of infeasibility has to leave over, relative to the terms it is the sum of."""

_SLIGHT = 1e-8
"""A missing torque this part of the largest arm times the largest force may be rounding.

Ten times what :func:`~cdsm.distribute_tension` accepts, so that it decides what is near.
"""

_NOTHING = 1e-11
"""A torque this part of the largest is rounding, where a cable may pull as much as it likes."""


@compiled
def torque_of(J: Array, c: int, y: Array) -> float:
    """Row c of J_L (C, nv) times y (nv,)."""
    total = 0.0
    for i in range(y.shape[0]):
        total += J[c, i] * y[i]
    return total


@compiled
def is_optimal(J: Array, b: Array, low: Array, high: Array, F: Array, y: Array) -> bool:
    """Whether F (C,) is the optimum, with y (nv,) the multipliers of balance.

    F = J_L y where F is between its bounds, not below it at the lower and not above it at the upper
    one.
    """
    arm = force = worst = 0.0
    for c in range(F.shape[0]):
        force = max(force, abs(F[c]))
        worst = max(worst, max(low[c] - F[c], F[c] - high[c]))
        multiplier = F[c] - torque_of(J, c, y)
        if F[c] > low[c] and multiplier > 0.0:
            worst = max(worst, multiplier)
        if F[c] < high[c] and multiplier < 0.0:
            worst = max(worst, -multiplier)
        for i in range(b.shape[0]):
            arm = max(arm, abs(J[c, i]))
    for i in range(b.shape[0]):
        missing = b[i]
        for c in range(F.shape[0]):
            missing -= J[c, i] * F[c]
        if abs(missing) > arm * OPTIMALITY * force:
            return False
    return worst <= OPTIMALITY * force


@compiled
def is_infeasible(J: Array, b: Array, low: Array, high: Array, v: Array) -> bool:
    """Whether v (nv,) proves that no F balances: vᵀb is above vᵀJ_Lᵀ F for all F within bounds."""
    largest = left = size = steepest = arm = torques = force = 0.0
    for c in range(J.shape[0]):
        largest = max(largest, abs(torque_of(J, c, v)))
        force = max(force, low[c])
        for i in range(b.shape[0]):
            arm = max(arm, abs(J[c, i]))
    for i in range(b.shape[0]):
        left += v[i] * b[i]
        size += abs(v[i] * b[i])
        steepest = max(steepest, abs(v[i]))
        torques = max(torques, abs(b[i]))
    for c in range(J.shape[0]):
        torque = torque_of(J, c, v)
        bound = high[c] if torque > 0.0 else low[c]
        if bound == math.inf:
            if torque > _NOTHING * largest:
                return False
            continue
        left -= torque * bound
        size += abs(torque * bound)
    if not arm > 0.0:
        arm = 1.0  # no cable turns any joint: as distribute_tension does
    return left > max(_PROOF * size, _SLIGHT * steepest * max(torques, arm * force))
