"""The rate: tensions change by no more than motors can."""

import math

import numpy as np
import pytest

import cdsm
from cdsm.planning import follow
from cdsm.planning.objectives import along_constraints
from cdsm.planning.stiffness_model import StiffnessModel
from tests.support.locked import (
    LENGTH,
    soft,
    soft_hinge,
)
from tests.support.paths import ARM, DOWN, assert_holds, waving


def along_hinge(F: float) -> float:
    """along(z) of the straight soft hinge, both cables at F: K over the lever squared."""
    return soft(F) / LENGTH**2


@pytest.mark.parametrize(("rate", "late"), [(10.0, 4), (12.5, 3), (12.4, 4), (39.9, 1), (50.1, 0)])
def test_target_that_jumps_is_hit_again_when_the_motors_are_there(rate: float, late: int) -> None:
    """From 20 N to 70 N and back: 50 N, which take 50/rate steps, the first of them allowed."""
    F = np.full(20, 20.0)
    F[6:13] = 70.0
    targets = [along_hinge(each) for each in F]
    plan = cdsm.plan_path(soft_hinge(), DOWN, targets, 10.0, angles=np.zeros((20, 1)), rate=rate)
    failed = [*range(6, 6 + late), *range(13, 13 + late)]
    assert [each.index for each in plan.infeasible] == failed
    assert {each.status for each in plan.infeasible} <= {"rate"}
    np.testing.assert_allclose(plan.tensions, F[list(plan.planned), None] * [1, 1], rtol=1e-9)
    assert_holds(plan, 10.0, math.inf)
    if late:
        assert "change cable1_1 by 50 N in 1 step(s) from sample 5" in plan.infeasible[0].reason
        assert f"{rate:g} N are allowed" in plan.infeasible[0].reason


@pytest.mark.parametrize("rate", [math.inf, 121.0, 119.0])
def test_tensions_that_would_buckle_the_arm_are_not_gone_on_from(rate: float) -> None:
    """Pushed by P from its tip a straight hinge is softer by P·lever, and buckles."""
    F, P = np.array([170.0, 50.0]), np.array([0.0, 4.0])
    stiff = np.array([soft(each) for each in F]) - P * LENGTH
    assert stiff[0] - P[1] * LENGTH < 0.0
    W = np.zeros((2, 6))
    W[:, 0] = -P
    plan = cdsm.plan_path(
        soft_hinge(), DOWN, stiff / LENGTH**2, 10.0, wrench=W, angles=[[0.0], [0.0]], rate=rate
    )
    assert plan.tensions[0] == pytest.approx(F[0], rel=1e-9)
    if rate >= 120.0:
        assert plan.complete
        assert plan.tensions[1] == pytest.approx(F[1], rel=1e-9)
    else:
        assert [each.status for each in plan.infeasible] == ["rate"]


def test_balance_that_the_rate_does_not_allow_is_named() -> None:
    """A load of 30 N on the lever asks for 3 N m, 100 N more in one cable than in the other."""
    W = np.zeros((3, 6))
    W[1, 2] = 30.0
    plan = cdsm.plan_path(
        soft_hinge(), DOWN, along_hinge(200.0), 10.0, wrench=W, angles=np.zeros((3, 1)), rate=20.0
    )
    assert plan.planned == (0, 2)
    assert [each.status for each in plan.infeasible] == ["rate"]
    assert "50 N in 1 step(s)" in plan.infeasible[0].reason


def test_rate_of_each_cable_is_its_own() -> None:
    q = waving(30)
    targets = 75e3 + 15e3 * np.sin(np.linspace(0.0, math.pi, 30))
    free = cdsm.plan_path(ARM, DOWN, targets, 50.0, angles=q)
    rate = np.full(15, math.inf)
    rate[4] = 0.5 * abs(np.diff(free.tensions[:, 4])).max()
    plan = cdsm.plan_path(ARM, DOWN, targets, 50.0, angles=q, rate=rate)
    assert plan.complete
    assert_holds(plan, 50.0, math.inf)
    assert abs(np.diff(plan.tensions[:, 4])).max() == pytest.approx(rate[4], rel=1e-9)


def test_least_change_stays_within_the_rate_and_goes_no_further_than_it_must() -> None:
    """From even tensions of a hinge, towards the one stiffness that needs 12 N more in each."""
    arm = soft_hinge()
    model = StiffnessModel(arm.at(np.zeros(1)), 10.0, math.inf, np.zeros(6), 1e-4)
    goal = along_constraints(model, np.array([DOWN]), np.array([along_hinge(32.0)]))
    before = np.full(2, 20.0)
    for rate, expected in ((50.0, 32.0), (12.5, 32.0), (5.0, 25.0)):
        found = follow.least_change(model, goal, before, np.full(2, rate))
        assert found is not None
        np.testing.assert_allclose(found[0], expected, rtol=1e-6)
        assert found[1] == (rate > 12.0)
