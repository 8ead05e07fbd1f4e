"""Tip, weight and their derivatives, as Pinocchio has them."""

import numpy as np

from cdsm.kernels import bodies as body_kernels
from cdsm.kernels.segments import mirror
from cdsm.kernels.tree import Frames, Routing, forward_kinematics
from cdsm.rigid_body import RigidBody
from tests.kernels.test_segments import BRANCH_JOINT, BRANCHES


def test_tree_that_branches_weighs_what_pinocchio_says() -> None:
    inertial = (
        '<inertial><origin xyz="0.02 -0.01 0.03" rpy="0.1 0.2 0.3"/><mass value="{}"/>'
        '<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
    )
    names = [
        ("root", "trunk", "0 1 0", "0.1 0 0"),
        ("trunk", "a", "0 0.6 0.8", "0.1 0.05 0"),
        ("a", "a2", "1 0 0", "0.1 0.02 0.01"),
        ("trunk", "b", "0 0 1", "0.1 -0.05 0"),
        ("b", "b2", "0.6 0.8 0", "0.08 0 0.03"),
    ]
    joints = "\n".join(
        BRANCH_JOINT.format(parent=parent, child=child, axis=axis, xyz=xyz)
        for parent, child, axis, xyz in names
    )
    urdf = BRANCHES.format(joints)
    for mass, link in enumerate(("trunk", "a", "b", "a2", "b2"), start=1):
        urdf = urdf.replace(
            f'<link name="{link}"/>', f'<link name="{link}">{inertial.format(mass)}</link>'
        )
    for tip in ("a2", "b", "root"):
        body = RigidBody(urdf, tip, np.array([1.0, -3.0, -9.0]))
        tree, masses = body.tree(), body.masses()
        q = np.array([0.2, -0.3, 0.4, 0.5, -0.6])
        count = q.size + 1
        rotation = np.full((count, 3, 3), np.nan)  # nothing may stay as it was
        origin, axis = np.full((2, count, 3), np.nan)
        frames = Frames(origin, axis, np.empty(tree.slide.shape), np.empty((0, 3)))
        none, points = np.empty(0, dtype=np.intp), np.empty((0, 3))
        routing = Routing(none, points, np.empty((0, 5), dtype=np.intp), none, np.empty(0))
        forward_kinematics(tree, routing, q, rotation, frames)
        for filled, of_base in ((origin, 0.0), (axis, 0.0), (rotation, np.eye(3))):
            assert np.isfinite(filled).all()
            np.testing.assert_array_equal(filled[0], of_base)
        pose, jacobian = np.full((4, 4), np.nan), np.zeros((6, q.size))
        body_kernels.tip_jacobian(tree.parent, masses, rotation, frames, pose, jacobian)
        heavy, torque = np.full((count, 7), np.nan), np.full(q.size, np.nan)
        slope = np.zeros((q.size, q.size))
        body_kernels.gravity_torque(tree, masses, rotation, frames, heavy, torque)
        body_kernels.add_gravity_stiffness(tree.parent, heavy, slope)
        mirror(slope)

        state = body.state(q)
        assert abs(state.gravity_torque).min() > 0.01
        np.testing.assert_allclose(pose, state.tip, rtol=0.0, atol=1e-15)
        np.testing.assert_allclose(jacobian, state.jacobian, rtol=0.0, atol=1e-15)
        np.testing.assert_allclose(torque, state.gravity_torque, rtol=0.0, atol=1e-14)
        np.testing.assert_allclose(slope, state.gravity_stiffness, rtol=0.0, atol=1e-14)
