"""Exact derivatives of a :class:`Stiffness` with respect to the cable tensions.

R (r, nv) are rows of the tip Jacobian, and X = (R K_θ⁻¹ Rᵀ)⁻¹ (r, r) is the tip stiffness. If K_θ
changes by ∂K_θ, X changes by Mᵀ ∂K_θ M. M = K_θ⁻¹ Rᵀ X is the joint motion per unit motion of the
tip. If a moment acts on the tip, K_θ is not symmetric, and the left factor is (K_θ⁻ᵀ Rᵀ Xᵀ)ᵀ.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import final

import numpy as np

from cdsm.planning.kernels import form_by_tension
from cdsm.stiffness_matrix import Stiffness
from cdsm.support.directions import Direction, unit_direction
from cdsm.support.format import aligned, without_rounding
from cdsm.support.validation import instance
from cdsm.support.values import Array, ReadOnlyState, frozen


@final
@dataclass(frozen=True, eq=False, kw_only=True)
class StiffnessGradient(ReadOnlyState):
    """Derivatives of a stiffness with respect to the cable tensions.

    Each has the name of the attribute or method of :class:`~cdsm.Stiffness` that it differentiates.
    Posture and wrench are fixed. A change of one tension alone breaks the balance (Eq. 13), so
    multiply the derivatives by changes ΔF that keep it: J_Lᵀ ΔF = 0.

    Attributes:
        stiffness: K; the derivatives are taken at its tensions.
        cable_stiffness: dk_c/dF_c (C,) [1/m] of each cable; 0 under force control.
    """

    stiffness: Stiffness
    cable_stiffness: Array

    def __repr__(self) -> str:
        return f"<StiffnessGradient of {self.stiffness.posture.arm.name}>"

    def __str__(self) -> str:
        arm = self.stiffness.posture.arm
        columns = (without_rounding(each) for each in (self.cable_stiffness / 1e3, self.margin))
        rows = [
            [
                "cable",
                "cable stiffness [N/mm]",
                f"smallest joint stiffness [{arm.stiffness_unit()}]",
            ]
        ]
        rows += [
            [name, *(f"{value:z.4g}" for value in values)]
            for name, *values in zip(arm.cables.names, *columns, strict=True)
        ]
        return "\n".join(["change per 1 N of tension in one cable", *aligned(rows)])

    @cached_property
    def joint(self) -> Array:
        """∂K_θ/∂F (C, nv, nv) [m/rad²]: one symmetric matrix per cable."""
        identity = np.eye(self.stiffness.posture.arm.nv)
        return frozen(self._projected(identity, identity))

    @cached_property
    def margin(self) -> Array:
        """∂λ_min/∂F = vᵀ ∂K_θ/∂F v (C,) [m/rad²], with the unit eigenvector v of λ_min.

        λ_min is the smallest eigenvalue of the symmetric part of K_θ. A multiple eigenvalue has no
        gradient. The result then belongs to one of its eigenvectors; the product with ΔF is an
        upper bound of the change of λ_min, to first order.
        """
        v = self.stiffness.critical_direction[:, None]
        return frozen(self._projected(v, v)[:, 0, 0])

    @cached_property
    def cartesian(self) -> Array:
        """∂(C_vv)⁻¹/∂F (C, 3, 3) [1/m], with the translational block C_vv of the compliance.

        Raises:
            SingularStiffness: K_θ is singular, or the tip hardly moves in some direction.
        """
        return frozen(self._through(self.stiffness.posture.jacobian[:3], self.stiffness.cartesian))

    def along(self, direction: Direction) -> Array:
        """Return ∂s/∂F (C,) [1/m] of the stiffness s = ``K.along(u)``, u being ``direction``.

        ∂s/∂F = s² (K_θ⁻ᵀ J_vᵀ u)ᵀ ∂K_θ/∂F (K_θ⁻¹ J_vᵀ u), with the translational rows J_v of the
        tip Jacobian. Raises InvalidInput if ``direction`` is not an axis or a nonzero (3,), and
        SingularStiffness if K_θ is singular or the tip cannot move along u.
        """
        u = unit_direction("direction", direction)
        self.stiffness._require_mobile(u)
        rows = u[None] @ self.stiffness.posture.jacobian[:3]
        return frozen(self._through(rows, np.array([[self.stiffness.along(u)]]))[:, 0, 0])

    def _through(self, rows: Array, X: Array) -> Array:
        """Return ∂X/∂F (C, r, r) of the tip stiffness X (r, r).

        ``rows`` (r, nv) are the rows of the tip Jacobian that belong to X.
        """
        K = self.stiffness.joint
        right = np.linalg.solve(K, rows.T) @ X
        left = np.linalg.solve(K.T, rows.T) @ X.T  # differs from right only if a moment acts
        return self._projected(left, right)

    def _projected(self, left: Array, right: Array) -> Array:
        """Return leftᵀ (∂K_θ/∂F_c) right (C, a, b) for left (nv, a) and right (nv, b)."""
        pose = self.stiffness.posture
        return form_by_tension(
            pose.length_hessian, pose.length_jacobian, self.cable_stiffness, left, right
        )


def stiffness_gradient(stiffness: Stiffness) -> StiffnessGradient:
    """Compute the derivatives of a stiffness K with respect to the cable tensions.

    ∂K_θ/∂F_c = H_c + k′_c J_c J_cᵀ, with the gradient J_c and the Hessian H_c of the length of
    cable c and k′_c = dk_c/dF_c. k′_c includes dEA/dF and the series spring. For example,
    ``stiffness_gradient(K).along(u)`` is the gradient of ``K.along(u)``.

    Raises:
        InvalidInput: ``stiffness`` is not a frictionless ``Stiffness``.
        ElasticityRangeError: A tension is outside the domain of its elasticity.
    """
    K = instance("stiffness", stiffness, Stiffness).require_frictionless()
    slope, _ = K.posture.arm._laws.slopes(K.tension, K.cable_stiffness)
    return StiffnessGradient(stiffness=K, cable_stiffness=slope)
