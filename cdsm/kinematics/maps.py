"""Inverse kinematics: joint angles from cable lengths, and joint angles from the tip.

Cable lengths from joint angles are computed by :meth:`~cdsm.Manipulator.cable_lengths`. A length
includes the lead, which is the straight cable between its actuator and the base disk.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from cdsm.errors import InvalidInput
from cdsm.kinematics.nearest import nearest
from cdsm.kinematics.residuals import LengthResidual, Residual, TipResidual
from cdsm.kinematics.solutions import JointSolution, KinematicSolution
from cdsm.manipulator import Manipulator
from cdsm.support.format import beyond as outside
from cdsm.support.validation import instance, number_array, scalar, vector
from cdsm.support.values import Array, frozen

_TOLERANCE = 1e-9
"""Default tolerance [-]: lengths and positions divided by the arm length, angles in rad."""

_SMALLEST_TOLERANCE = 1e-12
"""Smallest tolerance. Rounding of a chain of 40 joints is about 1e-14."""

_RIGID = 1e-9  # largest entry of RᵀR − 1 that counts as rounding


def solve_joint_angles(
    arm: Manipulator,
    cable_lengths: ArrayLike,
    guess: ArrayLike | None = None,
    *,
    tolerance: float = _TOLERANCE,
) -> JointSolution:
    """Find joint angles from cable lengths: min ‖L(θ) − L‖² within the joint limits (Eq. 5).

    If many postures have these lengths, the one with min ½‖θ − guess‖² is returned.

    Args:
        arm: The arm.
        cable_lengths: L (C,) [m], lead included, in the order of ``arm.cables``.
        guess: Start of the search (nv,) [rad], within the limits; the straight arm if not given.
        tolerance: Largest misfit ‖L(θ) − L‖/arm length [-] at which the lengths count as reachable.
            For measured lengths, give their error, since no exact fit exists.

    Returns:
        The solution. If the arm cannot have these lengths, ``reachable`` is false, and ``angles``
        and ``lengths`` have the least misfit found: no neighbouring posture, and no search from a
        dozen other starts, gives a smaller misfit.

    Raises:
        InvalidInput: ``cable_lengths`` or ``guess`` has a wrong shape or is not numbers, a length
            is not positive, the guess is beyond the limits, or ``tolerance`` is not from 1e-12 to
            below 1.
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
    found = _solve(LengthResidual(arm, wanted), guess, tolerance)
    lengths = arm.cable_lengths(found["angles"])
    return JointSolution(cable_lengths=wanted, lengths=lengths, **found)


def inverse_kinematics(
    arm: Manipulator,
    target: ArrayLike,
    guess: ArrayLike | None = None,
    *,
    tolerance: float = _TOLERANCE,
) -> KinematicSolution:
    """Find joint angles for a tip target: min ½‖θ − guess‖² with tip(θ) = target (Eq. 7).

    The angles are within the joint limits. A redundant arm has many solutions. The one that is
    returned is nearest to the guess, at least locally: except for joints at a limit, θ − guess has
    no component in the null space of the tip Jacobian.

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
            a rigid transform, the guess is beyond the limits, or ``tolerance`` is not from 1e-12 to
            below 1.
    """
    guess = _checked_guess(instance("arm", arm, Manipulator), guess)
    target = _checked_target(target)
    found = _solve(TipResidual(arm, target), guess, tolerance)
    tip = arm.at(found["angles"]).tip
    return KinematicSolution(target=target, tip=tip, **found)


def _solve(residual: Residual, guess: Array, tolerance: float) -> dict[str, Any]:
    """Find the angles nearest to ``guess`` (nv,) with ‖r‖ ≤ ``tolerance``, or else least ‖r‖.

    r is the ``residual``. Returns, by name, the fields that JointSolution and KinematicSolution
    have in common: ``arm``, ``guess``, ``angles``, ``tolerance``, ``iterations``.
    """
    tolerance = scalar("tolerance", tolerance)
    if not _SMALLEST_TOLERANCE <= tolerance < 1.0:
        raise InvalidInput(
            "tolerance",
            f"{tolerance:g} given; give a part of the arm's length from {_SMALLEST_TOLERANCE:g}, "
            "which rounding needs, to 1.",
        )
    angles, iterations = nearest(residual, guess, tolerance)
    return {
        "arm": residual.arm,
        "guess": guess,
        "angles": frozen(angles),
        "tolerance": tolerance,
        "iterations": iterations,
    }


def _checked_guess(arm: Manipulator, guess: ArrayLike | None) -> Array:
    if guess is None:
        return frozen(np.zeros(arm.nv))
    angles = vector("guess", guess, arm.nv, arm._meaning_of_q)
    beyond = arm._beyond_limits(angles)
    if beyond.any():
        i = int(beyond.argmax())
        limits = arm.lower[i], arm.upper[i], arm.joint_units[i]
        raise InvalidInput(
            "guess",
            f"{outside(arm.joint_names[i], angles[i], *limits)}; guess angles within the joint "
            "limits.",
        )
    return angles


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
            "target", "its upper left 3×3 block mirrors: its determinant is −1; reverse an axis."
        )
    return frozen(array)
