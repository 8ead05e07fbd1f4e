"""Where a loaded arm comes to rest, against potentials, closed forms and the linear compliance."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

import cdsm
from cdsm.statics.locked_arm import LockedArm
from cdsm.support.values import Array
from tests.support import arms
from tests.support.differences import assert_second_order
from tests.support.locked import (
    ARMS,
    EA,
    MOMENT,
    SIZES,
    STRAND,
    balanced,
    compressed,
    hinge,
    original_lengths,
    potential,
    pulls,
    restoring,
    soft_hinge,
    some_arm,
)

# --- potential, torque, stiffness -----------------------------------------------------------


@pytest.mark.parametrize("name", ARMS)
def test_torque_is_the_gradient_of_the_potential_and_stiffness_that_of_the_torque(
    name: str,
) -> None:
    pose, pull = balanced(name, moment=False)
    arm = pose.arm
    W = pull.wrench + arms.random_wrench(7, moment=False)
    loaded = LockedArm(pose, pull.values, W)
    q = pose.q + 1e-3 * np.random.default_rng(3).normal(size=arm.nv)
    here = loaded.at(q)
    energy = potential(pose, pull.values, W[:3])

    def at(y: Array) -> cdsm.Posture:
        return arm.at(y, check_limits=False)

    # steps so small that no tension leaves its law: 30 µm of cable at most
    small: Any = {"step": 2.0**-10, "size": 100.0, "tolerance": 1e-8}
    assert_second_order(lambda y: np.array(energy(at(y))), here.residual, q, **small)
    assert_second_order(lambda y: loaded.at(y).residual, here.stiffness, q, **small)


# --- stiffness ------------------------------------------------------------------------------


@pytest.mark.parametrize("moment", [False, True], ids=["force", "wrench"])
@pytest.mark.parametrize("name", ARMS)
def test_small_loads_move_the_arm_by_its_compliance(name: str, moment: bool) -> None:
    pose, pull = balanced(name, moment=moment)
    K = cdsm.stiffness(pose, pull)
    R = pose.tip[:3, :3]
    reach = np.array([pose.arm.geometry.length] * 3 + [1.0] * 3)
    C = K.compliance / reach[:, None] * reach[::-1]  # rad per newtons at the arm's length
    scale = 0.1 / abs(C).max()

    def tip(load: Array) -> Array:
        extra = scale * load * reach[::-1]
        there = cdsm.equilibrium(pose, pull, pull.wrench + extra).pose.tip
        turn = there[:3, :3] @ R.T
        # the axis times the sine of the angle, which starts out as the angle
        twice = [turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]]
        motion = np.append(there[:3, 3] - pose.tip[:3, 3], np.array(twice) / 2.0)
        return np.asarray(motion / reach)

    # 2 mrad at most; the laws are less smooth than the places, so h⁶ leaves more
    assert_second_order(tip, scale * C, np.zeros(6), step=2.0**-6, size=10.0, tolerance=1e-8)


def test_stiffness_at_rest_keeps_the_original_lengths_of_the_reference() -> None:
    """And since l_0 is what the motors hold, K of the arm at rest, taken anew, is the same."""
    pose, pull = balanced("universal-3-8-all")
    rest = cdsm.equilibrium(pose, pull, pull.wrench + 3.0 * arms.random_wrench(9))
    locked = original_lengths(pose, pull.values)
    np.testing.assert_allclose(rest.stiffness.free_lengths, locked, rtol=1e-12)
    for c, cable in enumerate(pose.arm.cables):
        k = cable.tangent_stiffness(rest.tension[c], locked[c])
        expected = k if cable.control == "position" else 0.0
        assert rest.stiffness.cable_stiffness[c] == pytest.approx(expected, rel=1e-12)
    assert abs(rest.pose.cable_lengths / pose.cable_lengths - 1.0).max() > 1e-4
    anew = cdsm.stiffness(rest.pose, rest.tension, rest.wrench)
    held = [cable.control == "position" for cable in pose.arm.cables]
    np.testing.assert_allclose(anew.free_lengths[held], locked[held], rtol=1e-11)
    np.testing.assert_allclose(anew.joint, rest.stiffness.joint, rtol=1e-9, atol=1e-9)
    np.testing.assert_array_equal(rest.stiffness.wrench, rest.wrench)


# --- one hinge, closed form -----------------------------------------------------------------


@pytest.mark.parametrize("angle", [-0.3, 0.005, 0.05, 0.4])
def test_hinge_rests_where_the_closed_form_says_with_one_cable_slack(angle: float) -> None:
    pose = hinge(limit=0.5).at([0.0])
    rest = cdsm.equilibrium(pose, [20.0, 20.0], restoring(angle) * MOMENT)
    assert rest.pose.q[0] == pytest.approx(angle, rel=1e-12)
    expected = pulls(angle)
    np.testing.assert_allclose(sorted(rest.tension), sorted(expected), rtol=1e-11)
    # 20 N of 2 kN are 1 % strain of 20 mm, which 0.2 mm of cable or 6.7 mrad take away
    loose = [cable.name for cable, F in zip(pose.arm.cables, rest.tension, strict=True) if F == 0]
    assert len(loose) == (abs(angle) > 0.01)
    assert rest.slack == tuple(loose)
    assert rest.stable
    assert ("slack" in str(rest)) == (abs(angle) > 0.01)


def test_stops_hold_some_joints_of_an_arm_and_the_others_find_their_balance() -> None:
    arm = some_arm("universal-3-8-table")
    geometry = replace(
        arm.geometry, joints=tuple(replace(j, limit=0.02) for j in arm.geometry.joints)
    )
    narrow = cdsm.Manipulator(geometry, cables=arm.cables, gravity=arm.gravity)
    pose = narrow.at(np.zeros(narrow.nv))
    pull = cdsm.distribute_tension(pose, minimum=40.0)
    W = np.array([0.0, 15.0, -10.0, 0.0, 0.0, 0.3])
    rest = cdsm.equilibrium(pose, pull, W)
    assert 0 < len(rest.at_limit) < narrow.nv
    held = np.array([name in rest.at_limit for name in narrow.joint_names])
    np.testing.assert_array_equal(abs(rest.pose.q[held]), 0.02)
    assert (abs(rest.pose.q[~held]) < 0.02).all()
    # a stop pushes inwards, and only a stop that is touched
    assert (np.sign(rest.stop_torque[held]) == -np.sign(rest.pose.q[held])).all()
    np.testing.assert_array_equal(rest.stop_torque[~held], 0.0)
    np.testing.assert_allclose(
        rest.residual + rest.stop_torque, rest.stiffness.residual, atol=1e-15
    )
    assert abs(rest.residual).max() < 1e-11
    # without the stops the arm goes further: they do something
    wide = cdsm.Manipulator(arm.geometry, cables=arm.cables, gravity=arm.gravity)
    assert abs(cdsm.equilibrium(wide.at(pose.q), pull.values, W).pose.q).max() > 0.021


# --- buckling -------------------------------------------------------------------------------


@pytest.mark.parametrize(("load", "buckles"), [(15.9, False), (16.1, True), (18.0, True)])
def test_straight_hinge_leaves_the_saddle_beyond_its_buckling_load(
    load: float, buckles: bool
) -> None:
    pose = soft_hinge(limit=1.2).at([0.0])
    W = np.array([-load, 0.0, 0.0, 0.0, 0.0, 0.0])
    K = cdsm.stiffness(pose, [20.0, 20.0], W)
    assert K.joint[0, 0] == pytest.approx(1.6 - load / 10.0, abs=1e-12)
    assert abs(K.residual[0]) < 1e-14
    rest = cdsm.equilibrium(pose, [20.0, 20.0], W)
    lowest = minimize_scalar(
        lambda q: compressed(q, load), bounds=(0.0, 1.2), method="bounded", options={"xatol": 1e-10}
    )
    # the minimum is flat: a bracketing search finds it to the root of the rounding
    assert rest.pose.q[0] == pytest.approx(lowest.x if buckles else 0.0, abs=1e-6)
    assert rest.stable
    if buckles:
        assert rest.pose.q[0] > 0.05  # which way is open; the same each time
        assert compressed(rest.pose.q[0], load) < compressed(0.0, load)
    again = cdsm.equilibrium(pose, [20.0, 20.0], W)
    np.testing.assert_array_equal(again.pose.q, rest.pose.q)


@pytest.mark.parametrize("push", [1e-12, 1e-8, 1e-3])
def test_no_push_is_too_small_to_lead_off_a_ridge(push: float) -> None:
    """Past buckling in all directions at once: the way down turns as the push does."""
    sizes = {**SIZES, "joints": 1, "cables_per_joint": 3, "link_length": 0.04, "lead": 0.98}
    sizes.pop("twist")
    arm = cdsm.Manipulator(
        cdsm.Geometry.universal(**sizes), cdsm.LinearElasticity(1000.0), gravity=(0.0, 0.0, 0.0)
    )
    pose = arm.at([0.0, 0.0])
    rest = cdsm.equilibrium(pose, np.full(3, 350.0), [0.0, 0.6 * push, 0.8 * push, 0.0, 0.0, 0.0])
    assert rest.stable
    assert abs(rest.pose.q).max() > 0.1


def test_two_hinges_beyond_buckling_rest_in_a_minimum_that_brute_force_finds() -> None:
    arm = soft_hinge(limit=0.6, joints=2, twist=0.4)
    pose = arm.at([0.0, 0.0])
    tension = np.full(4, 20.0)
    W = np.array([-10.6, 0.0, 0.0, 0.0, 0.0, 0.0])
    assert cdsm.stiffness(pose, tension, W).margin < -0.02
    rest = cdsm.equilibrium(pose, tension, W)
    assert rest.stable
    energy = potential(pose, tension, W[:3])
    axis = np.linspace(-0.6, 0.6, 25)
    field = np.array([[energy(arm.at([a, b])) for b in axis] for a in axis])
    a, b = np.unravel_index(field.argmin(), field.shape)
    least = energy(rest.pose)
    assert least < energy(pose) - 1e-3
    # one of the two that mirror each other, and no grid point is lower
    assert least <= field.min()
    near = min(abs(rest.pose.q - side * np.array([axis[a], axis[b]])).max() for side in (1, -1))
    assert near < 0.06


# --- slack and neutral ----------------------------------------------------------------------


def test_hanging_hinge_with_all_cables_slack_is_a_pendulum() -> None:
    # one cable above the hinge, which the arm slackens as it swings up in gravity along +x +z
    geometry = cdsm.Geometry.hinged(**{**SIZES, "link_mass": 0.4, "cables_per_joint": 1})
    arm = cdsm.Manipulator(geometry, cdsm.LinearElasticity(EA), gravity=(9.0, 0.0, 1.8))
    pose = arm.at([0.0])
    assert pose.length_jacobian[0, 0] > 0.0  # it slackens with negative angles
    rest = cdsm.equilibrium(pose, [1.0])
    # about y, z turns towards x: the link points along gravity at −atan(1.8/9)
    assert rest.pose.q[0] == pytest.approx(-math.atan(0.2), rel=1e-11)
    np.testing.assert_array_equal(rest.tension, 0.0)
    assert rest.slack == ("cable1_1",)
    assert rest.stable
    assert not rest.stiffness.passive.any()


def test_arm_without_any_tension_or_weight_is_neutral() -> None:
    arm = hinge()
    cables = [replace(cable, control="force") for cable in arm.cables]
    limp = cdsm.Manipulator(arm.geometry, cables=cables, gravity=(0.0, 0.0, 0.0))
    rest = cdsm.equilibrium(limp.at([0.1]), [0.0, 0.0])
    assert rest.pose.q[0] == 0.1
    assert not rest.stable
    assert not rest.slack  # force control: it is what was asked for
    assert "NEUTRAL" in str(rest)


# --- ends of the laws -----------------------------------------------------------------------


def test_answer_below_a_law_names_the_cables_though_iterates_may_pass() -> None:
    arm = hinge(limit=0.5, law=STRAND)
    soft = [replace(cable, series_stiffness=2e3) for cable in arm.cables]
    arm = cdsm.Manipulator(arm.geometry, cables=soft, gravity=(0.0, 0.0, 0.0))
    pose = arm.at([0.0])
    with pytest.raises(cdsm.ElasticityRangeError, match=r"\[2\.2 N, 810 N\]") as caught:
        cdsm.equilibrium(pose, [10.0, 10.0], 1.0 * MOMENT)
    (name,) = caught.value.cables
    assert name == arm.cables[caught.value.indices[0]].name
    assert caught.value.tension[0] < 2.2
    assert cdsm.equilibrium(pose, [30.0, 30.0], 1.0 * MOMENT).tension.min() > 2.2


# --- stops ----------------------------------------------------------------------------------


def test_disks_that_touch_are_stops_just_before() -> None:
    # the default limit: there the holes of the cable inside meet, and it has no direction
    arm = hinge()
    rest = cdsm.equilibrium(arm.at([0.0]), [20.0, 20.0], 200.0 * MOMENT)
    assert rest.at_limit == ("joint1",)
    assert rest.pose.q[0] == pytest.approx(arm.upper[0] - 1e-6, abs=1e-12)
    assert rest.stop_torque[0] == pytest.approx(restoring(rest.pose.q[0]) - 200.0, rel=1e-12)


def test_compliance_at_a_stop_is_that_of_the_other_joints() -> None:
    """Of two hinges the second rests on its stop: the tip turns about the first alone."""
    arm = hinge(joints=2)
    first, second = arm.geometry.joints
    geometry = replace(arm.geometry, joints=(first, replace(second, limit=0.02)))
    stopped = cdsm.Manipulator(geometry, cables=arm.cables, gravity=(0.0, 0.0, 0.0))
    moment = MOMENT
    rest = cdsm.equilibrium(stopped.at([0.0, 0.0]), np.full(4, 20.0), moment)
    assert rest.at_limit == ("joint2",)
    J = rest.pose.jacobian[:, :1]
    expected = J @ J.T / rest.stiffness.joint[0, 0]
    np.testing.assert_allclose(rest.compliance, expected, rtol=1e-12, atol=1e-18)
    free = cdsm.equilibrium(arm.at([0.0, 0.0]), np.full(4, 20.0), 0.1 * moment)
    np.testing.assert_array_equal(free.compliance, free.stiffness.compliance)


# --- the question ---------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("angle", "tension", "wrench", "said"),
    [
        (0.0, [20.0], None, "tension"),
        (0.0, [20.0, -1.0], None, "only pull"),
        (0.0, [20.0, 20.0], [1.0, 2.0, 3.0], "wrench"),
        (0.0, [20.0, 20.0], [math.nan, 0.0, 0.0, 0.0, 0.0, 0.0], "wrench"),
        (0.25, [20.0, 20.0], None, "joint1 = 14.32°.*11.46°"),
        (-0.25, [20.0, 20.0], None, "joint1 = -14.32°.*11.46°"),
    ],
)
def test_bad_input_is_named(angle: float, tension: Any, wrench: Any, said: str) -> None:
    pose = hinge(limit=0.2).at([angle], check_limits=False)
    with pytest.raises(cdsm.InvalidInput, match=said):
        cdsm.equilibrium(pose, tension, wrench)
