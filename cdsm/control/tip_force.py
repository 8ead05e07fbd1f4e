"""Bounds of the force at the tip from the tensions at the motors, with friction and noise.

At a known posture the force f, and the tensions T of all segments, meet

    Σ_j T_j g_j + g − J_vᵀ f = 0,   exp(−μ φ) T_j ≤ T_{j+1} ≤ exp(μ φ) T_j,   |T_1 − F| ≤ error,

with the measured tension F of each cable and its largest error, the tension T_1 of the segment at
the motor, the gradient g_j of the length of segment j, the gravity torque g, the translational rows
J_v of the tip Jacobian, the friction coefficient μ and the wrap angle φ of each hole. These
conditions describe a polyhedron. The largest and the least force along a direction u in it are the
solutions of two linear programs. The multipliers of each give a bound by weak duality, which holds
even if the solver's answer is not exact.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import final

import numpy as np
from numpy.typing import ArrayLike

from cdsm.errors import InvalidInput, SolverError
from cdsm.posture import Posture
from cdsm.support.directions import Direction, unit_direction
from cdsm.support.format import coordinates, without_rounding
from cdsm.support.linear_program import INFEASIBLE, OPTIMAL, proved_largest
from cdsm.support.validation import instance, quantity, vector
from cdsm.support.values import Array, ReadOnlyState
from cdsm.tension import grip

_WIDEST = 1e6  # limit of T and f in the linear programs, over the largest tension

_ROUNDING = 1e-12
"""Reduced costs below this are rounding and taken as zero, since ``_WIDEST`` multiplies them."""


@final
@dataclass(frozen=True, eq=False, kw_only=True)
class TipForce(ReadOnlyState):
    """Bounds of the force at the tip along a direction; made by :func:`tip_force`.

    Attributes:
        posture: The posture.
        tension: Measured tensions at the motors F (C,) [N].
        error: Largest error of each tension [N].
        direction: Unit direction u (3,), base axes.
        low: Least force along u [N] that is possible with friction and errors.
        high: Largest force along u [N] that is possible with friction and errors.
    """

    posture: Posture
    tension: Array
    error: float
    direction: Array
    low: float
    high: float

    def __repr__(self) -> str:
        return f"<TipForce {self._ends}>"

    def __str__(self) -> str:
        return f"{self._ends}, whatever friction holds"

    @property
    def _ends(self) -> str:
        *_, low, high = without_rounding(np.array([*self.tension, self.low, self.high]))
        return f"{low:.4g} to {high:.4g} N along {coordinates(self.direction)}"


def tip_force(
    pose: Posture, tension: ArrayLike, direction: Direction, error: float = 0.0
) -> TipForce:
    """Bound the force at the tip along a direction from the tensions at the motors.

    The load must have no moment. The bounds hold for each state of the cables that friction admits,
    if ``pose`` has the true posture, friction and masses. Measure the posture by joint encoders or
    a camera. A posture that :func:`track` estimates proves nothing: friction changes the strain
    between the holes, which the motors do not measure. So ``estimated_force`` of
    :class:`TrackingRun` has no bounds.

    Args:
        pose: The true posture.
        tension: Measured F (C,) [N].
        direction: u (3,) in base axes, any length, or an axis such as ``"z"``.
        error: Largest error of each measured tension [N].

    Raises:
        InvalidInput: An argument is invalid; or no force at the tip balances these tensions, with
            any friction, so that posture, tensions or error are wrong.
        SolverError: The solver fails on a linear program.
    """
    segments = instance("pose", pose, Posture).segments
    chains, size = segments.chains, len(segments.lengths)
    F = vector("tension", tension, len(pose.arm.cables), "one tension [N] per cable", "tension")
    u = unit_direction("direction", direction)
    off = quantity("error", error, "tension", zero=True)
    scale = float(abs(F).max(initial=0.0)) or 1.0
    # variables: T (S,) and f (3,), over the largest tension
    A = np.hstack([segments.length_jacobian.T, -pose.jacobian[:3].T])
    unit = abs(A).max(axis=1, keepdims=True)
    A, b = A / unit, -pose.gravity_torque / unit[:, 0] / scale
    ratio = np.exp(segments.grip)
    cone = np.zeros((2 * len(ratio), size + 3))
    rows = np.arange(len(ratio))
    for side, (here, there) in enumerate(((0, 1), (1, 0))):
        cone[rows + side * len(ratio), chains.hole + there] = 1.0
        cone[rows + side * len(ratio), chains.hole + here] = -ratio
    low, high = np.zeros(size + 3), np.full(size + 3, _WIDEST)
    high[:size] = (np.exp(grip(pose)) * (F + off) / scale)[chains.cable]
    first = chains.start[:-1]
    low[first], high[first] = np.maximum(F - off, 0.0) / scale, np.maximum(F + off, 0.0) / scale
    low[size:] = -_WIDEST

    def largest(direction: Array) -> float:
        cost, none = np.append(np.zeros(size), direction), np.zeros(len(cone))
        found, bound = proved_largest(cost, cone, none, A, b, low, high, _ROUNDING)
        if found.status == INFEASIBLE:
            raise InvalidInput(
                "tension",
                "no force at the tip balances these tensions at this posture, whatever friction "
                "holds. The posture is wrong, or error= is too small.",
            )
        if found.status != OPTIMAL:
            raise SolverError("highs", f"bounds no force at the tip: {found.message}")
        return scale * bound

    ends = -largest(-u), largest(u)
    if not math.isfinite(ends[0] + ends[1]):
        raise SolverError("highs", "bounds no force at the tip")
    return TipForce(posture=pose, tension=F, error=off, direction=u, low=ends[0], high=ends[1])
