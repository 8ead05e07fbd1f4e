"""Derivatives of the stiffness of an arm with respect to the cable tensions."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import final

import numpy as np
from numpy.typing import NDArray

from cdsm import readings
from cdsm.planning.tension_space import form_by_tension
from cdsm.stiffness_matrix import Stiffness
from cdsm.support.format import aligned, without_rounding
from cdsm.support.result import Result, unit
from cdsm.support.validation import Direction, instance, unit_direction
from cdsm.support.values import Array, frozen
from cdsm.terms import passive_stiffness


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class StiffnessGradient(Result):
    """Derivatives of a stiffness with respect to the cable tensions.

    Each has the name of the attribute or method of :class:`~cdsm.Stiffness` that it differentiates.
    Posture and wrench are fixed. A change of one tension alone breaks the balance (Eq. 13), so
    multiply the derivatives by changes ΔF that keep it: `J_Lᵀ ΔF = 0`.

    Attributes:
        stiffness: K; the derivatives are taken at its tensions.
        cable_stiffness: dk_c/dF_c (C,) [1/m] of each cable; 0 under force control.
    """

    _headline = "cable_stiffness"
    _rows = "cable"
    _posture_from = "stiffness.posture"

    stiffness: Stiffness
    cable_stiffness: Array = field(metadata=unit("1/m", "cable"))

    @cached_property
    def joint(self) -> Array:
        """`∂K_θ/∂F` (C, nv, nv) [m/rad²]: one symmetric matrix per cable."""
        J = self._driven
        slope = self.cable_stiffness[:, None, None]
        return frozen(self.stiffness.posture.length_hessian + slope * J[:, :, None] * J[:, None])

    @cached_property
    def _driven(self) -> Array:
        """Gradients of the lengths (C, nv) [m/rad], less by how far motors yield."""
        K = self.stiffness
        return _driven(K, np.zeros(K.tension.size, dtype=np.bool_))

    @cached_property
    def margin(self) -> Array:
        """`∂λ_min/∂F = vᵀ ∂K_θ/∂F v` (C,) [m/rad²], with the unit eigenvector v of `λ_min`.

        `λ_min` is the smallest eigenvalue of the symmetric part of `K_θ`. A multiple eigenvalue has
        no gradient. The result then belongs to one of its eigenvectors; the product with ΔF is an
        upper bound of the change of `λ_min`, to first order.
        """
        v = self.stiffness.critical_direction[:, None]
        form = form_by_tension(
            self.stiffness.posture, self.cable_stiffness, v, v, driven=self._driven
        )
        return frozen(form[:, 0, 0])

    @cached_property
    def cartesian(self) -> Array:
        """`∂(C_vv)⁻¹/∂F` (C, 3, 3) [1/m], with the translational block `C_vv` of the compliance.

        Raises SingularStiffness if `K_θ` is singular, or the tip hardly moves in some direction.
        """
        slope = self.cable_stiffness
        return frozen(
            self._through(
                np.eye(3), self.stiffness.cartesian, self.stiffness.joint, slope, self._driven
            )
        )

    def along(self, direction: Direction) -> Array:
        """Return `∂s/∂F` (C,) [1/m] of the stiffness s = ``K.along(u)``, u being ``direction``.

        `∂s/∂F = s² (K_θ⁻ᵀ J_vᵀ u)ᵀ ∂K_θ/∂F (K_θ⁻¹ J_vᵀ u)`, with the translational rows `J_v` of
        the tip Jacobian. Of cables at 0 N, those that the force does not stretch are left out; the
        gradient then holds while they stay at 0 N. Raises InvalidInput if ``direction`` is not an
        axis or a nonzero (3,), and SingularStiffness if `K_θ` is singular or the tip cannot move
        along u.
        """
        u = unit_direction("direction", direction)
        K = self.stiffness
        K.require_mobile(u)
        along, motion = K.tip_response(u)
        loose = K.loose(motion)
        k = np.where(loose, K.cable_stiffness, 0.0)
        J = K.posture.length_jacobian
        taut = readings.remove_cables(K.joint, J, k)
        soft = K.posture.arm.motors.yielding
        if soft is not None:
            taut = K.joint - K.passive + passive_stiffness(J, K.cable_stiffness - k, soft)
        slope = np.where(loose, 0.0, self.cable_stiffness)
        driven = _driven(K, loose)
        return frozen(self._through(u[None], np.array([[along]]), taut, slope, driven)[:, 0, 0])

    def _through(self, U: Array, X: Array, K: Array, slope: Array, driven: Array) -> Array:
        """Return Mᵀ ∂K_θ/∂F M (C, r, r), the derivative of X = (U C_vv Uᵀ)⁻¹ (r, r).

        M = K_θ⁻¹ (U J_v)ᵀ X is the joint motion per motion of the tip. The left one is of
        K_θᵀ, which differs if a moment acts on the tip.
        """
        rows = U @ self.stiffness.posture.jacobian[:3]
        left = np.linalg.solve(K.T, rows.T) @ X.T
        right = np.linalg.solve(K, rows.T) @ X
        return form_by_tension(self.stiffness.posture, slope, left, right, driven=driven)

    def __str__(self) -> str:
        arm = self.stiffness.posture.arm
        smallest = f"smallest joint stiffness [{arm.stiffness_unit()}]"
        columns = (without_rounding(slopes) for slopes in (self.cable_stiffness / 1e3, self.margin))
        rows = [["cable", "cable stiffness [N/mm]", smallest]]
        for name, *values in zip(arm.cables.names, *columns, strict=True):
            rows.append([name, *(f"{value:z.4g}" for value in values)])
        return "\n".join(["change per 1 N of tension in one cable", *aligned(rows)])


def _driven(K: Stiffness, loose: NDArray[np.bool_]) -> Array:
    """Compute Pᵀ J_L (C, nv) [m/rad] with K_eff = P K_L, of which some cables are ``loose`` (C,).

    dK_eff = P dK_L Pᵀ: these are the gradients of the lengths if all motors are rigid, P = 1.
    """
    soft = K.posture.arm.motors.yielding
    J = K.posture.length_jacobian
    if soft is None:
        return J
    return np.asarray(soft.transmission(np.where(loose, 0.0, K.cable_stiffness)).T @ J)


def stiffness_gradient(stiffness: Stiffness) -> StiffnessGradient:
    """Compute the derivatives of a stiffness K with respect to the cable tensions.

    `∂K_θ/∂F_c = H_c + k′_c J_c J_cᵀ`, with the gradient `J_c` and the Hessian `H_c` of the length
    of cable c and `k′_c = dk_c/dF_c`. `k′_c` includes `dEA/dF` and the series spring. Where motors
    yield, `J_c` is that of `Pᵀ J_L`, with `K_eff = P K_L` (:attr:`Stiffness.wire_stiffness`). For
    example, ``stiffness_gradient(K).along(u)`` is the gradient of ``K.along(u)``.

    Raises:
        InvalidInput: ``stiffness`` is not a frictionless ``Stiffness``.
        ElasticityRangeError: A tension is outside the domain of its elasticity.

    Example:
        >>> import cdsm
        >>> pose = cdsm.presets.virtual_prototype().at([0.1] * 10)
        >>> K = cdsm.stiffness(pose, cdsm.distribute_tension(pose, minimum=5.0))
        >>> slope = cdsm.stiffness_gradient(K).along("z")
        >>> print(f"cable1_2: {slope[1]:.3f} N/m per N")
        cable1_2: 25.760 N/m per N
    """
    K = instance("stiffness", stiffness, Stiffness).require_frictionless()
    slope = K.posture.arm.laws.stiffness_slope(K.tension, K.cable_stiffness)
    return StiffnessGradient(stiffness=K, cable_stiffness=slope)
