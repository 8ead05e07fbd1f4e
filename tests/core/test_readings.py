"""Readings of K_θ: the same numbers for one posture and for many, NaN where there is none."""

import numpy as np
import pytest

import cdsm
from cdsm import readings
from cdsm.support.values import Array


def definite(rows: int, joints: int) -> Array:
    A = np.random.default_rng(joints).normal(size=(rows, joints, joints))
    return A @ A.swapaxes(1, 2) + np.eye(joints)


def test_one_posture_has_the_readings_that_it_has_among_many() -> None:
    K = definite(6, 5)
    K[1, 2] = K[1, :, 2] = 0.0  # nothing holds a joint: singular to the last bit
    K[4] = np.outer(K[4, 0], K[4, 0])  # only one motion is resisted: singular but for rounding
    J = np.random.default_rng(0).normal(size=(6, 6, 5))
    J[2, 1] = J[2, 0]  # the tip moves along x + y only
    J[3, 2] = 0.0  # the tip does not move along z
    torque = np.eye(3) @ J[:, :3]
    inverse, singular = readings.invert(K, abs(K))
    motions = readings.tip_motions(J[:, :3])
    moves = readings.moves_tip(torque, J[:, :3])
    stiffness, motion = readings.along(inverse, torque, moves)
    np.testing.assert_array_equal(singular, [False, True, False, False, True, False])
    np.testing.assert_array_equal(motions.immobile, [False, False, True, True, False, False])
    assert np.isinf(stiffness[3, 2])
    for i in range(6):
        K_inverse, is_singular = readings.invert(K[i], abs(K[i]))
        alone = readings.tip_motions(J[i, :3])
        for many, one in (
            (readings.margin(K), readings.margin(K[i])),
            (inverse, K_inverse),
            (stiffness, readings.along(K_inverse, torque[i], moves[i])[0]),
            (motion, readings.along(K_inverse, torque[i], moves[i])[1]),
            (readings.compliance(inverse, J), readings.compliance(K_inverse, J[i])),
            (readings.cartesian(inverse, motions), readings.cartesian(K_inverse, alone)),
            (readings.pseudoinverse(K, motions), readings.pseudoinverse(K[i], alone)),
        ):
            np.testing.assert_allclose(many[i], one, rtol=1e-9)
        assert is_singular == singular[i]
        if not (singular[i] or alone.immobile):
            C = J[i, :3] @ np.linalg.inv(K[i]) @ J[i, :3].T
            expected = np.linalg.inv(C)
            np.testing.assert_allclose(readings.cartesian(K_inverse, alone), expected, rtol=1e-9)


def test_least_resisted_motion_and_direction_are_named() -> None:
    K = np.diag([3.0, 0.0, 2.0])
    np.testing.assert_allclose(abs(readings.singular_motion(K, abs(K))), [0.0, 1.0, 0.0])
    J_v = np.diag([1.0, 0.0, 1.0])
    np.testing.assert_allclose(abs(readings.immobile_direction(J_v, np.eye(3))), [0.0, 1.0, 0.0])


def test_no_joints_are_free_and_nothing_is_singular() -> None:
    """All joints at stops: K_θ of no joints has an inverse of no entries."""
    arm = cdsm.presets.virtual_prototype()
    K = cdsm.stiffness(arm.at(np.full(arm.nv, 0.1)), np.full(len(arm.cables), 50.0))
    assert K.joint_compliance(np.zeros(0, dtype=np.intp)).shape == (0, 0)
    with pytest.raises(cdsm.SingularStiffness, match="the tip cannot move along"):
        cdsm.stiffness(arm.at(np.zeros(arm.nv)), np.full(len(arm.cables), 50.0)).cartesian_in("x")
