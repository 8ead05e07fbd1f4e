"""Stiffness of the tip as a matrix: in any frame, at any point, and refused where it is none."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import cdsm
from cdsm import presets
from tests.support.arms import random_arm

POINT = np.array([0.11, -0.03, 0.07])


def stiffness(seed: int, joints: int = 4) -> cdsm.Stiffness:
    arm = random_arm(seed, joints)
    pose = arm.at(np.random.default_rng(seed).uniform(-0.15, 0.15, arm.nv))
    return cdsm.stiffness(pose, cdsm.distribute_tension(pose, 20.0))


@pytest.mark.parametrize("seed", range(5))
def test_stiffness_and_compliance_are_inverses_in_every_frame_and_at_every_point(seed: int) -> None:
    K = stiffness(seed)
    length = K.posture.arm.length
    scale = np.repeat([1.0, length], 3)  # the same lever makes the entries comparable
    np.testing.assert_array_equal(K.compliance_at(), K.compliance)
    for frame in ("base", "link1", "tool0"):
        for at in ("tip", POINT):
            spatial = K.spatial(frame, at)
            product = np.asarray(spatial) @ K.compliance_at(frame, at)
            product = product / scale[:, None] * scale
            np.testing.assert_allclose(product, np.eye(6), atol=1e-9)
            np.testing.assert_array_equal(spatial.compliance, K.compliance_at(frame, at))


@pytest.mark.parametrize("frame", ["base", "link2"])
def test_compliance_at_a_point_is_how_it_moves_under_a_wrench_there(frame: str) -> None:
    K = stiffness(1)
    pose = K.posture
    tip = pose.tip
    body = tip[:3, :3].T @ (POINT - tip[:3, 3])  # the point as the tip carries it
    R = np.eye(3) if frame == "base" else pose.link_pose(frame)[:3, :3]
    columns = []
    for k in range(6):
        ends = []
        for step in (1e-2, -1e-2):
            wrench = step * np.eye(6)[k]
            force, moment = R @ wrench[:3], R @ wrench[3:]
            at_tip = np.concatenate([force, moment + np.cross(POINT - tip[:3, 3], force)])
            end = cdsm.equilibrium(pose, K.tension, at_tip).pose.tip
            turned = Rotation.from_matrix(end[:3, :3] @ tip[:3, :3].T).as_rotvec()
            ends.append(np.concatenate([R.T @ (end[:3, 3] + end[:3, :3] @ body), R.T @ turned]))
        columns.append((ends[0] - ends[1]) / 2e-2)
    C = K.compliance_at(frame, POINT)
    np.testing.assert_allclose(np.transpose(columns), C, atol=1e-5 * abs(C).max())


def test_a_link_as_point_is_its_origin() -> None:
    K = stiffness(2)
    origin = K.posture.link_pose("link2")[:3, 3]
    np.testing.assert_allclose(K.spatial(at="link2").stiffness, K.spatial(at=origin).stiffness)


def test_where_all_joints_are_alike_the_motion_that_does_not_exist_is_named() -> None:
    arm = presets.virtual_prototype()
    pose = arm.at(np.full(arm.nv, np.deg2rad(10.0)))
    K = cdsm.stiffness(pose, cdsm.distribute_tension(pose, 50.0))
    with pytest.raises(cdsm.SingularStiffness, match=r"5 of 6 motions.*turn about") as error:
        K.spatial()
    missing = np.asarray(error.value.direction)
    assert missing.shape == (6,)
    assert abs(missing @ pose.jacobian).max() <= 1e-9
    assert np.linalg.matrix_rank(K.compliance_at(), rtol=1e-9) < 6


@pytest.mark.parametrize(
    ("arguments", "names"),
    [
        ({"frame": "link99"}, "link99"),
        ({"frame": 3}, "frame"),
        ({"at": "tipp"}, "tipp"),
        ({"at": [1.0, 2.0]}, "at"),
        ({"at": [1.0, 2.0, np.nan]}, "at"),
    ],
)
def test_wrong_frames_and_points_are_named(arguments: dict, names: str) -> None:
    with pytest.raises(cdsm.InvalidInput, match=names):
        stiffness(0).spatial(**arguments)
