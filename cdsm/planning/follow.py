"""Plan tensions along a path, sample by sample; a rate limits their change per step."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from cdsm.planning.admissible import Admissible
from cdsm.planning.path_plan import InfeasibleSample
from cdsm.planning.planner import Planner
from cdsm.planning.sqp import EFFORT, Program, search
from cdsm.planning.stiffness_model import Constraints, StiffnessModel
from cdsm.support.values import Array

_MISSED = (
    "no tensions were found that hit all targets at once. Ask for fewer, or for others; "
    "plan_stiffness finds what comes nearest to them at one posture."
)


@dataclass(frozen=True, eq=False)
class Sample:
    """One sample of a path: its target, and its tensions once they are planned."""

    index: int
    model: StiffnessModel  # K_θ over the admissible tensions at the sample
    constraints: Constraints  # c(F) = 0 where the target is hit
    F: Array  # tensions (C,) [N]; the least tensions until the sample is planned


@dataclass(eq=False)
class Follower:
    """Planner that takes the samples of a path one after the other, and stores the planned ones."""

    rate: Array  # largest change of a tension per step (C,) [N]; may hold inf
    starts: int  # number of starting tensions of a search from scratch
    seed: int
    planned: list[Sample] = field(default_factory=list)

    def add(self, sample: Sample) -> InfeasibleSample | None:
        """Plan the next sample; return None if this succeeds, else the sample with the reason.

        The tensions are the least ones that hit the target and that the rate allows: each differs
        from the tension of the last planned sample by at most ``rate`` per step. Raises
        UnreachableStiffness or SingularStiffness if no tensions hit the target, even with an
        unlimited rate.
        """
        region = sample.model.region
        last = self.planned[-1] if self.planned else None
        limited = last is not None and bool(np.isfinite(self.rate).any())
        near = self._near(region, sample, last) if limited else region
        found = self._search(sample, near, last.F) if last is not None else None
        if found is None:
            found = self._from_scratch(sample)
            if found is None:
                return InfeasibleSample(sample.index, "stiffness", _MISSED)
            if last is not None and limited:
                goal = self._search(sample, region, found.F, centre=last.F) or found
                found = self._search(sample, near, goal.F)
                if found is None:
                    return self._too_fast(last, goal)
        self.planned.append(found)
        return None

    def _near(
        self, region: Admissible | None, sample: Sample, other: Sample | None
    ) -> Admissible | None:
        """Return the part of ``region`` at ``sample`` that the rate allows.

        Each tension may differ from that of the sample ``other`` by ``rate`` times the number of
        steps between both samples. If ``other`` is None, return ``region``. Return None if no
        admissible tensions remain.
        """
        if region is None or other is None:
            return region
        return region.within(self.rate * abs(other.index - sample.index), other.F)

    def _search(
        self, sample: Sample, region: Admissible | None, start: Array, centre: Array | float = 0.0
    ) -> Sample | None:
        """Search ``region`` once for tensions that hit the target; return the planned sample.

        The search begins at ``start`` (C,) [N]. Of the tensions that hit the target, it takes those
        nearest to ``centre`` (C,) [N]; 0 gives the least ones. Return None if it misses the target.
        """
        found = _search(sample.model, region, sample.constraints, start, centre)
        return replace(sample, F=found[0]) if found and found[1] else None

    def _from_scratch(self, sample: Sample) -> Sample | None:
        """Plan a sample without regard to the samples before it.

        If no search hits the target, return None if ``sample`` has several targets, and raise
        UnreachableStiffness if it has a single one.
        """
        found = Planner(sample.model, sample.constraints, self.starts, self.seed).least()
        if found is None:
            return None
        return replace(sample, F=sample.model.region.tension(found.evaluation.F).values)

    def _too_fast(self, last: Sample, goal: Sample) -> InfeasibleSample:
        change, allowed = abs(goal.F - last.F), self.rate * (goal.index - last.index)
        cable = int((change / allowed).argmax())
        name = goal.model.pose.arm.cables[cable].name
        return InfeasibleSample(
            goal.index,
            "rate",
            f"tensions that hit the target exist, but none were found within the rate: the nearest "
            f"change {name} by {change[cable]:.4g} N in {goal.index - last.index} step(s) from "
            f"sample {last.index}, and {allowed[cable]:.4g} N are allowed. Raise rate, or change "
            "the target more slowly.",
        )


def least_change(
    model: StiffnessModel, constraints: Constraints, before: Array, rate: Array
) -> tuple[Array, bool] | None:
    """Search once for the tensions (C,) [N] nearest to ``before`` that meet ``constraints``.

    No tension changes by more than ``rate`` (C,) [N]. Also return whether the constraints are met;
    if not, the tensions have the smallest violation that was found. The search begins at the
    balanced tensions nearest to ``before``. Return None if no tensions within ``rate`` balance the
    arm, or if the arm is unstable where the search begins.
    """
    return _search(model, model.region.within(rate, before), constraints, before, before)


def _search(
    model: StiffnessModel,
    region: Admissible | None,
    constraints: Constraints,
    start: Array,
    centre: Array | float,
) -> tuple[Array, bool] | None:
    """Search ``region`` once for the tensions nearest to ``centre`` that meet ``constraints``.

    The search begins at the tensions of ``region`` nearest to ``start``. All tensions are (C,) [N].
    Return the tensions found, and whether they meet the constraints. Return None if there is no
    ``region``, or if the arm is unstable where the search begins.
    """
    F = None if region is None else region.nearest(start, region.low, region.high)
    if region is None or F is None:
        return None
    point = model.at(F)
    if point.reserve <= 0.0:
        return None
    unit = max(region.scale, float(point.F.max()))
    program = Program(region, point, constraints, EFFORT, unit, centre)
    found = search(program, point)
    return region.tension(found.evaluation.F).values, program.met(found)
