"""The verdict on an arm: one word, and the sentences that qualify it.

Prints, warnings, JSON, exit codes and the live view read it, so none of them says *stable* of an
arm of which another says something else.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, NamedTuple, final

import numpy as np

from cdsm import readings
from cdsm.applied import Applied, without_cables
from cdsm.errors import listed
from cdsm.posture import Posture
from cdsm.status import Status
from cdsm.support.format import plural
from cdsm.support.values import Array
from cdsm.terms import ConstantPull, torque_size

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
    Status.SELF_CONTACT,
    Status.SLACK,
    Status.OK,
)
_HELD: Final = (Status.OK, Status.SELF_CONTACT, Status.SLACK)
_LOOSE: Final = (Status.UNSTABLE, Status.UNSTABLE_TO_ONE_SIDE, Status.NEUTRAL)
MOST_JOINTS: Final = 6
"""Most joints at stops that a text lists; more are counted."""

_NAMED = 2  # most cables or joints in a label


class Finding(NamedTuple):
    """Cause why an arm is not simply stable, and the words that say so; OK for a mere note."""

    status: Status
    sentence: str
    label: str = ""  # a few words for a heading; empty: the title of the status


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
        return tuple(finding.sentence for finding in self.findings)

    @property
    def heading(self) -> str:
        """All findings in a few words: ``STABLE``, or ``BUCKLED at 12.3 N; joint1 on its stop``."""
        found = [finding for finding in self.findings if finding.status is not Status.OK]
        labels = [finding.label or finding.status.title for finding in found]
        return "; ".join(["STABLE", *labels] if self.is_held else labels)

    @property
    def word(self) -> str:
        """The verdict as prints have it, such as ``stable``."""
        if not self.is_held:
            return self.status.title
        slack = any(finding.status is Status.SLACK for finding in self.findings)
        return "stable even without the cables at 0 N" if slack else "stable"

    @property
    def is_held(self) -> bool:
        """Whether the arm is stable and in balance where it is; cables may be slack."""
        return self.status in _HELD

    @property
    def is_firm(self) -> bool:
        """Whether every motion of the joints off their stops is resisted where the arm is."""
        return not any(finding.status in _LOOSE for finding in self.findings)

    def with_findings(self, findings: Iterable[Finding]) -> Verdict:
        """Return the verdict that knows more; a new finding stands for all of the same cause."""
        news = tuple(findings)
        causes = {finding.status for finding in news}
        return judge([*news, *(old for old in self.findings if old.status not in causes)])


class Imbalance(NamedTuple):
    """Largest residual of the balance of an arm (Eq. 13)."""

    joint: int  # number of its joint
    torque: float  # its magnitude [N m], of a prismatic joint with the arm's length as lever
    relative: float  # the same per torque of cables, weight, springs and load [-]


def judge(findings: Iterable[Finding]) -> Verdict:
    """Return the verdict on an arm, given all causes why it is not simply stable."""
    return Verdict(tuple(sorted(findings, key=lambda finding: _SEVERITY.index(finding.status))))


def judge_stiffness(K: Stiffness) -> Verdict:
    """Return the verdict on an arm of which K_θ, tensions and wrench are known."""
    imbalance = imbalance_of(K.posture, K.tension, K.applied, K.residual)
    return judge(
        [
            *_instability(K),
            *find_doubts(K.posture),
            *find_imbalance(K.posture.arm, imbalance, K.residual),
            *find_excess(K.posture.arm, K.tension),
            *map(_note, () if K.distribution is None else K.distribution.warnings),
        ]
    )


def _note(sentence: str) -> Finding:
    return Finding(Status.OK, sentence)


def imbalance_of(pose: Posture, tension: Array, wrench: Applied, residual: Array) -> Imbalance:
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
        yield Finding(Status.UNBALANCED, sentence)


def find_excess(arm: Manipulator, tension: Array, maximum: float = math.inf) -> Iterator[Finding]:
    """Yield which cables are above their own maximum, or above ``maximum`` [N] of all cables."""
    most = np.minimum([cable.maximum for cable in arm.cables], maximum)
    above = np.flatnonzero(tension > (1.0 + _ROUNDING) * most).tolist()
    names = [arm.cables[c].name for c in above]
    sizes = [f"{arm.cables[c].name} at {tension[c]:.4g} N (maximum {most[c]:g} N)" for c in above]
    if names:
        sentence = f"above the maximum of the cable: {listed(sizes, 3)}"
        label = f"{listed(names, _NAMED)} above the maximum"
        yield Finding(Status.ABOVE_MAXIMUM, sentence, label)


def find_stops(arm: Manipulator, joints: Sequence[str]) -> Iterator[Finding]:
    """Yield which ``joints`` of the arm rest on their stops; their number, if they are many."""
    if not joints:
        return
    bends = [name for name in arm.joint_names if "_bend" in name]  # of a backbone, which may twist
    of_bends = set(joints) <= set(bends)
    every = plural(len(bends), "bend") if of_bends else plural(arm.nv, "joint")
    if len(joints) <= MOST_JOINTS:
        label = f"rests on the stop of {listed(joints, _NAMED)}"
        verb = "rests on its stop" if len(joints) == 1 else "rest on their stops"
        sentence = f"{listed(joints, MOST_JOINTS)} {verb}"
    elif len(joints) < (len(bends) if of_bends else arm.nv):
        sentence = label = f"{len(joints)} of {every} rest on their stops"
    else:
        sentence = label = f"all {every} are at their stops"
    yield Finding(Status.AT_STOP, sentence, label)


def find_slack(cables: Sequence[str]) -> Iterator[Finding]:
    """Yield which cables are slack."""
    if cables:
        yield Finding(Status.SLACK, f"slack: {listed(cables)}", f"{listed(cables, _NAMED)} slack")


def find_doubts(pose: Posture) -> Iterator[Finding]:
    """Yield that the arm passes through itself, and what else is doubtful of the posture."""
    notes = pose.notes
    for remark in pose.remarks:
        if remark in notes:
            yield Finding(Status.OK, remark)
        else:
            yield Finding(Status.SELF_CONTACT, remark, "the arm passes through itself")


def find_skewness(K: Array, arm: Manipulator) -> Iterator[Finding]:
    """Yield that a stable arm whose cables slide has a `K_θ` whose symmetric part is not positive.

    Of the joints off their stops it is K (n, n).
    """
    work = float(readings.margin(K)) if K.size else 1.0
    if work <= 0.0:
        least = readings.least_real_part(K)[0]
        unit = eigenvalue_unit(arm)
        yield Finding(
            Status.OK,
            f"cables slide, so K_θ is not symmetric: all its eigenvalues are positive, {least:.4g} "
            f"{unit} and more, so the arm follows slow loads, though its symmetric part has the "
            f"eigenvalue {work:.4g} {unit}; inertia is left out",
        )


def describe_buckling(K: Stiffness) -> str:
    """Return a sentence about an unstable arm: which joint buckles most, and the margin."""
    sentence = f"UNSTABLE: the arm buckles, {weakest_joint(K)} most; {_eigenvalue(K)}"
    return f"{sentence}{_if_motors_held(K)}"


def _if_motors_held(K: Stiffness) -> str:
    """Say so if the arm would be stable with rigid motors in place of those that yield."""
    soft = K.posture.arm.motors.yielding
    if soft is None:
        return ""
    rigid = K.joint + soft.softening(K.posture.length_jacobian, K.cable_stiffness)
    if least_eigenpair(rigid, K.posture.arm)[0] <= 0.0:
        return ""
    return f"; with rigid motors in place of {listed(soft.names)} it would be stable"


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
        yield Finding(Status.UNSTABLE, describe_buckling(K))
        return
    yield from find_skewness(K.joint, K.posture.arm)
    if not K.slack:
        return
    cables = f"{listed(K.slack, 4)} at 0 N"
    label = f"{listed(K.slack, _NAMED)} at 0 N"
    if K.friction != "frictionless":
        sentence = f"{cables} count as taut to both sides in all numbers of this K"
        yield Finding(Status.SLACK, sentence, label)
    elif K.margin_without_slack > 0.0:
        yield Finding(
            Status.SLACK,
            f"{cables} only pull: along(u) holds for a force along +u, and prints show the softer "
            "of both sides; joint, compliance, cartesian, spatial, modes and is_stable count these "
            "cables as taut",
            label,
        )
    else:
        value, motion = least_eigenpair(K.without_slack, K.posture.arm)
        joint = K.posture.arm.joint_names[int(abs(motion).argmax())]
        yield Finding(
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
