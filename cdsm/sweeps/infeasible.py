"""Why postures have no tensions: which joints lack torque, and how far joints may bend."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final, final

import numpy as np
from numpy.typing import NDArray

from cdsm.batch.distribution import distribute_tensions
from cdsm.errors import CdsmError, InfeasibleTension
from cdsm.manipulator import Manipulator
from cdsm.status import Status
from cdsm.support.format import place, plural
from cdsm.support.values import Array
from cdsm.sweeps.entries import Entries, counted
from cdsm.sweeps.poses import RandomPoses, finite_limits, joint_angles

_BALANCED: Final = (
    *(Status.OK, Status.OUTSIDE_ELASTICITY, Status.SINGULAR),
    *(Status.IMMOBILE, Status.UNSTABLE),
)
_TRIED: Final = 256  # random postures at which a joint limit is tried
_HELD: Final = 0.95  # least share of them that must have tensions
_MANY: Final = 0.05  # least share of postures beyond an angle that is worth a word
_LIMITS: Final = (1.2, 1.0, 0.8, 0.7, 0.6, 0.5, 0.45, 0.4, 0.35, 0.3, 0.25, 0.2, 0.15, 0.1, 0.05)
"""Joint limits [rad] that are tried."""


@final
@dataclass(frozen=True, kw_only=True)
class InfeasiblePostures:
    """Why postures have no tensions within the bounds; every statement is computed.

    Attributes:
        arm: The arm.
        count: Number of postures without tensions.
        postures: Number of all postures.
        examined: How many of them were examined one by one.
        joints: Of these, the number at which this joint lacks most torque, by its name.
        widened: How many of them have tensions within wider bounds.
        cables: How often a cable is at a bound there, by its name.
        largest: Largest angle of each joint [rad] at which any posture is balanced (nv,), or way
            [m]; NaN: none is.
        beyond: Number of postures in which the joint is further (nv,).
        limit: Joint limit [rad] within which nearly all random postures have tensions; None: the
            limits that were tried have none.
        share: Share of random postures within ``limit`` that have tensions.
    """

    arm: Manipulator
    count: int
    postures: int
    examined: int
    joints: dict[str, int]
    widened: int
    cables: dict[str, int]
    largest: Array
    beyond: NDArray[np.int64]
    limit: float | None
    share: float

    def __str__(self) -> str:
        lacking = f"{self.count} of {plural(self.postures, 'posture')} have no tensions within the "
        lines = [f"{lacking}bounds"]
        if self.joints:
            looked = f"of {self.examined} that were examined" if self.examined > 1 else "there"
            lines.append(f"  most torque is missing at {counted(self.joints)}, {looked}")
        if self.widened:
            wider = f"  {self.widened} of {self.examined} have tensions within wider bounds; at a "
            lines.append(f"{wider}bound then: {counted(self.cables)}")
        names = self.arm.joint_names
        ends = [
            f"{names[j]} beyond {place(float(self.largest[j]), self.arm.joint_units[j])}"
            for j in (names.index(joint) for joint in self.joints)
            if self.beyond[j] >= _MANY * self.postures
        ]
        if ends:
            lines.append(f"  no posture has tensions with {', or '.join(ends[:4])}")
        if self.limit is not None:
            within = f"within {place(self.limit, 'rad')} of every joint, {100.0 * self.share:.3g} %"
            remedy = f": try joint_limit = {self.limit:g}" if self.arm.is_serpentine else ""
            lines.append(f"  {within} of {_TRIED} random postures have tensions{remedy}")
        return "\n".join(lines)

    def to_dict(self) -> dict[str, object]:
        """Return what was found for JSON, angles in rad, ways in m."""
        names = ("postures", "examined", "joints", "widened", "cables", "limit", "share")
        numbers = {name: getattr(self, name) for name in names}
        largest = dict(zip(self.arm.joint_names, self.largest.tolist(), strict=True))
        return {"infeasible": self.count, **numbers, "largest_balanced": largest}


def explain_infeasible(entries: Entries) -> InfeasiblePostures | None:
    """Find why postures have no tensions; None if all of them have.

    Some of the postures are examined; joint limits are tried at random postures.
    """
    count = entries.count(Status.INFEASIBLE)
    if not count:
        return None
    arm = entries.arm
    q = entries.q
    joints = Counter[str]()
    cables = Counter[str]()
    widened = 0
    sample = entries.sample(Status.INFEASIBLE)
    for pose in sample:
        try:
            entries.least_tension(pose)
        except InfeasibleTension as error:
            joints[error.joint] += 1
            if math.isfinite(error.relaxation):
                widened += 1
                cables.update(error.binding)
        except CdsmError:  # friction leaves no tensions within the bounds of a cable
            continue
    balanced = np.isin(entries.status, _BALANCED)
    largest = abs(q[balanced]).max(axis=0) if balanced.any() else np.full(arm.nv, np.nan)
    beyond = np.count_nonzero(abs(q) > largest + 1e-9, axis=0)
    limit = None
    share = 0.0
    if count > (1.0 - _HELD) * len(q) and not entries.worst_friction:
        limit, share = _limit(entries)
    return InfeasiblePostures(
        arm=arm,
        count=count,
        postures=len(q),
        examined=len(sample),
        joints=dict(joints.most_common()),
        widened=widened,
        cables=dict(cables.most_common()),
        largest=largest,
        beyond=beyond,
        limit=limit,
        share=share,
    )


def _limit(entries: Entries) -> tuple[float | None, float]:
    """Return the largest limit [rad] within which nearly all random postures have tensions.

    With it comes their share. Joints that slide keep their limits.
    """
    arm = entries.arm
    bounds = (entries.minimum, entries.maximum, entries.wrench)
    turns = ~arm.slides
    widest = float(np.maximum(abs(arm.lower), abs(arm.upper)).max(where=turns, initial=0.0))
    nearest = float(np.maximum(arm.lower, -arm.upper).max(where=turns, initial=0.0))
    limits = [limit for limit in _LIMITS if nearest < limit < widest]
    q = joint_angles(arm, RandomPoses(_TRIED))
    lower, upper = finite_limits(arm)
    unit = (q - lower) / np.where(upper > lower, upper - lower, 1.0)

    def share_within(limit: float) -> float:
        low = np.where(turns, np.maximum(lower, -limit), lower)
        high = np.where(turns, np.minimum(upper, limit), upper)
        tensions = distribute_tensions(arm, low + unit * (high - low), *bounds)
        return float(np.mean(tensions.status == Status.OK))

    return _first_held(limits, share_within)


def _first_held(
    limits: Sequence[float], share_within: Callable[[float], float]
) -> tuple[float | None, float]:
    """Bisect falling ``limits`` for the first one whose share is large enough."""
    shares: dict[int, float] = {}
    low = 0
    high = len(limits)  # there is no such limit, if the answer is this one
    while low < high:
        middle = (low + high) // 2
        shares[middle] = share_within(limits[middle])
        if shares[middle] >= _HELD:
            high = middle
        else:
            low = middle + 1
    return (None, 0.0) if low == len(limits) else (limits[low], shares[low])
