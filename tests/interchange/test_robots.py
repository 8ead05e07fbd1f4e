"""Robots that nobody here wrote, from example-robot-data: the extra ``[robots]``."""

from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import cdsm
from cdsm.support.values import Array
from tests.support.differences import assert_second_order

data: Any = pytest.importorskip("example_robot_data", reason="the extra [robots] is not installed")

ROBOTS = {
    "ur5": (
        "ur_description/urdf/ur5_robot.urdf",
        "tool0",
        ("base_link", "shoulder_link", "upper_arm_link", "forearm_link", "wrist_1_link"),
    ),
    "finger_edu": (
        "finger_edu_description/robots/finger_edu.urdf",
        "finger_tip_link",
        ("finger_base_link", "finger_upper_link", "finger_middle_link", "finger_lower_link"),
    ),
    "double_pendulum": (
        "double_pendulum_description/urdf/double_pendulum.urdf",
        "link2",
        ("base_link", "link1", "link2"),
    ),
}


def robot(name: str) -> cdsm.Manipulator:
    """It, with a cable from each link to the next and one over all of them, on two sides."""
    file, tip, links = ROBOTS[name]
    path = Path(data.robots_loader.getModelPath(file)) / file
    rng = np.random.default_rng(1)
    ways = [*pairwise(links), links]
    cables = [
        cdsm.Cable(
            f"{side}{i}",
            tuple(cdsm.Site(link, tuple(rng.uniform(-0.06, 0.06, 3))) for link in way),
            cdsm.LinearElasticity(5e4),
            lead=0.3,
        )
        for side in ("left", "right")
        for i, way in enumerate(ways)
    ]
    return cdsm.Manipulator.from_urdf(path, cables, tip=tip)


@pytest.mark.parametrize("name", ROBOTS)
def test_lengths_and_stiffness_are_those_of_differences(name: str) -> None:
    arm = robot(name)
    q = np.clip(np.linspace(0.4, -0.3, arm.nv), arm.lower, arm.upper)
    pose = arm.at(q)
    tension = np.linspace(20.0, 60.0, len(arm.cables))

    def lengths(at: Array) -> Array:
        return arm.at(at, check_limits=False).cable_lengths

    assert_second_order(lengths, pose.length_jacobian, q, step=2.0**-10, tolerance=1e-8)
    K = cdsm.stiffness(pose, tension)

    def torque(at: Array) -> Array:
        there = arm.at(at, check_limits=False)
        longer = there.cable_lengths - pose.cable_lengths
        F = tension + K.cable_stiffness * longer
        return F @ there.length_jacobian + there.gravity_torque

    assert_second_order(torque, K.joint, q, step=2.0**-10, size=100.0, tolerance=1e-7)


@pytest.mark.parametrize("name", ROBOTS)
def test_mujoco_agrees(name: str) -> None:
    mujoco: Any = pytest.importorskip("mujoco")
    arm = robot(name)
    pose = arm.at(np.clip(np.linspace(0.4, -0.3, arm.nv), arm.lower, arm.upper))
    tension = np.linspace(20.0, 60.0, len(arm.cables))
    model = mujoco.MjModel.from_xml_string(cdsm.to_mjcf(arm, pose, tension))
    state = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, state, 0)
    mujoco.mj_forward(model, state)
    ours = cdsm.stiffness(pose, tension).residual
    theirs = state.qfrc_bias - state.qfrc_passive - state.qfrc_actuator
    place = [model.joint(joint).dofadr[0] for joint in arm.joint_names]
    np.testing.assert_allclose(theirs[place], ours, atol=1e-9)
