"""ROS 2 node: joint states in; cable tensions, stiffness margin and an ellipsoid for RViz out.

    cdsm export ARM.toml arm.urdf          # for robot_state_publisher
    python ros2_stiffness_node.py --ros-args -p arm:=ARM.toml -p least_tension:=10.0
    python ros2_stiffness_node.py --ros-args -p cables:=CABLES.toml -p tip:=tool0

The second form takes the robot from the topic robot_description, and adds the cables of a file.

It runs in a shell with ROS 2 sourced, in an environment that sees rclpy (`python -m venv
--system-site-packages`). Topics:

    joint_states   sensor_msgs/JointState           in; in any order, with other joints or without
    robot_description                std_msgs/String  in, if no arm is given: the URDF
    /cable_controller/commands       std_msgs/Float64MultiArray  tensions [N] in the arm's order,
                                     as a forward_command_controller of ros2_control reads them
    ~/tensions     sensor_msgs/JointState           effort: least tensions that balance the arm [N]
    ~/margin       std_msgs/Float64                 smallest eigenvalue of K_θ [N m/rad]
    ~/ellipsoid    visualization_msgs/Marker        where 1 N at the tip moves it
    /diagnostics   diagnostic_msgs/DiagnosticArray  why there is no answer, by joint or cable

Everything above :func:`main` needs no ROS.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

import cdsm


class Answer(NamedTuple):
    """What the node says of one posture.

    Attributes:
        tensions: Tension of each cable [N], by name; empty if none balance the arm.
        margin: Smallest eigenvalue of K_θ [N m/rad]; nan without tensions.
        tip: Position of the tip (3,) in the base frame [m].
        axes: Half axes (3,) of the ellipsoid of tip displacements under 1 N [m]; zero if unstable.
        orientation: Their quaternion (x, y, z, w) in the base frame.
        problem: Why something is missing; empty if all is well.
    """

    tensions: Mapping[str, float]
    margin: float
    tip: Sequence[float]
    axes: Sequence[float]
    orientation: Sequence[float]
    problem: str


def answer(arm: cdsm.Manipulator, positions: Mapping[str, float], least_tension: float) -> Answer:
    """Compute tensions, margin and ellipsoid at measured joint positions [rad], by joint name."""
    q = {name: positions.get(name, math.nan) for name in arm.joint_names}
    missing = [name for name in q if not math.isfinite(q[name])]
    if missing:
        return _unknown([0.0, 0.0, 0.0], f"no position of {', '.join(missing)} in joint_states")
    try:
        pose = arm.at(list(q.values()))
    except cdsm.CdsmError as error:
        return _unknown([0.0, 0.0, 0.0], str(error))
    tip = pose.tip[:3, 3].tolist()
    try:
        tension = cdsm.distribute_tension(pose, least_tension)
        K = cdsm.stiffness(pose, tension)
    except cdsm.CdsmError as error:
        return _unknown(tip, str(error))
    tensions = dict(tension)
    if not K.is_stable:
        problem = "UNSTABLE: the arm leaves this posture by itself"
        return Answer(tensions, K.margin, tip, [0.0] * 3, [0.0, 0.0, 0.0, 1.0], problem)
    axes, directions = np.linalg.eigh(K.compliance[:3, :3])
    directions[:, 0] *= np.sign(np.linalg.det(directions))  # a rotation, not a reflection
    quaternion = Rotation.from_matrix(directions).as_quat().tolist()
    return Answer(tensions, K.margin, tip, np.maximum(axes, 0.0).tolist(), quaternion, "")


def arm_of_description(urdf: str, cables: str, tip: str) -> cdsm.Manipulator:
    """Return the arm of the text of a URDF, with the cables of a file CABLES.toml."""
    with TemporaryDirectory() as folder:
        path = Path(folder, "robot.urdf")
        path.write_text(urdf, encoding="utf-8")
        return cdsm.Manipulator.from_urdf(path, tip=tip, cables=cables)


def _unknown(tip: Sequence[float], problem: str) -> Answer:
    return Answer({}, math.nan, tip, [0.0] * 3, [0.0, 0.0, 0.0, 1.0], problem)


def main() -> None:
    """Run the node until it is stopped."""
    import rclpy
    from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
    from rclpy.node import Node
    from rclpy.qos import DurabilityPolicy, QoSProfile
    from sensor_msgs.msg import JointState
    from std_msgs.msg import Float64, Float64MultiArray, String
    from visualization_msgs.msg import Marker

    class StiffnessNode(Node):  # type: ignore[misc]
        def __init__(self) -> None:
            super().__init__("cdsm_stiffness")
            self.declare_parameter("arm", "")
            self.declare_parameter("cables", "CABLES.toml")
            self.declare_parameter("tip", "tool0")
            self.declare_parameter("controller", "/cable_controller")
            self.declare_parameter("least_tension", 10.0)
            self.declare_parameter("frame", "base_link")
            self.declare_parameter("scale", 100.0)  # drawn over true size of the ellipsoid
            commands = self.value("controller") + "/commands"
            self.commands = self.create_publisher(Float64MultiArray, commands, 1)
            self.tensions = self.create_publisher(JointState, "~/tensions", 1)
            self.margin = self.create_publisher(Float64, "~/margin", 1)
            self.ellipsoid = self.create_publisher(Marker, "~/ellipsoid", 1)
            self.diagnostics = self.create_publisher(DiagnosticArray, "/diagnostics", 1)
            self.arm: cdsm.Manipulator | None = None
            if path := self.value("arm"):
                self.start(cdsm.Manipulator.read(path))
            else:  # robot_state_publisher says it once; who comes later gets it, too
                kept = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
                self.create_subscription(String, "robot_description", self.describe, kept)

        def describe(self, description: Any) -> None:
            if self.arm is None:
                files = self.value("cables"), self.value("tip")
                self.start(arm_of_description(description.data, *files))

        def start(self, arm: cdsm.Manipulator) -> None:
            self.arm = arm
            self.create_subscription(JointState, "joint_states", self.answer, 1)

        def value(self, name: str) -> Any:
            return self.get_parameter(name).value

        def answer(self, state: Any) -> None:
            positions = dict(zip(state.name, state.position, strict=False))
            said = answer(self.arm, positions, self.value("least_tension"))
            tensions = JointState(name=list(said.tensions), effort=list(said.tensions.values()))
            tensions.header.stamp = state.header.stamp
            self.tensions.publish(tensions)
            if said.tensions:
                self.commands.publish(Float64MultiArray(data=list(said.tensions.values())))
            self.margin.publish(Float64(data=said.margin))
            self.ellipsoid.publish(self.marker(said, state.header.stamp))
            status = DiagnosticStatus(
                level=DiagnosticStatus.WARN if said.problem else DiagnosticStatus.OK,
                name="cdsm stiffness",
                message=said.problem or "stable",
            )
            report = DiagnosticArray(status=[status])
            report.header.stamp = state.header.stamp
            self.diagnostics.publish(report)

        def marker(self, said: Answer, stamp: Any) -> Any:
            marker = Marker(ns="cdsm", type=Marker.SPHERE)
            marker.action = Marker.ADD if any(said.axes) else Marker.DELETE
            marker.header.frame_id, marker.header.stamp = self.value("frame"), stamp
            position, turn, size = marker.pose.position, marker.pose.orientation, marker.scale
            position.x, position.y, position.z = said.tip
            turn.x, turn.y, turn.z, turn.w = said.orientation
            size.x, size.y, size.z = (2.0 * self.value("scale") * axis for axis in said.axes)
            marker.color.r, marker.color.g, marker.color.b, marker.color.a = 0.84, 0.37, 0.0, 0.5
            return marker

    rclpy.init()
    try:
        rclpy.spin(StiffnessNode())
    except KeyboardInterrupt:
        pass
    finally:
        rclpy.try_shutdown()


if __name__ == "__main__":
    main()
