"""Other people's code as the judge: MuJoCo's spatial tendons, Pinocchio's own derivatives."""

from collections.abc import Callable
from functools import cache

import mujoco
import numpy as np
import pinocchio as pin
import pytest

import cdsm
from cdsm.support.values import Array
from tests.support import arms
from tests.support.differences import central_difference
from tests.support.mujoco_arms import in_mujoco, tendon_jacobian

ARMS: dict[str, Callable[[], cdsm.Manipulator]] = {
    **{
        f"{kind}-{n}": lambda n=n, kind=kind: arms.random_arm(n + 20, n, kind)  # type: ignore[misc]
        for kind in ("universal", "hinged")
        for n in (1, 3, 8)
    },
    "mixed": arms.mixed_arm,
}


@cache
def _arm(name: str) -> cdsm.Manipulator:
    return ARMS[name]()


CASES = [(name, seed) for name in ARMS for seed in range(2)]


@pytest.fixture(params=CASES, ids=[f"{name}-posture{seed}" for name, seed in CASES])
def pose(request: pytest.FixtureRequest) -> cdsm.Posture:
    name, seed = request.param
    return arms.random_posture(_arm(name), seed, reach=0.9)


# MuJoCo


def test_mujoco_measures_the_same_cable_lengths(pose: cdsm.Posture) -> None:
    _, data = in_mujoco(pose)
    lead = np.array([cable.lead for cable in pose.arm.cables])
    np.testing.assert_allclose(pose.cable_lengths, data.ten_length + lead, rtol=0.0, atol=1e-14)


def test_mujoco_measures_the_same_length_jacobian(pose: cdsm.Posture) -> None:
    model, data = in_mujoco(pose)
    theirs = tendon_jacobian(model, data)
    assert abs(theirs).max() > 1e-3
    np.testing.assert_allclose(pose.length_jacobian, theirs, rtol=0.0, atol=1e-14)


def test_mujoco_sees_the_same_tip(pose: cdsm.Posture) -> None:
    model, data = in_mujoco(pose)
    site = model.site("tool0").id
    linear, angular = np.zeros((3, model.nv)), np.zeros((3, model.nv))
    mujoco.mj_jacSite(model, data, linear, angular, site)
    np.testing.assert_allclose(pose.tip[:3, 3], data.site_xpos[site], rtol=0.0, atol=1e-14)
    np.testing.assert_allclose(
        pose.tip[:3, :3], data.site_xmat[site].reshape(3, 3), rtol=0.0, atol=1e-14
    )
    np.testing.assert_allclose(pose.jacobian, np.vstack([linear, angular]), rtol=0.0, atol=1e-14)


def test_mujoco_feels_the_same_gravity_torque(pose: cdsm.Posture) -> None:
    _, data = in_mujoco(pose)
    # the bias force of an arm at rest is gravity alone; some newtons times some decimetres
    np.testing.assert_allclose(pose.gravity_torque, data.qfrc_bias, rtol=0.0, atol=1e-13)


# Pinocchio


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


def _kinematic_hessian(pose: cdsm.Posture) -> Array:
    """∂J_X/∂q at tool0 as Pinocchio returns it: (6, nv, nv)."""
    model, data = _in_pinocchio(pose.arm)
    tip = model.getFrameId("tool0", pin.FrameType.BODY)
    pin.computeJointKinematicHessians(model, data, pose.q)
    pin.updateFramePlacements(model, data)
    hessian = pin.getFrameKinematicHessian(model, data, tip, pin.LOCAL_WORLD_ALIGNED)
    return np.asarray(hessian)


def _repaired(hessian: Array) -> Array:
    """Pinocchio labels column-major memory as row-major; read it as what it is."""
    return np.reshape(hessian.ravel("K"), hessian.shape, order="F")


@pytest.mark.parametrize("name", ["universal-3", "mixed"])
def test_pinocchio_still_returns_kinematic_hessians_in_the_wrong_layout(name: str) -> None:
    arm = _arm(name)
    pose = arms.random_posture(arm, 0)
    truth = central_difference(
        lambda q: arm.at(q, check_limits=False).jacobian, pose.q, step=2.0**-17
    )
    returned = _kinematic_hessian(pose)
    # first differences at 1e-5: 1e-11 of truncation and of rounding
    assert abs(_repaired(returned) - truth).max() < 1e-9 or abs(returned - truth).max() < 1e-9
    if abs(returned - truth).max() < 1e-9:
        pytest.fail(
            f"Pinocchio {pin.__version__} returns kinematic Hessians in the right layout now: "
            "take _repaired() out of this file, or it will spoil them."
        )


def test_eq16_load_part_is_pinocchios_kinematic_hessian_times_wrench(pose: cdsm.Posture) -> None:
    W = arms.random_wrench(8)
    load = cdsm.stiffness(pose, arms.random_tension(pose.arm, 8), wrench=W).load
    hessian = _repaired(_kinematic_hessian(pose))
    expected = -np.einsum("a,aij->ij", W, hessian)  # H[:, i, j] = ∂J[:, i]/∂q_j
    np.testing.assert_allclose(load, expected, rtol=0.0, atol=1e-13)


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
