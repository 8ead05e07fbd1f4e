"""Inverse kinematics: solved targets, nearest angles, limits, targets out of reach, bad input."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation

import cdsm
from cdsm.kinematics import KinematicSolution, _residual
from cdsm.support.values import Array
from tests.support import foreign
from tests.support.arms import STEEL, random_arm, readme_geometry
from tests.support.locked import hinge
from tests.support.printed import numbers, require_all

DATA = Path(__file__).parents[1] / "data"
KINDS = ("universal", "hinged", "tree")
TOUCHING = 1e-5  # part of a limit at which disks touch that solutions keep off it


def planar_arm(joints: int) -> cdsm.Manipulator:
    """Hinges about y only: the arm moves in the plane of x and z."""
    return hinge(0.9, joints=joints, base_length=0.04, hole_radius=0.02, lead=0.3)


def random_tree(seed: int, joints: int) -> cdsm.Manipulator:
    """A robot of a URDF with hinges and slides, some of them beside the way to the tip."""
    random = np.random.default_rng([seed, joints])
    parts, cables = [foreign.link_element("l0")], []
    for i in range(1, joints + 1):
        parent = f"l{max(i - random.integers(1, 3), 0)}"
        numbers = random.uniform([[-0.1], [-0.5], [-1.0]], [[0.3], [0.5], [1.0]], (3, 3))
        place = [" ".join(map(repr, each)) for each in numbers.tolist()]
        kind = "prismatic" if i % 3 == 0 else "revolute"
        parts.append(foreign.link_element(f"l{i}", 0.1))
        parts.append(foreign.joint_element(f"j{i}", kind, parent, f"l{i}", *place))
        for name in ("left", "right"):
            ends = random.uniform(-0.1, 0.1, (2, 3)).tolist()
            sites = (cdsm.Site("l0", tuple(ends[0])), cdsm.Site(f"l{i}", tuple(ends[1])))
            cables.append(cdsm.Cable(f"{name}{i}", sites, STEEL))
    urdf = f'<robot name="tree">{"".join(parts)}</robot>'
    return cdsm.Manipulator.from_urdf(urdf, cables, tip=f"l{joints}")


def some_arm(kind: str, seed: int, joints: int) -> cdsm.Manipulator:
    return random_tree(seed, joints) if kind == "tree" else random_arm(seed, joints, kind)


def inside(arm: cdsm.Manipulator, seed: int, reach: float) -> Array:
    """Joint angles within the part ``reach`` of the range of each joint."""
    part = 0.5 + 0.5 * reach * np.random.default_rng([seed, arm.nv]).uniform(-1.0, 1.0, arm.nv)
    return arm.lower + part * (arm.upper - arm.lower)


def least_distance(found: KinematicSolution, start: Array) -> float:
    """Distance from the guess that SLSQP finds from ``start`` for the same target; or inf."""
    arm, of, target = found.posture.arm, found.of, found.target
    margin = TOUCHING * (arm.upper - arm.lower)
    lower, upper = arm.lower + margin, arm.upper - margin

    def off(q: Array) -> Array:
        return _residual(arm, of, target, np.clip(q, lower, upper))[0]

    other = minimize(
        lambda q: (0.5 * np.sum((q - found.guess) ** 2), q - found.guess),
        start,
        jac=True,
        bounds=[*zip(lower, upper, strict=True)],
        constraints={"type": "eq", "fun": off},
        method="SLSQP",
        options={"ftol": 1e-12},
    )
    reached = np.linalg.norm(off(other.x)) < 1e-7
    return float(np.linalg.norm(other.x - found.guess)) if reached else math.inf


def distance(found: KinematicSolution) -> float:
    return float(np.linalg.norm(found.angles - found.guess))


# --- solved targets ------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("joints", [2, 5])
def test_eq5_lengths_of_a_posture_give_its_angles_back(kind: str, joints: int) -> None:
    for seed, reach in enumerate((0.4, 0.9, 1.0 - TOUCHING)):
        arm = some_arm(kind, joints + 10 * seed, joints)
        pose = arm.at(inside(arm, seed, reach))
        found = cdsm.solve_joint_angles(arm, pose.cable_lengths, 0.5 * pose.q)
        assert found.reachable
        np.testing.assert_allclose(found.posture.cable_lengths, pose.cable_lengths, atol=1e-9)
        if kind != "tree":
            np.testing.assert_allclose(found.angles, pose.q, rtol=0.0, atol=1e-8)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("joints", [4, 7])
@pytest.mark.parametrize("of", ["position", "pose"])
def test_eq7_targets_are_reached_by_the_nearest_angles(kind: str, joints: int, of: str) -> None:
    for seed in range(3):
        arm = some_arm(kind, joints + 60, joints)
        pose = arm.at(inside(arm, seed, 0.95))
        guess = np.zeros(arm.nv) if seed == 0 else inside(arm, 9, 0.4)
        target = pose.tip if of == "pose" else pose.tip[:3, 3]
        found = cdsm.inverse_kinematics(arm, target, guess)
        assert found.reachable
        assert found.of == of
        assert ((found.angles >= arm.lower) & (found.angles <= arm.upper)).all()
        places = slice(0, 4) if of == "pose" else 3
        reached = found.posture.tip[:, places]
        np.testing.assert_allclose(reached, pose.tip[:, places], rtol=0.0, atol=1e-8)
        assert distance(found) < 1.01 * least_distance(found, found.angles)


def test_eq7_no_other_solver_finds_nearer_angles() -> None:
    """SLSQP from six postures, with limits of 0.4 rad that are met."""
    geometry = readme_geometry(link_mass=0.1, joint_limit=0.4, lead=0.0)
    arm = cdsm.Manipulator(geometry, STEEL)
    met = 0
    for case in range(6):
        goal, guess = inside(arm, case, 0.9), inside(arm, 20 + case, 0.9)
        found = cdsm.inverse_kinematics(arm, arm.at(goal).tip[:3, 3], guess)
        others = [least_distance(found, inside(arm, seed, 0.6)) for seed in range(6)]
        assert distance(found) < min(others) * (1.0 + 1e-3)
        met += len(found.at_limit)
    assert met


@pytest.mark.parametrize("elbow", [1.0, -1.0])
def test_eq7_of_two_parallel_hinges_is_the_law_of_cosines(elbow: float) -> None:
    arm, bend = planar_arm(2), elbow * 0.6
    reach = 2.0 * 0.1 * math.cos(bend / 2)
    x, z = (reach * value / math.hypot(0.15, 0.06) for value in (0.15, -0.06))
    first = math.atan2(-z, x) - bend / 2
    # both elbows reach it: the guess decides
    found = cdsm.inverse_kinematics(arm, [0.04 + x, 0.0, z], guess=[0.0, 0.2 * elbow])
    np.testing.assert_allclose(found.angles, [first, bend], rtol=0.0, atol=1e-8)


def test_targets_of_the_straight_arm_where_the_jacobian_is_singular() -> None:
    arm = random_arm(4, 5)
    for target in (arm.at(np.zeros(10)).tip, arm.at(np.zeros(10)).tip[:3, 3]):
        np.testing.assert_array_equal(cdsm.inverse_kinematics(arm, target).angles, 0.0)
    # straight ahead but nearer: no joint moves the tip backwards to first order
    found = cdsm.inverse_kinematics(arm, [0.8 * arm.length, 0.0, 0.0])
    assert found.reachable
    assert abs(found.angles).max() > 0.1
    # parallel hinges: a pose has six numbers, of which three can change
    plane = planar_arm(6)
    q = np.array([0.3, -0.5, 0.4, 0.2, -0.6, 0.1])
    found = cdsm.inverse_kinematics(plane, plane.at(q).tip)
    assert found.reachable
    assert np.linalg.matrix_rank(found.posture.jacobian) == 3
    assert np.linalg.norm(found.angles) < np.linalg.norm(q)


def test_a_joint_at_its_limit_is_found_there_and_a_locked_joint_stays() -> None:
    arm = planar_arm(3)
    q = np.array([0.2, arm.upper[1], -0.4])
    found = cdsm.solve_joint_angles(arm, arm.at(q).cable_lengths)
    assert found.reachable
    assert found.at_limit == ("joint2",)
    np.testing.assert_allclose(found.angles, q, rtol=0.0, atol=1e-8)
    locked = foreign.TREE.replace('lower="-0.9" upper="1.1"', 'lower="0.2" upper="0.2"', 1)
    tree = cdsm.Manipulator.from_urdf(locked, foreign.cables(STEEL), tip="tip")
    goal = np.array([0.2, 0.1, 0.3, -0.2, 0.0, 0.0])
    found = cdsm.inverse_kinematics(tree, tree.at(goal).tip[:3, 3], goal * [1, 2, 1, 1, 1, 1])
    assert found.reachable
    assert found.at_limit == ("a",)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("joints", [4, 5, 7])
def test_angles_satisfy_the_optimality_conditions(kind: str, joints: int) -> None:
    """q − guess is normal to the angles with the same tip, within the limits: 45 targets."""
    for seed in range(5):
        arm = some_arm(kind, seed, joints)
        tip = arm.at(inside(arm, seed, 0.8)).tip
        target = tip[:3, 3] if seed % 2 else tip
        found = cdsm.inverse_kinematics(arm, target, inside(arm, seed + 100, 0.5))
        assert found.reachable
        assert not found.at_limit
        J = _residual(arm, found.of, found.target, found.angles)[1]
        away = found.angles - found.guess
        multipliers = np.linalg.lstsq(J.T, away, rcond=1e-10)[0]
        assert abs(away - J.T @ multipliers).max() < 1e-9


def continuous_finger() -> cdsm.Manipulator:
    """A finger of which the first joint has no limits, and the third follows the second."""
    cables = []
    for side in (1.0, -1.0):
        sites = (cdsm.Site("palm", (0.0, 0.0, 0.01 * side)), cdsm.Site("p3", (0.01, 0.0, 0.0)))
        cables.append(cdsm.Cable(f"cable{side:+g}", sites, STEEL))
    urdf = (DATA / "continuous_finger.urdf").read_text()
    return cdsm.Manipulator.from_urdf(urdf, cables, tip="nail")


@pytest.mark.parametrize("turn", [0.5, 5.0])
def test_a_joint_without_limits_is_never_at_one(turn: float) -> None:
    arm = continuous_finger()
    q = np.array([turn, 0.4])
    found = cdsm.inverse_kinematics(arm, arm.at(q).tip[:3, 3], q - 0.1)
    assert found.reachable
    assert found.at_limit == ()
    np.testing.assert_allclose(found.angles, q, rtol=0.0, atol=1e-9)
    found = cdsm.inverse_kinematics(arm, arm.at([turn, 1.0]).tip[:3, 3], [turn, 0.9])
    assert found.at_limit == ("b2",)


def test_a_finger_without_limits_stretches_towards_a_far_target() -> None:
    arm = continuous_finger()
    length = 0.05 + 0.03 + 0.02  # from the joint at x = 20 mm to the tip
    towards = np.array([-0.6, 0.0, 0.8])
    found = cdsm.inverse_kinematics(arm, [0.02, 0.0, 0.0] + 0.9 * towards)
    assert not found.reachable
    assert found.at_limit == ()
    assert found.position_error == pytest.approx(0.9 - length, rel=1e-9)


# --- targets out of reach ------------------------------------------------------------------------


def test_far_target_stretches_the_arm_towards_it_and_says_how_near() -> None:
    arm = random_arm(5, 4)
    reach = 4 * arm.geometry.links[0].length
    start = np.array([arm.geometry.base_length, 0.0, 0.0])
    towards = np.array([1.0, 0.2, -0.15]) / math.hypot(1.0, 0.2, 0.15)
    found = cdsm.inverse_kinematics(arm, start + 2.0 * reach * towards)
    assert not found.reachable
    assert found.position_error == pytest.approx(reach, rel=1e-9)
    np.testing.assert_allclose(found.posture.tip[:3, 3], start + reach * towards, atol=1e-5)


def test_hinge_stops_at_its_limit_below_target_and_lengths_that_it_cannot_have() -> None:
    arm = planar_arm(1)
    found = cdsm.inverse_kinematics(arm, [0.04, 0.0, 0.1])  # straight up
    assert found.angles == -0.9
    assert found.at_limit == ("joint1",)
    assert found.position_error == pytest.approx(0.2 * math.sin((math.pi / 2 - 0.9) / 2))
    straight = arm.at([0.0]).cable_lengths
    away = arm.at([0.9]).cable_lengths - straight
    found = cdsm.solve_joint_angles(arm, straight + 1.5 * away)
    assert found.angles == 0.9
    np.testing.assert_allclose(found.length_error, -0.5 * away, rtol=1e-9)
    # both cables longer than straight: by symmetry the straight arm is the nearest
    found = cdsm.solve_joint_angles(arm, straight + 1e-3, guess=[0.1])
    assert found.angles == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("kind", KINDS)
def test_no_other_posture_comes_nearer_to_a_target_out_of_reach(kind: str) -> None:
    arm = some_arm(kind, 4, 5)
    pose = np.eye(4)
    pose[:3, :3] = Rotation.from_rotvec([0.3, -2.0, 1.0]).as_matrix()
    pose[:3, 3] = arm.length * np.array([-1.9, 0.2, -0.1])
    place, whole = (cdsm.inverse_kinematics(arm, each) for each in (pose[:3, 3], pose))
    assert not place.reachable
    for s in range(100):
        tip = arm.at(inside(arm, s, 1.0 - TOUCHING)).tip
        off = float(np.linalg.norm(tip[:3, 3] - pose[:3, 3])) / arm.length
        assert place.misfit < off
        turn = Rotation.from_matrix(tip[:3, :3] @ pose[:3, :3].T).magnitude()
        assert whole.misfit < math.hypot(off, turn)


def test_measured_lengths_are_reachable_within_their_error() -> None:
    arm = random_arm(2, 5)
    lengths = arm.at(inside(arm, 1, 0.4)).cable_lengths
    lengths = lengths + np.random.default_rng(1).normal(0.0, 1e-5, len(arm.cables))
    found = cdsm.solve_joint_angles(arm, lengths, tolerance=1e-3)
    assert found.reachable
    exact = cdsm.solve_joint_angles(arm, lengths)
    assert not exact.reachable
    np.testing.assert_allclose(found.angles, exact.angles, rtol=0.0, atol=1e-6)
    slope = exact.length_error @ exact.posture.length_jacobian  # least squares
    assert abs(slope).max() < 1e-6 * np.linalg.norm(exact.length_error)


def test_the_cable_that_is_off_most_is_named_with_its_sign() -> None:
    arm = random_arm(2, 5)
    lengths = arm.at(inside(arm, 1, 0.4)).cable_lengths
    noise = np.random.default_rng(1).normal(0.0, 1e-5, len(arm.cables))
    signs = set()
    for sign in (1.0, -1.0):
        found = cdsm.solve_joint_angles(arm, lengths + sign * noise)
        worst = int(abs(found.length_error).argmax())
        name = arm.cables[worst].name
        off = numbers(str(found), f"{name} is off most, by {{}}")
        require_all([(off[0], found.length_error[worst])], digits=2)
        signs |= {np.sign(found.length_error[worst])}
    assert signs == {1.0, -1.0}


# --- bad input and output ------------------------------------------------------------------------

ARM = random_arm(1, 2)
TIP = ARM.at(np.full(4, 0.1)).tip
LENGTHS = ARM.at(np.zeros(4)).cable_lengths
REFUSED: list[tuple[Any, dict[str, Any], str]] = [
    ([0.1, 0.2], {}, r"target: shape \(2,\).*position \(3,\).*pose \(4, 4\)"),
    ([0.1, math.nan, 0.0], {}, r"target: entry \[1\] is nan"),
    (TIP @ np.diag([1.1, 1.0, 1.0, 1.0]), {}, r"target: is no rigid.*by 0\.21.*from_matrix"),
    (TIP, {"guess": [0.0, 2.0, 0.0, 0.0]}, r"guess: joint1_2 = 114\.6°.*joint limits"),
    (TIP, {"tolerance": -1.0}, "tolerance: "),
    (None, {"cable_lengths": [0.1, 0.2]}, r"cable_lengths: shape \(2,\) given, \(\d+,\)"),
    (None, {"cable_lengths": [0.1, -0.2, *LENGTHS[2:]]}, r"cable_lengths: -0\.2 m .* cable1_2"),
]


@pytest.mark.parametrize(("target", "options", "said"), REFUSED)
def test_bad_input_is_refused_by_name(target: Any, options: dict[str, Any], said: str) -> None:
    solve: Any = cdsm.solve_joint_angles if target is None else cdsm.inverse_kinematics
    given = {"arm": ARM, **({} if target is None else {"target": target}), **options}
    with pytest.raises(cdsm.InvalidInput, match=said):
        solve(**given)
