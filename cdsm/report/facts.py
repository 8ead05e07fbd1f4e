"""Compute numbers of the report: ranks, residual, state of each cable, tip stiffnesses."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, final

import numpy as np

from cdsm.cable import Control
from cdsm.errors import ElasticityRangeError, SingularStiffness
from cdsm.report.potential import joint_unit
from cdsm.stiffness_matrix.sticking import first_order_loads, holding, tension_gradient
from cdsm.support.values import Array, ReadOnlyState, frozen

if TYPE_CHECKING:
    from cdsm.stiffness_matrix import Stiffness


RANK = 1e-9
"""Singular values below this fraction of the largest one are taken as zero."""


@final
@dataclass(frozen=True, eq=False, kw_only=True)
class Rank(ReadOnlyState):
    """Rank and condition number of a matrix whose entries all have the same unit.

    Attributes:
        rank: Number of singular values above :data:`RANK` times the largest.
        full: Largest possible rank: the smaller of the numbers of rows and columns.
        values: Singular values (n,), in the unit of the entries, the largest first.
    """

    rank: int
    full: int
    values: Array

    @classmethod
    def of(cls, matrix: Array) -> Rank:
        """Compute the rank of a matrix whose entries all have the same unit."""
        values = np.linalg.svd(matrix, compute_uv=False)
        rank = int(np.count_nonzero(values > RANK * values[0]))
        return cls(rank=rank, full=values.size, values=frozen(values.astype(np.float64)))

    @property
    def condition(self) -> float:
        """Return the condition number of the matrix [-]; inf if its rank is not full."""
        if self.rank < self.full:
            return math.inf
        return float(self.values[0] / self.values[-1])


@final
@dataclass(frozen=True, kw_only=True)
class CableState:
    """Tension and stiffness of one cable, and the domain of its law.

    Attributes:
        name: Name of the cable.
        control: ``"position"`` or ``"force"``.
        tension: F [N].
        stiffness: k as used in K_θ [N/m].
        tangent: EA(F) [N]; None if F is outside the domain (possible under force control).
        secant: ΔF/(Δl/l_0) of Eq. 18 [N]; None if F is outside the domain.
        low: Lowest tension in the domain of the law [N].
        high: Highest tension in the domain of the law [N], or inf.
    """

    name: str
    control: Control
    tension: float
    stiffness: float
    tangent: float | None
    secant: float | None
    low: float
    high: float

    @property
    def below(self) -> float:
        """Return the tension minus ``low`` [N]; negative if it is below the domain of the law."""
        return self.tension - self.low

    @property
    def above(self) -> float:
        """Return ``high`` minus the tension [N]; negative if it is above the domain of the law."""
        return self.high - self.tension

    @property
    def is_slack(self) -> bool:
        """Return whether the tension is zero."""
        return self.tension == 0.0


@final
@dataclass(frozen=True, eq=False, kw_only=True)
class Readings(ReadOnlyState):
    """Three definitions of the tip stiffness along each base axis.

    Attributes:
        along: 1/(uᵀ C_vv u) along x, y, z (3,) [N/m]: the stiffness that a small weight measures.
        cartesian: Diagonal of (C_vv)⁻¹ (3,) [N/m]; NaN if it does not exist.
        pseudoinverse: Diagonal of J⁺ᵀ K J⁺ (3,) [N/m]; NaN if it does not exist.
    """

    along: Array
    cartesian: Array
    pseudoinverse: Array

    @property
    def spread(self) -> Array:
        """Return, per axis, the ratio of the largest to the smallest of the three (3,) [-].

        Infinite and missing stiffnesses are ignored. The ratio is inf if the signs differ.
        """
        spread = np.ones(3)
        rows = np.array([self.along, self.cartesian, self.pseudoinverse])
        for i, column in enumerate(rows.T):
            known = column[np.isfinite(column)]
            if known.size:
                same = (known > 0.0).all() or (known < 0.0).all()
                spread[i] = abs(known).max() / abs(known).min() if same else np.inf
        return frozen(spread)


def ranks(K: Stiffness) -> tuple[Rank, Rank, Rank]:
    """Compute the ranks of J_X (6, nv), of its linear rows (3, nv), and of J_Lᵀ (nv, C).

    First, rows and columns are scaled with the arm's length where units differ, so that all entries
    of J_X have no unit and all entries of J_Lᵀ have the unit m.
    """
    pose, unit = K.posture, joint_unit(K.posture.arm)
    rows = np.repeat([1.0 / pose.arm.length, 1.0], 3)
    tip = pose.jacobian * rows[:, None] * unit
    return Rank.of(tip), Rank.of(tip[:3]), Rank.of(pose.length_jacobian.T * unit[:, None])


def balance_error(K: Stiffness) -> tuple[float, str, float]:
    """Return the largest residual of Eq. 13 [N m], the name of its joint, and a relative residual.

    The latter is divided by :func:`torque_size` [-]. The force at a prismatic joint is multiplied
    by the arm's length.
    """
    arm, whole = K.posture.arm, torque_size(K)
    left = abs(K.residual * joint_unit(arm))
    worst = int(left.argmax())
    return float(left[worst]), arm.joint_names[worst], left[worst] / whole if whole > 0.0 else 0.0


def torque_size(K: Stiffness) -> float:
    """Return the largest entry of |J_L|ᵀ F + |J_X|ᵀ |W| + |g| [N m], the scale of residuals."""
    pose = K.posture
    parts = K.tension @ abs(pose.length_jacobian) + abs(K.wrench) @ abs(pose.jacobian)
    return float(((parts + abs(pose.gravity_torque)) * joint_unit(pose.arm)).max())


def cable_states(K: Stiffness) -> tuple[CableState, ...]:
    """Return the state of each cable, in the order of the arm."""
    states = []
    for cable, tension, k in zip(K.posture.arm.cables, K.tension, K.cable_stiffness, strict=True):
        law, F = cable.elasticity, np.array(tension)
        states.append(
            CableState(
                name=cable.name,
                control=cable.control,
                tension=float(F),
                stiffness=float(k),
                tangent=_number(law.rigidity, F),
                secant=_number(law.secant_rigidity, F),
                low=law.low,
                high=law.high,
            )
        )
    return tuple(states)


def _number(answer: Callable[[Array], Array], tension: Array) -> float | None:
    """Return what a method of a law gives at a tension; None outside the law."""
    try:
        return float(answer(tension))
    except ElasticityRangeError:
        return None


@final
@dataclass(frozen=True, eq=False, kw_only=True)
class Sticking(ReadOnlyState):
    """Tip stiffness of an arm under loads so small that friction holds all cables in their holes.

    Attributes:
        along: Stiffness along x, y, z while all cables stick (3,) [N/m]; inf if the tip cannot move
            along the axis.
        below: Loads along x, y, z (3,) [N] up to which all cables stick, to first order.
    """

    along: Array
    below: Array


def sticking(K: Stiffness, readings: Readings | None) -> Sticking | None:
    """Compute the tip stiffnesses while all cables stick in their holes.

    ``readings`` are the tip stiffnesses without friction. Returns None if ``readings`` is None, if
    no cable can stick, or if a tension is outside the domain of its law.
    """
    pose, sticks = K.posture, holding(K.posture)
    T, J = K.tension[pose.segments.chains.cable], pose.jacobian[:3]
    if readings is None or not sticks.any():
        return None
    try:
        gradient = tension_gradient(pose, T, np.zeros_like(sticks))
    except ElasticityRangeError:  # a motor holds a force outside the domain
        return None
    stuck = K.joint - K.passive + pose.segments.length_jacobian.T @ gradient
    motion = np.linalg.solve(stuck, J.T)
    compliance = np.einsum("ri,ir->r", J, motion)
    moves = np.isfinite(readings.along)
    along = np.divide(1.0, compliance, out=np.full(3, np.inf), where=moves)
    loads = [first_order_loads(pose, T, gradient, each).min() for each in motion.T]
    return Sticking(along=frozen(along), below=frozen(np.where(moves, loads, np.inf)))


def readings(K: Stiffness) -> Readings | None:
    """Compute ``along``, Cartesian and pseudoinverse stiffness; None if K_θ is singular."""
    try:
        along = np.array([K.along(axis) for axis in np.eye(3)])
    except SingularStiffness:
        return None

    def diagonal(read: Callable[[], Array]) -> Array:
        try:
            return frozen(np.diag(read()).copy())
        except SingularStiffness:
            return frozen(np.full(3, np.nan))

    return Readings(
        along=frozen(along),
        cartesian=diagonal(lambda: K.cartesian),
        pseudoinverse=diagonal(K.pseudoinverse),
    )
