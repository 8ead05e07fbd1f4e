"""The verdict on an arm: one word, and the sentences that qualify it.

Prints, warnings, JSON, exit codes and the live view read it, so none of them says *stable* of an
arm of which another says something else.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, NamedTuple, final

import numpy as np

from cdsm.errors import listed
from cdsm.posture import Posture
from cdsm.status import Status
from cdsm.support.values import Array
from cdsm.terms import ConstantPull, torque_size, without_cables

if TYPE_CHECKING:
    from cdsm.manipulator import Manipulator
    from cdsm.stiffness_matrix.value import Stiffness

TOLERANCE: Final = 1e-6
"""Largest residual of balance, KKT residual and error of a term, relative to what they are of."""

_ROUNDING = 1e-9  # a tension above its maximum by less than this part of it is at its maximum

_SEVERITY: Final = (
    Status.MOVED,
    Status.UNSTABLE,
    Status.UNSTABLE_TO_ONE_SIDE,
    Status.NEUTRAL,
    Status.AT_STOP,
    Status.UNBALANCED,
    Status.ABOVE_MAXIMUM,
    Status.SLACK,
    Status.OK,
)
_HELD: Final = (Status.OK, Status.SLACK)

Finding = tuple[Status, str]
"""Cause why an arm is not simply stable, and the sentence that says so; OK for a mere note."""


@final
@dataclass(frozen=True)
class Verdict:
    """What may be said of an arm with its tensions and load.

    Attributes:
        findings: The causes why the arm is not simply stable with a sentence each, the most severe
            first.
    """

    findings: tuple[Finding, ...] = ()

    @property
    def status(self) -> Status:
        """The most severe cause why the arm is not simply stable; OK if there is none."""
        return self.findings[0][0] if self.findings else Status.OK

    @property
    def warnings(self) -> tuple[str, ...]:
        """The sentences of all findings."""
        return tuple(sentence for _, sentence in self.findings)

    @property
    def heading(self) -> str:
        """The verdict in capitals: ``STABLE``, or ``NOT IN BALANCE``."""
        return "STABLE" if self.status is Status.OK else self.status.title

    @property
    def word(self) -> str:
        """The verdict as prints have it, such as ``stable``."""
        if self.status is Status.SLACK:
            return "stable even without the cables at 0 N"
        return "stable" if self.status is Status.OK else self.heading

    @property
    def is_held(self) -> bool:
        """Whether the arm is stable and in balance where it is; cables may be slack."""
        return self.status in _HELD

    def with_findings(self, findings: Iterable[Finding]) -> Verdict:
        """Return the verdict that knows more, such as that the arm buckled on the way."""
        return judge([*findings, *self.findings])


class Imbalance(NamedTuple):
    """Largest residual of the balance of an arm (Eq. 13)."""

    joint: int  # number of its joint
    torque: float  # its magnitude [N m], of a prismatic joint with the arm's length as lever
    relative: float  # the same per torque of cables, weight, springs and load [-]


def judge(findings: Iterable[Finding]) -> Verdict:
    """Return the verdict on an arm, given all causes why it is not simply stable."""
    return Verdict(tuple(sorted(findings, key=lambda finding: _SEVERITY.index(finding[0]))))


def judge_stiffness(K: Stiffness) -> Verdict:
    """Return the verdict on an arm of which K_θ, tensions and wrench are known."""
    imbalance = imbalance_of(K.posture, K.tension, K.wrench, K.residual)
    wrapping = K.posture.wrapping
    return judge(
        [
            *_instability(K),
            *((Status.OK, remark) for remark in (wrapping.remarks if wrapping else ())),
            *find_imbalance(K.posture.arm, imbalance, K.residual),
            *find_excess(K.posture.arm, K.tension),
        ]
    )


def imbalance_of(pose: Posture, tension: Array, wrench: Array, residual: Array) -> Imbalance:
    """Return the largest of the torques ``residual`` (nv,) that are missing for balance."""
    lever = pose.arm.levers
    missing = abs(residual * lever)
    joint = int(missing.argmax())
    terms = ConstantPull(tension), *without_cables(pose, wrench)
    size = sum(float((torque_size(term, pose) * lever).max()) for term in terms)
    return Imbalance(joint, float(missing[joint]), float(missing[joint]) / (size or 1.0))


def find_imbalance(arm: Manipulator, imbalance: Imbalance, residual: Array) -> Iterator[Finding]:
    """Yield which torque is missing at which joint, if the arm is not in balance."""
    if imbalance.relative > TOLERANCE:
        joint = imbalance.joint
        missing = f"{abs(residual[joint]):.3g} {arm.torque_unit(joint)}"
        sentence = f"not in balance: {missing} missing at {arm.joint_names[joint]}"
        yield Status.UNBALANCED, sentence


def find_excess(arm: Manipulator, tension: Array) -> Iterator[Finding]:
    """Yield which cables are above their own maximum, with their tensions."""
    maximum = np.array([cable.maximum for cable in arm.cables])
    above = np.flatnonzero(tension > (1.0 + _ROUNDING) * maximum).tolist()
    names = [
        f"{arm.cables[c].name} at {tension[c]:.4g} N (maximum {maximum[c]:g} N)" for c in above
    ]
    if names:
        yield Status.ABOVE_MAXIMUM, f"above the maximum of the cable: {listed(names, 3)}"


def describe_buckling(K: Stiffness) -> str:
    """Return a sentence about an unstable arm: which joint buckles most, and the margin."""
    return f"UNSTABLE: the arm buckles, {weakest_joint(K)} most; {_eigenvalue(K)}"


def weakest_joint(K: Stiffness) -> str:
    """Return the name of the joint that moves most in the motion that K_θ resists least."""
    arm = K.posture.arm
    motion = least_eigenpair(K.joint, arm)[1]
    return arm.joint_names[int(abs(motion).argmax())]


def least_joint_stiffness(K: Stiffness) -> str:
    """Return the smallest joint stiffness as text, in one unit, and the joint that it belongs to.

    Where joints turn and slide, a sliding one counts with the arm's length as lever.
    """
    arm = K.posture.arm
    value, motion = least_eigenpair(K.joint, arm)
    joint = arm.joint_names[int(abs(motion).argmax())]
    return f"{value:.4g} {eigenvalue_unit(arm)}, {joint} moves most{_lever_note(arm)}"


def eigenvalue_unit(arm: Manipulator) -> str:
    """Return the one unit of an eigenvalue of K_θ, see :func:`least_eigenpair`."""
    return "N/m" if arm.slides.all() else "N m/rad"


def least_eigenpair(K: Array, arm: Manipulator) -> tuple[float, Array]:
    """Compute the smallest eigenvalue of the symmetric part of K_θ, and its motion (nv,).

    Of an arm whose joints turn and slide, the way of a sliding joint counts per length of the arm,
    so that all entries have one unit.
    """
    symmetric = (K + K.T) / 2.0
    if arm.slides.any() and not arm.slides.all():
        symmetric = symmetric * arm.levers[:, None] * arm.levers
    values, vectors = np.linalg.eigh(symmetric)
    return float(values[0]), np.asarray(vectors[:, 0])


def _instability(K: Stiffness) -> Iterator[Finding]:
    """Yield that the arm is unstable, or is so without the cables at 0 N, or that there are any."""
    if not K.is_stable:
        yield Status.UNSTABLE, describe_buckling(K)
        return
    if not K.slack:
        return
    cables = f"{listed(K.slack, 4)} at 0 N"
    if K.friction != "frictionless":
        yield Status.SLACK, f"{cables} count as taut to both sides in all numbers of this K"
    elif K.margin_without_slack > 0.0:
        yield (
            Status.SLACK,
            f"{cables} only pull: along(u) holds for a force along +u, and prints show the softer "
            "of both sides; joint, compliance, cartesian, spatial, modes and is_stable count these "
            "cables as taut",
        )
    else:
        value, motion = least_eigenpair(K.without_slack, K.posture.arm)
        joint = K.posture.arm.joint_names[int(abs(motion).argmax())]
        yield (
            Status.UNSTABLE_TO_ONE_SIDE,
            f"UNSTABLE TO ONE SIDE: without {cables}, which only pull, nothing holds the arm, "
            f"{joint} least; the smallest eigenvalue of K_θ without them is {value:.4g} "
            f"{eigenvalue_unit(K.posture.arm)}",
        )


def _eigenvalue(K: Stiffness) -> str:
    arm = K.posture.arm
    value = f"{least_eigenpair(K.joint, arm)[0]:.4g} {eigenvalue_unit(arm)}"
    return f"the smallest eigenvalue of K_θ is {value}{_lever_note(arm)}"


def _lever_note(arm: Manipulator) -> str:
    if not arm.slides.any() or arm.slides.all():
        return ""
    return f" (sliding joints with the arm's length, {arm.length:.4g} m, as lever)"
