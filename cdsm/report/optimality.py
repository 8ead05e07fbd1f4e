"""Whether distributed tensions are the least: the optimality conditions, evaluated anew."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, final

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import null_space
from scipy.optimize import lsq_linear

from cdsm.kernels import tension as tension_kernels
from cdsm.kernels.tension import DISTANCE
from cdsm.support.validation import Array
from cdsm.tension import Tension

if TYPE_CHECKING:
    from cdsm.stiffness_matrix import Stiffness


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
