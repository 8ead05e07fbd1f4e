"""Solutions of inverse kinematics.

All solutions are within the joint limits. If disks touch at a limit and their holes coincide, a
cable has no direction. Solutions then stay away from the limit by 1e-5 of it.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property
from typing import final

import numpy as np

from cdsm.kinematics.residuals import LIMIT_MARGIN
from cdsm.manipulator import Manipulator
from cdsm.posture import Posture
from cdsm.rigid_body import rotation_vector
from cdsm.support.values import Array, ReadOnlyState, frozen


@dataclass(frozen=True, eq=False, kw_only=True)
class _Solution(ReadOnlyState, ABC):
    arm: Manipulator
    guess: Array
    angles: Array
    tolerance: float
    iterations: int

    @property
    @abstractmethod
    def _misfit(self) -> float:
        """Misfit in arm lengths and rad, to be compared with the tolerance."""

    @property
    def reachable(self) -> bool:
        """Whether the misfit is within the tolerance."""
        return self._misfit <= self.tolerance

    @cached_property
    def posture(self) -> Posture:
        """Posture of the arm at ``angles``."""
        return self.arm.at(self.angles)

    @property
    def at_limit(self) -> tuple[str, ...]:
        """Names of the joints at a limit."""
        inner = 1.0 - LIMIT_MARGIN
        tight = (self.angles <= inner * self.arm.lower) | (self.angles >= inner * self.arm.upper)
        return tuple(self.arm.joint_names[i] for i in np.flatnonzero(tight))

    @property
    def _verdict(self) -> str:
        return "reachable" if self.reachable else "NOT REACHABLE"

    def _angle_rows(self) -> list[str]:
        at_limit = self.at_limit
        return [
            f"{'joint':<12}{'angle [rad]':>14}",
            *(
                f"{joint:<12}{angle:>z14.6f}{'  at limit' if joint in at_limit else ''}"
                for joint, angle in zip(self.arm.joint_names, self.angles, strict=True)
            ),
            "",
        ]

    def __repr__(self) -> str:
        return f"<{type(self).__name__} of {self.arm.name}, {self._verdict}>"


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class JointSolution(_Solution):
    """Joint angles for given cable lengths; made by :func:`solve_joint_angles`.

    All arrays are read-only. The lengths count as reached if the norm of :attr:`residual` over the
    arm length is within the tolerance.

    Attributes:
        arm: The arm.
        cable_lengths: Wanted cable lengths (C,) [m], lead included.
        guess: Joint angles at which the search started (nv,) [rad].
        angles: Joint angles of the solution (nv,) [rad], within the limits.
        lengths: Cable lengths L (C,) [m] at ``angles``: the wanted lengths, or the nearest ones.
        tolerance: Largest misfit at which the lengths count as reached, in arm lengths [-].
        iterations: Number of evaluations of L.
    """

    cable_lengths: Array
    lengths: Array

    @cached_property
    def residual(self) -> Array:
        """Cable lengths at the solution less the wanted lengths (C,) [m]."""
        return frozen(self.lengths - self.cable_lengths)

    @property
    def _misfit(self) -> float:
        return float(np.linalg.norm(self.residual)) / self.arm.length

    @property
    def redundancy(self) -> int:
        """Number of joint motions that change no cable length: nv − rank J_L.

        If it is 0 and no limit is active, the angles are unique in a neighbourhood.
        """
        return self.arm.nv - int(np.linalg.matrix_rank(self.posture.length_jacobian))

    def __str__(self) -> str:
        rows = [f"{'cable':<12}{'wanted [m]':>14}{'length [m]':>14}{'off [m]':>12}"]
        rows += [
            f"{cable.name:<12}{wanted:>14.6f}{length:>14.6f}{off:>12.1e}"
            for cable, wanted, length, off in zip(
                self.arm.cables, self.cable_lengths, self.lengths, self.residual, strict=True
            )
        ]
        worst = int(abs(self.residual).argmax())
        verdict = (
            f"{self._verdict}: {self.arm.cables[worst].name} is off most, "
            f"by {self.residual[worst]:+.2g} m"
        )
        return "\n".join([*rows, "", *self._angle_rows(), verdict])


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class KinematicSolution(_Solution):
    """Joint angles that bring the tip to a target; made by :func:`inverse_kinematics`.

    All arrays are read-only and in base axes. The target counts as reached if
    √(position error²/arm length² + orientation error²) is within the tolerance.

    Attributes:
        arm: The arm.
        target: Wanted position (3,) [m] or pose (4, 4) of the tip, translation in m.
        guess: Joint angles that the solution should be near (nv,) [rad].
        angles: Joint angles of the solution (nv,) [rad], within the limits.
        tip: Pose of ``tool0`` (4, 4) at ``angles``, translation in m: the target or the nearest.
        tolerance: Largest misfit at which the target counts as reached, in arm lengths and rad [-].
        iterations: Number of evaluations of the tip.
    """

    target: Array
    tip: Array

    @property
    def position_error(self) -> float:
        """Distance from the tip to the target [m]."""
        wanted = self.target if self.target.ndim == 1 else self.target[:3, 3]
        return float(np.linalg.norm(self.tip[:3, 3] - wanted))

    @property
    def orientation_error(self) -> float:
        """Angle between tip and target orientation [rad]; 0 if the target is a position."""
        if self.target.ndim == 1:
            return 0.0
        return float(np.linalg.norm(rotation_vector(self.tip[:3, :3] @ self.target[:3, :3].T)[0]))

    @property
    def _misfit(self) -> float:
        return float(np.hypot(self.position_error / self.arm.length, self.orientation_error))

    def __str__(self) -> str:
        verdict = f"{self._verdict}: the tip is {self.position_error:.2g} m"
        if self.target.ndim == 2:
            verdict += f" and {self.orientation_error:.2g} rad"
        return "\n".join([*self._angle_rows(), f"{verdict} from its target"])
