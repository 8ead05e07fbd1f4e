"""Numba kernels of the tension problem: it is made dimensionless, and every answer is verified.

    min ½‖F‖²   so that   J_Lᵀ F = τ   and   low ≤ F ≤ high.

Whoever found a point, a solver or a guess, it is the optimum if it meets the conditions of Karush,
Kuhn and Tucker, since the problem is strictly convex; and a vector of Farkas proves that no point
meets the constraints. The tolerances below are those of single postures and of batches.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from cdsm.kernels.compiling import compiled
from cdsm.support.values import Array

NO_ARM = 1e-15
"""A moment arm this part of the arm's length is rounding, as of a cable that meets the axis."""

OPTIMALITY = 1e-9
"""Largest accepted violation of balance, bounds and stationarity, relative to the largest force."""

DISTANCE = 1e-6
"""Largest accepted distance from the optimum, as the duality gap bounds it, relative to max F."""

_PROOF = 1e-8
"""What a proof of infeasibility has to leave over, relative to the terms it is the sum of."""

_MISSING = 10.0 * OPTIMALITY
"""A missing torque this part of the largest arm times the largest force may be accepted."""

_ROUNDING = 1e-11
"""A torque this part of the largest is none, where a cable may pull as much as it likes."""


class Scaled(NamedTuple):
    """The balance of an arm, J_Lᵀ F = J_Xᵀ W − g with low ≤ F ≤ high, made dimensionless.

    Attributes:
        A: J_Lᵀ over the largest moment arm (nv, C).
        b: Torque over moment arm and force (nv,).
        low: Lower bounds over force (C,).
        high: Upper bounds over force (C,).
        arm: Largest moment arm [m], up to the next power of two, so that scaling rounds nothing.
        force: Largest of the lower bounds and of torque over moment arm [N], likewise.
    """

    A: Array
    b: Array
    low: Array
    high: Array
    arm: float
    force: float


@compiled
def scaled_balance(
    length_jacobian: Array, torque: Array, low: Array, high: Array, reach: float
) -> tuple[Array, Array, Array, Array, float, float]:
    """Return the fields of :class:`Scaled`; moment arms that are rounding of ``reach`` are none."""
    count, nv = length_jacobian.shape
    largest = 0.0
    A = np.empty((nv, count))
    for c in range(count):
        for i in range(nv):
            A[i, c] = length_jacobian[c, i]
            if abs(A[i, c]) < NO_ARM * reach:
                A[i, c] = 0.0
            largest = max(largest, abs(A[i, c]))
    arm = _power_of_two(largest)
    largest = 0.0
    for i in range(nv):
        largest = max(largest, abs(torque[i]) / arm)
    for c in range(count):
        largest = max(largest, low[c])
    force = _power_of_two(largest)
    # one after the other: their product may be less than any number
    return A / arm, torque / arm / force, low / force, high / force, arm, force


@compiled
def _power_of_two(value: float) -> float:
    """The power of two next above a magnitude; 1 for zero."""
    return 2.0 ** math.ceil(math.log2(value)) if value > 0.0 else 1.0


@compiled
def optimality(
    A: Array, b: Array, low: Array, high: Array, x: Array, y: Array, z: Array
) -> tuple[float, float, float]:
    """How far x is from solving min ½‖x‖² so that A x = b, low ≤ x ≤ high.

    Args:
        A: (m, n).
        b: (m,).
        low: (n,).
        high: (n,), may hold inf.
        x: The point (n,).
        y: Multipliers of the equations (m,).
        z: Multipliers of the bounds (n,): negative at low, positive at high.

    Returns:
        Largest violation of balance, over the largest moment arm, and of the bounds; largest entry
        of x + Aᵀy + z (or of z⁺ where high is infinite); and the duality gap
        |xᵀx + bᵀy + lowᵀz⁻ + highᵀz⁺|, of which twice bounds the squared distance from the
        optimum. All are zero exactly at the optimum.
    """
    primal = dual = gap = arm = 0.0
    for i in range(b.shape[0]):
        residual = -b[i]
        for j in range(x.shape[0]):
            residual += A[i, j] * x[j]
            arm = max(arm, abs(A[i, j]))
        primal = max(primal, abs(residual))
        gap += b[i] * y[i]
    primal = primal / arm if arm > 0.0 else primal
    for j in range(x.shape[0]):
        primal = max(primal, low[j] - x[j], x[j] - high[j])
        slope = x[j] + z[j]
        for i in range(b.shape[0]):
            slope += A[i, j] * y[i]
        dual = max(dual, abs(slope))
        gap += x[j] * x[j]
        if z[j] < 0.0:
            gap += low[j] * z[j]
        elif high[j] < np.inf:
            gap += high[j] * z[j]
        else:
            dual = max(dual, z[j])  # a bound that is not there has no multiplier
    return primal, dual, abs(gap)


@compiled
def is_optimal(
    J: Array, b: Array, low: Array, high: Array, F: Array, v: Array, y: Array, z: Array
) -> bool:
    """Whether F (C,) is the optimum, if J_L v = F for the cables between their bounds, v (nv,).

    Multipliers y (nv,) and z (C,) are filled: a bound takes what the balance leaves over.
    """
    force = 0.0
    for i in range(b.shape[0]):
        y[i] = -v[i]
    for c in range(F.shape[0]):
        force = max(force, abs(F[c]))
        left = row_product(J, c, v) - F[c]
        at_bound = F[c] <= low[c] if left < 0.0 else F[c] >= high[c]
        z[c] = left if at_bound else 0.0
    primal, dual, gap = optimality(J.T, b, low, high, F, y, z)
    close = math.sqrt(2.0 * gap) <= DISTANCE * force
    return max(primal, dual) <= OPTIMALITY * force and close


@compiled
def is_infeasible(J: Array, b: Array, low: Array, high: Array, v: Array) -> bool:
    """Whether v (nv,) proves that no F balances: vᵀb is above vᵀJ_Lᵀ F for all F within bounds."""
    largest = left = size = steepest = arm = torques = force = 0.0
    for c in range(J.shape[0]):
        largest = max(largest, abs(row_product(J, c, v)))
        force = max(force, low[c])
        for i in range(b.shape[0]):
            arm = max(arm, abs(J[c, i]))
    for i in range(b.shape[0]):
        left += v[i] * b[i]
        size += abs(v[i] * b[i])
        steepest = max(steepest, abs(v[i]))
        torques = max(torques, abs(b[i]))
    for c in range(J.shape[0]):
        torque = row_product(J, c, v)
        bound = high[c] if torque > 0.0 else low[c]
        if bound == math.inf:
            if torque > _ROUNDING * largest:
                return False
            continue
        left -= torque * bound
        size += abs(torque * bound)
    if not arm > 0.0:
        arm = 1.0  # no cable turns any joint: as in scaled_balance
    return left > max(_PROOF * size, _MISSING * steepest * max(torques, arm * force))


@compiled
def row_product(J: Array, c: int, v: Array) -> float:
    """Row c of J_L (C, nv) times v (nv,)."""
    total = 0.0
    for i in range(v.shape[0]):
        total += J[c, i] * v[i]
    return total


@compiled
def onto_bounds(x: Array, z: Array, low: Array, high: Array, rounding: float) -> Array:
    """The point x (n,) with its entries at a bound, or outside of it, exactly on it.

    Multipliers z (n,) mark the bounds: negative at low, positive at high. A solver misses them by
    up to ``rounding``, and a law that begins above zero does not take almost zero for zero.
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
