"""Somebody else's robots: trees that branch and slide, by differences and by other programs."""

import copy
import pickle
from pathlib import Path

import numpy as np
import pytest

import cdsm
from cdsm.support.values import Array
from tests.support.differences import assert_second_order
from tests.support.foreign import POSTURE, TENSION, TREE, crab, energy

UP = np.array([3.0, -4.0, 5.0])


def test_cable_lengths_have_their_derivatives() -> None:
    arm = crab()
    pose = arm.at(POSTURE)

    def lengths(q: Array) -> Array:
        return arm.at(q, check_limits=False).cable_lengths

    assert arm.nv == 6
    assert_second_order(lengths, pose.length_jacobian, POSTURE, step=2.0**-9, tolerance=1e-9)
    # rounding leaves the second difference fewer digits
    assert_second_order(
        lengths, pose.length_hessian, POSTURE, order=2, step=2.0**-8, tolerance=1e-6
    )


def test_stiffness_is_the_hessian_of_the_potential() -> None:
    """The master law: all four terms and their signs, over slides and across branches."""
    arm = crab(gravity=(1.0, -2.0, -9.0))
    pose = arm.at(POSTURE)
    K = cdsm.stiffness(pose, TENSION, wrench=np.append(UP, np.zeros(3)))
    total = energy(arm, UP, pose, TENSION)
    assert_second_order(total, K.residual, POSTURE, step=2.0**-9, size=50.0, tolerance=1e-7)
    assert_second_order(total, K.joint, POSTURE, order=2, step=2.0**-8, size=50.0, tolerance=1e-6)


def test_batch_is_the_single_path() -> None:
    arm = crab()
    rng = np.random.default_rng(1)
    q = POSTURE + rng.uniform(-0.2, 0.2, (40, 6))
    rows = cdsm.evaluate(arm, q, TENSION, outputs=("tip", "jacobian", "joint", "gravity_torque"))
    for i in range(len(q)):
        pose = arm.at(q[i])
        K = cdsm.stiffness(pose, TENSION)
        np.testing.assert_allclose(rows["tip"][i], pose.tip, atol=1e-13)
        np.testing.assert_allclose(rows["jacobian"][i], pose.jacobian, atol=1e-13)
        np.testing.assert_allclose(rows["gravity_torque"][i], pose.gravity_torque, atol=1e-12)
        np.testing.assert_allclose(rows["joint"][i], K.joint, atol=1e-12 * abs(K.joint).max())


def test_loaded_equilibrium_moves_by_the_compliance() -> None:
    arm = crab()
    pose = arm.at(POSTURE)
    moved = []
    for size in (1e-3, -1e-3):
        wrench = size * np.append(UP, np.zeros(3))
        moved.append(cdsm.equilibrium(pose, TENSION, wrench))
    rest = cdsm.equilibrium(pose, TENSION)
    expected = rest.compliance[:3, :3] @ UP
    tips = [each.pose.tip[:3, 3] for each in moved]
    np.testing.assert_allclose((tips[0] - tips[1]) / 2e-3, expected, rtol=1e-5, atol=1e-12)


def test_robot_from_a_file_is_the_robot_from_its_text(tmp_path: Path) -> None:
    path = tmp_path / "crab.urdf"
    path.write_text(TREE, encoding="utf-8")
    file = cdsm.write_cables(crab().cables, tmp_path / "cables.toml")
    arm = cdsm.Manipulator.from_urdf(path, cdsm.read_cables(file), tip="tip")
    assert arm == crab()
    assert hash(arm) == hash(crab())
    assert arm.name == "crab"
    assert "6 degrees of freedom, 9 cables" in str(arm)
    assert not arm.is_serpentine
    with pytest.raises(cdsm.InvalidInput, match="made from a URDF"):
        _ = arm.geometry


def test_copies_and_other_cables() -> None:
    arm = crab()
    for again in (pickle.loads(pickle.dumps(arm)), copy.deepcopy(arm)):
        assert again == arm
        np.testing.assert_array_equal(again.at(POSTURE).tip, arm.at(POSTURE).tip)
    fewer = arm.with_cables(arm.cables[:4])
    assert len(fewer.cables) == 4
    assert fewer.urdf == arm.urdf
    assert fewer != arm


@pytest.mark.parametrize(("tip", "said"), [("nose", "link"), ("a", "link")])
def test_tip_must_be_a_link(tip: str, said: str) -> None:
    with pytest.raises(cdsm.InvalidInput, match=said):
        cdsm.Manipulator.from_urdf(TREE, crab().cables, tip=tip)


def test_cable_on_a_link_that_does_not_exist_is_named() -> None:
    lost = cdsm.Cable(
        "lost",
        (cdsm.Site("floor", (0.0, 0.0, 0.0)), cdsm.Site("wing", (0.0, 0.0, 0.1))),
        cdsm.LinearElasticity(1e4),
    )
    with pytest.raises(cdsm.InvalidInput, match=r"lost.*wing"):
        cdsm.Manipulator.from_urdf(TREE, [lost], tip="tip")


def test_cables_that_meet_the_axis_turn_nothing() -> None:
    """Their moment arms are rounding, 1e-18 m, and no tension is asked of them."""
    geometry = cdsm.Geometry(
        name="flat",
        base_length=0.02,
        hole_radius=0.02,
        joints=(cdsm.Joint(axes=((0.0, 1.0, 0.0),), disk_offset=0.01),),
        links=(cdsm.Link(length=0.05, mass=0.2),),
        cables=tuple(cdsm.CableRoute(joint=1, angle=angle) for angle in (0.0, np.pi)),
    )
    arm = cdsm.Manipulator(geometry, cdsm.LinearElasticity(1e4))
    pose = arm.at([0.0])
    assert 0.0 < abs(pose.length_jacobian).max() < 1e-16
    with pytest.raises(cdsm.InfeasibleTension, match="cannot exert this torque"):
        cdsm.distribute_tension(pose, 5.0)
    rows = cdsm.distribute_tensions(arm, [[0.0]], 5.0)
    assert rows.status[0] == cdsm.Status.INFEASIBLE


def test_gate_whose_tip_is_its_hinge_has_a_length() -> None:
    """What errors are compared with must not be zero."""
    gate = (
        '<robot name="gate"><link name="post"/><link name="leaf"/><joint name="hinge" '
        'type="revolute"><parent link="post"/><child link="leaf"/><axis xyz="0 0 1"/>'
        '<limit lower="-1.5" upper="1.5" effort="1" velocity="1"/></joint></robot>'
    )
    ropes = [
        cdsm.Cable(
            name,
            (cdsm.Site("post", (0.0, y, 0.0)), cdsm.Site("leaf", (0.5, 0.0, 0.0))),
            cdsm.LinearElasticity(1e4),
        )
        for name, y in (("left", 0.3), ("right", -0.3))
    ]
    arm = cdsm.Manipulator.from_urdf(gate, ropes, tip="leaf")
    assert arm.length == 0.5
    pose = arm.at([0.2])
    found = cdsm.solve_joint_angles(arm, pose.cable_lengths)
    np.testing.assert_allclose(found.angles, [0.2], atol=1e-9)
    pull = cdsm.distribute_tension(pose, 20.0)
    # L² = a² + b² ∓ 2ab sin q: the balance of two ropes of known arms
    arms = 0.15 * np.cos(0.2) / np.sqrt(0.34 - np.array([1.0, -1.0]) * 0.3 * np.sin(0.2))
    assert pull.values[0] * arms[0] == pytest.approx(pull.values[1] * arms[1], rel=1e-12)
    assert cdsm.equilibrium(pose, pull, [0.0, 0.0, 0.0, 0.0, 0.0, 2.0]).stable
