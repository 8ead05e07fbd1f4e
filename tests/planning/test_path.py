"""Tensions along a path: hit, within the rate, and every sample that cannot be named."""

import csv
import itertools
import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.optimize import root

import cdsm
from cdsm import presets
from cdsm.planning import follow
from cdsm.planning.follow import Follower
from cdsm.support.validation import Array
from tests.planning.test_range import DOWN
from tests.support import arms
from tests.support.locked import (
    BUCKLING,
    EA,
    LENGTH,
    STRAND,
    TABLE,
    H,
    R,
    hinge,
    soft,
    soft_hinge,
    some_arm,
)

ARM = presets.virtual_prototype()


def waving(count: int) -> Array:
    """Joint angles (count, 10) around those of the paper, each at its own pace."""
    s = np.linspace(0.0, 1.0, count)[:, None]
    return np.asarray(presets.TEN_DEGREES * (1.0 + 0.3 * np.sin(0.5 * s * np.arange(1, 11))))


def assert_holds(plan: cdsm.PathPlan, low: float, high: float) -> None:
    """Every planned sample does what was asked for, judged by the stiffness alone."""
    for k, i in enumerate(plan.planned):
        F, K = plan.tensions[k], plan.stiffness[k]
        again = cdsm.stiffness(plan.arm.at(plan.angles[k]), F, wrench=K.wrench)
        assert again.along(DOWN) == pytest.approx(plan.target[i], rel=1e-9)
        assert plan.achieved[k] == again.along(DOWN)
        assert abs(again.residual).max() < 1e-12 * F.max()
        assert (low <= F).all()
        assert (high >= F).all()
        assert again.is_stable
    changes = abs(np.diff(plan.tensions, axis=0)) / np.diff(plan.planned)[:, None]
    assert (changes <= plan.rate * (1.0 + 1e-12)).all()
    np.testing.assert_array_equal(plan.steps, [0.0, *changes.max(axis=1)])
    named = [*plan.planned, *(each.index for each in plan.infeasible)]
    assert sorted(named) == list(range(len(plan.target)))


# --- the targets are hit --------------------------------------------------------------------


@pytest.mark.parametrize("law", [STRAND, cdsm.LinearElasticity(20e3)], ids=["strand", "linear"])
def test_samples_have_the_efforts_of_plans_from_scratch(law: cdsm.Elasticity) -> None:
    arm = presets.virtual_prototype(law)
    q = waving(24)
    found = [cdsm.stiffness_range(arm.at(each), DOWN, 40.0, 400.0, starts=3) for each in q]
    parts = 0.2 + 0.5 * np.sin(np.linspace(0.0, math.pi, 24))
    targets = [each.low + x * (each.high - each.low) for each, x in zip(found, parts, strict=True)]
    plan = cdsm.plan_path(arm, DOWN, targets, 40.0, 400.0, angles=q)
    assert plan.complete
    assert_holds(plan, 40.0, 400.0)
    np.testing.assert_array_equal(plan.angles, q)
    for i in range(0, 24, 2):
        alone = cdsm.plan_stiffness(arm.at(q[i]), DOWN, targets[i], 40.0, 400.0)
        effort = np.linalg.norm(plan.tensions[i])
        assert effort == pytest.approx(alone.efforts[0], rel=1e-7)


def test_few_steps_are_enough_from_the_sample_before() -> None:
    plan = cdsm.plan_path(ARM, DOWN, 80e3, 50.0, angles=waving(100))
    assert plan.complete
    assert plan.iterations < 8 * 100


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


@pytest.mark.slow
def test_several_directions_and_matrices_are_hit_at_every_sample() -> None:
    q = waving(3)
    held = [cdsm.stiffness(ARM.at(a), cdsm.distribute_tension(ARM.at(a), 60.0)) for a in q]
    directions = np.eye(3)[1:]
    several = [[K.along(u) for u in directions] for K in held]
    plan = cdsm.plan_path(ARM, directions, several, 30.0, 300.0, angles=q)
    np.testing.assert_allclose(plan.achieved, several, rtol=1e-9)
    matrices = [(K.cartesian + K.cartesian.T) / 2.0 for K in held]
    full = cdsm.plan_path(ARM, None, matrices, 30.0, 300.0, angles=q)
    np.testing.assert_allclose(full.achieved, matrices, rtol=1e-8, atol=1e-8 * matrices[0].max())
    one = cdsm.plan_path(ARM, None, matrices[0], 30.0, 300.0, angles=q[[0, 0]])
    np.testing.assert_array_equal(one.target, [matrices[0]] * 2)
    for k in (0, 1):  # with nothing to go on from, and with something
        hard = np.array([[held[0].along(u) for u in np.eye(3)]] * 2)
        hard[k] *= [1.5, 0.7, 1.5]
        part = cdsm.plan_path(ARM, np.eye(3), hard, 30.0, 300.0, angles=q[[0, 0]])
        assert [(each.index, each.status) for each in part.infeasible] == [(k, "stiffness")]
        assert "all targets at once" in part.infeasible[0].reason


def test_load_may_change_along_the_path() -> None:
    W = np.zeros((10, 6))
    W[3:7, 2] = -15.0
    plan = cdsm.plan_path(ARM, DOWN, 80e3, 50.0, wrench=W, angles=waving(10))
    assert plan.complete
    assert_holds(plan, 50.0, math.inf)
    for K, load in zip(plan.stiffness, W, strict=True):
        np.testing.assert_array_equal(K.wrench, load)


def test_hung_weight_measures_what_was_planned_while_the_arm_carries_another() -> None:
    """Soft, stiff with 10 N in the hand, soft; measured up and down with locked motors."""
    s = np.arange(24)
    stiff = np.interp(s, [6, 10, 14, 18], [0.0, 1.0, 1.0, 0.0])
    W = np.zeros((24, 6))
    W[:, 2] = -10.0 * (stiff == 1.0)
    plan = cdsm.plan_path(ARM, DOWN, 70e3 + 25e3 * stiff, 50.0, 800.0, W, angles=waving(24))
    assert plan.complete
    for k in (2, 12, 20):
        force = 1e-7 * plan.target[k] * np.array(DOWN)
        load = plan.stiffness[k].wrench
        soft = [
            1.0
            / cdsm.weight_test(
                ARM.at(plan.angles[k]), plan.tensions[k], sign * force, wrench=load
            ).stiffness
            for sign in (1.0, -1.0)
        ]
        assert 2.0 / sum(soft) == pytest.approx(plan.target[k], rel=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 5, 9])
def test_random_arms_keep_to_their_targets_and_rates(seed: int) -> None:
    """Strands, tables and straight wires; wrenches with a moment."""
    rng = np.random.default_rng(seed)
    law = (STRAND, cdsm.LinearElasticity(30e3), TABLE)[seed % 3]
    arm = arms.random_arm(seed, 3, ("hinged", "universal")[seed % 2], law)
    ends = arms.random_posture(arm, seed, 0.4).q, arms.random_posture(arm, seed + 100, 0.5).q
    q = ends[0] + np.linspace(0.0, 0.3, 15)[:, None] * (ends[1] - ends[0])
    W = 0.3 * arms.random_wrench(seed)
    found = cdsm.stiffness_range(arm.at(q[7]), DOWN, 15.0, 400.0, W, starts=4)
    wave = 0.4 + 0.3 * np.sin(np.linspace(0.0, rng.uniform(2.0, 10.0), 15))
    targets = found.low + wave * (found.high - found.low)
    plan = cdsm.plan_path(arm, DOWN, targets, 15.0, 400.0, W, angles=q, rate=20.0)
    assert len(plan.planned) >= 2
    assert_holds(plan, 15.0, 400.0)
    for each in plan.infeasible:  # of a rate only if there are tensions without it
        try:
            cdsm.plan_stiffness(arm.at(q[each.index]), DOWN, targets[each.index], 15.0, 400.0, W)
        except cdsm.UnreachableStiffness:
            assert each.status == "stiffness"
        else:
            assert each.status == "rate"


# --- the rate -------------------------------------------------------------------------------


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


@pytest.mark.slow
def test_ramp_is_anticipated_where_other_tensions_of_the_same_stiffness_lead_there(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The least tensions of the ramp change by up to 25 N per step, and 18 N are allowed."""
    # as in the paper tension only softens: the stiffer, the smaller the tensions, in long steps
    arm = presets.virtual_prototype(cdsm.LinearElasticity(48e3), original_length="stretched")
    q = np.full((40, 10), presets.TEN_DEGREES)
    found = cdsm.stiffness_range(arm.at(q[0]), DOWN, 50.0, 800.0)
    ramp = 0.3 + 0.5 * np.clip((np.arange(40) - 10) / 20.0, 0.0, 1.0)
    targets = found.low + ramp * (found.high - found.low)
    given: dict[str, Any] = {"target": targets, "minimum": 50.0, "maximum": 800.0, "angles": q}
    free = cdsm.plan_path(arm, DOWN, **given)
    assert free.complete
    rate = 0.75 * float(free.steps.max())
    plan = cdsm.plan_path(arm, DOWN, **given, rate=rate)
    assert_holds(plan, 50.0, 800.0)
    with monkeypatch.context() as patch:
        patch.setattr(Follower, "_replan_towards", lambda self, goal: False)
        greedy = cdsm.plan_path(arm, DOWN, **given, rate=rate)
    with monkeypatch.context() as patch:
        patch.setattr(follow, "_BACK", 3)
        near = cdsm.plan_path(arm, DOWN, **given, rate=rate)
    assert_holds(near, 50.0, 800.0)
    assert len(plan.infeasible) <= 1
    assert len(greedy.infeasible) >= 15
    assert len(plan.infeasible) < len(near.infeasible) <= len(greedy.infeasible)
    # what leads to the ramp costs more than the least, and the least comes back after it
    efforts = [np.linalg.norm(each.tensions[0]) for each in (plan, free)]
    assert efforts[0] >= efforts[1] * (1.0 - 1e-9)
    np.testing.assert_allclose(plan.tensions[-1], free.tensions[-1], rtol=1e-6)


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


# --- what cannot be -------------------------------------------------------------------------


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
    told = {each.index: each for each in plan.infeasible}
    assert {i: each.status for i, each in told.items()} == {
        2: "posture",
        4: "balance",
        6: "stiffness",
    }
    assert isinstance(told[2].error, cdsm.JointLimitError)
    assert "widen joint_limit" in told[2].reason
    assert "check_limits" not in told[2].reason  # which a path does not have
    assert isinstance(told[4].error, cdsm.InfeasibleTension)
    error = told[6].error
    assert isinstance(error, cdsm.UnreachableStiffness)
    with pytest.raises(cdsm.UnreachableStiffness) as alone:
        cdsm.plan_stiffness(ARM.at(q[6]), DOWN, 1e6, 50.0, 500.0)
    assert (error.low, error.high) == (alone.value.low, alone.value.high)
    assert told[6].reason == str(error)
    assert_holds(plan, 50.0, 500.0)


def test_tip_out_of_reach_is_named_with_how_near_it_comes() -> None:
    q = waving(3)
    tips = np.array([ARM.at(each).tip[:3, 3] for each in q])
    far = ARM.geometry.length + 0.25
    tips[1] = (far, 0.0, 0.0)
    plan = cdsm.plan_path(ARM, DOWN, 80e3, 50.0, tips=tips, guess=q[0])
    assert plan.planned == (0, 2)
    assert plan.infeasible[0].status == "posture"
    assert "no nearer" in plan.infeasible[0].reason
    assert "than 0.25 m" in plan.infeasible[0].reason


def test_samples_that_no_tension_holds_are_named() -> None:
    unstable = cdsm.plan_path(soft_hinge(), DOWN, 1e3, 1.01 * BUCKLING, angles=[[0.0], [0.0]])
    assert [each.status for each in unstable.infeasible] == ["singular"] * 2
    assert unstable.planned == ()
    assert unstable.tensions.shape == unstable.cable_lengths.shape == (0, 2)
    assert unstable.unstrained_lengths.shape == (0, 2)
    assert unstable.steps.size == 0
    rigid = cdsm.plan_path(soft_hinge(), (1.0, 0.0, 0.0), 1e3, 10.0, angles=[[0.0]])
    assert "cannot move along" in rigid.infeasible[0].reason
    beyond = cdsm.plan_path(ARM, DOWN, 80e3, 900.0, angles=waving(1))
    assert beyond.infeasible[0].status == "elasticity"


# --- the motors -----------------------------------------------------------------------------


def test_unstrained_length_and_elongation_make_the_length() -> None:
    """Springs, strands, drives; a cable whose motor holds the force has none."""
    arm = some_arm("universal-3-8-all")
    q = np.outer(np.linspace(0.5, 1.0, 4), arms.random_posture(arm, 11, reach=0.25).q)
    found = cdsm.stiffness_range(arm.at(q[2]), DOWN, 40.0, 300.0, starts=4)
    plan = cdsm.plan_path(
        arm, DOWN, 0.5 * (found.low + found.high), 40.0, 300.0, angles=q, rate=200.0
    )
    assert len(plan.planned) >= 3
    held = [cable for cable in arm.cables if cable.control == "position"]
    assert len(held) < len(arm.cables)
    assert plan.unstrained_lengths.shape == (len(plan.planned), len(held))
    for k, K in enumerate(plan.stiffness):
        np.testing.assert_array_equal(plan.cable_lengths[k], K.posture.cable_lengths)
        lengths = iter(plan.unstrained_lengths[k])
        for cable, F, L in zip(arm.cables, plan.tensions[k], plan.cable_lengths[k], strict=True):
            if cable.control == "position":
                free = float(next(lengths))
                assert 0.0 < free < L
                assert free + float(cable.elongation(F, free)) == pytest.approx(L, rel=1e-14)


def test_csv_holds_every_sample_with_its_units_bit_by_bit(tmp_path: Path) -> None:
    cables = [replace(c, control="force") if c.name == "cable2_1" else c for c in ARM.cables]
    arm = cdsm.Manipulator(ARM.geometry, cables=cables, gravity=ARM.gravity)
    targets = [80e3, 1e7, 81e3]
    plan = cdsm.plan_path(arm, DOWN, targets, 50.0, angles=waving(3))
    path = plan.write_csv(tmp_path / "motors.csv")
    with path.open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert [row["status"] for row in rows] == ["planned", "stiffness", "planned"]
    assert [row["sample"] for row in rows] == ["0", "1", "2"]
    assert rows[1]["reason"] == plan.infeasible[0].reason
    assert rows[1]["cable1_1 tension [N]"] == rows[0]["reason"] == ""
    names = [cable.name for cable in arm.cables]
    for k, row in enumerate((rows[0], rows[2])):
        for kind, unit, values in (
            ("tension", "N", plan.tensions),
            ("length", "m", plan.cable_lengths),
        ):
            told = [float(row[f"{name} {kind} [{unit}]"]) for name in names]
            np.testing.assert_array_equal(told, values[k])
        angles = [float(row[f"{name} [rad]"]) for name in arm.joint_names]
        np.testing.assert_array_equal(angles, plan.angles[k])
        held = [name for name in names if name != "cable2_1"]
        free = [float(row[f"{name} unstrained length [m]"]) for name in held]
        np.testing.assert_array_equal(free, plan.unstrained_lengths[k])
    assert not any("cable2_1 unstrained" in column for column in rows[0])
    with pytest.raises(cdsm.FileError, match="does not exist"):
        plan.write_csv(tmp_path / "absent" / "motors.csv")


# --- between the samples --------------------------------------------------------------------


def resting(
    arm: cdsm.Manipulator, q: Array, l_0: Array, F: Array, W: Array
) -> tuple[Array, Callable[[Array], Array]]:
    """Where locked motors leave the arm, by the law of each cable and scipy alone, and its tip."""

    def torque(q: Array, W: Array) -> Array:
        pose, free = arm.at(q), iter(l_0.tolist())
        pulls = [
            F[c]
            if cable.control == "force"
            else float(
                cable.tension(pose.cable_lengths[c] - (unstrained := next(free)), unstrained)
            )
            for c, cable in enumerate(arm.cables)
        ]
        return np.asarray(
            pose.length_jacobian.T @ pulls + pose.gravity_torque - pose.jacobian.T @ W
        )

    def at(more: Array) -> Array:
        found = root(torque, q, args=(W + np.append(more, np.zeros(3)),), tol=1e-14).x
        assert abs(torque(found, W + np.append(more, np.zeros(3)))).max() < 1e-9
        return np.asarray(found)

    return at(np.zeros(3)), lambda force: arm.at(at(force)).tip[:3, 3]


def test_half_way_the_arm_is_where_the_mean_of_all_commands_leaves_it() -> None:
    """Strands, springs and drives, cables under force control, and a load that changes."""
    arm = some_arm("universal-3-8-all")
    assert {cable.control for cable in arm.cables} == {"position", "force"}
    q = np.outer([0.8, 0.9], arms.random_posture(arm, 11, reach=0.25).q)
    W = np.array([[0.0, 0.0, -4.0, 0.0, 0.0, 0.0], [1.0, 0.0, 2.0, 0.0, 0.0, 0.0]])
    found = cdsm.stiffness_range(arm.at(q[0]), DOWN, 40.0, 300.0, W[0], starts=4)
    targets = [x * found.low + (1.0 - x) * found.high for x in (0.6, 0.5)]
    plan = cdsm.plan_path(arm, DOWN, targets, 40.0, 300.0, W, angles=q)
    assert plan.complete
    (between,) = plan.between
    K = between.stiffness
    assert K is not None
    means = [x.mean(axis=0) for x in (q, plan.unstrained_lengths, plan.tensions, W)]
    rest, tip = resting(arm, *means)
    np.testing.assert_allclose(K.posture.q, rest, rtol=0.0, atol=1e-11)
    assert abs(rest - means[0]).max() > 1e-4
    errors = []
    for force in (0.4, 0.2):  # a finite weight is of second order
        moved = tip(force * np.array(DOWN)) - tip(-force * np.array(DOWN))
        errors.append(2.0 * force / float(moved @ DOWN) / float(between.achieved or 0.0) - 1.0)
    assert abs(errors[1]) < 1e-6
    assert abs(errors[1]) < 0.3 * abs(errors[0]) + 1e-8
    assert between.index == 0
    assert float(between.target) == pytest.approx(np.mean(targets), rel=1e-15)
    assert between.misfit == pytest.approx(
        abs(float(between.achieved or 0.0) / np.mean(targets) - 1.0), rel=1e-12
    )


def test_half_way_a_straight_hinge_has_the_tension_of_the_mean_length() -> None:
    """L = l_0 (1 + F/EA), and K = 2 R² (EA + F)/L − F h of both cables, where h is half of L."""
    F = np.array([20.0, 500.0])

    def along(F: Array | float) -> Array:
        return np.asarray((R**2 * (EA + F) / H - F * H) / LENGTH**2)

    plan = cdsm.plan_path(hinge(), DOWN, along(F), 10.0, angles=np.zeros((2, 1)))
    np.testing.assert_allclose(plan.tensions, np.transpose([F, F]), rtol=1e-9)
    middle = float(EA / np.mean(1.0 / (1.0 + F / EA)) - EA)
    (between,) = plan.between
    assert between.stiffness is not None
    np.testing.assert_allclose(between.stiffness.tension, middle, rtol=1e-9)
    assert float(between.achieved or 0.0) == pytest.approx(float(along(middle)), rel=1e-9)
    assert between.misfit == pytest.approx(1.0 - along(middle) / along(F).mean(), rel=1e-7)
    assert f"up to {100.0 * between.misfit:.2g} % off (samples 0 and 1)" in str(plan)


def test_half_the_step_leaves_a_quarter_of_the_error_half_way() -> None:
    worst = []
    for count in (9, 17, 33):
        s = np.linspace(0.0, math.pi, count)
        plan = cdsm.plan_path(ARM, DOWN, 70e3 + 20e3 * np.sin(s), 50.0, angles=waving(count))
        assert [each.index for each in plan.between] == list(range(count - 1))
        worst.append(max(each.misfit for each in plan.between))
    assert worst[0] < 2e-3
    for coarse, fine in itertools.pairwise(worst):
        assert 3.5 < coarse / fine < 4.5


def test_motors_pay_out_the_unstrained_length_whatever_the_stiffness_takes_for_it() -> None:
    s = np.linspace(0.0, math.pi, 9)
    plans = [
        cdsm.plan_path(
            presets.virtual_prototype(original_length=name),
            DOWN,
            70e3 + 20e3 * np.sin(s),
            50.0,
            angles=waving(9),
        )
        for name in ("unstrained", "stretched")
    ]
    for plan in plans:
        lengths = plan.unstrained_lengths * (1.0 + STRAND.strain(plan.tensions))
        np.testing.assert_allclose(lengths, plan.cable_lengths, rtol=1e-14)
    worst = [max(each.misfit for each in plan.between) for plan in plans]
    assert worst[1] == pytest.approx(worst[0], rel=0.2)


def test_only_neighbours_have_something_between_them() -> None:
    plan = cdsm.plan_path(ARM, DOWN, [80e3, 80e3, 1e7, 80e3], 50.0, angles=waving(4))
    assert [each.index for each in plan.between] == [0]
    assert cdsm.plan_path(ARM, DOWN, 80e3, 50.0, angles=waving(1)).between == ()
    at_once = cdsm.plan_path(ARM, None, np.eye(3) * 1e9, 50.0, angles=waving(2))
    assert at_once.between == ()


def test_several_targets_are_missed_by_their_norm_half_way() -> None:
    q = waving(3)[:2]
    held = [cdsm.stiffness(ARM.at(a), cdsm.distribute_tension(ARM.at(a), 60.0)) for a in q]
    directions = np.eye(3)[1:]
    several = np.array([[K.along(u) for u in directions] for K in held])
    (two,) = cdsm.plan_path(ARM, directions, several, 30.0, 300.0, angles=q).between
    assert two.stiffness is not None
    along = [two.stiffness.along(u) for u in directions]
    np.testing.assert_array_equal(two.achieved, along)
    np.testing.assert_allclose(two.target, several.mean(axis=0), rtol=1e-15)
    assert two.misfit == pytest.approx(np.linalg.norm(along / several.mean(axis=0) - 1.0))
    matrices = np.array([K.cartesian for K in held])
    (full,) = cdsm.plan_path(ARM, None, matrices, 30.0, 300.0, angles=q).between
    assert full.stiffness is not None
    off = full.stiffness.cartesian - matrices.mean(axis=0)
    assert full.misfit == pytest.approx(np.linalg.norm(off) / np.linalg.norm(matrices.mean(axis=0)))
    assert 0.0 < full.misfit < 0.1


def test_arm_that_does_not_come_to_rest_half_way_says_why() -> None:
    """A hinge K = 1.8 + 0.08 F − 0.1 P: tensions fall faster than the load that they hold."""
    arm, F, P = hinge(law=cdsm.LinearElasticity(20.0)), [100.0, 1.0], np.array([90.0, 15.0])
    W = np.outer(P, [-1.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    straight = arm.at([0.0])
    stiff = [
        cdsm.stiffness(straight, [f, f], wrench=w).along(DOWN) for f, w in zip(F, W, strict=True)
    ]
    plan = cdsm.plan_path(arm, DOWN, stiff, 0.5, 200.0, W, angles=np.zeros((2, 1)))
    np.testing.assert_allclose(plan.tensions, np.transpose([F, F]), rtol=1e-6)
    (between,) = plan.between
    assert between.stiffness is None
    assert between.achieved is None
    assert between.misfit == math.inf
    assert "the arm buckles" in between.reason
    assert f"half-way between samples 0 and 1: {between.reason}" in str(plan)
    assert "smaller steps" in between.reason
    assert repr(between) == "<HalfWay from sample 0 to 1, misfit inf>"


def test_cable_that_leaves_its_law_half_way_is_named() -> None:
    law = cdsm.TabulatedElasticity((15.0, 100.0, 400.0), (0.0, 2e-3, 8e-3))
    arm = presets.virtual_prototype(law)
    q = np.outer([2.0, -2.0], np.full(10, presets.TEN_DEGREES))
    targets = [1.02 * cdsm.stiffness_range(arm.at(a), DOWN, 15.0, 300.0).low for a in q]
    plan = cdsm.plan_path(arm, DOWN, targets, 15.0, 300.0, angles=q)
    (between,) = plan.between
    assert between.misfit == math.inf
    assert "cable1_1" in between.reason
    assert "[15 N, 400 N]" in between.reason


# --- the border -----------------------------------------------------------------------------

BAD: list[tuple[dict[str, Any], str]] = [
    ({"angles": None}, "angles: neither of angles= and tips="),
    ({"tips": np.zeros((2, 3))}, "angles: both of angles= and tips="),
    ({"angles": np.zeros(10)}, r"angles: shape \(10,\) given; \(S, 10\)"),
    ({"angles": np.zeros((0, 10))}, "angles: shape"),
    ({"angles": [[math.nan] * 10]}, "angles: entry"),
    ({"angles": None, "tips": np.zeros((2, 2))}, r"tips: shape \(2, 2\) given; \(S, 3\)"),
    ({"angles": None, "tips": np.zeros((1, 3)), "guess": [9.0] * 10}, "guess"),
    ({"guess": np.zeros(10)}, "guess: given with angles="),
    ({"target": [1e4] * 5}, r"target: shape \(5,\) given; \(\) for all samples or \(2,\)"),
    ({"target": [8e4, -1.0]}, "target: -1 N/m given"),
    ({"target": math.nan}, "target"),
    ({"direction": np.eye(3)}, r"target: shape \(\) given; \(3,\)"),
    ({"direction": (0.0, 0.0, 0.0)}, "zero vector"),
    ({"direction": np.eye(2)}, "direction: shape"),
    ({"direction": None, "target": np.triu(np.ones((3, 3)))}, "symmetric"),
    ({"rate": 0.0}, "rate: 0 N given"),
    ({"rate": -1.0}, "rate: -1 N given"),
    ({"rate": math.nan}, "rate"),
    ({"rate": [1.0, 2.0]}, "rate: shape"),
    ({"wrench": np.zeros((3, 6))}, "wrench: shape"),
    ({"minimum": 80.0, "maximum": 70.0}, "maximum: 70 N given"),
    ({"minimum": -1.0}, "minimum"),
    ({"margin": 0.0}, "margin"),
    ({"starts": 0}, "starts"),
    ({"seed": -1}, "seed"),
    ({"arm": "this one"}, "arm"),
]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"minimum": 5.0, "maximum": 1.0}, "maximum: 1 N given"),
        ({"minimum": -1.0}, "minimum: -1 N given"),
        ({"margin": 2.0}, "margin: 2 given"),
    ],
)
def test_what_no_sample_could_do_is_refused_before_any(
    change: dict[str, Any], message: str
) -> None:
    beyond = np.full((2, ARM.nv), 9.0)  # no posture is possible, so that no sample would notice
    with pytest.raises(cdsm.InvalidInput, match=message):
        cdsm.plan_path(ARM, DOWN, 8e4, angles=beyond, **change)


@pytest.mark.parametrize(("change", "message"), BAD)
def test_bad_input_is_named(change: dict[str, Any], message: str) -> None:
    given = {"arm": ARM, "direction": DOWN, "target": 8e4, "minimum": 50.0, "angles": waving(2)}
    with pytest.raises(cdsm.InvalidInput, match=message):
        cdsm.plan_path(**{**given, **change})


def test_what_is_printed_sums_up_and_names(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    for name in ("FORCE_COLOR", "TTY_COMPATIBLE"):  # which rich takes for a terminal
        monkeypatch.delenv(name, raising=False)
    targets = [80e3, 80e3, 1e7, 1e7, 80e3, 1e7]
    plan = cdsm.plan_path(ARM, DOWN, targets, 50.0, angles=waving(6))
    lines = str(plan).splitlines()
    assert lines[0].startswith("3 of 6 samples planned, with 50 to ")
    assert "N per step" in lines[0]
    assert lines[1].startswith("half-way between samples the stiffness is up to ")
    assert lines[1].endswith(" % off (samples 0 and 1)")
    assert lines[2].startswith("samples 2 to 3: stiffness, the first of them: no admissible")
    assert lines[3].startswith("sample 5: stiffness")
    assert len(lines) == 4
    assert repr(plan) == "<PathPlan of 3 of 6 samples>"
    # nobody looks at the standard error, so that there is no bar
    assert capsys.readouterr().err == ""


def test_bar_is_shown_on_a_terminal_unless_it_is_not_wanted(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("FORCE_COLOR", "1")  # what rich takes for a terminal
    cdsm.plan_path(ARM, DOWN, 80e3, 50.0, angles=waving(2), progress=False)
    assert capsys.readouterr().err == ""
    cdsm.plan_path(ARM, DOWN, 80e3, 50.0, angles=waving(2))
    assert "planning the path" in capsys.readouterr().err
