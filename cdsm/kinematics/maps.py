"""Inverse kinematics: joint angles from cable lengths, and joint angles from the tip.

Cable lengths from joint angles are computed by :meth:`~cdsm.Manipulator.cable_lengths`. A length
includes the lead, which is the straight cable between its actuator and the base disk.

Each problem may have many solutions, one or none. From many solutions, the one nearest to a guess
is returned. If there is none, the arm's best approximation is returned with ``reachable`` false.
All solutions are within the joint limits. If disks touch at a limit and their holes coincide, a
cable has no direction. Solutions then stay away from the limit by 1e-5 of it.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import final

import numpy as np
from numpy.typing import ArrayLike

from cdsm.errors import InvalidInput
from cdsm.kinematics.nearest import InverseProblem, nearest
from cdsm.kinematics.residuals import LIMIT_MARGIN, LengthResidual, TipResidual, usable_limits
from cdsm.manipulator import Manipulator
from cdsm.posture import Posture
from cdsm.rigid_body import rotation_vector
from cdsm.support.validation import (
    Array,
    ReadOnlyState,
    frozen,
    instance,
    number_array,
    scalar,
    vector,
)

_TOLERANCE = 1e-9
"""Default tolerance: lengths and positions in arm lengths, and angles in rad."""

_SMALLEST_TOLERANCE = 1e-12
"""Smallest tolerance. Rounding of a chain of 40 joints is about 1e-14."""

_RIGID = 1e-9
"""Largest entry of RᵀR − 1 that counts as rounding."""


@final
@dataclass(frozen=True, eq=False, kw_only=True)
class JointSolution(ReadOnlyState):
    """Joint angles for given cable lengths; made by :func:`solve_joint_angles`.

    All arrays are read-only.

    Attributes:
        arm: The arm.
        cable_lengths: Wanted cable lengths (C,) [m], lead included.
        guess: Joint angles at which the search started (nv,) [rad].
        angles: Joint angles of the solution (nv,) [rad], within the limits.
        lengths: Cable lengths L (C,) [m] at ``angles``: the wanted lengths, or the nearest ones.
        tolerance: Largest misfit at which the lengths count as reached, in arm lengths [-].
        iterations: Number of evaluations of L.
    """

    arm: Manipulator
    cable_lengths: Array
    guess: Array
    angles: Array
    lengths: Array
    tolerance: float
    iterations: int

    @cached_property
    def residual(self) -> Array:
        """Cable lengths at the solution less the wanted lengths (C,) [m]."""
        return frozen(self.lengths - self.cable_lengths)

    @property
    def reachable(self) -> bool:
        """Whether the norm of :attr:`residual` over the arm length is within the tolerance."""
        misfit = float(np.linalg.norm(self.residual)) / self.arm.length
        return misfit <= self.tolerance

    @cached_property
    def posture(self) -> Posture:
        """Posture of the arm at ``angles``."""
        return self.arm.at(self.angles)

    @property
    def redundancy(self) -> int:
        """Number of joint motions that change no cable length: nv − rank J_L.

        If it is 0 and no limit is active, the angles are unique in a neighbourhood.
        """
        return self.arm.nv - int(np.linalg.matrix_rank(self.posture.length_jacobian))

    @property
    def at_limit(self) -> tuple[str, ...]:
        """Names of the joints at a limit."""
        return _at_limit(self.arm, self.angles)

    def __repr__(self) -> str:
        return f"<JointSolution of {self.arm.name}, {_verdict(self.reachable)}>"

    def __str__(self) -> str:
        rows = [f"{'cable':<12}{'wanted [m]':>14}{'length [m]':>14}{'off [m]':>12}"]
        rows += [
            f"{cable.name:<12}{wanted:>14.6f}{length:>14.6f}{off:>12.1e}"
            for cable, wanted, length, off in zip(
                self.arm.cables, self.cable_lengths, self.lengths, self.residual, strict=True
            )
        ]
        worst = int(abs(self.residual).argmax())
        verdict = f"{_verdict(self.reachable)}: {self.arm.cables[worst].name} is off most, "
        verdict += f"by {self.residual[worst]:+.2g} m"
        return "\n".join([*rows, "", *_angle_rows(self.arm, self.angles), "", verdict])


@final
@dataclass(frozen=True, eq=False, kw_only=True)
class KinematicSolution(ReadOnlyState):
    """Joint angles that bring the tip to a target; made by :func:`inverse_kinematics`.

    All arrays are read-only and in base axes.

    Attributes:
        arm: The arm.
        target: Wanted position (3,) [m] or pose (4, 4) of the tip, translation in m.
        guess: Joint angles that the solution should be near (nv,) [rad].
        angles: Joint angles of the solution (nv,) [rad], within the limits.
        tip: Pose of ``tool0`` (4, 4) at ``angles``, translation in m: the target or the nearest.
        tolerance: Largest misfit at which the target counts as reached, in arm lengths and rad [-].
        iterations: Number of evaluations of the tip.
    """

    arm: Manipulator
    target: Array
    guess: Array
    angles: Array
    tip: Array
    tolerance: float
    iterations: int

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
    def reachable(self) -> bool:
        """Whether √(position error²/arm length² + orientation error²) is within the tolerance."""
        distance = self.position_error / self.arm.length
        return float(np.hypot(distance, self.orientation_error)) <= self.tolerance

    @cached_property
    def posture(self) -> Posture:
        """Posture of the arm at ``angles``."""
        return self.arm.at(self.angles)

    @property
    def at_limit(self) -> tuple[str, ...]:
        """Names of the joints at a limit."""
        return _at_limit(self.arm, self.angles)

    def __repr__(self) -> str:
        return f"<KinematicSolution of {self.arm.name}, {_verdict(self.reachable)}>"

    def __str__(self) -> str:
        verdict = f"{_verdict(self.reachable)}: the tip is {self.position_error:.2g} m"
        if self.target.ndim == 2:
            verdict += f" and {self.orientation_error:.2g} rad"
        return "\n".join([*_angle_rows(self.arm, self.angles), "", f"{verdict} from its target"])


def solve_joint_angles(
    arm: Manipulator,
    cable_lengths: ArrayLike,
    guess: ArrayLike | None = None,
    *,
    tolerance: float = _TOLERANCE,
) -> JointSolution:
    """Find joint angles from cable lengths: min ‖L(θ) − L‖² within the joint limits (Eq. 5).

    If many angles give these lengths, those with min ½‖θ − guess‖² are returned.

    Args:
        arm: The arm.
        cable_lengths: L (C,) [m], lead included, in the order of ``arm.cables``.
        guess: Start of the search (nv,) [rad], within the limits; the straight arm if not given.
        tolerance: Largest misfit √Σ(L(θ) − L)² over the arm's length [-] at which the lengths count
            as reachable. For measured lengths, give their error: an exact fit does not exist.

    Returns:
        The solution. If the arm cannot have these lengths, ``reachable`` is false, and ``angles``
        and ``lengths`` have the least misfit found: no neighbouring posture, and no search from a
        dozen other starts, gives a smaller misfit.

    Raises:
        InvalidInput: ``cable_lengths`` or ``guess`` has a wrong shape or is not numbers, a length
            is not positive, the guess is beyond the limits, or ``tolerance`` is not in 1e-12 … 1.
        CableError: Two sites of a cable coincide at a posture of the search.
    """
    guess = _checked_guess(instance("arm", arm, Manipulator), guess)
    wanted = vector("cable_lengths", cable_lengths, len(arm.cables), "one length [m] per cable")
    if not (wanted > 0.0).all():
        c = int(wanted.argmin())
        raise InvalidInput(
            "cable_lengths",
            f"{wanted[c]:g} m given for {arm.cables[c].name}; a length is positive, and includes "
            "the lead.",
        )
    tolerance = _checked_tolerance(tolerance)
    solution = nearest(
        InverseProblem(LengthResidual(arm, wanted), *usable_limits(arm), guess), tolerance
    )
    return JointSolution(
        arm=arm,
        cable_lengths=wanted,
        guess=guess,
        angles=frozen(solution.angles),
        lengths=arm.cable_lengths(solution.angles),
        tolerance=tolerance,
        iterations=solution.iterations,
    )


def inverse_kinematics(
    arm: Manipulator,
    target: ArrayLike,
    guess: ArrayLike | None = None,
    *,
    tolerance: float = _TOLERANCE,
) -> KinematicSolution:
    """Find joint angles for a tip target: min ½‖θ − guess‖² so that tip(θ) = target (Eq. 7).

    The angles are within the joint limits. A redundant arm reaches its target in many ways. This
    solution is the nearest to the guess, at least in a neighbourhood: except for joints at a limit,
    θ − guess has no component in the null space of the tip Jacobian.

    Args:
        arm: The arm.
        target: Position (3,) [m] of ``tool0`` or pose (4, 4) like ``pose.tip`` [m], base axes.
        guess: Joint angles that the solution should be near (nv,) [rad], within the limits; the
            straight arm if not given.
        tolerance: Largest misfit at which the target counts as reachable, see ``Returns`` [-].

    Returns:
        The solution. The misfit is √(position error²/arm length² + orientation error²). If the arm
        cannot reach the target, ``reachable`` is false, and ``angles`` and ``tip`` have the least
        misfit found: no neighbouring posture, and no search from a dozen other starts, has less.

    Raises:
        InvalidInput: ``target`` or ``guess`` has a wrong shape or is not numbers, the target is not
            a rigid transform, the guess is beyond the limits, or ``tolerance`` is not in 1e-12 … 1.
    """
    guess = _checked_guess(instance("arm", arm, Manipulator), guess)
    target = _checked_target(target)
    tolerance = _checked_tolerance(tolerance)
    solution = nearest(
        InverseProblem(TipResidual(arm, target), *usable_limits(arm), guess), tolerance
    )
    return KinematicSolution(
        arm=arm,
        target=target,
        guess=guess,
        angles=frozen(solution.angles),
        tip=frozen(arm._model.body.state(solution.angles).tip),
        tolerance=tolerance,
        iterations=solution.iterations,
    )


def _checked_guess(arm: Manipulator, guess: ArrayLike | None) -> Array:
    if guess is None:
        return frozen(np.zeros(arm.nv))
    angles = vector("guess", guess, arm.nv, arm._meaning_of_q)
    beyond = arm._model.beyond_limits(angles)
    if beyond.any():
        i = int(beyond.argmax())
        raise InvalidInput(
            "guess",
            f"{arm.joint_names[i]} = {angles[i]:.6g} rad is outside [{arm.lower[i]:.6g}, "
            f"{arm.upper[i]:.6g}] rad; guess angles within the joint limits.",
        )
    return angles


def _checked_tolerance(tolerance: float) -> float:
    checked = scalar("tolerance", tolerance)
    if not _SMALLEST_TOLERANCE <= checked < 1.0:
        raise InvalidInput(
            "tolerance",
            f"{checked:g} given; give a part of the arm's length from {_SMALLEST_TOLERANCE:g}, "
            "which rounding needs, to 1.",
        )
    return checked


def _checked_target(target: ArrayLike) -> Array:
    array = number_array("target", target)
    if array.shape == (3,):
        return frozen(array)
    if array.shape != (4, 4):
        raise InvalidInput(
            "target",
            f"shape {array.shape} given; give a position (3,) [m], or a pose (4, 4) with "
            "translation in m.",
        )
    if not np.array_equal(array[3], (0.0, 0.0, 0.0, 1.0)):
        raise InvalidInput("target", f"last row {array[3].tolist()} given; it must be 0 0 0 1.")
    R = array[:3, :3]
    off = float(abs(R.T @ R - np.eye(3)).max())
    if off > _RIGID:
        raise InvalidInput(
            "target",
            f"its upper left 3×3 block R is no rotation: RᵀR is off the identity by {off:.2g}. "
            "scipy.spatial.transform.Rotation.from_matrix(R).as_matrix() gives the nearest one.",
        )
    if np.linalg.det(R) < 0.0:
        raise InvalidInput(
            "target", "its upper left 3×3 block mirrors: its determinant is −1; turn an axis round."
        )
    return frozen(array)


def _at_limit(arm: Manipulator, angles: Array) -> tuple[str, ...]:
    tight = (angles <= (1.0 - LIMIT_MARGIN) * arm.lower) | (
        angles >= (1.0 - LIMIT_MARGIN) * arm.upper
    )
    return tuple(arm.joint_names[i] for i in np.flatnonzero(tight))


def _verdict(reachable: bool) -> str:
    return "reachable" if reachable else "NOT REACHABLE"


def _angle_rows(arm: Manipulator, angles: Array) -> list[str]:
    at_limit = _at_limit(arm, angles)
    rows = [
        f"{joint:<12}{angle:>z14.6f}{'  at limit' if joint in at_limit else ''}"
        for joint, angle in zip(arm.joint_names, angles, strict=True)
    ]
    return [f"{'joint':<12}{'angle [rad]':>14}", *rows]
