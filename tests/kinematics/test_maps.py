"""Kinematic maps: closed forms, round trips, optimality, and targets out of reach."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from scipy.optimize import minimize, minimize_scalar
from scipy.spatial.transform import Rotation

import cdsm
from cdsm.kinematics.residuals import LengthResidual, Residual, TipResidual
from cdsm.support.values import Array
from tests.support.arms import STEEL, mixed_arm, random_arm, random_posture, readme_geometry
from tests.support.differences import assert_second_order

ARMS: dict[str, Callable[[], cdsm.Manipulator]] = {
    **{
        f"{kind}-{n}": lambda n=n, kind=kind: random_arm(n + 60, n, kind)  # type: ignore[misc]
        for kind in ("universal", "hinged")
        for n in (1, 2, 3, 4, 5, 7, 10)
    },
    "mixed": mixed_arm,
}

# joints that stand within this part of their limit rest on it, see residuals.LIMIT_MARGIN
AT_LIMIT = 2e-5

GENTLE = math.radians(25.0)


def planar_arm(joints: int, **changes: Any) -> cdsm.Manipulator:
    """Hinges about y only: it moves in the plane of x and z, and its inverse is school geometry."""
    sizes: dict[str, Any] = {
        "joints": joints,
        "twist": 0.0,
        "link_length": 0.1,
        "base_length": 0.04,
        "disk_offset": 0.01,
        "hole_radius": 0.02,
        "link_mass": 0.1,
        "joint_limit": 0.9,
        "lead": 0.3,
    }
    return cdsm.Manipulator(cdsm.Geometry.hinged(**(sizes | changes)), STEEL)


def limited_arm() -> cdsm.Manipulator:
    """Limits well before the disks touch, and so near that they are met."""
    geometry = readme_geometry(link_mass=0.1, joint_limit=0.4, lead=0.0)
    return cdsm.Manipulator(geometry, STEEL)


def gentle_posture(arm: cdsm.Manipulator, seed: int) -> Array:
    """Joint angles within ±25° and the limits."""
    most = np.minimum(GENTLE, arm.upper)
    return np.random.default_rng([seed, arm.nv]).uniform(-1.0, 1.0, arm.nv) * most


def resting(arm: cdsm.Manipulator, angles: Array) -> Array:
    """Which limit each joint rests on (nv,): −1 the lower, 1 the upper, 0 none."""
    near = (1.0 - AT_LIMIT) * arm.upper
    return (angles >= near).astype(float) - (angles <= -near)


def assert_least(arm: cdsm.Manipulator, angles: Array, slope: Array, size: float) -> None:
    """Assert that what has this slope is least here: it is level, or falls only beyond a limit."""
    held = resting(arm, angles)
    assert abs(slope[held == 0]).max(initial=0.0) < 1e-10 * size
    assert (held * slope).max() < 1e-10 * size


def assert_nearest(arm: cdsm.Manipulator, angles: Array, guess: Array, J: Array) -> None:
    """Assert the optimality of min ½‖θ − guess‖² among the angles that answer alike.

    θ − guess has no part in the null space of J, as far as joints are free; and a joint that rests
    on a limit is pressed against it. The multipliers of the answer are those of least squares.
    """
    free = resting(arm, angles) == 0
    away = angles - guess
    _, values, right = np.linalg.svd(J[:, free])
    rank = int((values > 1e-9 * values.max(initial=0.0)).sum())
    null = right[rank:]
    # 1e-10: rounding over the smallest singular value that counts here, some 1e-3
    assert abs(null @ away[free]).max(initial=0.0) < 1e-10
    multiplier = np.linalg.lstsq(J[:, free].T, away[free], rcond=1e-9)[0]
    slope = away - multiplier @ J
    assert (resting(arm, angles) * slope).max() < 1e-9


# --- cable lengths from joint angles ------------------------------------------------------------


@pytest.mark.parametrize("name", ARMS)
def test_eq8_cable_lengths_are_those_of_the_posture(name: str) -> None:
    arm = ARMS[name]()
    for seed in range(3):
        pose = random_posture(arm, seed)
        lengths = arm.cable_lengths(pose.q)
        np.testing.assert_array_equal(lengths, pose.cable_lengths)
        assert not lengths.flags.writeable


def test_eq8_cable_lengths_of_one_hinge_in_closed_form() -> None:
    arm = planar_arm(1)
    q, h, R = 0.35, 0.01, 0.02
    # the chord between two disks; turning about y lifts +z away from what is ahead
    chord = 2.0 * np.array(
        [
            h * math.cos(q / 2) + R * math.sin(q / 2),
            h * math.cos(q / 2) - R * math.sin(q / 2),
        ]
    )
    lengths = arm.cable_lengths([q])
    np.testing.assert_allclose(sorted(lengths), sorted(0.3 + chord), rtol=0.0, atol=1e-16)
    # the shorter one is on the side that the arm turns to: −z for a positive turn about y
    bottom = int(np.argmin([path[0, 2] for path in arm.at([q]).cable_paths]))
    assert lengths[bottom] == lengths.min()


def test_cable_lengths_check_the_joint_limits_unless_told_not_to() -> None:
    arm = planar_arm(2)
    with pytest.raises(cdsm.JointLimitError, match=r"joint2 = 57\.3°"):
        arm.cable_lengths([0.0, 1.0])
    beyond = arm.cable_lengths([0.0, 1.0], check_limits=False)
    np.testing.assert_array_equal(beyond, arm.at([0.0, 1.0], check_limits=False).cable_lengths)
    with pytest.raises(cdsm.InvalidInput, match=r"q: shape \(3,\) given, \(2,\) needed"):
        arm.cable_lengths([0.0, 0.0, 0.0])


def test_cable_lengths_where_sites_coincide_name_the_cable() -> None:
    arm = random_arm(1, 2, "hinged")  # its limits are where the disks touch
    with pytest.raises(cdsm.CableError, match=r"cable1_\d.*coincide at q"):
        arm.cable_lengths([arm.upper[0], 0.0])


# --- joint angles from cable lengths ------------------------------------------------------------


@pytest.mark.parametrize("kind", ["universal", "hinged"])
@pytest.mark.parametrize("joints", range(1, 11))
def test_eq5_lengths_of_a_posture_give_its_angles_back(kind: str, joints: int) -> None:
    for seed in range(5):  # a hundred in all
        arm = random_arm(joints + 10 * seed, joints, kind)
        q = gentle_posture(arm, seed)
        found = cdsm.solve_joint_angles(arm, arm.cable_lengths(q))
        assert found.reachable
        assert found.redundancy == 0
        # rounding of a length of 1 m over a moment arm of 1 cm is 1e-14
        np.testing.assert_allclose(found.angles, q, rtol=0.0, atol=1e-12)
        np.testing.assert_allclose(found.residual, 0.0, rtol=0.0, atol=1e-14)


@pytest.mark.parametrize("kind", ["universal", "hinged"])
def test_eq5_round_trip_holds_up_to_the_limits(kind: str) -> None:
    for seed in range(6):
        arm = random_arm(seed, 6, kind)
        pose = random_posture(arm, seed, reach=1.0)
        found = cdsm.solve_joint_angles(arm, pose.cable_lengths)
        np.testing.assert_allclose(found.angles, pose.q, rtol=0.0, atol=1e-12)


def test_eq5_round_trip_of_a_mixed_arm_from_another_guess() -> None:
    arm = mixed_arm()
    q = np.array([0.3, -0.2, 0.4, -0.35, 0.25])
    found = cdsm.solve_joint_angles(arm, arm.cable_lengths(q), guess=-q)
    np.testing.assert_allclose(found.angles, q, rtol=0.0, atol=1e-12)


def test_joint_at_its_limit_is_found_there() -> None:
    arm = planar_arm(3)
    q = np.array([0.2, arm.upper[1], -0.4])
    found = cdsm.solve_joint_angles(arm, arm.cable_lengths(q))
    assert found.reachable
    assert found.at_limit == ("joint2",)
    np.testing.assert_allclose(found.angles, q, rtol=0.0, atol=1e-12)


@pytest.mark.parametrize("kind", ["universal", "hinged"])
@pytest.mark.parametrize("joints", [2, 3, 5, 9])
def test_too_few_cables_give_the_angles_nearest_the_guess(kind: str, joints: int) -> None:
    full = random_arm(joints, joints, kind)
    random = np.random.default_rng(joints)
    kept = random.choice(len(full.cables), full.nv // 2, replace=False)
    arm = cdsm.Manipulator(full.geometry, cables=[full.cables[c] for c in sorted(kept)])
    for seed in range(3):
        q = gentle_posture(arm, seed)
        guess = gentle_posture(arm, seed + 50)
        found = cdsm.solve_joint_angles(arm, arm.cable_lengths(q), guess)
        assert found.reachable
        assert found.redundancy >= arm.nv - arm.nv // 2
        np.testing.assert_allclose(found.lengths, arm.cable_lengths(q), rtol=0.0, atol=1e-14)
        assert_nearest(arm, found.angles, guess, found.posture.length_jacobian)
        assert np.linalg.norm(found.angles - guess) < np.linalg.norm(q - guess)


def test_guess_that_answers_already_is_the_answer() -> None:
    full = random_arm(3, 4)
    arm = cdsm.Manipulator(full.geometry, cables=full.cables[:5])
    pose = random_posture(arm, 1)
    found = cdsm.solve_joint_angles(arm, pose.cable_lengths, guess=pose.q)
    np.testing.assert_allclose(found.angles, pose.q, rtol=0.0, atol=1e-14)
    moved = cdsm.inverse_kinematics(arm, pose.tip, guess=pose.q)
    np.testing.assert_allclose(moved.angles, pose.q, rtol=0.0, atol=1e-14)


def test_lengths_that_no_posture_has_give_the_nearest_in_closed_form() -> None:
    # both cables of a hinge longer than straight: by symmetry the straight arm is the nearest
    arm = planar_arm(1)
    straight = arm.cable_lengths([0.0])
    found = cdsm.solve_joint_angles(arm, straight + 1e-3, guess=[0.1])
    assert not found.reachable
    assert found.angles == pytest.approx(0.0, abs=1e-12)
    np.testing.assert_allclose(found.residual, -1e-3, rtol=1e-12)
    # one longer and one shorter by more than the limit allows: the joint rests on the limit
    away = arm.cable_lengths([0.9]) - straight
    found = cdsm.solve_joint_angles(arm, straight + 1.5 * away)
    assert not found.reachable
    assert found.angles == 0.9
    assert found.at_limit == ("joint1",)
    np.testing.assert_allclose(found.residual, -0.5 * away, rtol=1e-12)


def test_nearest_lengths_of_a_hinge_are_those_of_a_search_over_its_angle() -> None:
    arm = planar_arm(1)
    wanted = arm.cable_lengths([0.3]) + np.array([2e-3, 1e-3])
    best = minimize_scalar(
        lambda q: 1e6 * np.sum((arm.cable_lengths([q]) - wanted) ** 2),
        bounds=(-0.9, 0.9),
        method="bounded",
        options={"xatol": 1e-10},
    )
    found = cdsm.solve_joint_angles(arm, wanted)
    assert found.angles[0] == pytest.approx(best.x, abs=1e-7)  # what a parabola's floor allows
    assert not found.reachable


@pytest.mark.parametrize("noise", [1e-6, 1e-4, 1e-2])
@pytest.mark.parametrize("kind", ["universal", "hinged"])
def test_nearest_lengths_leave_a_residual_that_no_joint_can_lessen(kind: str, noise: float) -> None:
    for seed in range(3):
        arm = random_arm(seed, 4, kind)
        random = np.random.default_rng(seed)
        wanted = arm.cable_lengths(gentle_posture(arm, seed))
        wanted = wanted + random.normal(0.0, noise, wanted.size) * arm.geometry.hole_radius / 0.03
        found = cdsm.solve_joint_angles(arm, abs(wanted))
        assert not found.reachable
        slope = found.residual @ found.posture.length_jacobian
        assert_least(arm, found.angles, slope, float(np.linalg.norm(found.residual)))
        np.testing.assert_array_equal(found.lengths, arm.cable_lengths(found.angles))
        np.testing.assert_array_equal(found.residual, found.lengths - found.cable_lengths)


def test_measured_lengths_are_reachable_within_their_error() -> None:
    arm = random_arm(2, 5)
    q = gentle_posture(arm, 1)
    error = np.random.default_rng(1).normal(0.0, 1e-5, len(arm.cables))
    found = cdsm.solve_joint_angles(arm, arm.cable_lengths(q) + error, tolerance=1e-3)
    assert found.reachable
    exact = cdsm.solve_joint_angles(arm, arm.cable_lengths(q) + error)
    assert not exact.reachable
    np.testing.assert_array_equal(found.angles, exact.angles)
    assert exact.iterations > found.iterations  # other starts were tried in vain


# --- joint angles from the tip ------------------------------------------------------------------


@pytest.mark.parametrize("kind", ["universal", "hinged"])
@pytest.mark.parametrize("joints", [3, 4, 5, 7, 10, 20])
@pytest.mark.parametrize("what", ["position", "pose"])
def test_eq7_tip_of_a_posture_is_reached_by_the_nearest_angles(
    kind: str, joints: int, what: str
) -> None:
    arm = random_arm(joints + 60, joints, kind)
    for seed in range(2):
        pose = random_posture(arm, seed, reach=0.95)
        guess = np.zeros(arm.nv) if seed == 0 else gentle_posture(arm, 9)
        target = pose.tip if what == "pose" else pose.tip[:3, 3]
        found = cdsm.inverse_kinematics(arm, target, guess)
        assert found.reachable
        assert found.position_error < 1e-12
        assert found.orientation_error < 1e-12
        reached = arm.at(found.angles).tip  # within the limits, or it would raise
        np.testing.assert_array_equal(found.tip, reached)
        np.testing.assert_allclose(reached[:3, 3], pose.tip[:3, 3], rtol=0.0, atol=1e-12)
        if what == "pose":
            np.testing.assert_allclose(reached, pose.tip, rtol=0.0, atol=1e-12)
        J = found.posture.jacobian
        assert_nearest(arm, found.angles, guess, J if what == "pose" else J[:3])


# the search ends near a saddle for the first three, and the guess leads nowhere for the others
HARD = [("universal", 6, 8), ("universal", 8, 10), ("universal", 9, 13)]
HARD += [("hinged", 4, 0), ("hinged", 4, 2), ("hinged", 4, 4)]


@pytest.mark.parametrize(("kind", "joints", "seed"), HARD)
def test_eq7_hard_poses_are_reached_by_the_nearest_angles(
    kind: str, joints: int, seed: int
) -> None:
    arm = random_arm(joints + 60, joints, kind)
    found = cdsm.inverse_kinematics(arm, random_posture(arm, seed, reach=0.95).tip)
    assert found.reachable
    assert_nearest(arm, found.angles, np.zeros(arm.nv), found.posture.jacobian)


def test_eq7_answer_is_nearer_than_the_posture_the_target_came_from() -> None:
    for seed in range(10):
        arm = random_arm(seed, 6)
        pose = random_posture(arm, seed)
        found = cdsm.inverse_kinematics(arm, pose.tip[:3, 3])
        assert np.linalg.norm(found.angles) < np.linalg.norm(pose.q)


def test_eq7_no_other_solver_finds_nearer_angles() -> None:
    arm = limited_arm()
    target = random_posture(arm, 3, reach=0.9).tip[:3, 3]
    guess = gentle_posture(arm, 4)
    found = cdsm.inverse_kinematics(arm, target, guess)
    norms = []
    for seed in range(6):
        other = minimize(
            lambda q: 0.5 * np.sum((q - guess) ** 2),
            random_posture(arm, seed).q,
            jac=lambda q: q - guess,
            bounds=list(zip(arm.lower, arm.upper, strict=True)),
            constraints={
                "type": "eq",
                "fun": lambda q: 10.0 * (arm.at(q).tip[:3, 3] - target),
                "jac": lambda q: 10.0 * arm.at(q).jacobian[:3],
            },
            method="SLSQP",
            options={"ftol": 1e-14, "maxiter": 300},
        )
        if other.success:
            norms.append(np.linalg.norm(other.x - guess))
    assert len(norms) >= 3
    assert np.linalg.norm(found.angles - guess) == pytest.approx(min(norms), rel=1e-7)


@pytest.mark.parametrize("elbow", [1.0, -1.0])
def test_eq7_of_two_parallel_hinges_is_the_law_of_cosines(elbow: float) -> None:
    arm = planar_arm(2)
    bend = elbow * 0.6
    x, z = 0.15, -0.06
    # scaled to the distance that an elbow of ±0.6 rad spans
    reach = 2.0 * 0.1 * math.cos(bend / 2)
    x, z = (reach * value / math.hypot(x, z) for value in (x, z))
    first = math.atan2(-z, x) - bend / 2
    # both elbows reach it: the guess decides
    found = cdsm.inverse_kinematics(arm, [0.04 + x, 0.0, z], guess=[0.0, 0.2 * elbow])
    assert found.reachable
    np.testing.assert_allclose(found.angles, [first, bend], rtol=0.0, atol=1e-12)


def test_eq7_of_parallel_hinges_reaches_poses_though_the_jacobian_has_rank_three() -> None:
    arm = planar_arm(6)
    q = np.array([0.3, -0.5, 0.4, 0.2, -0.6, 0.1])
    found = cdsm.inverse_kinematics(arm, arm.at(q).tip)
    assert found.reachable
    assert np.linalg.matrix_rank(found.posture.jacobian) == 3
    assert_nearest(arm, found.angles, np.zeros(6), found.posture.jacobian)


def test_target_that_the_straight_arm_cannot_start_towards_is_reached() -> None:
    # straight ahead but nearer: no joint moves the tip backwards to first order
    arm = random_arm(4, 5)
    found = cdsm.inverse_kinematics(arm, [0.8 * arm.geometry.length, 0.0, 0.0])
    assert found.reachable
    assert abs(found.angles).max() > 0.1
    assert_nearest(arm, found.angles, np.zeros(arm.nv), found.posture.jacobian[:3])


def test_straight_arm_reaches_its_own_tip_where_the_jacobian_is_singular() -> None:
    arm = random_arm(4, 5)
    for target in (arm.at(np.zeros(10)).tip, arm.at(np.zeros(10)).tip[:3, 3]):
        found = cdsm.inverse_kinematics(arm, target)
        assert found.reachable
        np.testing.assert_array_equal(found.angles, 0.0)


# --- targets out of reach -----------------------------------------------------------------------


def test_far_target_stretches_the_arm_towards_it() -> None:
    arm = random_arm(5, 4)
    reach = 4 * arm.geometry.links[0].length
    start = np.array([arm.geometry.base_length, 0.0, 0.0])
    towards = np.array([1.0, 0.2, -0.15]) / math.sqrt(1.0 + 0.2**2 + 0.15**2)
    for distance in (1.1, 2.0, 20.0):
        found = cdsm.inverse_kinematics(arm, start + distance * reach * towards)
        assert not found.reachable
        assert found.position_error == pytest.approx((distance - 1.0) * reach, rel=1e-12)
        np.testing.assert_allclose(
            found.tip[:3, 3], start + reach * towards, rtol=0.0, atol=1e-9 * reach
        )
        np.testing.assert_allclose(found.angles[2:], 0.0, rtol=0.0, atol=1e-9)


def test_target_beyond_the_limits_presses_joints_against_them() -> None:
    arm = planar_arm(1)
    # straight up; a positive turn about y goes down
    found = cdsm.inverse_kinematics(arm, [0.04, 0.0, 0.1])
    assert not found.reachable
    assert found.angles == -0.9
    assert found.at_limit == ("joint1",)
    assert found.position_error == pytest.approx(2 * 0.1 * math.sin((math.pi / 2 - 0.9) / 2))


@pytest.mark.parametrize("kind", ["universal", "hinged"])
@pytest.mark.parametrize("joints", [2, 4, 8])
def test_nearest_posture_to_a_target_out_of_reach_is_a_minimum(kind: str, joints: int) -> None:
    arm = random_arm(joints, joints, kind)
    size = arm.geometry.length
    random = np.random.default_rng(joints)
    pose = np.eye(4)
    pose[:3, :3] = Rotation.from_rotvec([0.3, -2.0, 1.0]).as_matrix()
    pose[:3, 3] = size * np.array([0.9, 0.2, -0.1])
    for target in (-0.7 * size * random.uniform(0.8, 1.0, 3), pose):
        found = cdsm.inverse_kinematics(arm, target)
        assert not found.reachable
        r, J = TipResidual(arm, found.target).evaluate(found.angles)
        assert_least(arm, found.angles, r @ J, float(np.linalg.norm(r)))
        assert np.linalg.norm(r) == pytest.approx(
            math.hypot(found.position_error / size, found.orientation_error), rel=1e-12
        )
        # and no random posture is nearer
        others = [
            np.linalg.norm(
                TipResidual(arm, found.target).evaluate(random_posture(arm, s, 0.99).q)[0]
            )
            for s in range(200)
        ]
        assert np.linalg.norm(r) < min(others)


def test_answers_are_postures_that_the_arm_can_take() -> None:
    # where the disks of this arm touch, its cables have no direction
    arm = random_arm(7, 3, "hinged")
    found = cdsm.inverse_kinematics(arm, [-0.1, 0.0, 0.05])
    assert found.at_limit
    assert found.posture.cable_lengths.shape == (6,)
    lengths = np.full(6, 0.5)
    assert cdsm.solve_joint_angles(arm, lengths).posture.cable_lengths.shape == (6,)


def test_the_same_question_has_the_same_answer() -> None:
    arm = random_arm(7, 4)
    target = Rotation.random(random_state=1).as_matrix()
    pose = np.block([[target, np.full((3, 1), 0.1)], [np.zeros((1, 3)), np.ones((1, 1))]])
    first, again = (cdsm.inverse_kinematics(arm, pose) for _ in range(2))
    np.testing.assert_array_equal(first.angles, again.angles)
    assert first.iterations == again.iterations


# --- the derivatives behind it ------------------------------------------------------------------

TURNED = np.eye(4)
TURNED[:3, :3] = Rotation.from_rotvec([0.7, -0.4, 1.1]).as_matrix()
TURNED[:3, 3] = [0.1, -0.05, 0.08]


def questions() -> dict[str, tuple[Residual, cdsm.Posture]]:
    universal, hinged = random_arm(61, 3), random_arm(62, 4, "hinged")
    poses = random_posture(universal, 1), random_posture(hinged, 2)
    return {
        "lengths": (LengthResidual(universal, poses[0].cable_lengths + 0.01), poses[0]),
        "lengths of hinges": (LengthResidual(hinged, poses[1].cable_lengths - 0.01), poses[1]),
        "position": (TipResidual(universal, TURNED[:3, 3]), poses[0]),
        "pose": (TipResidual(universal, TURNED), poses[0]),
        "pose of hinges": (TipResidual(hinged, TURNED), poses[1]),
    }


@pytest.mark.parametrize("name", questions())
def test_residual_and_its_derivatives_agree_with_differences(name: str) -> None:
    question, pose = questions()[name]

    def slope(q: Array) -> Array:
        r, J = question.evaluate(q)
        return r @ J

    r, J = question.evaluate(pose.q)
    assert_second_order(lambda q: question.evaluate(q)[0], J, pose.q, tolerance=1e-9)
    hessian = question.hessian(pose.q)
    # the antisymmetric part of the load term is none of the Hessian's
    assert_second_order(slope, (hessian + hessian.T) / 2.0, pose.q, tolerance=1e-9)
    assert np.linalg.norm(r) > 1e-3


def test_curvature_is_the_second_derivative_where_the_target_is_met() -> None:
    arm = random_arm(61, 3)
    pose = random_posture(arm, 1)
    random = np.random.default_rng(3)
    for question, count in (
        (LengthResidual(arm, pose.cable_lengths), len(arm.cables)),
        (TipResidual(arm, pose.tip[:3, 3]), 3),
        (TipResidual(arm, pose.tip), 6),
    ):
        weight = random.normal(size=count)
        curvature = question.curvature(pose.q, weight)
        symmetric = (curvature + curvature.T) / 2.0

        def slope(q: Array, question: Residual = question, weight: Array = weight) -> Array:
            return weight @ question.evaluate(q)[1]

        assert_second_order(slope, symmetric, pose.q, tolerance=1e-8)


# --- what is refused, and what is said ----------------------------------------------------------

ARM = random_arm(1, 2)
TIP = ARM.at(np.full(4, 0.1)).tip


def changed(row: int, column: int, value: float) -> Array:
    pose = TIP.copy()
    pose[row, column] = value
    return pose


ANY: Any = None
LENGTHS = ARM.cable_lengths(np.zeros(4))
REFUSED: dict[str, tuple[Callable[[], object], tuple[str, ...]]] = {
    "arm a number": (lambda: cdsm.inverse_kinematics(3, TIP), ("arm: 3", "Manipulator")),  # type: ignore[arg-type]
    "target of two": (
        lambda: cdsm.inverse_kinematics(ARM, [0.1, 0.2]),
        ("target: shape (2,)", "position (3,)", "pose (4, 4)"),
    ),
    "target NaN": (
        lambda: cdsm.inverse_kinematics(ARM, [0.1, math.nan, 0.0]),
        ("target: entry [1] is nan",),
    ),
    "target scaled": (
        lambda: cdsm.inverse_kinematics(ARM, changed(0, 0, 1.5)),
        ("target", "no rotation", "off the identity by", "Rotation.from_matrix"),
    ),
    "target mirrored": (
        lambda: cdsm.inverse_kinematics(ARM, TIP @ np.diag([1.0, 1.0, -1.0, 1.0])),
        ("target", "mirrors", "determinant is −1"),
    ),
    "target transposed": (
        lambda: cdsm.inverse_kinematics(ARM, TIP.T),
        ("target: last row", "must be 0 0 0 1"),
    ),
    "guess beyond a limit": (
        lambda: cdsm.inverse_kinematics(ARM, TIP, guess=[0.0, 2.0, 0.0, 0.0]),
        ("guess: joint1_2 = 114.6°", f"{ARM.upper[1]:.4g}", "within the joint limits"),
    ),
    "guess too long": (
        lambda: cdsm.solve_joint_angles(ARM, LENGTHS, guess=[0.0] * 5),
        ("guess: shape (5,) given, (4,) needed", "joint2_2"),
    ),
    "lengths too few": (
        lambda: cdsm.solve_joint_angles(ARM, [0.1, 0.2]),
        (f"cable_lengths: shape (2,) given, ({len(ARM.cables)},) needed",),
    ),
    "length negative": (
        lambda: cdsm.solve_joint_angles(ARM, [0.1, -0.2, *LENGTHS[2:]]),
        ("cable_lengths: -0.2 m given for cable1_2", "positive", "lead"),
    ),
    "length infinite": (
        lambda: cdsm.solve_joint_angles(ARM, [math.inf, *LENGTHS[1:]]),
        ("cable_lengths: entry [0] is inf",),
    ),
    **{
        f"tolerance {value}": (
            lambda value=value: cdsm.inverse_kinematics(ARM, TIP, tolerance=value),  # type: ignore[misc]
            ("tolerance", said),
        )
        for value, said in ((0.0, "0 given"), (-1.0, "-1 given"), (1.0, "1 given"), (ANY, "object"))
    },
}


@pytest.mark.parametrize("name", REFUSED)
def test_bad_input_is_refused_by_name(name: str) -> None:
    call, said = REFUSED[name]
    with pytest.raises(cdsm.InvalidInput) as caught:
        call()
    for part in said:
        assert part in str(caught.value)


def test_tables_name_cables_joints_and_what_is_not_reached() -> None:
    found = cdsm.solve_joint_angles(ARM, LENGTHS + np.eye(len(LENGTHS))[1] * 0.02)
    text = str(found)
    for name in (*ARM.joint_names, *(cable.name for cable in ARM.cables), "[mm]", " deg"):
        assert name in text
    assert "NOT REACHABLE: cable1_2 is off most, by -9.4 mm" in text
    assert "NOT REACHABLE" in repr(found)
    reached = cdsm.inverse_kinematics(ARM, TIP)
    assert str(reached).endswith("° from its target")
    assert "\n\nreachable: the tip is " in str(reached)
    far = cdsm.inverse_kinematics(planar_arm(1), [0.04, 0.0, 0.1])
    assert "joint1  -51.5662 deg  at limit" in str(far)
    assert "NOT REACHABLE: the tip is 66 mm from its target" in str(far)


def test_absurd_targets_still_have_an_answer() -> None:
    far = cdsm.inverse_kinematics(ARM, [1e9, 1e8, 0.0])
    assert not far.reachable
    assert np.isfinite(far.angles).all()
    long = cdsm.solve_joint_angles(ARM, np.full(len(ARM.cables), 1e6))
    assert not long.reachable
    assert np.isfinite(long.angles).all()
