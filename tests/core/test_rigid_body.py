"""The rigid-body model: gravity, mass, and the order of its coordinates."""

import numpy as np

import cdsm
from cdsm.rigid_body import RigidBody, rotation_vector
from cdsm.urdf import TIP, to_urdf
from tests.support.arms import mixed_arm, random_posture

POSE = random_posture(mixed_arm(), 5)
BODY = POSE.arm._body
NAMES = BODY.joint_names
BACKWARDS = RigidBody(to_urdf(POSE.arm.geometry), TIP, POSE.arm.gravity, tuple(reversed(NAMES)))


def test_mass_matrix_is_symmetric_and_positive() -> None:
    M = BODY.mass_matrix(POSE.q)
    np.testing.assert_array_equal(M, M.T)
    assert np.linalg.eigvalsh(M)[0] > 0.0


def test_other_order_of_joints_permutes_everything() -> None:
    assert BACKWARDS.joint_names == NAMES[::-1]
    (ours, J), (theirs, same) = BODY.tip(POSE.q), BACKWARDS.tip(POSE.q[::-1].copy())
    np.testing.assert_array_equal(theirs, ours)
    np.testing.assert_array_equal(same, J[:, ::-1])
    arm = POSE.arm
    turned = cdsm.Manipulator.from_urdf(
        arm.urdf, arm.cables, tip=TIP, joint_names=NAMES[::-1], gravity=arm.gravity
    ).at(POSE.q[::-1])
    np.testing.assert_array_equal(turned.gravity_torque, POSE.gravity_torque[::-1])
    np.testing.assert_array_equal(turned.gravity_stiffness, POSE.gravity_stiffness[::-1, ::-1])
    np.testing.assert_array_equal(
        BACKWARDS.mass_matrix(POSE.q[::-1].copy()), BODY.mass_matrix(POSE.q)[::-1, ::-1]
    )


def test_rotation_vector_of_a_turn_about_an_axis() -> None:
    c, s = np.cos(0.7), np.sin(0.7)
    vector, slope = rotation_vector(np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]))
    np.testing.assert_allclose(vector, [0.0, 0.0, 0.7], atol=1e-15)
    np.testing.assert_allclose(slope @ [0.0, 0.0, 1.0], [0.0, 0.0, 1.0], atol=1e-15)
