"""The starts and the record of a search for one target."""

from typing import Any

import pytest

import cdsm
from cdsm.planning import planner
from cdsm.planning.planner import Planner
from cdsm.planning.range import range_ends
from tests.planning.test_plan import posture
from tests.support import arms
from tests.support.locked import STRAND
from tests.support.paths import DOWN


def test_end_of_the_range_that_a_crossing_meets_by_rounding_is_reached() -> None:
    pose = arms.random_posture(arms.random_arm(3, 3, "hinged", STRAND), 3, 0.3)
    u = (0.0, 1.0, 0.3)
    found = cdsm.stiffness_range(pose, u, 10.0)
    plan = cdsm.plan_stiffness(pose, u, found.low, 10.0)
    assert plan.achieved == pytest.approx(found.low, rel=1e-6)
    path = cdsm.plan_path(pose.arm, u, [3.0 * found.low, found.low], 10.0, angles=[pose.q] * 2)
    assert path.complete


def test_what_a_search_has_met_beyond_the_range_widens_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """As if the range had been found far too narrow."""
    pose, low, high = posture("hinged-3-strand")
    found = cdsm.stiffness_range(pose, DOWN, low, high)
    target = 0.5 * (found.low + found.high)
    true = range_ends

    def narrow(*given: Any) -> Any:
        end, _ = true(*given)
        return end, end

    monkeypatch.setattr(planner, "range_ends", narrow)
    monkeypatch.setattr(Planner, "_starts", lambda self: iter(()))
    plan = cdsm.plan_stiffness(pose, DOWN, target, low, high)
    assert plan.achieved == pytest.approx(target, rel=1e-9)
    with pytest.raises(cdsm.UnreachableStiffness) as caught:
        cdsm.plan_stiffness(pose, DOWN, 1.1 * found.high, low, high)
    assert found.low < target < caught.value.high <= found.high * (1.0 + 1e-9)
