"""Other people's code as the judge: MuJoCo's spatial tendons, Pinocchio's own derivatives."""

from typing import Any

import mujoco
import numpy as np
import pinocchio as pin
import pytest

import cdsm
from tests.support import arms
from tests.support.mujoco_arms import in_mujoco, tendon_jacobian

ARMS = {
    **{
        f"{k}-{n}": arms.random_arm(n + 20, n, k)
        for k in ("universal", "hinged")
        for n in (1, 3, 8)
    },
    "mixed": arms.mixed_arm(),
}
CASES = [(name, seed) for name in ARMS for seed in range(2)]


@pytest.fixture(params=CASES, ids=[f"{name}-posture{seed}" for name, seed in CASES])
def pose(request: pytest.FixtureRequest) -> cdsm.Posture:
    name, seed = request.param
    return arms.random_posture(ARMS[name], seed, reach=0.9)


def test_mujoco_measures_the_same_lengths_tip_and_weight(pose: cdsm.Posture) -> None:
    model, data = in_mujoco(pose)
    near: Any = {"rtol": 0.0, "atol": 1e-14}
    lead = np.array([cable.lead for cable in pose.arm.cables])
    np.testing.assert_allclose(pose.cable_lengths, data.ten_length + lead, **near)
    theirs = tendon_jacobian(model, data)
    assert abs(theirs).max() > 1e-3
    np.testing.assert_allclose(pose.length_jacobian, theirs, **near)
    site = model.site("tool0").id
    linear, angular = np.zeros((3, model.nv)), np.zeros((3, model.nv))
    mujoco.mj_jacSite(model, data, linear, angular, site)
    np.testing.assert_allclose(pose.tip[:3, 3], data.site_xpos[site], **near)
    np.testing.assert_allclose(pose.tip[:3, :3], data.site_xmat[site].reshape(3, 3), **near)
    np.testing.assert_allclose(pose.jacobian, np.vstack([linear, angular]), **near)
    # the bias force of an arm at rest is gravity alone; some newtons times some decimetres
    np.testing.assert_allclose(pose.gravity_torque, data.qfrc_bias, rtol=0.0, atol=1e-13)


def _in_pinocchio(arm: cdsm.Manipulator) -> tuple[pin.Model, pin.Data]:
    model = pin.buildModelFromXML(arm.urdf)
    model.gravity.linear = arm.gravity.copy()
    return model, model.createData()


def test_link_pose_is_pinocchios_frame(pose: cdsm.Posture) -> None:
    model, data = _in_pinocchio(pose.arm)
    pin.framesForwardKinematics(model, data, pose.q)
    for frame, place in zip(model.frames, data.oMf, strict=True):
        if frame.type == pin.FrameType.BODY:
            ours = pose.link_pose(frame.name)
            np.testing.assert_allclose(ours, place.homogeneous, rtol=0.0, atol=1e-14)


def test_eq16_gravity_and_load_are_pinocchios_static_torque_derivative(pose: cdsm.Posture) -> None:
    W = arms.random_wrench(8)
    K = cdsm.stiffness(pose, arms.random_tension(pose.arm, 8), wrench=W)
    model, data = _in_pinocchio(pose.arm)
    pin.framesForwardKinematics(model, data, pose.q)
    # the wrench at the last joint, in that joint's own axes: there it turns with the link …
    last = data.oMi[model.njoints - 1]
    moment = W[3:] + np.cross(pose.tip[:3, 3] - last.translation, W[:3])
    wrenches = pin.StdVec_Force()
    wrenches.extend([pin.Force.Zero() for _ in range(model.njoints)])
    wrenches[model.njoints - 1] = pin.Force(last.rotation.T @ W[:3], last.rotation.T @ moment)
    following = pin.computeStaticTorqueDerivatives(model, data, pose.q, wrenches)
    # … and a dead wrench does not, so that turn by ω_j, (ω_j × f, ω_j × m), is taken back
    turning = np.vstack(
        [np.cross(pose.jacobian[3:].T, W[:3]).T, np.cross(pose.jacobian[3:].T, W[3:]).T]
    )
    dead = following + pose.jacobian.T @ turning
    np.testing.assert_allclose(K.gravity + K.load, dead, rtol=0.0, atol=1e-13)
