"""Residuals of the two inverse problems that :mod:`cdsm.kinematics.nearest` solves.

The Hessian of a weighted sum of residuals is computed as a term of the stiffness: as H_L·F, with
the weights of the cable lengths as tensions F, or as ∂(J_Xᵀ W)/∂θ, with the weights of the tip
errors as wrench W.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import final

import numpy as np

from cdsm.errors import CableError
from cdsm.manipulator import Manipulator
from cdsm.posture import load_stiffness
from cdsm.rigid_body import rotation_vector
from cdsm.support.values import Array, frozen

LIMIT_MARGIN = 1e-5
"""A joint counts as at its limit if it is within this fraction of the limit's value."""

_NO_WRENCH = frozen(np.zeros(6))


@dataclass(frozen=True, eq=False)
class Residual(ABC):
    """Dimensionless residual r (m,), a function of the joint angles q (nv,); 0 at the target."""

    arm: Manipulator
    target: Array

    @abstractmethod
    def evaluate(self, q: Array) -> tuple[Array, Array]:
        """Compute the residual r (m,) at joint angles q (nv,), and its Jacobian ∂r/∂q (m, nv)."""

    @abstractmethod
    def curvature(self, q: Array, weight: Array) -> Array:
        """Compute the Hessian (nv, nv) of weight · r with respect to q, for constant weights (m,).

        It is exact where r = 0, and may be approximate elsewhere.
        """

    def hessian(self, q: Array) -> Array:
        """Compute the Hessian of ½‖r‖² (nv, nv) with respect to q; it is exact for all r."""
        r, J = self.evaluate(q)
        return self.curvature(q, r) + J.T @ J


@final
class LengthResidual(Residual):
    """Residual of the cable lengths: r = (L(q) − target)/arm length (C,)."""

    def evaluate(self, q: Array) -> tuple[Array, Array]:
        """Compute the residual r (C,) and ∂r/∂q = J_L/arm length (C, nv) at q (nv,)."""
        pose, length = self.arm.at(q, check_limits=False), self.arm.length
        return (pose.cable_lengths - self.target) / length, pose.length_jacobian / length

    def curvature(self, q: Array, weight: Array) -> Array:
        """Compute the Hessian (nv, nv) of weight · r as H_L·F, with F = weight/arm length (C,)."""
        tension = frozen(weight / self.arm.length)
        pose = self.arm.at(q, check_limits=False)
        none = frozen(np.zeros(weight.size))
        active: Array = pose._joint_stiffness(tension, none, _NO_WRENCH)[0]
        return active


@final
class TipResidual(Residual):
    """Residual of the tip: position error/arm length (3,), for a target position (3,) [m].

    For a target pose (4, 4), it is (6,): the rotation vector of the orientation error follows.
    """

    def evaluate(self, q: Array) -> tuple[Array, Array]:
        """Compute the error r of the tip, (3,) or (6,), and ∂r/∂q (3, nv) or (6, nv) at q."""
        (tip, jacobian), length = self.arm._body.tip(q), self.arm.length
        linear, angular = jacobian[:3] / length, jacobian[3:]
        if self.target.ndim == 1:
            return (tip[:3, 3] - self.target) / length, linear
        turn, turn_jacobian = rotation_vector(tip[:3, :3] @ self.target[:3, :3].T)
        offset = (tip[:3, 3] - self.target[:3, 3]) / length
        return np.concatenate([offset, turn]), np.vstack([linear, turn_jacobian @ angular])

    def curvature(self, q: Array, weight: Array) -> Array:
        """Compute the Hessian (nv, nv) of weight · r as ∂(J_Xᵀ W)/∂θ; exact where r = 0.

        The force of the wrench W is weight[:3]/arm length, its moment weight[3:].
        """
        # at r = 0, ∂r/∂q is J_X up to the length
        wrench = np.zeros(6)
        wrench[: weight.size] = weight
        wrench[:3] /= self.arm.length
        jacobian, joints = self.arm._body.tip(q)[1], self.arm._body.tip_joints
        return -load_stiffness(frozen(jacobian), frozen(wrench), joints)

    def hessian(self, q: Array) -> Array:
        """Compute the Hessian of ½‖r‖² (nv, nv) with respect to q; it is exact for all r."""
        # ∂(½φ²) = φ·ω exactly, so the second derivative contains that of φ only once
        r, J = self.evaluate(q)
        angular = self.arm._body.tip(q)[1][3 : r.size]
        return self.curvature(q, r) + J[:3].T @ J[:3] + angular.T @ J[3:]


def usable_limits(arm: Manipulator) -> tuple[Array, Array]:
    """Return lower and upper joint limits (nv,) at which no two holes of a cable coincide.

    A limit of the arm at which holes coincide is multiplied by 1 − 1e-5.
    """
    # a cable through coincident holes has no direction, so the arm cannot be evaluated there
    limits = arm.lower.copy(), arm.upper.copy()
    for limit in limits:
        for i, alone in enumerate(np.diag(limit)):
            try:
                arm.cable_lengths(alone)
            except CableError:
                limit[i] *= 1.0 - LIMIT_MARGIN
    return limits
