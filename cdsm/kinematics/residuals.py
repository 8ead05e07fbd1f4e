"""Residuals of the two inverse problems, which :mod:`cdsm.kinematics.nearest` solves.

Both second derivatives are those of the stiffness: weights on cable lengths act like tensions,
weights on the tip like a dead wrench.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

import numpy as np

from cdsm.errors import CableError
from cdsm.kernels.stiffness import load_stiffness
from cdsm.manipulator import Manipulator
from cdsm.rigid_body import rotation_vector
from cdsm.support.validation import Array, frozen

HAIR = 1e-5
"""Part of a joint's limit within which the joint stands at it."""

_NO_WRENCH = frozen(np.zeros(6))


@final
@dataclass(frozen=True, eq=False)
class LengthMisfit:
    """How far cable lengths are from those wanted, over the arm's length."""

    arm: Manipulator
    wanted: Array

    def misfit(self, q: Array) -> tuple[Array, Array]:
        """Residual r(q) and its Jacobian."""
        pose, size = self.arm.at(q, check_limits=False), self.arm.length
        return (pose.cable_lengths - self.wanted) / size, pose.length_jacobian / size

    def curvature(self, q: Array, weight: Array) -> Array:
        """Second derivative of weight · r(q)."""
        # H_L·F of tensions F = weight
        tension = frozen(weight / self.arm.length)
        pose = self.arm.at(q, check_limits=False)
        return pose._joint_stiffness(tension, frozen(np.zeros(weight.size)), _NO_WRENCH)[0]

    def hessian(self, q: Array) -> Array:
        """Second derivative of ½ |r(q)|²."""
        r, J = self.misfit(q)
        return self.curvature(q, r) + J.T @ J


@final
@dataclass(frozen=True, eq=False)
class TipMisfit:
    """How far the tip is from its target: position over the arm's length, rotation vector."""

    arm: Manipulator
    target: Array

    def misfit(self, q: Array) -> tuple[Array, Array]:
        """Residual r(q) and its Jacobian."""
        state, size = self.arm._body.state(q), self.arm.length
        linear, angular = state.jacobian[:3] / size, state.jacobian[3:]
        if self.target.ndim == 1:
            return (state.tip[:3, 3] - self.target) / size, linear
        turn, slope = rotation_vector(state.tip[:3, :3] @ self.target[:3, :3].T)
        away = (state.tip[:3, 3] - self.target[:3, 3]) / size
        return np.concatenate([away, turn]), np.vstack([linear, slope @ angular])

    def curvature(self, q: Array, weight: Array) -> Array:
        """Second derivative of weight · r(q)."""
        # ∂(J_Xᵀ W)/∂θ of a dead wrench W = weight: where r = 0, ∂r/∂q is J_X but for the size
        wrench = np.zeros(6)
        wrench[: weight.size] = weight
        wrench[:3] /= self.arm.length
        jacobian, way = self.arm._body.state(q).jacobian, self.arm._masses.way
        return -load_stiffness(frozen(jacobian), frozen(wrench), way)

    def hessian(self, q: Array) -> Array:
        """Second derivative of ½ |r(q)|²."""
        # ∂(½φ²) = φ·ω exactly, so its second derivative needs that of φ once, not twice
        r, J = self.misfit(q)
        angular = self.arm._body.state(q).jacobian[3 : r.size]
        return self.curvature(q, r) + J[:3].T @ J[:3] + angular.T @ J[3:]


def usable_limits(arm: Manipulator) -> tuple[Array, Array]:
    """The joint limits, drawn in by a hair where the holes of touching disks meet there.

    The default limit is where disks touch, and a cable that passes there has no direction: such a
    posture would be an answer that the arm cannot be evaluated at.
    """
    limits = arm.lower.copy(), arm.upper.copy()
    for limit in limits:
        for i, alone in enumerate(np.diag(limit)):
            try:
                arm.cable_lengths(alone)
            except CableError:
                limit[i] *= 1.0 - HAIR
    return limits
