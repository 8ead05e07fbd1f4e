"""K_θ at one posture as a function of the cable tensions F, and searches among admissible F.

    K_θ(F) = Σ_c F_c H_c + J_Lᵀ diag(k(F)) J_L + const,      ∂K_θ/∂F_c = H_c + k′_c J_c J_cᵀ.

J_c is the gradient and H_c the Hessian of the length of cable c, k_c its stiffness, k′_c = dk_c/dF.
F is admissible if it balances the arm, J_Lᵀ F = J_Xᵀ W − g (Eq. 13), within the bounds and the
domains of the elasticities, and the arm is stable. Searches are scipy's SLSQP (Kraft, ACM TOMS 20,
1994) with exact gradients; its exit code is ignored, results are checked.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from functools import cached_property
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import brentq, minimize

from cdsm import readings
from cdsm.applied import required_torque
from cdsm.errors import ElasticityRangeError, InfeasibleTension, SingularStiffness
from cdsm.loads import LoadsLike, loads_of
from cdsm.motors import YIELDING_REMEDY, refuse_shared, refuse_yielding
from cdsm.posture import Posture
from cdsm.stiffness_matrix import Stiffness, stiffness
from cdsm.stiffness_matrix.verdict import describe_buckling
from cdsm.support.validation import SMALLEST, instance
from cdsm.support.values import Array, frozen, total
from cdsm.tension import (
    Tension,
    advice,
    bounds_at,
    distribute_tension,
    least_tension,
    too_few_cables,
)
from cdsm.tension.least_tensions import nearest_balanced
from cdsm.tension.solvers import nondimensional, without_warnings
from cdsm.terms import CABLE_TERMS

MARGIN: Final = 1e-2
"""An arm counts as stable down to this part of the smallest eigenvalue of K_θ at the anchor."""

LARGEST_TENSION: Final = 1e3
"""Largest tension of a search without an upper bound, over the largest of the least tensions."""

_REGULAR = 1e-3  # an arm is clearly stable from this part of its smallest diagonal entry on
_RANK_TOLERANCE = 1e-10  # singular values of J_Lᵀ below this part of the largest count as zero
_DIGITS = 6  # decimal places of tensions, over the largest of the least, in which corners differ

Function = Callable[[Array], tuple[Any, Array]]
"""Function of F (C,) that returns its value, () or (n,), and its gradient, (C,) or (n, C)."""

TensionLimits = tuple[Array, Array]
"""Lower and upper bounds of the tensions, (C,) [N] each."""


class StiffnessPoint(NamedTuple):
    """What follows from K_θ under given tensions F."""

    along: tuple[Array, Array]  # s = 1/(uᵀ C_vv u) (n,) [N/m] along n directions u, ∂s/∂F (n, C)
    smallest: tuple[float, Array]  # smallest eigenvalue λ of the symmetric part, ∂λ/∂F (C,)


class TensionSpace:
    """The admissible tensions at a posture, and what follows from K_θ under them.

    Attributes:
        pose: The posture.
        directions: n unit directions u (n, 3), base axes; the tip can move along each of them.
        least: The least tensions in balance (Eq. 17), within bounds and domains.
        bounds: Lower and upper bounds (C,) [N], within the domains; inf if there is none.
        capped: The same with finite upper bounds, for searches of the largest tensions.
        unit: Largest of the least tensions [N]; 1 N if all are zero.
    """

    def __init__(
        self,
        pose: Posture,
        directions: Array,
        minimum: ArrayLike,
        maximum: ArrayLike,
        wrench: LoadsLike,
    ) -> None:
        self.pose = instance("pose", pose, Posture)
        refuse_shared(pose.arm.motors, "plan")
        why = "yields, and plans know rigid motors only"
        refuse_yielding(pose.arm.motors, "plan", why, YIELDING_REMEDY)
        self.directions = directions.reshape(-1, 3)
        self.least = _least_tension_within_laws(pose, minimum, maximum, wrench)
        low = self.least.minimum_held
        high = self.least.maximum_held
        self.unit = float(self.least.values.max()) or 1.0
        self.bounds = low, high
        self.capped = low, np.minimum(high, LARGEST_TENSION * max(self.unit, float(low.max())))
        K = stiffness(pose, self.least)
        J = pose.length_jacobian
        for u in self.directions:
            K.require_mobile(u)
        self._size = max(float(K.magnitudes.diagonal().min()), SMALLEST)
        constant = [matrix for name, matrix in K.terms.items() if name not in CABLE_TERMS]
        self.constant_stiffness = total(constant)
        torque = required_torque(pose, self.least.applied)
        self._balance = nondimensional(J, torque, low, high, pose.arm.length)
        _, sizes, basis = np.linalg.svd(J.T)
        rank = int((sizes > _RANK_TOLERANCE * sizes.max(initial=0.0)).sum())
        self._rows = basis[:rank]
        self._free = basis[rank:]
        self._last: tuple[Array, StiffnessPoint] | None = None

    def at(self, F: Array) -> StiffnessPoint:
        """Evaluate K_θ under F (C,) [N], which rounding may have moved over the bounds."""
        F = np.clip(F, *self.bounds)
        if self._last and np.array_equal(F, self._last[0]):  # SLSQP asks for value, then gradient
            return self._last[1]
        pose = self.pose
        (K, k) = self._joint_stiffness(F)
        slope = pose.arm.laws.stiffness_slope(F, k)
        slack = readings.slack_cables(F, k)
        if slack.any():
            self._last = F, self._one_sided(K, k, slope, slack)
            return self._last[1]
        values, vectors = np.linalg.eigh((K + K.T) / 2.0)
        rows = self.directions @ pose.jacobian[:3]
        K = K + 1e-21 * self._size * np.eye(len(K))  # which cannot be singular
        right, left = (np.asarray(np.linalg.solve(A, rows.T), np.float64) for A in (K, K.T))
        s = 1.0 / (rows * right.T).sum(axis=1)
        left, right = (np.column_stack([s * M, vectors[:, 0]]) for M in (left, right))
        *slopes, softest = form_by_tension(pose, slope, left, right).diagonal(0, 1, 2).T
        self._last = F, StiffnessPoint((s, np.array(slopes)), (float(values[0]), softest))
        return self._last[1]

    def _one_sided(
        self, K: Array, k: Array, slope: Array, slack: NDArray[np.bool_]
    ) -> StiffnessPoint:
        """Evaluate K_θ (nv, nv) where some cables are at 0 N, and can only add tension.

        ``along`` and its gradient are those with the cables that pull under the force, see
        :func:`cdsm.readings.one_sided_along`; the smallest eigenvalue is that without any of them.
        """
        J = self.pose.length_jacobian
        rows = self.directions @ self.pose.jacobian[:3]
        K_0 = readings.remove_cables(K, J, np.where(slack, k, 0.0))
        values, vectors = np.linalg.eigh((K_0 + K_0.T) / 2.0)
        v = vectors[:, :1]
        softest = form_by_tension(self.pose, np.where(slack, 0.0, slope), v, v)[:, 0, 0]
        _, motion, buckles = readings.one_sided_along(
            K[None],
            abs(K)[None],
            J[None],
            np.where(slack, k, 0.0)[None],
            rows[None],
            np.ones((1, len(rows)), dtype=np.bool_),
        )
        along = np.empty(len(rows))
        slopes = np.empty((len(rows), slack.size))
        for i, torque in enumerate(rows):
            # where the arm is not stable, which the searches avoid, all cables count
            loose = slack & (not buckles[0]) & readings.loose_cables(J, slack, motion[0, i])
            taut = readings.remove_cables(K, J, np.where(loose, k, 0.0))
            right, left = (np.linalg.solve(A, torque[:, None]) for A in (taut, taut.T))
            along[i] = 1.0 / (torque @ right[:, 0])
            change = np.where(loose, 0.0, slope)
            form = form_by_tension(self.pose, change, along[i] * left, along[i] * right)
            slopes[i] = form[:, 0, 0]
        return StiffnessPoint((along, slopes), (float(values[0]), softest))

    def reserve(self, F: Array) -> float:
        """Return λ/floor − 1 [-] of the smallest eigenvalue λ under F (C,); stable: 0 or more."""
        F = np.clip(F, *self.bounds)
        (K, k) = self._joint_stiffness(F)
        slack = readings.slack_cables(F, k)
        if slack.any():
            K = readings.remove_cables(K, self.pose.length_jacobian, np.where(slack, k, 0.0))
        return float(np.linalg.eigvalsh((K + K.T) / 2.0)[0]) / self.floor - 1.0

    def _joint_stiffness(self, F: Array) -> tuple[Array, Array]:
        """Compute K_θ (nv, nv) and the cable stiffnesses (C,) [N/m] under F (C,) [N]."""
        pose = self.pose
        J = self.pose.length_jacobian
        k = pose.arm.laws.stiffness(pose.cable_lengths, F)
        return self.constant_stiffness + np.tensordot(F, pose.length_hessian, 1) + (J.T * k) @ J, k

    def nearest(self, F: Array, bounds: TensionLimits | None = None) -> Array | None:
        """Return the balanced tensions (C,) [N] nearest to F within the bounds, if any."""
        solution = nearest_balanced(self._balance, F, *(bounds or self.bounds))
        return solution.x if solution.ok else None

    def tension(self, F: Array) -> Tension:
        """Return F (C,) [N] as a :class:`Tension`."""
        return replace(self.least, values=frozen(F.copy()), least=False)

    def within(self, F: Array, change: Array) -> TensionLimits:
        """Return the bounds of tensions that differ from F by ``change`` at most, (C,) [N] each."""
        return np.maximum(self.bounds[0], F - change), np.minimum(self.bounds[1], F + change)

    def search(
        self,
        start: Array,
        objective: Function,
        *rules: tuple[str, Function],
        bounds: TensionLimits | None = None,
        stable: bool = True,
        precision: float = 1e-12,
        iterations: int = 100,
    ) -> Array | None:
        """Minimise ``objective`` from ``start`` (C,) [N] among the admissible tensions, locally.

        ``rules`` are more constraints: each "eq" or "ineq" (not negative), and a function. Return
        tensions (C,) [N] in balance within ``bounds``, or None if there are none. They may miss
        stability and ``rules``.
        """
        unit = self.unit
        limits = bounds or self.bounds
        if (limits[0] > limits[1]).any():
            return None

        def scaled(kind: str, function: Function) -> dict[str, Any]:
            return {
                "type": kind,
                "fun": lambda x: function(unit * x)[0],
                "jac": lambda x: unit * function(unit * x)[1],
            }

        def balance(F: Array) -> tuple[Array, Array]:
            return self._rows @ (F - self.least.values) / unit, self._rows / unit

        constraints = [*rules, *[("eq", balance)] * (len(self._rows) > 0)]
        if stable:
            stability = affine(lambda F: self.at(F).smallest, MARGIN / self.floor, -MARGIN)
            constraints.append(("ineq", stability))
        goal = scaled("", objective)
        with without_warnings():  # of iterates beyond the bounds
            result = minimize(
                goal["fun"],
                np.clip(start, *limits) / unit,
                jac=goal["jac"],
                method="SLSQP",
                bounds=np.transpose(limits) / unit,
                constraints=[scaled(*rule) for rule in constraints],
                options={"ftol": precision, "maxiter": iterations},
            )
        return self.nearest(np.clip(unit * result.x, *limits), limits)

    @cached_property
    def anchor(self) -> Array:
        """The least tensions (C,) [N] if the arm is clearly stable; else the most stable found.

        Raises SingularStiffness if the arm is stable under none.
        """

        def smallest(F: Array) -> float:
            return self.at(F).smallest[0]

        best = self.least.values
        if smallest(best) < _REGULAR * self._size:
            goal = affine(lambda F: self.at(F).smallest, -1.0 / self._size)
            points = [best, *self._corners(0)]
            starts = max(points, key=smallest), np.mean(points, axis=0)
            optima = [self.search(F, goal, bounds=self.capped, stable=False) for F in starts]
            best = max([*points, *(F for F in optima if F is not None)], key=smallest)
        if smallest(best) <= 0.0:
            K = stiffness(self.pose, best, self.least.applied)
            raise unstable(K, "admissible tensions", self.bounds)
        return best

    @cached_property
    def floor(self) -> float:
        """Smallest eigenvalue of K_θ with which the arm counts as stable [N m/rad]."""
        return MARGIN * self.at(self.anchor).smallest[0]

    def corner(self, way: Array) -> Array | None:
        """Return the balanced tensions (C,) [N] farthest in the direction ``way`` (C,), if any."""
        step = (self._free @ way) @ self._free
        far = (
            LARGEST_TENSION
            * self.capped[1].max()
            / max(float(np.linalg.norm(step)), SMALLEST)
            * step
        )
        return self.nearest(self.least.values + far, self.capped)

    def corners(self, random: int) -> list[Array]:
        """Return stable tensions (C,) [N] far apart: towards bounds, and in random directions."""
        return [self.pulled_back(F, 1e-3) for F in self._corners(random)]

    def _corners(self, random: int) -> Array:
        axes = np.eye(self.least.values.size)
        others = np.random.default_rng(0).normal(size=(random, len(axes)))
        ways = (*axes, *-axes, *others)
        balanced = [F for F in map(self.corner, ways) if F is not None]
        corners = np.array(balanced or [self.least.values])
        _, different = np.unique(np.round(corners / self.unit, _DIGITS), axis=0, return_index=True)
        return corners[np.sort(different)]

    def pulled_back(self, F: Array, precision: float = 1e-14) -> Array:
        """Return the stable tensions nearest to F (C,) [N] on the line from F to the anchor."""

        def moved(part: float) -> Array:
            return np.asarray(F + part * (self.anchor - F))

        if self.reserve(F) >= 0.0:
            return F
        part = brentq(lambda part: self.reserve(moved(part)), 0.0, 1.0, xtol=precision)
        while self.reserve(moved(part)) < 0.0:  # the root may lie on the other side
            part += precision
        return moved(part)


def affine(function: Function, factor: float, constant: float = 0.0) -> Function:
    """Return the function ``factor`` · ``function`` + ``constant``."""

    def scaled(F: Array) -> tuple[Any, Array]:
        value, gradient = function(F)
        return factor * value + constant, factor * gradient

    return scaled


def form_by_tension(
    pose: Posture, slope: Array, left: Array, right: Array, driven: Array | None = None
) -> Array:
    """Compute leftᵀ (∂K_θ/∂F_c) right (C, a, b) for ``left`` (nv, a) and ``right`` (nv, b).

    ``slope`` (C,) [1/m] are the derivatives of the cable stiffnesses with respect to the tensions.
    ``driven`` (C, nv) is in the place of J_L where motors yield.
    """
    H = pose.length_hessian
    J = pose.length_jacobian if driven is None else driven
    pairs = (left[:, None, :, None] * right[:, None]).reshape(H[0].size, -1)
    active = (H.reshape(len(H), -1) @ pairs).reshape(-1, left.shape[1], right.shape[1])
    passive = slope[:, None, None] * (J @ left)[:, :, None] * (J @ right)[:, None]
    return np.asarray(active + passive)


def unstable(K: Stiffness, tried: str, bounds: TensionLimits | None = None) -> SingularStiffness:
    """Return the error that none of the tensions ``tried`` make the arm stable; K is the best."""
    arm = K.posture.arm
    state = next(iter(K.verdict.warnings), describe_buckling(K))
    problem = f"no {tried} make the arm stable. At best: {state}. {too_few_cables(arm)}"
    if all(cable.control == "force" for cable in arm.cables):
        problem += (
            "All motors control force, so that no cable resists by its elasticity: have some "
        )
        problem += 'hold their length (control="position").'
    else:
        wider = advice(arm, K.tension, *bounds) if bounds else ""
        problem += f"Change the posture or the load, take stiffer cables{wider and f', {wider}'}."
    return SingularStiffness(problem, K.critical_direction)


def _least_tension_within_laws(
    pose: Posture, minimum: ArrayLike, maximum: ArrayLike, wrench: LoadsLike
) -> Tension:
    """Distribute the least tensions within the bounds and the domains of the laws.

    Raises InfeasibleTension if no tensions within the bounds balance the arm, ElasticityRangeError
    if none of those that do are within the domains.
    """
    bounds = bounds_at(pose, minimum, maximum, within_laws=True)
    load = loads_of(pose.arm, wrench)
    if (bounds.minimum_held <= bounds.maximum_held).all():
        with suppress(InfeasibleTension):
            return least_tension(pose, bounds, load)
    least = distribute_tension(pose, minimum, maximum, load)
    F = least.values
    outside = (bounds.minimum_held > F) | (bounds.maximum_held < F)
    if not outside.any():  # but for rounding, they are at an end of a domain
        return replace(least, **bounds._asdict())
    wider = advice(pose.arm, F, least.minimum_held, least.maximum_held, outside)
    places = np.flatnonzero(outside).tolist()
    cables = pose.arm.cables
    raise ElasticityRangeError(
        f"outside the domain {cables[places[0]].elasticity._span} of the elasticity, and no "
        "tensions within it and the bounds balance the arm. Take another elasticity, change the "
        f"posture or the load{wider and f', {wider}'}.",
        F[outside].tolist(),
        places,
        [cables[c].name for c in places],
    )
