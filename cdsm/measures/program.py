"""Linear programs over the cable tensions that balance an arm.

Forces x (k,) [N] act at the tip along the columns of U (3, k), besides the wrench W. The balance
(Eq. 13) is

    J_Lᵀ F − J_vᵀ U x = J_Xᵀ W − g,   minimum ≤ F ≤ maximum.

F and x are the variables. A simplex kernel solves most of the programs and proves the result; HiGHS
solves the others.
"""

from __future__ import annotations

import math
from typing import NamedTuple, Self

import numpy as np

from cdsm._former import tension as tension_kernels
from cdsm.errors import SolverError
from cdsm.measures.simplex import single_largest
from cdsm.posture import Posture
from cdsm.support.linear_program import INFEASIBLE, OPTIMAL, UNBOUNDED, least
from cdsm.support.values import Array


class Loads(NamedTuple):
    """Balance of an arm under loads x, in dimensionless form.

    The top of the module explains the symbols. The columns of ``A`` belong to the C tensions, then
    to the k loads.
    """

    A: Array  # [J_Lᵀ, −J_vᵀ U], scaled (nv, C+k)
    b: Array  # torque J_Xᵀ W − g, scaled (nv,)
    low: Array  # lower bounds of the tensions, scaled (C,)
    high: Array  # upper bounds of the tensions, scaled (C,)
    lever: Array  # scale of each column (C+k,)
    force: float  # unit of force [N]

    @classmethod
    def of(cls, pose: Posture, low: Array, high: Array, wrench: Array, directions: Array) -> Self:
        """Build the balance of a posture under ``wrench`` W (6,), for loads along U (3, k).

        ``directions`` is U; ``low`` and ``high`` (C,) [N] are the bounds of the tensions.
        """
        torque = pose.jacobian.T @ wrench - pose.gravity_torque
        motion = pose.jacobian[:3].T @ directions
        return cls.scaled(pose.length_jacobian, motion, torque, low, high, pose.arm.length)

    @classmethod
    def scaled(
        cls, J: Array, motion: Array, torque: Array, low: Array, high: Array, length: float
    ) -> Self:
        """Build the balance from arrays.

        J is J_L (C, nv), ``motion`` J_vᵀ U (nv, k), ``torque`` J_Xᵀ W − g (nv,) [N m]; ``low`` and
        ``high`` (C,) [N] are the bounds of the tensions, ``length`` is that of the arm [m].
        """
        A, b, low, high, arm, force = tension_kernels.scaled_balance(J, torque, low, high, length)
        columns = np.hstack([A, -motion / arm])
        # HiGHS drops entries below 1e-9, so each column is scaled by its own largest entry
        lever = abs(columns).max(axis=0)
        lever = np.where(lever > 0.0, lever, 1.0)
        return cls(columns / lever, b, low, high, lever, force)

    def largest(self, along: Array, *, positive: bool = False) -> tuple[float, Array] | None:
        """Maximise a·x over all loads x (k,) [N] that tensions balance; return a·x and x.

        a is ``along`` (k,). If ``positive``, only x ≥ 0 is allowed. If a·x is unbounded, the value
        is inf and x is NaN. Returns None if tensions balance no load. Raises SolverError if the
        solver stops for another reason.
        """
        count = self.low.size
        tensions, loads = self.lever[:count], self.lever[count:]
        low = np.append(self.low * tensions, np.full(along.size, 0.0 if positive else -math.inf))
        high = np.append(self.high * tensions, np.full(along.size, math.inf))
        cost = np.append(np.zeros(count), along / loads)
        cost /= float(abs(cost).max()) or 1.0
        best = np.empty_like(cost)
        if not single_largest(cost, self.A, self.b, low, high, best):
            found = least(-cost, A_eq=self.A, b_eq=self.b, bounds=np.column_stack([low, high]))
            if found.status == INFEASIBLE:
                return None
            if found.status == UNBOUNDED:
                return math.inf, np.full(along.size, math.nan)
            if found.status != OPTIMAL:
                raise SolverError("highs", f"finds no largest load: {found.message}")
            best = found.x
        x = best[count:] / loads * self.force
        return float(along @ x), x
