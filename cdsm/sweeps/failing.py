"""Why postures have tensions, but no stiffness: which cable leaves its law, which joint buckles."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from typing import final

from cdsm.errors import CdsmError
from cdsm.posture import Posture
from cdsm.status import Status
from cdsm.stiffness_matrix import stiffness
from cdsm.stiffness_matrix.verdict import weakest_joint
from cdsm.support.format import plural
from cdsm.support.values import Array
from cdsm.sweeps.entries import Entries, counted


@final
@dataclass(frozen=True, kw_only=True)
class Passing:
    """Cables whose tensions pass one end of their law, or one tension that leaves no wire.

    Attributes:
        place: Which end it is, in words.
        cables: In how many of the postures each cable does so, by its name.
        tension: The tension farthest beyond the end [N].
    """

    place: str
    cables: dict[str, int]
    tension: float


@final
@dataclass(frozen=True, kw_only=True)
class OutsidePostures:
    """Which tensions are outside the laws of their cables.

    Attributes:
        count: Number of postures of this kind.
        postures: Number of all postures.
        examined: How many of ``count`` were examined one by one.
        passing: The ends that are passed, and by which cables.
    """

    count: int
    postures: int
    examined: int
    passing: tuple[Passing, ...]

    def __str__(self) -> str:
        whole = plural(self.postures, "posture")
        lines = [f"tensions are outside the law of a cable at {self.count} of {whole}"]
        for passing in self.passing:
            cables = counted(passing.cables)
            lines.append(f"  {passing.place}: {cables}{_examined(self)}, {passing.tension:.4g} N")
        return "\n".join(lines)

    def to_dict(self) -> dict[str, object]:
        """Return what was examined for JSON."""
        return {
            "count": self.count,
            "examined": self.examined,
            "cables": {passing.place: passing.cables for passing in self.passing},
        }


@final
@dataclass(frozen=True, kw_only=True)
class UnstablePostures:
    """Which joints buckle.

    Attributes:
        count: Number of postures of this kind.
        postures: Number of all postures.
        examined: How many of ``count`` were examined one by one.
        joints: In how many of these each joint moves most as the arm buckles, by its name.
        slack: In how many of these each cable is at 0 N, and the arm stable only if it counted as
            taut, by its name.
    """

    count: int
    postures: int
    examined: int
    joints: dict[str, int]
    slack: dict[str, int]

    def __str__(self) -> str:
        whole = plural(self.postures, "posture")
        lines = [f"the arm buckles at {self.count} of {whole}"]
        if self.joints:
            lines.append(f"  most moves {counted(self.joints)}{_examined(self)}")
        if self.slack:
            lines.append(f"  only slack cables hold it: {counted(self.slack)}{_examined(self)}")
        return "\n".join(lines)

    def to_dict(self) -> dict[str, object]:
        """Return what was examined for JSON."""
        names = ("count", "examined", "joints", "slack")
        return {name: getattr(self, name) for name in names}


def explain_outside(entries: Entries) -> OutsidePostures | None:
    """Find which cables leave their laws, of some of the postures; None if none does."""
    count = entries.count(Status.OUTSIDE_ELASTICITY)
    if not count:
        return None
    cables: dict[str, Counter[str]] = {}
    farthest: dict[str, float] = {}
    sample = entries.sample(Status.OUTSIDE_ELASTICITY)
    for pose in sample:
        try:
            F = entries.least_tension(pose)
        except CdsmError:
            continue
        for cable, place, tension, high in _passing(pose, F.values):
            cables.setdefault(place, Counter())[cable] += 1
            extreme = max if high else min
            farthest[place] = extreme(farthest.get(place, tension), tension)
    return OutsidePostures(
        count=count,
        postures=len(entries.q),
        examined=len(sample),
        passing=tuple(
            Passing(place=place, cables=dict(names.most_common()), tension=farthest[place])
            for place, names in cables.items()
        ),
    )


def _passing(pose: Posture, F: Array) -> Iterator[tuple[str, str, float, bool]]:
    """Yield cables whose tensions F (C,) pass an end: name, end, tension, whether it is high."""
    most = pose.arm.laws.largest_tensions(pose.cable_lengths)
    for c, (cable, tension) in enumerate(zip(pose.arm.cables, F.tolist(), strict=True)):
        law = cable.elasticity
        if cable.control == "force":
            continue
        if tension < law.low:
            yield cable.name, f"below {law.low:.4g} N, where the law begins", tension, False
        elif tension > law.high:
            yield cable.name, f"above {law.high:.4g} N, where the law ends", tension, True
        elif tension >= most[c]:
            yield cable.name, "the series spring leaves no wire", tension, True


def explain_unstable(entries: Entries) -> UnstablePostures | None:
    """Find which joints buckle, at some of the postures; None if none does."""
    count = entries.count(Status.UNSTABLE)
    if not count:
        return None
    joints = Counter[str]()
    slack = Counter[str]()
    sample = entries.sample(Status.UNSTABLE)
    for pose in sample:
        K = stiffness(pose, entries.least_tension(pose))
        if K.margin > 0.0:
            slack.update(K.slack)
        else:
            joints[weakest_joint(K)] += 1
    return UnstablePostures(
        count=count,
        postures=len(entries.q),
        examined=len(sample),
        joints=dict(joints.most_common()),
        slack=dict(slack.most_common()),
    )


def _examined(postures: OutsidePostures | UnstablePostures) -> str:
    """Say of how many postures the counts are."""
    return f", of {postures.examined} that were examined" if postures.examined > 1 else ""
