"""Numba kernels of the tension problem: make it dimensionless, and verify every solution.

    min ½‖F‖²   subject to   J_Lᵀ F = τ   and   low ≤ F ≤ high.

The problem is strictly convex. A point from any solver or guess is the optimum if it meets the
Karush-Kuhn-Tucker conditions. A Farkas vector v proves that no tensions meet the constraints:
vᵀτ > vᵀJ_Lᵀ F for all F within the bounds. Single postures and batches use the same tolerances.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from cdsm._former.compiling import Width, compiled, inner, lanes, upwards
from cdsm.support.values import Array

NO_ARM = 1e-15
"""Moment arms below this part of the arm's length are rounding: the cable crosses the axis."""

OPTIMALITY = 1e-9
"""Largest accepted violation of balance, bounds and stationarity, relative to the largest force."""

DISTANCE = 1e-6
"""Largest accepted distance from the optimum, bounded by the duality gap, relative to max F."""

_PROOF = 1e-8
"""Smallest vᵀb − vᵀJ_Lᵀ F that proves infeasibility, relative to the magnitudes of its terms."""

_MISSING = 10.0 * OPTIMALITY
"""A proof needs a missing torque above this fraction of the largest moment arm × largest force."""

_ROUNDING = 1e-11
"""J_c v below this fraction of the largest is rounding, for a cable c without upper bound."""


class Balance(NamedTuple):
    """Balance J_Lᵀ F = τ of r postures for which a search must find the tensions."""

    arms: Array  # J_L (r, C, nv) [m]; moment arms that are rounding errors are set to zero
    torque: Array  # τ (r, nv) [N m]
    tension: Array  # F (r, C) [N]


class Certificate(NamedTuple):
    """Result of :func:`set_optimal` or :func:`set_infeasible` for W postures, and scratch."""

    y: Array  # multipliers of the balance (nv, W)
    z: Array  # multipliers of the bounds (C, W)
    sums: Array  # scratch (6, W)
    force: Array  # the largest force (W,)
    certified: Array  # the result (W,): 1 if proved, else 0


@inner
def certificate(nv: int, cables: int, width: int) -> Certificate:
    """Allocate a :class:`Certificate` for a block of ``width`` postures."""
    return Certificate(
        np.empty((nv, width)),
        np.empty((cables, width)),
        np.empty((6, width)),
        np.empty(width),
        np.empty(width),
    )


@compiled
def scaled_balance(
    length_jacobian: Array, torque: Array, low: Array, high: Array, reach: float
) -> tuple[Array, Array, Array, Array, float, float]:
    """Compute the fields of :class:`Scaled`; moment arms below NO_ARM · ``reach`` become zero.

    ``reach`` is the length of the arm [m]; J_L is (C, nv), the torque (nv,), bounds are (C,).
    """
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


@inner
def _power_of_two(value: float) -> float:
    """Return the smallest power of two that is not below ``value``; 1 if ``value`` is zero."""
    return 2.0 ** math.ceil(math.log2(value)) if value > 0.0 else 1.0


@inner
def set_violations(
    J: Array,
    b: Array,
    low: Array,
    high: Array,
    x: Array,
    y: Array,
    z: Array,
    violations: Array,
    width: Width,
) -> None:
    """Measure how far x is from the optimum of min ½‖x‖² subject to Jᵀ x = b, low ≤ x ≤ high.

    J is (n, m, W), b is (m, W), and low, high and x are (n, W); high may be inf. y (m, W) are the
    multipliers of the equations. z (n, W) are the multipliers of the bounds: negative at low,
    positive at high.

    Fills the first three rows of ``violations`` (5 or more, W), which are zero only at the optimum.
    Row 0 is the largest violation of balance (divided by the largest moment arm) and of the bounds.
    Row 1 is the largest |x + J y + z|, or z⁺ where high is infinite. Row 2 is the duality gap
    |xᵀx + bᵀy + lowᵀz⁻ + highᵀz⁺|; twice the gap bounds the squared distance from the optimum.
    """
    primal, dual, gap = violations[0], violations[1], violations[2]
    arm, term = violations[3], violations[4]
    for w in lanes(width):
        primal[w] = dual[w] = gap[w] = arm[w] = 0.0
    for i in upwards(0, b.shape[0]):
        for w in lanes(width):
            term[w] = -b[i, w]
        for c in upwards(0, x.shape[0]):
            for w in lanes(width):
                term[w] += J[c, i, w] * x[c, w]
            for w in lanes(width):
                arm[w] = max(arm[w], abs(J[c, i, w]))
        for w in lanes(width):
            primal[w] = max(primal[w], abs(term[w]))
        for w in lanes(width):
            gap[w] += b[i, w] * y[i, w]
    for w in lanes(width):
        primal[w] /= arm[w] if arm[w] > 0.0 else 1.0
    for c in upwards(0, x.shape[0]):
        for w in lanes(width):
            primal[w] = max(primal[w], max(low[c, w] - x[c, w], x[c, w] - high[c, w]))
        for w in lanes(width):
            term[w] = x[c, w] + z[c, w]
        for i in upwards(0, b.shape[0]):
            for w in lanes(width):
                term[w] += J[c, i, w] * y[i, w]
        for w in lanes(width):  # an infinite bound has no multiplier
            excess = z[c, w] if high[c, w] == math.inf else 0.0
            dual[w] = max(dual[w], max(abs(term[w]), excess))
        for w in lanes(width):
            bound = low[c, w] if z[c, w] < 0.0 else high[c, w]
            gap[w] += x[c, w] * x[c, w] + (bound * z[c, w] if bound < math.inf else 0.0)
    for w in lanes(width):
        gap[w] = abs(gap[w])


@inner
def set_optimal(
    J: Array,
    b: Array,
    low: Array,
    high: Array,
    F: Array,
    v: Array,
    scratch: Certificate,
    width: Width,
) -> None:
    """Set ``scratch.certified`` (W,) to 1 where F (C, W) is the optimum within the bounds, else 0.

    J is J_L (C, nv, W), b the torque to balance (nv, W). v (nv, W) satisfies J_L v = F for cables
    between their bounds. The multipliers are y = −v, and z = J_L v − F at a bound, elsewhere 0.
    """
    y, z, violations, force, certified = scratch
    for w in lanes(width):
        force[w] = 0.0
    for i in upwards(0, b.shape[0]):
        for w in lanes(width):
            y[i, w] = -v[i, w]
    for c in upwards(0, F.shape[0]):
        for w in lanes(width):
            force[w] = max(force[w], abs(F[c, w]))
        for w in lanes(width):
            z[c, w] = -F[c, w]
        for i in upwards(0, b.shape[0]):
            for w in lanes(width):
                z[c, w] += J[c, i, w] * v[i, w]
        for w in lanes(width):
            below = z[c, w] < 0.0 and F[c, w] <= low[c, w]
            above = z[c, w] >= 0.0 and F[c, w] >= high[c, w]
            z[c, w] = z[c, w] if below or above else 0.0
    set_violations(J, b, low, high, F, y, z, violations, width)
    for w in lanes(width):
        violated = max(violations[0, w], violations[1, w])
        close = math.sqrt(2.0 * violations[2, w]) <= DISTANCE * force[w]
        certified[w] = 1.0 if violated <= OPTIMALITY * force[w] and close else 0.0


@inner
def set_infeasible(
    J: Array, b: Array, low: Array, high: Array, v: Array, scratch: Certificate, width: Width
) -> None:
    """Set ``scratch.certified`` (W,) to 1 where v (nv, W) proves infeasibility, else to 0.

    v is a proof if vᵀb > vᵀJ_Lᵀ F for all F with low ≤ F ≤ high. J is J_L (C, nv, W), b (nv, W)
    the torque to balance, and ``low`` and ``high`` (C, W) are the bounds.
    """
    _, work, sums, force, certified = scratch
    left, size, steepest = sums[0], sums[1], sums[2]
    arm, torques, largest = sums[3], sums[4], sums[5]
    for w in lanes(width):
        left[w] = size[w] = steepest[w] = arm[w] = torques[w] = largest[w] = force[w] = 0.0
    for i in upwards(0, b.shape[0]):
        for w in lanes(width):
            left[w] += v[i, w] * b[i, w]
        for w in lanes(width):
            size[w] += abs(v[i, w] * b[i, w])
        for w in lanes(width):
            steepest[w] = max(steepest[w], abs(v[i, w]))
        for w in lanes(width):
            torques[w] = max(torques[w], abs(b[i, w]))
    for c in upwards(0, J.shape[0]):
        for w in lanes(width):
            force[w] = max(force[w], low[c, w])
        for w in lanes(width):
            work[c, w] = 0.0
        for i in upwards(0, b.shape[0]):
            for w in lanes(width):
                arm[w] = max(arm[w], abs(J[c, i, w]))
            for w in lanes(width):
                work[c, w] += J[c, i, w] * v[i, w]
        for w in lanes(width):
            largest[w] = max(largest[w], abs(work[c, w]))
    for c in upwards(0, J.shape[0]):
        for w in lanes(width):
            bound = high[c, w] if work[c, w] > 0.0 else low[c, w]
            endless = math.inf if work[c, w] > _ROUNDING * largest[w] else 0.0
            work[c, w] = work[c, w] * bound if bound < math.inf else endless
        for w in lanes(width):
            left[w] -= work[c, w]
        for w in lanes(width):
            size[w] += abs(work[c, w])
    for w in lanes(width):
        # without an arm no cable turns any joint: as in scaled_balance
        turned = max(torques[w], (arm[w] if arm[w] > 0.0 else 1.0) * force[w])
        proved = left[w] > max(_PROOF * size[w], _MISSING * steepest[w] * turned)
        certified[w] = 1.0 if proved else 0.0
