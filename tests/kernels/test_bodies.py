"""Tip, weight and their derivatives, as Pinocchio has them."""

import numpy as np
import pinocchio as pin

from cdsm.kernels import bodies as body_kernels
from cdsm.kernels import records
from cdsm.kernels.tree import Frames, Routing
from cdsm.rigid_body import RigidBody
from tests.kernels.test_segments import BRANCH_JOINT, BRANCHES, forward_kinematics
from tests.support.kernels import from_python

tip_jacobian = from_python(body_kernels.tip_jacobian)
gravity_torque = from_python(body_kernels.gravity_torque)
set_gravity_stiffness = from_python(body_kernels.set_gravity_stiffness)
mirror = from_python(records.mirror)


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
        # nothing may stay as it was
        rotation = np.full((count, 3, 3, 1), np.nan)
        origin, axis = np.full((2, count, 3, 1), np.nan)
        frames = Frames(origin, axis, np.empty((len(tree.slide), 3, 1)), np.empty((0, 3, 1)))
        origin[0] = axis[0] = 0.0
        none, points = np.empty(0, dtype=np.intp), np.empty((0, 3))
        routing = Routing(none, points, np.empty((0, 5), dtype=np.intp), none, np.empty(0))
        forward_kinematics(tree, routing, q[:, None], np.empty((2, 1)), rotation, frames, None)
        for filled, of_base in ((origin, 0.0), (axis, 0.0), (rotation, np.eye(3))):
            assert np.isfinite(filled).all()
            np.testing.assert_array_equal(filled[0, ..., 0], of_base)
        pose, jacobian = np.zeros((4, 4, 1)), np.zeros((6, q.size, 1))
        tip_jacobian(tree.parent, masses, rotation, frames, pose, jacobian, None)
        heavy, torque = np.full((count, 7, 1), np.nan), np.full((q.size, 1), np.nan)
        slope = np.zeros((q.size, q.size, 1))
        gravity_torque(tree, masses, rotation, frames, heavy, torque, None)
        set_gravity_stiffness(tree.parent, heavy, slope, None)
        mirror(slope, None)
        pose, jacobian = pose[..., 0], jacobian[..., 0]
        torque, slope = torque[..., 0], slope[..., 0]

        for found, expected in zip((pose, jacobian), body.tip(q), strict=True):
            np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-15)
        model, data = body._model, body._data()
        weight = pin.computeGeneralizedGravity(model, data, q[body._ours])[body._theirs]
        change = pin.computeGeneralizedGravityDerivatives(model, data, q[body._ours])
        assert abs(weight).min() > 0.01
        np.testing.assert_allclose(torque, weight, rtol=0.0, atol=1e-14)
        order = np.ix_(body._theirs, body._theirs)
        np.testing.assert_allclose(slope, change[order], rtol=0.0, atol=1e-14)
