"""Tensions along a path: each search starts from the samples before, within the rate."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Literal

import numpy as np

from cdsm.planning.admissible import Admissible
from cdsm.planning.planner import Planner
from cdsm.planning.sqp import EFFORT, Program, search
from cdsm.planning.stiffness_model import Constraints, StiffnessModel
from cdsm.support.validation import Array

Status = Literal["posture", "balance", "elasticity", "singular", "stiffness", "rate"]

_MISSED: Final[tuple[Status, str]] = (
    "stiffness",
    "no tensions were found that hit all targets at once. Ask for fewer, or for others; "
    "plan_stiffness finds what comes nearest to them at one posture.",
)

_BACK = 50
"""Largest number of earlier samples that are planned again for a later sample."""


@dataclass(frozen=True, eq=False)
class SampleTarget:
    """Target of one sample of a path."""

    index: int
    model: StiffnessModel  # K_θ over the admissible tensions at the sample
    constraints: Constraints
    single: tuple[Array, float] | None  # u (3,) and stiffness [N/m], for a single direction


@dataclass(frozen=True, eq=False)
class PlannedSample:
    """Sample with its planned tensions F (C,) [N]."""

    target: SampleTarget
    F: Array


class Follower:
    """Planner of a path, sample by sample, with a record of the planned samples.

    Args:
        rate: Largest change of a tension per step (C,) [N]; may hold inf.
        starts: Number of starting tensions of a search from scratch.
        seed: Seed of the random starting tensions.

    Attributes:
        planned: The samples planned so far.
        iterations: Iterations of all searches so far.
    """

    def __init__(self, rate: Array, starts: int, seed: int) -> None:
        self.rate = rate
        self.starts = starts
        self.seed = seed
        self.planned: list[PlannedSample] = []
        self.iterations = 0

    def add(self, target: SampleTarget) -> tuple[Status, str] | None:
        """Plan one more sample. Return None, or the reason of a failure.

        It takes the least tensions within the rate from the last sample. If these miss the target
        but others hit it, the samples before are planned again until they lead to the others.

        Raises:
            UnreachableStiffness: No tensions hit the single target at any rate.
            SingularStiffness: No admissible tensions hold the arm at any rate.
        """
        if not self.planned:
            F = self._from_scratch(target)
            if F is None:
                return _MISSED
            self.planned.append(PlannedSample(target, F))
            return None

        last, region = self.planned[-1], target.model.region
        change = self._allowed_change(last.target, target)
        near = region.within(change, last.F) if np.isfinite(change).any() else region
        F = None if near is None else self._search(target, near, last.F)
        if F is None:
            F = self._from_scratch(target)
            if F is None:
                return _MISSED
            if near is not region:
                nearest = self._search(target, region, F, centre=last.F)
                goal = PlannedSample(target, F if nearest is None else nearest)
                F = None if near is None else self._search(target, near, goal.F)
                if F is None:
                    return None if self._replan_towards(goal) else _too_fast(last, goal, change)
        self.planned.append(PlannedSample(target, F))
        return None

    def _allowed_change(self, one: SampleTarget, other: SampleTarget) -> Array:
        """Return the allowed change of tensions (C,) [N] between two samples."""
        return self.rate * abs(other.index - one.index)

    def _search(
        self, target: SampleTarget, region: Admissible, start: Array, centre: Array | float = 0.0
    ) -> Array | None:
        """Search once for the least tensions, or for the nearest to a centre."""
        F = region.nearest(start, region.low, region.high)
        point = None if F is None else target.model.at(F)
        if point is None or point.reserve <= 0.0:
            return None
        unit = max(region.scale, float(point.F.max()))
        program = Program(target.model, region, point, target.constraints, EFFORT, unit, centre)
        found = search(program, point)
        self.iterations += found.iterations
        return region.tension(found.end.evaluation.F).values if program.met(found.end) else None

    def _from_scratch(self, target: SampleTarget) -> Array | None:
        """Return the least tensions at any rate, or None if several targets are not hit at once."""
        planner = Planner(target.model, target.constraints, self.starts, self.seed)
        try:
            found = planner.least()
            if found is None and target.single is not None:
                found = planner.within_range(*target.single)
        finally:
            self.iterations += planner.iterations
        return None if found is None else target.model.region.tension(found.end.evaluation.F).values

    def _replan_towards(self, goal: PlannedSample) -> bool:
        """Plan the last samples again so that they lead to a goal within the rate; return success.

        The loop goes backwards from the last sample. Each sample stays within the rate of the next
        one and comes as near as possible to the one before. It ends when a sample is within the
        rate of both.
        """
        later = [goal]
        for k in range(len(self.planned) - 1, max(len(self.planned) - 1 - _BACK, -1), -1):
            target, F = self.planned[k].target, self.planned[k].F
            change = self._allowed_change(target, later[-1].target)
            region = target.model.region.within(change, later[-1].F)
            if region is None:
                return False
            before = self.planned[k - 1] if k else None
            joint: Admissible | None = region
            if before is not None:
                joint = region.within(self._allowed_change(before.target, target), before.F)
            joined = None if joint is None else self._search(target, joint, F)
            if joined is not None:
                self.planned[k:] = [PlannedSample(target, joined), *reversed(later)]
                return True
            nearer = None if before is None else self._search(target, region, F, centre=before.F)
            if nearer is None:
                return False
            later.append(PlannedSample(target, nearer))
        return False


def _too_fast(last: PlannedSample, goal: PlannedSample, allowed: Array) -> tuple[Status, str]:
    change = abs(goal.F - last.F)
    cable = int((change / allowed).argmax())
    name = goal.target.model.pose.arm.cables[cable].name
    before, steps = last.target.index, goal.target.index - last.target.index
    return "rate", (
        f"tensions that hit the target exist, but none were found within the rate: the nearest "
        f"change {name} by {change[cable]:.4g} N in {steps} step(s) from sample {before}, "
        f"and {allowed[cable]:.4g} N are allowed. Raise rate, or change the target more slowly."
    )
