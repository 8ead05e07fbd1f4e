"""Exact derivatives of a :class:`Stiffness` with respect to the cable tensions."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import final

import numpy as np

from cdsm.posture import Posture
from cdsm.stiffness_matrix import Stiffness
from cdsm.support.format import aligned, without_rounding
from cdsm.support.result import Result, unit
from cdsm.support.validation import Direction, instance, unit_direction
from cdsm.support.values import Array, frozen


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class StiffnessGradient(Result):
    """Derivatives of a stiffness with respect to the cable tensions.

    Each has the name of the attribute or method of :class:`~cdsm.Stiffness` that it differentiates.
    Posture and wrench are fixed. A change of one tension alone breaks the balance (Eq. 13), so
    multiply the derivatives by changes ΔF that keep it: J_Lᵀ ΔF = 0.

    Attributes:
        stiffness: K; the derivatives are taken at its tensions.
        cable_stiffness: dk_c/dF_c (C,) [1/m] of each cable; 0 under force control.
    """

    _headline, _rows = "cable_stiffness", "cable"

    stiffness: Stiffness
    cable_stiffness: Array = field(metadata=unit("1/m", "cable"))

    @property
    def _posture(self) -> Posture:
        return self.stiffness.posture

    @cached_property
    def joint(self) -> Array:
        """∂K_θ/∂F (C, nv, nv) [m/rad²]: one symmetric matrix per cable."""
        J, slope = self._posture.length_jacobian, self.cable_stiffness[:, None, None]
        return frozen(self._posture.length_hessian + slope * J[:, :, None] * J[:, None])

    @cached_property
    def margin(self) -> Array:
        """∂λ_min/∂F = vᵀ ∂K_θ/∂F v (C,) [m/rad²], with the unit eigenvector v of λ_min.

        λ_min is the smallest eigenvalue of the symmetric part of K_θ. A multiple eigenvalue has no
        gradient. The result then belongs to one of its eigenvectors; the product with ΔF is an
        upper bound of the change of λ_min, to first order.
        """
        v = self.stiffness.critical_direction[:, None]
        return frozen(form_by_tension(self._posture, self.cable_stiffness, v, v)[:, 0, 0])

    @cached_property
    def cartesian(self) -> Array:
        """∂(C_vv)⁻¹/∂F (C, 3, 3) [1/m], with the translational block C_vv of the compliance.

        Raises SingularStiffness if K_θ is singular, or the tip hardly moves in some direction.
        """
        return frozen(self._through(np.eye(3), self.stiffness.cartesian))

    def along(self, direction: Direction) -> Array:
        """Return ∂s/∂F (C,) [1/m] of the stiffness s = ``K.along(u)``, u being ``direction``.

        ∂s/∂F = s² (K_θ⁻ᵀ J_vᵀ u)ᵀ ∂K_θ/∂F (K_θ⁻¹ J_vᵀ u), with the translational rows J_v of the
        tip Jacobian. Raises InvalidInput if ``direction`` is not an axis or a nonzero (3,), and
        SingularStiffness if K_θ is singular or the tip cannot move along u.
        """
        u = unit_direction("direction", direction)
        self.stiffness._require_mobile(u)
        return frozen(self._through(u[None], np.array([[self.stiffness.along(u)]]))[:, 0, 0])

    def _through(self, U: Array, X: Array) -> Array:
        """Return Mᵀ ∂K_θ/∂F M (C, r, r), the derivative of X = (U C_vv Uᵀ)⁻¹ (r, r).

        M = K_θ⁻¹ (U J_v)ᵀ X is the joint motion per motion of the tip. The left one is of
        K_θᵀ, which differs if a moment acts on the tip.
        """
        K, rows = self.stiffness.joint, U @ self._posture.jacobian[:3]
        left, right = np.linalg.solve(K.T, rows.T) @ X.T, np.linalg.solve(K, rows.T) @ X
        return form_by_tension(self._posture, self.cable_stiffness, left, right)

    def __str__(self) -> str:
        arm = self._posture.arm
        smallest = f"smallest joint stiffness [{arm.stiffness_unit()}]"
        columns = (without_rounding(each) for each in (self.cable_stiffness / 1e3, self.margin))
        rows = [["cable", "cable stiffness [N/mm]", smallest]]
        for name, *values in zip(arm.cables.names, *columns, strict=True):
            rows.append([name, *(f"{value:z.4g}" for value in values)])
        return "\n".join(["change per 1 N of tension in one cable", *aligned(rows)])


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
    slope = K.posture.arm._laws.stiffness_slope(K.tension, K.cable_stiffness)
    return StiffnessGradient(stiffness=K, cable_stiffness=slope)


def form_by_tension(pose: Posture, slope: Array, left: Array, right: Array) -> Array:
    """Compute leftᵀ (∂K_θ/∂F_c) right (C, a, b) for ``left`` (nv, a) and ``right`` (nv, b).

    ``slope`` (C,) [1/m] are the derivatives of the cable stiffnesses with respect to the tensions.
    """
    H, J = pose.length_hessian, pose.length_jacobian
    pairs = (left[:, None, :, None] * right[:, None]).reshape(H[0].size, -1)
    active = (H.reshape(len(H), -1) @ pairs).reshape(-1, left.shape[1], right.shape[1])
    passive = slope[:, None, None] * (J @ left)[:, :, None] * (J @ right)[:, None]
    return np.asarray(active + passive)
