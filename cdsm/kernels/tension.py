"""Numba kernels of the tension problem: make it dimensionless, and verify every solution.

    min ½‖F‖²   so that   J_Lᵀ F = τ   and   low ≤ F ≤ high.

The problem is strictly convex. A point from any solver or guess is the optimum if it meets the
Karush-Kuhn-Tucker conditions. A Farkas vector proves that the constraints are infeasible. The
tolerances below hold for single postures and batches.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from cdsm.kernels.compiling import compiled
from cdsm.support.values import Array

NO_ARM = 1e-15
"""Moment arm, relative to the arm's length, that counts as rounding (cable through the axis)."""

OPTIMALITY = 1e-9
"""Largest accepted violation of balance, bounds and stationarity, relative to the largest force."""

DISTANCE = 1e-6
"""Largest accepted distance from the optimum, bounded by the duality gap, relative to max F."""

_PROOF = 1e-8
"""Smallest margin of a proof of infeasibility, relative to the terms of its sum."""

_MISSING = 10.0 * OPTIMALITY
"""Missing torque, relative to the largest arm times the largest force, that may be accepted."""

_ROUNDING = 1e-11
"""Torque, relative to the largest, that counts as zero for a cable without upper bound."""


class Scaled(NamedTuple):
    """Balance of an arm, J_Lᵀ F = J_Xᵀ W − g with low ≤ F ≤ high, in dimensionless form.

    Attributes:
        A: J_Lᵀ divided by ``arm`` (nv, C).
        b: Torque divided by ``arm`` and ``force`` (nv,).
        low: Lower bounds divided by ``force`` (C,).
        high: Upper bounds divided by ``force`` (C,).
        arm: Largest moment arm [m], rounded up to a power of two, so that scaling is exact.
        force: Largest of the lower bounds and of torque over moment arm [N], also rounded up.
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
    """Compute the fields of :class:`Scaled`; moment arms below NO_ARM times ``reach`` are zero."""
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
    # divide twice: the product of the two may underflow
    return A / arm, torque / arm / force, low / force, high / force, arm, force


@compiled
def _power_of_two(value: float) -> float:
    """Return the next power of two at or above a magnitude; 1 for zero."""
    return 2.0 ** math.ceil(math.log2(value)) if value > 0.0 else 1.0


@compiled
def optimality(
    A: Array, b: Array, low: Array, high: Array, x: Array, y: Array, z: Array
) -> tuple[float, float, float]:
    """Measure the violation of optimality of x for min ½‖x‖² so that A x = b, low ≤ x ≤ high.

    A is (m, n), b is (m,), and low, high and x are (n,); high may hold inf. y (m,) are the
    multipliers of the equations. z (n,) are the multipliers of the bounds: negative at low,
    positive at high.

    Returns:
        Three numbers that are all zero exactly at the optimum. First, the largest violation of
        balance (divided by the largest moment arm) and of the bounds. Second, the largest entry of
        x + Aᵀy + z, or of z⁺ where high is infinite. Third, the duality gap |xᵀx + bᵀy + lowᵀz⁻ +
        highᵀz⁺|; twice the gap bounds the squared distance from the optimum.
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
            dual = max(dual, z[j])  # an infinite bound has no multiplier
    return primal, dual, abs(gap)


@compiled
def is_optimal(
    J: Array, b: Array, low: Array, high: Array, F: Array, v: Array, y: Array, z: Array
) -> bool:
    """Check whether F (C,) is the optimum; v (nv,) gives J_L v = F for cables between their bounds.

    Fill the multipliers y = −v (nv,) and z (C,); at a bound z = J_L v − F, elsewhere 0.
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
    """Check whether v (nv,) proves infeasibility: vᵀb > vᵀJ_Lᵀ F for all F within the bounds."""
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
    """Compute row c of J_L (C, nv) times v (nv,)."""
    total = 0.0
    for i in range(v.shape[0]):
        total += J[c, i] * v[i]
    return total


@compiled
def onto_bounds(x: Array, z: Array, low: Array, high: Array, rounding: float) -> Array:
    """Return the point x (n,) with the entries at or outside a bound set exactly to the bound.

    Multipliers z (n,) mark the bounds: negative at low, positive at high. A solver misses bounds by
    up to ``rounding``. A law whose domain starts above zero needs an exact zero.
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
