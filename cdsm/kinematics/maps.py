"""Kinematic maps: joint angles from cable lengths, and from where the tip is wanted.

The third, cable lengths from joint angles, is :meth:`~cdsm.Manipulator.cable_lengths`.

Both maps may have many solutions, one or none. Of many, the one nearest a guess is returned. If
there is none, the nearest that the arm can do is returned, and its ``reachable`` is false. All
solutions are within the joint limits. Where disks touch at a limit and their holes meet, they keep
1e-5 of the limit away from it, because a cable has no direction there.
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
"""Default tolerance: lengths and positions over the arm's length, and angles in rad."""

_SMALLEST_TOLERANCE = 1e-12
"""Of a chain of 40 joints, rounding takes some 1e-14."""

_RIGID = 1e-9
"""Largest entry of RᵀR − 1 that is rounding."""


@final
@dataclass(frozen=True, eq=False, kw_only=True)
class JointSolution(ReadOnlyState):
    """Joint angles that give an arm certain cable lengths; made by :func:`solve_joint_angles`.

    All arrays are read-only.

    Attributes:
        arm: The arm.
        cable_lengths: The lengths asked for (C,) [m], lead included.
        guess: Where they were searched from (nv,) [rad].
        angles: Joint angles (nv,) [rad], within the limits.
        lengths: L (C,) [m] at these angles: those asked for, or the nearest the arm can have.
        tolerance: Misfit up to which they count as reached, in arm lengths [-].
        iterations: How often L was evaluated.
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
        """Lengths at these angles less those asked for (C,) [m]."""
        return frozen(self.lengths - self.cable_lengths)

    @property
    def reachable(self) -> bool:
        """Whether the root of the summed squares of :attr:`residual` is within the tolerance."""
        misfit = float(np.linalg.norm(self.residual)) / self.arm.length
        return misfit <= self.tolerance

    @cached_property
    def posture(self) -> Posture:
        """The arm at these angles."""
        return self.arm.at(self.angles)

    @property
    def redundancy(self) -> int:
        """How many joint motions change no cable length, nv − rank J_L; 0: the angles are unique.

        Unique in a neighbourhood, and as far as no limit is active.
        """
        return self.arm.nv - int(np.linalg.matrix_rank(self.posture.length_jacobian))

    @property
    def at_limit(self) -> tuple[str, ...]:
        """Names of the joints that stand at a limit."""
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
        target: Where the tip is wanted: a position (3,) [m] or a pose (4, 4), translation in m.
        guess: The joint angles wanted near (nv,) [rad].
        angles: Joint angles (nv,) [rad], within the limits.
        tip: Pose of ``tool0`` (4, 4) at these angles, translation in m: the target, or the nearest
            to it that the arm can do.
        tolerance: Misfit up to which the target counts as reached, in arm lengths and rad [-].
        iterations: How often the tip was evaluated.
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
        """Angle between the tip and the target [rad]; 0 if only a position was asked for."""
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
        """The arm at these angles."""
        return self.arm.at(self.angles)

    @property
    def at_limit(self) -> tuple[str, ...]:
        """Names of the joints that stand at a limit."""
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
    """Joint angles from cable lengths: min ‖L(θ) − L‖² within the joint limits (Eq. 5).

    Where the cables leave joints undetermined, of all angles with these lengths those nearest the
    guess are taken: min ½‖θ − guess‖².

    Args:
        arm: The arm.
        cable_lengths: L (C,) [m], lead included, in the order of ``arm.cables``.
        guess: Where to search from (nv,) [rad], within the limits; the straight arm if not given.
        tolerance: Misfit √Σ(L(θ) − L)² over the arm's length [-] up to which the lengths are
            called reachable. Measured lengths are never met exactly: give their error.

    Returns:
        The angles. If the arm cannot have these lengths, ``reachable`` is false, and ``angles`` and
        ``lengths`` are the nearest it can have: no neighbouring posture, and none of those that a
        dozen other starts lead to, has a smaller misfit.

    Raises:
        InvalidInput: Wrong shape, not numbers, a length not positive, or a guess beyond the limits.
        CableError: The search met a posture at which two sites of a cable coincide.
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
    """Joint angles from the tip: min ½‖θ − guess‖² so that tip(θ) = target, in the limits (Eq. 7).

    Of the many ways a redundant arm can reach its target this is the nearest to the guess, at
    least in a neighbourhood: θ − guess has no part in the null space of the Jacobian, but for
    joints at a limit.

    Args:
        arm: The arm.
        target: Where ``tool0`` is wanted, base axes: a position (3,) [m], or a pose (4, 4) with
            translation in m, as ``pose.tip`` is.
        guess: The angles wanted near (nv,) [rad], within the limits; the straight arm if not given.
        tolerance: Misfit up to which the target is called reachable, see ``Returns`` [-].

    Returns:
        The angles. If the arm cannot reach the target, ``reachable`` is false, and ``angles`` and
        ``tip`` are the nearest it can do by √(position error²/arm length² + orientation error²):
        no neighbouring posture, and none of those that a dozen other starts lead to, has less.

    Raises:
        InvalidInput: Wrong shape, not numbers, not a rigid transform, or a guess beyond the limits.
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
    """A table of the joint angles, with a mark at those that stand at a limit."""
    at_limit = _at_limit(arm, angles)
    rows = [
        f"{joint:<12}{angle:>z14.6f}{'  at limit' if joint in at_limit else ''}"
        for joint, angle in zip(arm.joint_names, angles, strict=True)
    ]
    return [f"{'joint':<12}{'angle [rad]':>14}", *rows]
