"""Tensions along a path: hit, within the largest change, and every sample that cannot be named."""

import csv
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import cdsm
from cdsm import Status, presets
from tests.support import arms
from tests.support.locked import BUCKLING, LENGTH, STRAND, TABLE, soft, soft_hinge, some_arm
from tests.support.paths import ARM, DOWN, assert_holds, waving


def test_samples_have_the_efforts_of_plans_from_scratch() -> None:
    arm, q = presets.virtual_prototype(STRAND), waving(8)
    found = [cdsm.stiffness_range(arm.at(each), DOWN, 40.0, 400.0, starts=3) for each in q]
    parts = 0.2 + 0.5 * np.sin(np.linspace(0.0, math.pi, 8))
    targets = [each.low + x * (each.high - each.low) for each, x in zip(found, parts, strict=True)]
    plan = cdsm.plan_path(arm, DOWN, targets, 40.0, 400.0, angles=q)
    assert plan.complete
    assert_holds(plan, 40.0, 400.0)
    np.testing.assert_array_equal(plan.angles, q)
    for i in range(0, 8, 2):
        alone = cdsm.plan_stiffness(arm.at(q[i]), DOWN, targets[i], 40.0, 400.0)
        effort = np.linalg.norm(plan.tensions[i])
        assert effort == pytest.approx(np.linalg.norm(alone.tension.values), rel=1e-7)


def test_path_of_tips_is_that_of_the_angles_that_lead_there() -> None:
    q = waving(12)
    tips = [ARM.at(each).tip[:3, 3] for each in q]
    plan = cdsm.plan_path(ARM, DOWN, 80e3, 50.0, tips=tips, guess=q[0])
    assert plan.complete
    assert_holds(plan, 50.0, math.inf)
    reached = [K.posture.tip[:3, 3] for K in plan.stiffness]
    np.testing.assert_allclose(reached, tips, atol=1e-9)
    # the nearest angles to those before, so that the joints move little
    assert abs(np.diff(plan.angles, axis=0)).max() < 0.05
    again = cdsm.plan_path(ARM, DOWN, 80e3, 50.0, angles=plan.angles)
    np.testing.assert_allclose(again.tensions, plan.tensions, rtol=1e-12)
    tips[1] = np.array([ARM.geometry.length + 0.25, 0.0, 0.0])
    plan = cdsm.plan_path(ARM, DOWN, 80e3, 50.0, tips=tips[:3], guess=q[0])
    assert plan.planned == (0, 2)
    assert plan.infeasible[0].status is Status.OUT_OF_REACH
    assert "than 250 mm" in plan.infeasible[0].reason


@pytest.mark.parametrize("seed", [1, 5])
def test_random_arms_keep_to_their_targets_and_rates(seed: int) -> None:
    """Tables and straight wires; wrenches with a moment."""
    rng = np.random.default_rng(seed)
    law = (STRAND, cdsm.LinearElasticity(30e3), TABLE)[seed % 3]
    arm = arms.random_arm(seed, 3, ("hinged", "universal")[seed % 2], law)
    ends = arms.random_posture(arm, seed, 0.4).q, arms.random_posture(arm, seed + 100, 0.5).q
    q = ends[0] + np.linspace(0.0, 0.11, 6)[:, None] * (ends[1] - ends[0])
    W = 0.3 * arms.random_wrench(seed)
    found = cdsm.stiffness_range(arm.at(q[5]), DOWN, 15.0, 400.0, W, starts=4)
    wave = 0.4 + 0.3 * np.sin(np.linspace(0.0, rng.uniform(2.0, 10.0), 6))
    targets = found.low + wave * (found.high - found.low)
    plan = cdsm.plan_path(arm, DOWN, targets, 15.0, 400.0, W, angles=q, max_change_per_sample=20.0)
    assert len(plan.planned) >= 2
    assert_holds(plan, 15.0, 400.0)
    assert plan.infeasible
    for each in plan.infeasible:  # of a rate only if there are tensions without it
        try:
            cdsm.plan_stiffness(arm.at(q[each.index]), DOWN, targets[each.index], 15.0, 400.0, W)
        except cdsm.UnreachableStiffness:
            assert each.status is Status.UNREACHABLE_STIFFNESS
        else:
            assert each.status is Status.CHANGE_LIMITED


def test_every_infeasible_sample_is_named_and_the_path_goes_on() -> None:
    q = waving(9)
    q[2, 3] = 2.0
    W = np.zeros((9, 6))
    W[4, 2] = -1e5
    targets = np.full(9, 80e3)
    targets[6] = 1e6
    plan = cdsm.plan_path(ARM, DOWN, targets, 50.0, 500.0, W, angles=q)
    assert plan.planned == (0, 1, 3, 5, 7, 8)
    assert not plan.complete
    assert [each.index for each in plan.infeasible] == [2, 4, 6]
    beyond, loaded, asked = plan.infeasible
    assert (beyond.status, loaded.status, asked.status) == (
        Status.BEYOND_LIMITS,
        Status.INFEASIBLE,
        Status.UNREACHABLE_STIFFNESS,
    )
    assert isinstance(beyond.error, cdsm.InvalidInput)
    assert isinstance(loaded.error, cdsm.InfeasibleTension)
    assert isinstance(asked.error, cdsm.UnreachableStiffness)
    assert asked.reason == str(asked.error)
    with pytest.raises(cdsm.UnreachableStiffness) as alone:
        cdsm.plan_stiffness(ARM.at(q[6]), DOWN, 1e6, 50.0, 500.0)
    assert (asked.error.low, asked.error.high) == (alone.value.low, alone.value.high)
    assert_holds(plan, 50.0, 500.0)
    for arm, u, least, status, said in (
        (soft_hinge(), DOWN, 1.01 * BUCKLING, Status.SINGULAR, ""),
        (soft_hinge(), (1.0, 0.0, 0.0), 10.0, Status.SINGULAR, "cannot move along"),
        (ARM, DOWN, 900.0, Status.OUTSIDE_ELASTICITY, ""),
    ):
        plan = cdsm.plan_path(arm, u, 1e3, least, angles=np.zeros((2, arm.nv)))
        assert plan.planned == ()
        assert [each.status for each in plan.infeasible] == [status] * 2
        assert said in plan.infeasible[0].reason


def along_hinge(F: float) -> float:
    """along(z) of the straight soft hinge, both cables at F: K over the lever squared."""
    return soft(F) / LENGTH**2


@pytest.mark.parametrize(("rate", "late"), [(12.5, 3), (12.4, 4), (50.1, 0)])
def test_target_that_jumps_is_hit_again_when_the_motors_are_there(rate: float, late: int) -> None:
    """From 20 N to 70 N and back: 50 N, which take 50/rate steps, the first of them allowed."""
    F = np.full(20, 20.0)
    F[6:13] = 70.0
    targets = [along_hinge(each) for each in F]
    plan = cdsm.plan_path(
        soft_hinge(), DOWN, targets, 10.0, angles=np.zeros((20, 1)), max_change_per_sample=rate
    )
    failed = [*range(6, 6 + late), *range(13, 13 + late)]
    assert [each.index for each in plan.infeasible] == failed
    assert {each.status for each in plan.infeasible} <= {Status.CHANGE_LIMITED}
    np.testing.assert_allclose(plan.tensions, F[list(plan.planned), None] * [1, 1], rtol=1e-9)
    assert_holds(plan, 10.0, math.inf)
    if late:
        assert " by 50 N in 1 sample," in plan.infeasible[0].reason
        assert f"{rate:g} N are allowed" in plan.infeasible[0].reason


def test_rate_of_each_cable_is_its_own() -> None:
    q = waving(30)
    targets = 75e3 + 15e3 * np.sin(np.linspace(0.0, math.pi, 30))
    free = cdsm.plan_path(ARM, DOWN, targets, 50.0, angles=q)
    rate = np.full(15, math.inf)
    rate[4] = 0.5 * abs(np.diff(free.tensions[:, 4])).max()
    plan = cdsm.plan_path(ARM, DOWN, targets, 50.0, angles=q, max_change_per_sample=rate)
    assert plan.complete
    assert_holds(plan, 50.0, math.inf)
    assert abs(np.diff(plan.tensions[:, 4])).max() == pytest.approx(rate[4], rel=1e-9)


def test_rest_length_and_elongation_make_the_length() -> None:
    """Springs, strands, drives; a cable whose motor holds the force has none."""
    arm = some_arm("universal-3-8-all")
    q = np.outer(np.linspace(0.5, 1.0, 4), arms.random_posture(arm, 11, reach=0.25).q)
    found = cdsm.stiffness_range(arm.at(q[2]), DOWN, 40.0, 300.0, starts=4)
    middle = 0.5 * (found.low + found.high)
    plan = cdsm.plan_path(arm, DOWN, middle, 40.0, 300.0, angles=q, max_change_per_sample=200.0)
    assert len(plan.planned) >= 3
    held = [c for c, cable in enumerate(arm.cables) if cable.control == "position"]
    assert len(held) < len(arm.cables)
    assert plan.rest_lengths.shape == (len(plan.planned), len(held))
    for k, K in enumerate(plan.stiffness):
        np.testing.assert_array_equal(plan.cable_lengths[k], K.posture.cable_lengths)
        for c, free in zip(held, plan.rest_lengths[k].tolist(), strict=True):
            L, stretch = plan.cable_lengths[k, c], arm.cables[c].elongation
            assert 0.0 < free < L
            assert free + float(stretch(plan.tensions[k, c], free)) == pytest.approx(L, rel=1e-14)


def test_csv_holds_every_sample_with_its_units_bit_by_bit(tmp_path: Path) -> None:
    cables = [replace(c, control="force") if c.name == "cable2_1" else c for c in ARM.cables]
    arm = cdsm.Manipulator(ARM.geometry, cables=cables, gravity=ARM.gravity)
    plan = cdsm.plan_path(arm, DOWN, [80e3, 1e7, 81e3], 50.0, angles=waving(3))
    with plan.write(tmp_path / "motors.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert [row["status"] for row in rows] == ["ok", "unreachable_stiffness", "ok"]
    assert rows[1]["reason"] == plan.infeasible[0].reason
    held = [name for name in arm.cables.names if name != "cable2_1"]
    for k, row in enumerate((rows[0], rows[2])):
        for kind, names, unit, values in (
            ("", arm.joint_names, "rad", plan.angles),
            ("tensions ", arm.cables.names, "N", plan.tensions),
            ("cable_lengths ", arm.cables.names, "m", plan.cable_lengths),
            ("rest_lengths ", held, "m", plan.rest_lengths),
            ("tips ", "xyz", "m", plan.tips),
        ):
            told = [float(row[f"{kind}{name} [{unit}]"]) for name in names]
            np.testing.assert_array_equal(told, values[k])
        assert float(row["achieved [N/m]"]) == plan.achieved[k]
    assert "rest_lengths cable2_1 [m]" not in rows[0]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"angles": None}, "angles: neither of angles= and tips="),
        ({"angles": np.zeros(10)}, r"angles: shape \(10,\) given; \(S, 10\)"),
        ({"guess": np.zeros(10)}, "guess: given with angles="),
        ({"target": [1e4] * 5}, r"target: shape \(5,\) given; \(\) for all samples or \(2,\)"),
        ({"target": [8e4, -1.0]}, "target: -1 N/m given"),
        ({"direction": np.eye(3)}, r"target: shape \(\) given; \(3,\)"),
        ({"max_change_per_sample": 0.0}, "max_change_per_sample: 0 N given"),
        ({"minimum": 80.0, "maximum": 70.0, "angles": np.full((2, 10), 9.0)}, "maximum: 70 N"),
    ],
)
def test_bad_input_is_named(change: dict[str, Any], message: str) -> None:
    given = {"arm": ARM, "direction": DOWN, "target": 8e4, "minimum": 50.0, "angles": waving(2)}
    with pytest.raises(cdsm.InvalidInput, match=message):
        cdsm.plan_path(**{**given, **change})


def test_a_sample_whose_targets_are_not_hit_together_is_named_as_such() -> None:
    targets = [[80e3, 1.0], [80e3, 1.0]]
    plan = cdsm.plan_path(ARM, [DOWN, (0.0, 1.0, 0.0)], targets, 50.0, 400.0, angles=waving(2))
    assert [sample.status for sample in plan.infeasible] == [Status.UNREACHABLE_STIFFNESS] * 2
    assert "at once" in plan.infeasible[0].reason
    assert "UNREACHABLE STIFFNESS" in str(plan)
