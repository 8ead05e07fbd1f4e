"""Numba kernels around the tension problem: making it dimensionless, and verifying its answer."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from cdsm.kernels.compiling import compiled
from cdsm.support.validation import Array

NO_ARM = 1e-15
"""A moment arm this part of the arm's length is rounding, as of a cable that meets the axis."""


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
    """The power of two next above a magnitude, and that can be divided by; 1 for zero."""
    return 2.0 ** max(math.ceil(math.log2(value)), -1022) if value > 0.0 else 1.0


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
        Largest violation of the constraints, largest entry of x + Aᵀy + z (or of z⁺ where high is
        infinite), and the duality gap |xᵀx + bᵀy + lowᵀz⁻ + highᵀz⁺|: all zero exactly at the
        optimum.
    """
    primal = dual = gap = 0.0
    for i in range(b.shape[0]):
        residual = -b[i]
        for j in range(x.shape[0]):
            residual += A[i, j] * x[j]
        primal = max(primal, abs(residual))
        gap += b[i] * y[i]
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
def settled(x: Array, z: Array, low: Array, high: Array, rounding: float) -> Array:
    """The point x (n,) with what is pressed against a bound, or outside of it, exactly on it.

    What is pressed, the multipliers z (n,) tell: negative at low, positive at high. A solver leaves
    it there but for ``rounding``, and to a law that begins above zero, almost zero is not zero.
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
