"""Tensions along a path: each sample searched from those before, within what a motor can change."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Literal

import numpy as np

from cdsm.planning.admissible import Admissible
from cdsm.planning.objectives import Problem
from cdsm.planning.planner import Planner
from cdsm.planning.sqp import EFFORT, Task, search
from cdsm.planning.starts import settled
from cdsm.planning.stiffness_model import Reading
from cdsm.support.validation import Array

Status = Literal["posture", "balance", "elasticity", "singular", "stiffness", "rate"]

_MISSED: Final[tuple[Status, str]] = (
    "stiffness",
    "no tensions were found that hit all targets at once. Ask for fewer, or for others; "
    "plan_stiffness finds what comes nearest to them at one posture.",
)

_BACK = 50
"""How many samples are planned again at most, so that a later one is within the rate."""


@dataclass(frozen=True, eq=False)
class Aim:
    """What is wanted at one sample of a path.

    Attributes:
        index: Which sample.
        question: The arm there, and what limits its tensions.
        reading: What is to be zero.
        single: u (3,) and the stiffness [N/m] along it, where that is all that is wanted.
    """

    index: int
    question: Problem
    reading: Reading
    single: tuple[Array, float] | None


@dataclass(frozen=True, eq=False)
class Planned:
    """A sample and tensions F (C,) [N] for it."""

    aim: Aim
    F: Array


class Follower:
    """Plans one sample after another, and the record of it.

    Args:
        rate: How much a tension may change per step (C,) [N]; may hold inf.
        starts: From how many tensions to search where there are none to go on from.
        seed: Of the random ones among them.

    Attributes:
        chain: The samples planned so far.
        iterations: Steps of all searches so far.
    """

    def __init__(self, rate: Array, starts: int, seed: int) -> None:
        self.rate = rate
        self.starts = starts
        self.seed = seed
        self.chain: list[Planned] = []
        self.iterations = 0

    def add(self, aim: Aim) -> tuple[Status, str] | None:
        """Plan one more sample; return why that is not possible, or None.

        The least tensions within the rate from the last sample. If none of those hit the target,
        but others do, the samples before are planned again, backwards, until they lead there.

        Raises:
            UnreachableStiffness: No tensions hit the one target, whatever the rate.
            SingularStiffness: No admissible tensions hold the arm, whatever the rate.
        """
        if not self.chain:
            F = self._anew(aim)
            if F is None:
                return _MISSED
            self.chain.append(Planned(aim, F))
            return None
        last = self.chain[-1]
        reach = self._reach(last.aim, aim)
        region = aim.question.region
        near = region.within(reach, last.F) if np.isfinite(reach).any() else region
        F = None if near is None else self._hit(aim, near, last.F)
        if F is None:
            F = self._anew(aim)
            if F is None:
                return _MISSED
            if near is not region:
                nearest = self._hit(aim, region, F, centre=last.F)
                goal = Planned(aim, F if nearest is None else nearest)
                F = None if near is None else self._hit(aim, near, goal.F)
                if F is None:
                    return None if self._lead_to(goal) else _too_fast(last, goal, reach)
        self.chain.append(Planned(aim, F))
        return None

    def _reach(self, one: Aim, other: Aim) -> Array:
        """How much the tensions may change between two samples (C,) [N]."""
        return self.rate * abs(other.index - one.index)

    def _hit(
        self, aim: Aim, region: Admissible, start: Array, centre: Array | float = 0.0
    ) -> Array | None:
        """The least tensions, or those nearest a centre, to which one search leads."""
        F = region.nearest(start, region.low, region.high)
        point = None if F is None else aim.question.field.at(F)
        if point is None or point.reserve <= 0.0:
            return None
        unit = max(region.scale, float(point.F.max()))
        task = Task(region, aim.question.field, point, aim.reading, EFFORT, unit, centre)
        found = settled(task, search(task, point))
        self.iterations += found.iterations
        return region.tension(found.sight.point.F).values if task.met(found.sight) else None

    def _anew(self, aim: Aim) -> Array | None:
        """The least tensions whatever the rate; none if several targets cannot be hit at once.

        Raises:
            UnreachableStiffness: No tensions hit the one target.
            SingularStiffness: No admissible tensions hold the arm.
        """
        planner = Planner(aim.question, aim.reading, self.starts, self.seed)
        try:
            found = planner.least()
            if found is None and aim.single is not None:
                found = planner.within_range(*aim.single)
        finally:
            self.iterations += planner.iterations
        return None if found is None else aim.question.region.tension(found.sight.point.F).values

    def _lead_to(self, goal: Planned) -> bool:
        """Plan the last samples again so that they lead to a goal within the rate, if they can.

        Backwards: each is brought as near as possible to the one before it, while it keeps within
        the rate of the one after it, until both are.
        """
        back = [goal]
        for k in range(len(self.chain) - 1, max(len(self.chain) - 1 - _BACK, -1), -1):
            aim, F = self.chain[k].aim, self.chain[k].F
            region = aim.question.region.within(self._reach(aim, back[-1].aim), back[-1].F)
            if region is None:
                return False
            before = self.chain[k - 1] if k else None
            joint: Admissible | None = region
            if before is not None:
                joint = region.within(self._reach(before.aim, aim), before.F)
            joined = None if joint is None else self._hit(aim, joint, F)
            if joined is not None:
                self.chain[k:] = [Planned(aim, joined), *reversed(back)]
                return True
            if before is None:
                return False
            nearer = self._hit(aim, region, F, centre=before.F)
            if nearer is None:
                return False
            back.append(Planned(aim, nearer))
        return False


def _too_fast(last: Planned, goal: Planned, reach: Array) -> tuple[Status, str]:
    change = abs(goal.F - last.F)
    cable = int((change / reach).argmax())
    name = goal.aim.question.pose.arm.cables[cable].name
    steps = goal.aim.index - last.aim.index
    return "rate", (
        f"tensions that hit the target exist, but none were found within the rate: the nearest "
        f"change {name} by {change[cable]:.4g} N in {steps} step(s) from sample {last.aim.index}, "
        f"and {reach[cable]:.4g} N are allowed. Raise rate, or change the target more slowly."
    )
