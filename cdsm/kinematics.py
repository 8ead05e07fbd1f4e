"""Inverse kinematics: joint angles from a tip target or from cable lengths, nearest to a guess.

With a dimensionless residual r(q), lengths over the arm's length and rotations in rad, solve

    min ½‖q − guess‖²   subject to   r(q) = 0   and   lower ≤ q ≤ upper,

or min ½‖r‖² if r = 0 is out of reach. Both are the limit ε → 0 of min ½‖r‖² + ½ε‖q − guess‖², a
least-squares problem of full rank (:mod:`cdsm.support.nearest`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import partial
from typing import Literal, final

import numpy as np
from numpy.typing import ArrayLike

from cdsm.errors import InvalidInput
from cdsm.manipulator import Manipulator
from cdsm.posture import Posture
from cdsm.rigid_body import rotation_vector
from cdsm.status import Status
from cdsm.support.format import aligned, beyond, place
from cdsm.support.nearest import at_limits, nearest, range_of
from cdsm.support.result import Result, quantity, unit
from cdsm.support.validation import fraction, instance, number_array, vector
from cdsm.support.values import Array, frozen

_Kind = Literal["position", "pose", "lengths"]
_Pair = tuple[Array, Array]

_TOUCHING = 5e-6  # part of a joint's range that is left out at both limits if disks touch there


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class KinematicSolution(Result):
    """Joint angles, found by :func:`inverse_kinematics` or :func:`solve_joint_angles`.

    Attributes:
        posture: The arm at the angles that were found.
        of: What ``target`` is: ``"position"``, ``"pose"`` or ``"lengths"``.
        target: Wanted position (3,) [m] or pose (4, 4) of the tip, or cable lengths (C,) [m].
        guess: Joint angles that the solution should be near (nv,) [rad].
        tolerance: Largest misfit of a reached target [-].
    """

    _headline = "misfit"

    posture: Posture
    of: _Kind = field(metadata=unit("1"))
    target: Array
    guess: Array = field(metadata=unit("joint", "joint"))
    tolerance: float = field(metadata=unit("1"))

    @property
    def angles(self) -> Array:
        """Joint angles (nv,) [rad], within the limits; [m] for prismatic joints."""
        return self.posture.q

    @quantity("1", "equation")
    def residual(self) -> Array:
        """Errors r [-] of the position (3,) or lengths (C,); for a pose, of rotation (3,) too."""
        return frozen(_residual(self.posture.arm, self.of, self.target, self.angles)[0])

    @quantity("1")
    def misfit(self) -> float:
        """Norm of the residual [-]."""
        return float(np.linalg.norm(self.residual))

    @quantity("1")
    def reachable(self) -> bool:
        """Whether the misfit is within the tolerance."""
        return self.misfit <= self.tolerance

    @quantity("m")
    def position_error(self) -> float:
        """Distance of the tip from its target [m]; NaN if cable lengths are the target."""
        missed = self.posture.arm.length * float(np.linalg.norm(self.residual[:3]))
        return math.nan if self.of == "lengths" else missed

    @quantity("rad")
    def orientation_error(self) -> float:
        """Angle between the tip and its target [rad]; NaN if the target is no pose."""
        return float(np.linalg.norm(self.residual[3:])) if self.of == "pose" else math.nan

    @quantity("m", "cable")
    def length_error(self) -> Array:
        """Cable lengths minus their targets (C,) [m]; NaN if the tip has the target."""
        lengths = self.posture.cable_lengths
        return frozen(lengths - (self.target if self.of == "lengths" else math.nan))

    @quantity("1", "limit")
    def at_limit(self) -> tuple[str, ...]:
        """Names of the joints at a limit."""
        arm = self.posture.arm
        q = self.angles
        at_lower, at_upper = at_limits(q, arm.lower, arm.upper, 2.0 * _TOUCHING)
        return tuple(arm.joint_names[i] for i in np.flatnonzero(at_lower | at_upper))

    def __str__(self) -> str:
        arm = self.posture.arm
        rows = [
            (name, place(q, unit), "at limit" if name in self.at_limit else "")
            for name, q, unit in zip(arm.joint_names, self.angles, arm.joint_units, strict=True)
        ]
        if self.of == "lengths":
            c = int(abs(self.length_error).argmax())
            problem = f"{arm.cables[c].name} is off most, by {1e3 * self.length_error[c]:+.2g} mm"
        else:
            problem = f"the tip is {1e3 * self.position_error:.2g} mm off its target"
            turned = math.degrees(self.orientation_error)
            problem += f" and turned by {turned:.2g}°" if self.of == "pose" else ""
        verdict = "reachable" if self.reachable else "NOT REACHABLE"
        return "\n".join([*aligned([("joint", "angle", ""), *rows]), "", f"{verdict}: {problem}"])


def inverse_kinematics(
    arm: Manipulator, target: ArrayLike, guess: ArrayLike | None = None, *, tolerance: float = 1e-8
) -> KinematicSolution:
    """Find joint angles for a tip target: `min ½‖θ − guess‖²` with `tip(θ) = target` (Eq. 7).

    Of many solutions, the one nearest to the guess is returned, at least locally. If there is none,
    ``reachable`` is false, and the misfit is the least of searches from a dozen other postures too.

    Args:
        arm: The arm.
        target: Position (3,) [m] of ``tool0``, or pose (4, 4) like ``pose.tip`` [m], base axes.
        guess: Joint angles (nv,) [rad], within the limits, that the solution is near; default 0.
        tolerance: Largest `√(e²/L² + φ²)` of a reached target, with its error of position
            e, that of orientation φ, and the length L of the arm.

    Raises:
        InvalidInput: The target is no position or rigid transform, the guess is not (nv,) numbers
            or beyond the limits, or the tolerance is not between 0 and 1.

    Example:
        >>> import cdsm
        >>> arm = cdsm.presets.virtual_prototype()
        >>> target = arm.at([0.1] * 10).tip[:3, 3]
        >>> found = cdsm.inverse_kinematics(arm, target)
        >>> found.reachable, f"{1e3 * found.position_error:.0e} mm"
        (True, '7e-14 mm')
    """
    wanted = frozen(number_array("target", target))
    if wanted.shape not in ((3,), (4, 4)):
        problem = f"shape {wanted.shape} given; give a position (3,) or a pose (4, 4) [m]."
        raise InvalidInput("target", problem)
    if wanted.ndim == 2:
        R = wanted[:3, :3]
        last = wanted[3].tolist()
        off = float(abs(R.T @ R - np.eye(3)).max())
        determinant = float(np.linalg.det(R))
        if off > 1e-9 or determinant < 0.0 or last != [0.0, 0.0, 0.0, 1.0]:
            problem = (
                f"is no rigid transform: RᵀR is off 1 by {off:.2g}, det R = {determinant:.4g}, the "
                f"last row {last}. Give 0 0 0 1 below a rotation; scipy.spatial.transform.Rotation."
                "from_matrix(R).as_matrix() is the nearest one to R."
            )
            raise InvalidInput("target", problem)
    return _solve(arm, "pose" if wanted.ndim == 2 else "position", wanted, guess, tolerance)


def solve_joint_angles(
    arm: Manipulator,
    cable_lengths: ArrayLike,
    guess: ArrayLike | None = None,
    *,
    tolerance: float = 1e-8,
) -> KinematicSolution:
    """Find joint angles from cable lengths: `min ‖L(θ) − L‖²` within the joint limits (Eq. 5).

    Args:
        arm: The arm.
        cable_lengths: L (C,) [m], lead included, in the order of ``arm.cables``.
        guess: As for :func:`inverse_kinematics`, with the same choice among many solutions.
        tolerance: Largest `‖L(θ) − L‖` of reached lengths, over the length of the arm; for
            measured ones, their error.

    Raises:
        InvalidInput: The lengths are not (C,) positive numbers; guess and tolerance as there. Two
            sites of a cable coincide at a posture of the search.

    Example:
        >>> import cdsm
        >>> arm = cdsm.presets.virtual_prototype()
        >>> lengths = arm.at([0.1] * 10).cable_lengths
        >>> cdsm.solve_joint_angles(arm, lengths).angles.round(6).tolist()
        [0.1, 0.1, 0.1, 0.1, 0.1, 0.1, 0.1, 0.1, 0.1, 0.1]
    """
    cables = instance("arm", arm, Manipulator).cables
    wanted = vector("cable_lengths", cable_lengths, len(cables), "one length [m] per cable")
    for c in np.flatnonzero(wanted <= 0.0).tolist():
        problem = f"{wanted[c]:g} m given for {cables[c].name}; a length with its lead is positive."
        raise InvalidInput("cable_lengths", problem)
    return _solve(arm, "lengths", wanted, guess, tolerance)


def _solve(
    arm: Manipulator, kind: _Kind, target: Array, guess: ArrayLike | None, tolerance: float
) -> KinematicSolution:
    near = frozen(np.zeros(instance("arm", arm, Manipulator).nv))
    if guess is not None:
        near = vector("guess", guess, arm.nv, arm.meaning_of_q)
        for i in np.flatnonzero(arm.beyond_limits(near)).tolist():
            limits = arm.lower[i], arm.upper[i], arm.joint_units[i]
            problem = beyond(arm.joint_names[i], near[i], *limits)
            raise InvalidInput("guess", f"{problem}; guess angles within the joint limits.")
    tolerance = fraction("tolerance", tolerance)
    search = partial(nearest, partial(_residual, arm, kind, target), near, tolerance)
    lower = arm.lower  # a joint may be locked
    upper = np.maximum(arm.upper, arm.lower + 1e-12)
    try:
        pose = arm.at(search(lower, upper))
    except InvalidInput as error:
        if error.status != Status.COINCIDENT_SITES:
            raise
        # disks touch at a limit, so a cable has no direction there
        margin = _TOUCHING * range_of(lower, upper)
        pose = arm.at(search(lower + margin, upper - margin))
    return KinematicSolution(posture=pose, of=kind, target=target, guess=near, tolerance=tolerance)


def _residual(arm: Manipulator, kind: _Kind, target: Array, q: Array) -> _Pair:
    """Compute r (m,) and ∂r/∂q (m, nv) at q (nv,)."""
    if kind == "lengths":
        pose = arm.at(q, check_limits=False)
        return (pose.cable_lengths - target) / arm.length, pose.length_jacobian / arm.length
    tip, jacobian = arm.body.tip(q)
    linear = jacobian[:3] / arm.length
    wanted = target if kind == "position" else target[:3, 3]
    offset = (tip[:3, 3] - wanted) / arm.length
    if kind == "position":
        return offset, linear
    turn, slope = rotation_vector(tip[:3, :3] @ target[:3, :3].T)
    return np.append(offset, turn), np.vstack([linear, slope @ jacobian[3:]])
