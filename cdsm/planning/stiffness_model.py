"""K_θ at one posture as a function of the tensions, and the tip stiffness that follows from it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq

from cdsm.errors import InvalidInput
from cdsm.planning import kernels
from cdsm.planning.admissible import admissible
from cdsm.posture import Posture, load_stiffness
from cdsm.support.format import JointUnits
from cdsm.support.validation import SMALLEST, instance, scalar
from cdsm.support.values import Array

_LEAST_MARGIN = 1e-9  # rounding changes the smallest eigenvalue by 1e-11 of the largest
_NEAREST = 1e-9  # smallest distance of two eigenvalues in a derivative, as a part of the scale


def checked_margin(margin: float) -> float:
    """Check and return ``margin``: the least λ_min/λ_max of K_θ that counts as stable.

    It is at least 1e-9, which is above rounding errors, and below 1.
    """
    part = scalar("margin", margin)
    if not _LEAST_MARGIN <= part < 1.0:
        raise InvalidInput(
            "margin",
            f"{part:g} given; it is a part of the largest eigenvalue of K_θ: "
            f"{_LEAST_MARGIN:g} <= margin < 1. Less is rounding.",
        )
    return part


class StiffnessModel:
    """K_θ as a function of the admissible tensions F at a posture; every planner builds one.

    Attributes:
        pose: The posture.
        region: The admissible tensions.
        unit: Unit of each joint coordinate (nv,): 1 rad, or the arm's length [m] if it is
            prismatic. K_θ is in these units, so that its eigenvalues can be compared [N m/rad].
        jacobian: Tip Jacobian (6, nv), per ``unit`` of each joint.
        scale: Largest magnitude of an eigenvalue of K_θ under the least tensions [N m/rad].
        floor: Limit of the smallest eigenvalue of K_θ; below it the arm counts as unstable
            [N m/rad].
        evaluations: Number of evaluations of K_θ.
        iterations: Number of iterations of all searches.
    """

    def __init__(
        self,
        pose: Posture,
        minimum: ArrayLike,
        maximum: ArrayLike,
        wrench: ArrayLike,
        margin: float,
    ) -> None:
        self.pose = instance("pose", pose, Posture)
        self.region = region = admissible(pose, minimum, maximum, wrench)
        part = checked_margin(margin)
        self.unit = unit = JointUnits(pose.arm.slides).levers(pose.arm.length)
        squared = np.outer(unit, unit)
        self.jacobian = pose.jacobian * unit
        # products with the cached tensor are faster than a loop over the cables
        self.geometry = pose.length_hessian * squared, pose.length_jacobian * unit
        load = load_stiffness(pose.jacobian, region.least.wrench, pose.arm._body.tip_joints)
        self.constant = (pose.gravity_stiffness + load) * squared
        self.scale = max(float(abs(self.at(region.least.values).eigenvalues).max()), SMALLEST)
        self.floor = part * self.scale

    def at(self, F: Array) -> Evaluation:
        """Evaluate K_θ under admissible tensions F (C,) [N]."""
        # rounding between two admissible points can leave the bounds and the domain of a law
        return Evaluation(self, np.minimum(np.maximum(F, self.region.low), self.region.high))


class Evaluation:
    """K_θ under given tensions: a point of a search.

    Attributes:
        model: The model that evaluates K_θ.
        F: Tensions (C,) [N].
        K: K_θ (nv, nv) [N m/rad].
        eigenvalues: Eigenvalues of the symmetric part of K_θ, ascending (nv,) [N m/rad].
        eigenvectors: Their unit eigenvectors, the columns of (nv, nv).
    """

    def __init__(self, model: StiffnessModel, F: Array) -> None:
        self.model = model
        self.F = F
        self._springs = model.pose.arm._laws.stiffness(model.pose.cable_lengths, F)
        self.K, self.eigenvalues, self.eigenvectors = kernels.stiffness_at(
            model.constant, *model.geometry, F, self._springs
        )

    @cached_property
    def spring_slopes(self) -> tuple[Array, Array]:
        """Derivatives dk/dF (C,) [1/m] and d²k/dF² (C,) [1/(N m)] of the cable stiffnesses k."""
        return self.model.pose.arm._laws.slopes(self.F, self._springs)

    @property
    def reserve(self) -> float:
        """λ_min of K_θ minus ``model.floor`` [N m/rad]; the arm is stable if it is not negative."""
        return float(self.eigenvalues[0] - self.model.floor)

    @cached_property
    def reserve_gradient(self) -> Array:
        """Derivatives (C,) [m/rad²] of :attr:`reserve`, λ_min − floor, by the tensions."""
        return self.mode_gradient(self.eigenvectors[:, :1])

    def mode_gradient(self, v: Array) -> Array:
        """Return ∂(vᵀ K_θ v)/∂F (C,) [m/rad²] for a constant vector v (nv, 1)."""
        v = np.ascontiguousarray(v)
        return kernels.form_by_tension(*self.model.geometry, self.spring_slopes[0], v, v)[:, 0, 0]

    def reserve_hessian(self) -> Array:
        """Return the second derivatives (C, C) [m/(N rad²)] of :attr:`reserve` by the tensions.

        Entry cd is 2 Σ_j (vᵀ ∂_c K_θ v_j)(v_jᵀ ∂_d K_θ v)/(λ − λ_j) + δ_cd k″_c (J_c·v)². v is the
        eigenvector of the smallest eigenvalue λ, v_j are the other eigenvectors. ∂_c is ∂/∂F_c, J_c
        the gradient of the length of cable c, k″_c the second derivative of its stiffness by F_c, δ
        the Kronecker symbol.
        """
        (_, J), v = self.model.geometry, np.ascontiguousarray(self.eigenvectors[:, :1])
        first, second = self.spring_slopes
        mixed = kernels.form_by_tension(*self.model.geometry, first, self.eigenvectors, v)[:, 1:, 0]
        distances = self.eigenvalues[1:] - self.eigenvalues[0]
        weights = -2.0 / np.maximum(distances, _NEAREST * self.model.scale)
        result: Array = (mixed * weights) @ mixed.T
        result[np.diag_indices(len(J))] += second * (J @ v)[:, 0] ** 2
        return result

    def backtracked(self, F: Array) -> Evaluation | None:
        """Return the first stable point on the line from F (C,) [N] to ``self.F``.

        The result is None if no stable point is found.
        """
        start = self.model.at(F)
        if start.reserve >= 0.0:
            return start

        def between(part: float) -> Evaluation:
            return self.model.at(F + part * (self.F - F))

        # a concave reserve is above its chord, so it is zero before its chord
        far = start.reserve / (start.reserve - self.reserve) if self.reserve > 0.0 else 1.0
        while between(far).reserve < 0.0:
            if far >= 1.0:
                return None
            far = min(2.0 * far, 1.0)
        part = brentq(lambda part: between(part).reserve, 0.0, far, xtol=1e-15, rtol=1e-13)
        # rounding may put the root on the unstable side
        ends = (between(min(part + back, 1.0)) for back in (0.0, 1e-14, 1e-12, 1e-10))
        return next((end for end in ends if end.reserve >= 0.0), None)


class Constraint(NamedTuple):
    """Data of n constraints on one tip stiffness X = (R K_θ⁻¹ Rᵀ)⁻¹ (r, r) [N/m].

    The value of constraint j is the weighted sum Σ_ab E_j,ab X_ab [-]. :class:`Constraints` has its
    target.
    """

    rows: Array  # R (r, nv) [m/rad]
    weights: Array  # E (n, r, r) [m/N]


@dataclass(frozen=True, eq=False)
class Constraints:
    """Constraints c(F) = 0: each c is a weighted sum of stiffnesses [-] minus its target."""

    parts: tuple[Constraint, ...]  # whose values are joined in this order
    targets: Array  # (n,) [-]
    single: tuple[Array, float] | None = None  # u (3,) and target [N/m] of one direction

    def at(self, evaluation: Evaluation) -> ConstraintValues:
        """Return the constraint values c at the tensions of ``evaluation``; it must be stable."""
        return ConstraintValues(self, evaluation)


class ConstraintValues:
    """Constraint values at stable tensions F, with their first and second derivatives.

    A value is a weighted sum of the entries of a tip stiffness X = (R K_θ⁻¹ Rᵀ)⁻¹, minus a target.
    R are rows of the tip Jacobian. M = K_θ⁻¹ Rᵀ X is the joint motion per motion of the tip, and
    P = K_θ⁻¹ − M R K_θ⁻¹ is the joint motion per torque with the tip fixed. With ∂_i = ∂/∂F_i,

        ∂_i X = Mᵀ ∂_i K_θ M,
        ∂_i ∂_j X = −Mᵀ (∂_i K_θ P ∂_j K_θ + ∂_j K_θ P ∂_i K_θ) M + δ_ij Mᵀ J_i k″_i J_iᵀ M.

    J_i is the gradient of the length of cable i, k″_i the second derivative of its stiffness by its
    tension, δ the Kronecker symbol. The formulas are those of a symmetric K_θ. If a moment acts on
    the tip, Mᵀ is replaced by (K_θ⁻ᵀ Rᵀ Xᵀ)ᵀ.

    ``values`` are the values c (n,) [-] of :class:`Constraints`.
    """

    def __init__(self, constraints: Constraints, evaluation: Evaluation) -> None:
        self.evaluation = evaluation
        self._parts = constraints.parts
        self._tips = [kernels.tip_stiffness(evaluation.K, part.rows) for part in self._parts]
        values = [
            part.weights.reshape(-1, X.size) @ X.ravel()
            for part, (X, *_) in zip(self._parts, self._tips, strict=True)
        ]
        self.values: Array = np.concatenate(values) - constraints.targets

    @cached_property
    def jacobian(self) -> Array:
        """Derivatives (n, C) [1/N] of the constraint values with respect to the tensions."""
        slopes = *self.evaluation.model.geometry, self.evaluation.spring_slopes[0]
        return np.concatenate(
            [
                kernels.constraint_jacobian(*slopes, part.weights, left, right)
                for part, (_, right, left, _) in zip(self._parts, self._tips, strict=True)
            ]
        )

    def hessian(self, y: Array) -> Array:
        """Return the Hessian (C, C) [1/N²] of Σ_j y_j c_j, the values c with weights ``y`` (n,)."""
        slopes = *self.evaluation.model.geometry, *self.evaluation.spring_slopes
        total, first = np.zeros((self.evaluation.F.size,) * 2), 0
        each = zip(self._parts, self._tips, strict=True)
        for (rows, weights), (X, right, left, inverse) in each:
            n = len(weights)
            Y = (y[first : first + n] @ weights.reshape(n, -1)).reshape(X.shape)
            total += kernels.constraint_hessian(*slopes, Y, inverse, rows, left, right)
            first += n
        return total
