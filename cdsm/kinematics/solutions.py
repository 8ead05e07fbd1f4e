"""Solutions of inverse kinematics.

All solutions are within the joint limits. If two holes of a cable coincide at a limit, because
disks touch there, the cable has no direction. The limit is then reduced by the factor 1 − 1e-5.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, final

import numpy as np

from cdsm.kinematics.residuals import LIMIT_MARGIN
from cdsm.manipulator import Manipulator
from cdsm.posture import Posture
from cdsm.rigid_body import rotation_vector
from cdsm.support.format import JointUnits, aligned, plain
from cdsm.support.values import Array, ReadOnlyState, frozen

if TYPE_CHECKING:
    from matplotlib.figure import Figure


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
        """Distance from the target [-]: lengths over the arm length, angles in rad."""

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
        names, at_limit = self.arm.joint_names, self.at_limit
        shown = JointUnits(self.arm.slides).shown
        rows = [
            (joint, f"{value / size:z.4f} {unit}", "at limit" if joint in at_limit else "")
            for joint, value, (unit, size) in zip(names, self.angles, shown, strict=True)
        ]
        return [*aligned([("joint", "angle", ""), *rows]), ""]

    def plot(self) -> Figure:
        """Plot the arm at ``angles``, in mm.

        Raises:
            CableError: Two neighbouring sites of a cable coincide at these angles.
        """
        return self.posture.plot()

    def __repr__(self) -> str:
        return f"<{type(self).__name__} of {self.arm.name}, {self._verdict}>"


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class JointSolution(_Solution):
    """Joint angles for given cable lengths; made by :func:`solve_joint_angles`.

    All arrays are read-only. The lengths count as reached if the norm of :attr:`residual`, divided
    by the arm length, is within the tolerance.

    Attributes:
        arm: The arm.
        cable_lengths: Wanted cable lengths (C,) [m], lead included.
        guess: Joint angles at which the search started (nv,) [rad].
        angles: Joint angles of the solution (nv,) [rad], within the limits.
        lengths: Cable lengths L (C,) [m] at ``angles``: the wanted ones, or the nearest found.
        tolerance: Largest misfit at which the lengths count as reached, in arm lengths [-].
        iterations: Number of evaluations of L.
    """

    cable_lengths: Array
    lengths: Array

    @cached_property
    def residual(self) -> Array:
        """Misfit of each cable (C,) [m]: ``lengths`` − ``cable_lengths``."""
        return frozen(self.lengths - self.cable_lengths)

    @property
    def _misfit(self) -> float:
        return float(np.linalg.norm(self.residual)) / self.arm.length

    def to_dict(self) -> dict[str, object]:
        """Return angles and cable lengths in SI for JSON, with units in the keys."""
        numbers = {
            "reachable": self.reachable,
            **JointUnits(self.arm.slides).to_dict(self.arm.joint_names, self.angles),
            "wanted_length_m": dict(zip(self._cables, self.cable_lengths, strict=True)),
            "cable_length_m": dict(zip(self._cables, self.lengths, strict=True)),
            "at_limit": self.at_limit,
            "iterations": self.iterations,
        }
        return plain(numbers)

    @property
    def _cables(self) -> tuple[str, ...]:
        return self.arm.cables.names

    @property
    def redundancy(self) -> int:
        """Number of independent joint motions that change no cable length: nv − rank J_L.

        If it is 0 and no limit is active, the angles are unique in a neighbourhood.
        """
        return self.arm.nv - int(np.linalg.matrix_rank(self.posture.length_jacobian))

    def __str__(self) -> str:
        numbers = 1e3 * np.column_stack([self.cable_lengths, self.lengths, self.residual])
        rows = aligned(
            [("cable", "wanted [mm]", "length [mm]", "off [mm]")]
            + [
                (name, f"{wanted:.3f}", f"{length:.3f}", f"{off:.1e}")
                for name, (wanted, length, off) in zip(self._cables, numbers, strict=True)
            ]
        )
        worst = int(abs(self.residual).argmax())
        verdict = (
            f"{self._verdict}: {self._cables[worst]} is off most, "
            f"by {1e3 * self.residual[worst]:+.2g} mm"
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
        tip: Pose of ``tool0`` (4, 4) at ``angles``, translation in m: the target, or the pose
            nearest to it.
        tolerance: Largest misfit at which the target counts as reached, in arm lengths and rad [-].
        iterations: Number of evaluations of the tip.
    """

    target: Array
    tip: Array

    def to_dict(self) -> dict[str, object]:
        """Return angles, tip and errors in SI for JSON, with units in the keys."""
        numbers = {
            "reachable": self.reachable,
            **JointUnits(self.arm.slides).to_dict(self.arm.joint_names, self.angles),
            "tip_position_m": self.tip[:3, 3],
            "tip_rotation": self.tip[:3, :3],
            "position_error_m": self.position_error,
            "orientation_error_rad": self.orientation_error,
            "at_limit": self.at_limit,
            "iterations": self.iterations,
        }
        return plain(numbers)

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
        verdict = f"{self._verdict}: the tip is {1e3 * self.position_error:.2g} mm"
        if self.target.ndim == 2:
            verdict += f" and {math.degrees(self.orientation_error):.2g}°"
        return "\n".join([*self._angle_rows(), f"{verdict} from its target"])
