"""The rigid-body model: gravity, mass, and the order of its coordinates."""

from functools import partial

import numpy as np
import pytest

import cdsm
from cdsm.rigid_body import RigidBody, rotation_vector
from cdsm.urdf import TIP, to_urdf
from tests.support.arms import mixed_arm, random_posture
from tests.support.differences import assert_second_order

POSE = random_posture(mixed_arm(), 5)
BODY = POSE.arm._body
NAMES = BODY.joint_names
BACKWARDS = RigidBody(to_urdf(POSE.arm.geometry), TIP, POSE.arm.gravity, tuple(reversed(NAMES)))


def test_gravity_torque_and_stiffness_are_derivatives_of_the_potential_energy() -> None:
    assert_second_order(
        lambda q: np.array([BODY.potential_energy(q)]), POSE.gravity_torque[None], POSE.q
    )
    at = partial(POSE.arm.at, check_limits=False)
    assert_second_order(lambda q: at(q).gravity_torque, POSE.gravity_stiffness, POSE.q)


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


def test_orders_that_do_not_name_each_joint_once_are_refused() -> None:
    text = to_urdf(POSE.arm.geometry)
    for names, told in ((NAMES[:-1], "leaves out"), ((*NAMES[:-1], NAMES[0]), "too many")):
        with pytest.raises(cdsm.InvalidInput, match=told):
            RigidBody(text, TIP, np.zeros(3), names)


def test_rotation_vector_of_a_turn_about_an_axis() -> None:
    c, s = np.cos(0.7), np.sin(0.7)
    vector, slope = rotation_vector(np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]))
    np.testing.assert_allclose(vector, [0.0, 0.0, 0.7], atol=1e-15)
    np.testing.assert_allclose(slope @ [0.0, 0.0, 1.0], [0.0, 0.0, 1.0], atol=1e-15)
