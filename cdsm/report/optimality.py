"""Check for a report whether tensions are the least, with multipliers that no solver computed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, final

import numpy as np
from scipy.linalg import null_space
from scipy.optimize import lsq_linear

from cdsm.kernels import tension as tension_kernels
from cdsm.kernels.tension import DISTANCE
from cdsm.tension import Tension

if TYPE_CHECKING:
    from cdsm.stiffness_matrix import Stiffness


@final
@dataclass(frozen=True, kw_only=True)
class Optimality:
    """Optimality conditions of distributed tensions: balance, bounds and stationarity (Eq. 17).

    Violations are relative to the largest tension and the largest moment arm. The Lagrange
    multipliers do not come from the solver: this module computes them by least squares, with the
    required sign at the bounds.

    Attributes:
        solver: Name of the solver.
        at_minimum: Names of the cables at their lower bound.
        at_maximum: Names of the cables at their upper bound.
        feasibility: Largest violation of balance and bounds [-].
        stationarity: Largest entry of the KKT residual F + J_L λ + μ [-], with the multipliers λ of
            the balance and μ of the bounds; None if the tensions are those of a stiffness plan,
            which need not be the least.
    """

    solver: str
    at_minimum: tuple[str, ...]
    at_maximum: tuple[str, ...]
    feasibility: float
    stationarity: float | None

    @property
    def optimal(self) -> bool:
        """Return whether no violation exceeds :data:`~cdsm.kernels.tension.DISTANCE`, 1e-6."""
        return max(self.feasibility, self.stationarity or 0.0) <= DISTANCE


def optimality(K: Stiffness, tension: Tension) -> Optimality:
    """Evaluate the optimality conditions at the tensions of ``K``.

    ``tension`` is the distribution from which they come; it has their bounds and solver.
    """
    pose = K.posture
    torque = pose.jacobian.T @ K.wrench - pose.gravity_torque
    problem = tension_kernels.Scaled(
        *tension_kernels.scaled_balance(
            pose.length_jacobian, torque, tension.minimum, tension.maximum, pose.arm.length
        )
    )
    x = K.tension / problem.force
    size = max(1.0, float(x.max()))
    at_low = x - problem.low <= DISTANCE * size
    at_high = problem.high - x <= DISTANCE * size
    # multipliers z of the bounds, ≤ 0 at lower and ≥ 0 at upper ones, with x + z ≈ −Aᵀ y: least
    # squares in the null space of A, where Aᵀ y has no part
    null, bound = null_space(problem.A).T, np.flatnonzero(at_low | at_high)
    z = np.zeros(x.size)
    if null.size and bound.size:
        signs = np.where(at_low, -np.inf, 0.0)[bound], np.where(at_high, np.inf, 0.0)[bound]
        z[bound] = lsq_linear(null[:, bound], -null @ x, bounds=signs, method="bvls").x
    y = np.asarray(np.linalg.lstsq(problem.A.T, -x - z, rcond=None)[0])
    primal, dual, _ = tension_kernels.single_optimality(*problem[:4], x, y, z)
    return Optimality(
        solver=tension.solver,
        at_minimum=tension.at_minimum,
        at_maximum=tension.at_maximum,
        feasibility=primal / size,
        stationarity=dual / size if tension.least else None,
    )
