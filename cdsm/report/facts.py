"""Facts about a stiffness: ranks, balance, optimality, where cables stand, the three readings."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, final

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import null_space
from scipy.optimize import linprog, lsq_linear

from cdsm.cable import Cable, Control
from cdsm.errors import CdsmError, SingularStiffness
from cdsm.kernels import tension as tension_kernels
from cdsm.kernels.tension import DISTANCE
from cdsm.report.potential import evaluate_law, joint_unit
from cdsm.support.values import Array, ReadOnlyState, frozen
from cdsm.tension import Tension

if TYPE_CHECKING:
    from cdsm.stiffness_matrix import Stiffness


RANK = 1e-9
"""A singular value below this part of the largest counts as zero."""


@final
@dataclass(frozen=True, eq=False, kw_only=True)
class Rank(ReadOnlyState):
    """Rank and condition of a matrix.

    Lengths are taken in arm lengths, so that rows and columns compare.

    Attributes:
        rank: Singular values above :data:`RANK` of the largest.
        full: The smaller of its numbers of rows and columns.
        values: Singular values (n,) [-], the largest first.
    """

    rank: int
    full: int
    values: Array

    @classmethod
    def of(cls, matrix: Array) -> Rank:
        """That of a matrix whose entries are comparable."""
        values = np.linalg.svd(matrix, compute_uv=False)
        rank = int(np.count_nonzero(values > RANK * values[0]))
        return cls(rank=rank, full=values.size, values=frozen(values.astype(np.float64)))

    @property
    def condition(self) -> float:
        """Largest over smallest singular value [-]; inf where the rank is not full."""
        if self.rank < self.full:
            return math.inf
        return float(self.values[0] / self.values[-1])


@final
@dataclass(frozen=True, kw_only=True)
class CableState:
    """One cable: where it stands in its law.

    Attributes:
        name: Its name.
        control: ``"position"`` or ``"force"``.
        tension: F [N].
        stiffness: k as K_θ counts it [N/m].
        tangent: EA(F) [N]; None where the law has none, as for a motor that holds a force outside.
        secant: ΔF/(Δl/l_0) of Eq. 18 [N], or None.
        low: Low end of the law [N].
        high: Its high end [N], or inf.
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
        """How far F may fall before the law ends [N]; negative outside."""
        return self.tension - self.low

    @property
    def above(self) -> float:
        """How far F may rise before the law ends [N]; negative outside."""
        return self.high - self.tension

    @property
    def is_slack(self) -> bool:
        """Whether it pulls with nothing at all."""
        return self.tension == 0.0


@final
@dataclass(frozen=True, eq=False, kw_only=True)
class Readings(ReadOnlyState):
    """The three numbers behind "the stiffness in x", side by side.

    Attributes:
        along: 1/(uᵀ C_vv u) along x, y, z (3,) [N/m]: what a small hung weight measures.
        cartesian: Diagonal of (C_vv)⁻¹ (3,) [N/m]; NaN if it does not exist.
        pseudoinverse: Diagonal of J⁺ᵀ K J⁺ (3,) [N/m]; NaN if it does not exist.
    """

    along: Array
    cartesian: Array
    pseudoinverse: Array

    @property
    def spread(self) -> Array:
        """The largest of those that exist over the smallest (3,) [-], inf if the signs differ."""
        spread = np.ones(3)
        rows = np.array([self.along, self.cartesian, self.pseudoinverse])
        for i, column in enumerate(rows.T):
            known = column[np.isfinite(column)]
            if known.size:
                same = (known > 0.0).all() or (known < 0.0).all()
                spread[i] = abs(known).max() / abs(known).min() if same else np.inf
        return frozen(spread)


def jacobian_rank(K: Stiffness) -> Rank:
    """Rank of J_X (6, nv): how many of the six motions of the tip the joints make."""
    return Rank.of(_scaled_jacobian(K))


def translation_rank(K: Stiffness) -> Rank:
    """Rank of the linear rows of J_X (3, nv)."""
    return Rank.of(_scaled_jacobian(K)[:3])


def _scaled_jacobian(K: Stiffness) -> Array:
    arm = K.posture.arm
    rows = np.repeat([1.0 / arm.length, 1.0], 3)
    scaled: Array = K.posture.jacobian * rows[:, None] * joint_unit(arm)
    return scaled


def cable_rank(K: Stiffness) -> Rank:
    """Rank of J_Lᵀ (nv, C): how many of the joint torques the cables give."""
    return Rank.of(K.posture.length_jacobian.T * joint_unit(K.posture.arm)[:, None])


def closure(K: Stiffness) -> float:
    """How evenly tensions can grow without a torque: max min n/max n with J_Lᵀ n = 0, n ≥ 0 [-].

    Zero: they cannot, and there is no pretension in all cables.
    """
    A = (K.posture.length_jacobian * joint_unit(K.posture.arm)).T
    A = A / (abs(A).max() or 1.0)
    count = A.shape[1]
    found = linprog(  # variables n, then the smallest of them
        np.append(np.zeros(count), -1.0),
        A_ub=np.hstack([-np.eye(count), np.ones((count, 1))]),
        b_ub=np.zeros(count),
        A_eq=np.hstack([A, np.zeros((len(A), 1))]),
        b_eq=np.zeros(len(A)),
        bounds=(0.0, 1.0),
        method="highs",
    )
    value = float(found.x[-1]) if found.status == 0 else 0.0
    return value if value > RANK else 0.0


def imbalance(K: Stiffness) -> tuple[float, str, float]:
    """Largest residual of the statics [N m], its joint, and that over the torques it is a sum of.

    A joint that slides counts with the arm's length as lever.
    """
    arm, whole = K.posture.arm, torque_size(K)
    left = abs(K.residual * joint_unit(arm))
    worst = int(left.argmax())
    return float(left[worst]), arm.joint_names[worst], left[worst] / whole if whole > 0.0 else 0.0


def torque_size(K: Stiffness) -> float:
    """Largest of the sums of magnitudes that the statics cancel [N m]."""
    pose = K.posture
    parts = K.tension @ abs(pose.length_jacobian) + abs(K.wrench) @ abs(pose.jacobian)
    return float(((parts + abs(pose.gravity_torque)) * joint_unit(pose.arm)).max())


def cable_states(K: Stiffness) -> tuple[CableState, ...]:
    """Every cable, in the order of the arm."""
    pulled = zip(K.posture.arm.cables, K.tension.tolist(), K.cable_stiffness.tolist(), strict=True)
    return tuple(_state(cable, F, k) for cable, F, k in pulled)


def _state(cable: Cable, F: float, k: float) -> CableState:
    law = cable.elasticity
    return CableState(
        name=cable.name,
        control=cable.control,
        tension=F,
        stiffness=k,
        tangent=_number(cable, lambda: law.rigidity(np.array(F))),
        secant=_number(cable, lambda: law.secant_rigidity(np.array(F))),
        low=float(law.domain.low),
        high=float(law.domain.high),
    )


def _number(cable: Cable, answer: Callable[[], Array]) -> float | None:
    """What a law answers; None where it has no answer."""
    try:
        return float(evaluate_law(cable, answer))
    except CdsmError:
        return None


def readings(K: Stiffness) -> Readings:
    """The three stiffnesses along the base axes."""
    along = np.array([K.along(axis) for axis in np.eye(3)])

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


@final
@dataclass(frozen=True, kw_only=True)
class Optimality:
    """How well distributed tensions meet what they were distributed for.

    They balance the arm within their bounds, and are the least that do (Eq. 17) unless chosen for a
    stiffness.

    All dimensionless, relative to the largest tension and moment arm. The multipliers are found
    anew, whatever the solver said: by least squares, those of the bounds with the sign they need.

    Attributes:
        solver: Name of the solver.
        at_minimum: Names of the cables at their lower bound.
        at_maximum: Names of the cables at their upper bound.
        feasibility: Largest violation of balance and bounds [-].
        stationarity: Largest entry of F + J_L λ + μ, the KKT residual [-]; None if they are not
            meant to be the least.
    """

    solver: str
    at_minimum: tuple[str, ...]
    at_maximum: tuple[str, ...]
    feasibility: float
    stationarity: float | None

    @property
    def optimal(self) -> bool:
        """Whether both are within :data:`~cdsm.kernels.tension.DISTANCE`."""
        return max(self.feasibility, self.stationarity or 0.0) <= DISTANCE


def optimality(K: Stiffness, pull: Tension) -> Optimality:
    """The optimality conditions of tensions, evaluated anew."""
    pose = K.posture
    torque = pose.jacobian.T @ K.wrench - pose.gravity_torque
    problem = tension_kernels.Scaled(
        *tension_kernels.scaled_balance(
            pose.length_jacobian, torque, pull.minimum, pull.maximum, pose.arm.length
        )
    )
    x = K.tension / problem.force
    size = max(1.0, float(x.max()))
    at_low = x - problem.low <= DISTANCE * size
    at_high = problem.high - x <= DISTANCE * size
    z = _bound_multipliers(problem.A, x, at_low, at_high)
    y = np.asarray(np.linalg.lstsq(problem.A.T, -x - z, rcond=None)[0])
    primal, dual, _ = tension_kernels.optimality(*problem[:4], x, y, z)
    return Optimality(
        solver=pull.solver,
        at_minimum=pull.at_minimum,
        at_maximum=pull.at_maximum,
        feasibility=primal / size,
        stationarity=dual / size if pull.least else None,
    )


def _bound_multipliers(
    A: Array, x: Array, at_low: NDArray[np.bool_], at_high: NDArray[np.bool_]
) -> Array:
    """Bound multipliers z (C,) that come nearest to x + z = −Aᵀ y, of the sign they need.

    Negative or zero at a lower bound, positive or zero at an upper one.

    Whatever y is, it has no part in the null space of A.
    """
    null = null_space(A).T
    lows, highs = np.flatnonzero(at_low), np.flatnonzero(at_high)
    z = np.zeros(x.size)
    if null.size and lows.size + highs.size:
        columns = np.hstack([-null[:, lows], null[:, highs]])
        parts = lsq_linear(columns, -null @ x, bounds=(0.0, np.inf), method="bvls").x
        np.subtract.at(z, lows, parts[: lows.size])
        np.add.at(z, highs, parts[lows.size :])
    return z
