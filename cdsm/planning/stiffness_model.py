"""K_θ of one posture as a function of the tensions, with second derivatives of what it gives."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.optimize import brentq

from cdsm.kernels.stiffness import load_stiffness
from cdsm.planning import kernels
from cdsm.planning.admissible import Admissible
from cdsm.support.validation import SMALLEST, Array

_NEAREST = 1e-9
"""Eigenvalues nearer to each other than this part of the scale are taken to be so far apart."""


class Field:
    """K_θ(F) over the admissible tensions.

    Args:
        region: The admissible tensions.
        margin: From which part of :attr:`scale` on the smallest eigenvalue of K_θ counts as stable.

    Attributes:
        pose: The posture.
        scale: Largest eigenvalue of K_θ, by magnitude, under the least tensions [N m/rad].
        floor: Smallest eigenvalue of a K_θ that counts as stable [N m/rad].
        evaluations: How often K_θ was evaluated.
    """

    def __init__(self, region: Admissible, margin: float) -> None:
        self.pose = pose = region.least.posture
        self.evaluations = 0
        # products with the tensor, which is cached, beat going through the cables each time
        self.geometry = pose.length_hessian, pose.length_jacobian
        load = load_stiffness(pose.jacobian, region.least.wrench, pose.arm._model.masses.tip_joints)
        self.constant = pose.gravity_stiffness + load
        self._bounds = region.low, region.high
        self.scale = max(float(abs(self.at(region.least.values).values).max()), SMALLEST)
        self.floor = margin * self.scale

    def at(self, F: Array) -> Point:
        """K_θ under admissible tensions F (C,) [N]."""
        self.evaluations += 1
        # between two admissible places rounding can be off their bounds, and off a law's domain
        return Point(self, np.minimum(np.maximum(F, self._bounds[0]), self._bounds[1]))


class Point:
    """K_θ under some tensions.

    Attributes:
        field: Of which.
        F: Tensions (C,) [N].
        K: K_θ (nv, nv) [N m/rad].
        values: Eigenvalues of its symmetric part, rising (nv,) [N m/rad].
        vectors: Their eigenvectors, the columns of (nv, nv).
    """

    def __init__(self, field: Field, F: Array) -> None:
        pose = field.pose
        self.field = field
        self.F = F
        self._springs = pose.arm._model.laws.stiffness(pose.cable_lengths, F)
        self.K, self.values, self.vectors = kernels.stiffness_at(
            field.constant, *field.geometry, F, self._springs
        )

    @cached_property
    def slopes(self) -> tuple[Array, Array]:
        """dk/dF (C,) [1/m] and d²k/dF² (C,) [1/(N m)]."""
        return self.field.pose.arm._model.laws.slopes(self.F, self._springs)

    @property
    def reserve(self) -> float:
        """By how much λ_min is above the floor [N m/rad]; not negative: it counts as stable."""
        return float(self.values[0] - self.field.floor)

    def reserve_slope(self) -> Array:
        """Derivative of the reserve by the tensions (C,) [m/rad²]."""
        return self.along_slope(self.vectors[:, :1])

    def along_slope(self, v: Array) -> Array:
        """Derivative of vᵀ K_θ v by the tensions (C,) [m/rad²], v (nv, 1)."""
        v = np.ascontiguousarray(v)
        rates = kernels.by_tension(*self.field.geometry, self.slopes[0], v, v)
        return rates[:, 0, 0]

    def reserve_curvature(self) -> Array:
        """Second derivative of the reserve by the tensions (C, C) [m/(N rad²)].

        2 Σ_j (vᵀ ∂_c K_θ v_j)(v_jᵀ ∂_d K_θ v)/(λ − λ_j) + δ_cd vᵀ J_c k″_c J_cᵀ v, v of λ = λ_min.
        """
        J, v = self.field.pose.length_jacobian, np.ascontiguousarray(self.vectors[:, :1])
        first, second = self.slopes
        mixed = kernels.by_tension(*self.field.geometry, first, self.vectors, v)[:, 1:, 0]
        gaps = np.maximum(self.values[1:] - self.values[0], _NEAREST * self.field.scale)
        result: Array = (mixed * (-2.0 / gaps)) @ mixed.T
        result[np.diag_indices(len(J))] += second * (J @ v)[:, 0] ** 2
        return result


def drawn_back(field: Field, F: Array, anchor: Point) -> Point | None:
    """The first stable point from tensions F (C,) [N] on the way to stable ones, if it is found."""
    point = field.at(F)
    if point.reserve >= 0.0:
        return point

    def on_the_way(part: float) -> Point:
        return field.at(F + part * (anchor.F - F))

    # the reserve, if concave, is above its chord, and zero before that is
    far = point.reserve / (point.reserve - anchor.reserve) if anchor.reserve > 0.0 else 1.0
    while on_the_way(far).reserve < 0.0:
        if far >= 1.0:
            return None
        far = min(2.0 * far, 1.0)
    part = brentq(lambda part: on_the_way(part).reserve, 0.0, far, xtol=1e-15, rtol=1e-13)
    for back in (0.0, 1e-14, 1e-12, 1e-10):  # the root may lie on the wrong side by its rounding
        point = on_the_way(min(part + back, 1.0))
        if point.reserve >= 0.0:
            return point
    return None


@dataclass(frozen=True, eq=False)
class Part:
    """Numbers E_j : X [-] of one tip stiffness X = (R K_θ⁻¹ Rᵀ)⁻¹.

    Attributes:
        rows: R (r, nv) [m/rad].
        weights: E (n, r, r) [m/N].
    """

    rows: Array
    weights: Array


@dataclass(frozen=True, eq=False)
class Reading:
    """What is wanted of the tip stiffness, as numbers that are to be zero.

    Attributes:
        parts: Where the numbers come from.
        wanted: What is subtracted from them (n,) [-].
    """

    parts: tuple[Part, ...]
    wanted: Array

    def of(self, point: Point) -> Sight:
        """The reading at a stable point."""
        return Sight(self, point)


class Sight:
    """A reading at a stable point, with its first and second derivative by the tensions.

    With M = K_θ⁻¹ Rᵀ X the joint motion per motion of the tip, and P = K_θ⁻¹ − M R K_θ⁻¹ what moves
    while the tip is held,

        ∂X/∂F_c = Mᵀ ∂_c K_θ M,
        ∂²X/∂F_c∂F_d = −Mᵀ (∂_c K_θ P ∂_d K_θ + ∂_d K_θ P ∂_c K_θ) M + δ_cd Mᵀ J_c k″_c J_cᵀ M.

    Attributes:
        point: The point.
        values: The numbers (n,) [-].
    """

    def __init__(self, reading: Reading, point: Point) -> None:
        self.point = point
        self._seen = [_Seen(part, point) for part in reading.parts]
        self.values: Array = np.concatenate([seen.values for seen in self._seen]) - reading.wanted

    @cached_property
    def slopes(self) -> Array:
        """Derivative of the values by the tensions (n, C) [1/N]."""
        return np.concatenate([seen.slopes() for seen in self._seen])

    def curvature(self, y: Array) -> Array:
        """Second derivative of y · values by the tensions (C, C) [1/N²], y (n,)."""
        total, first = np.zeros((self.point.F.size,) * 2), 0
        for seen in self._seen:
            last = first + seen.values.size
            total += seen.curvature(y[first:last])
            first = last
        return total


class _Seen:
    """One part at a point."""

    def __init__(self, part: Part, point: Point) -> None:
        self.part = part
        self.point = point
        X, self.right, self.left, self.inverse = kernels.tip_stiffness(point.K, part.rows)
        self.values: Array = part.weights.reshape(-1, X.size) @ X.ravel()

    @cached_property
    def _pushed(self) -> Array:
        """∂K_θ M (C, nv, r)."""
        field = self.point.field
        return kernels.changed(*field.geometry, self.point.slopes[0], self.right)

    def slopes(self) -> Array:
        return kernels.readings_by_tension(self.part.weights, self.left, self._pushed)

    def curvature(self, y: Array) -> Array:
        point, weights = self.point, self.part.weights
        first, second = point.slopes
        return kernels.tip_curvature(
            (y @ weights.reshape(y.size, -1)).reshape(weights.shape[1:]),
            self.inverse,
            self.part.rows,
            self.left,
            self.right,
            kernels.changed(*point.field.geometry, first, self.left),
            self._pushed,
            point.field.pose.length_jacobian,
            second,
        )
