"""Kernels of cable lengths by themselves: trees that branch, which no geometry has."""

from typing import NamedTuple

import numpy as np
import pytest
from cdsm.arm_model import route

import cdsm
from cdsm.kernels import segments, tree
from cdsm.kernels.tree import Routing, Tree
from cdsm.rigid_body import RigidBody
from cdsm.support.values import Array
from tests.support import arms
from tests.support.differences import assert_second_order
from tests.support.kernels import block, from_python

BRANCHES = """<robot name="fork">
  <link name="root"/> <link name="trunk"/> <link name="a"/> <link name="b"/>
  <link name="a2"/> <link name="b2"/>
  {}
</robot>"""

BRANCH_JOINT = """<joint name="{child}" type="revolute">
  <parent link="{parent}"/> <child link="{child}"/> <axis xyz="{axis}"/>
  <origin xyz="{xyz}" rpy="0.3 -0.2 0.5"/>
  <limit lower="-1" upper="1" effort="1" velocity="1"/>
</joint>"""


add_length_hessian = from_python(segments.add_length_hessian)
set_lengths = from_python(segments.set_lengths)
forward_kinematics = from_python(tree.forward_kinematics)
empty_frames = from_python(tree.empty_frames)
segment_scratch = from_python(segments.segment_scratch)


class _Fork(NamedTuple):
    tree: Tree
    routing: Routing

    def evaluate(self, q: Array) -> tuple[Array, Array, Array]:
        """L, J_L and H_L of its one cable."""
        nv, rows, width = q.size, len(self.tree.parent), 2  # the posture twice, side by side
        frames, scratch = empty_frames(self.tree, self.routing, width), segment_scratch(nv, width)
        angles, rotation = block(np.stack([q, q])), np.empty((rows, 3, 3, width))
        forward_kinematics(
            self.tree, self.routing, angles, np.empty((2, width)), rotation, frames, width
        )
        L, J, shortest = np.empty((1, width)), np.empty((1, nv, width)), np.empty(width)
        set_lengths(self.routing, frames, scratch, L, J, shortest, width)
        assert (shortest > 0.01).all()
        H, slot = np.zeros((1, nv, nv, width)), np.zeros(1, dtype=np.intp)
        segment, joint = self.routing.segment, self.routing.joint
        ones = np.ones((1, width))
        add_length_hessian(segment, joint, frames, ones, slot, scratch, H, width)
        upper = H[0, ..., 0]
        lengths, jacobian = L[:, 0], J[..., 0]
        hessian = (np.triu(upper) + np.triu(upper, 1).T)[None]
        np.testing.assert_array_equal(J[..., 0], J[..., 1])
        np.testing.assert_array_equal(H[..., 0], H[..., 1])
        return lengths, jacobian, hessian


@pytest.mark.slow
def test_segment_between_two_branches_of_a_tree() -> None:
    """No arm of a Geometry branches; the kernels take trees all the same."""
    rows = [
        ("root", "trunk", "0 1 0", "0.1 0 0"),
        ("trunk", "a", "0 0.6 0.8", "0.1 0.05 0"),
        ("a", "a2", "1 0 0", "0.1 0.02 0.01"),
        ("trunk", "b", "0 0 1", "0.1 -0.05 0"),
        ("b", "b2", "0.6 0.8 0", "0.08 0 0.03"),
    ]
    joints = [
        BRANCH_JOINT.format(parent=parent, child=child, axis=axis, xyz=xyz)
        for parent, child, axis, xyz in rows
    ]
    body = RigidBody(BRANCHES.format("\n".join(joints)), "a2", np.zeros(3))
    sites = [
        cdsm.Site("a2", (0.03, 0.02, -0.01)),
        cdsm.Site("b2", (0.05, -0.01, 0.02)),
        cdsm.Site("root", (0.0, 0.03, 0.04)),
    ]
    cable = cdsm.Cable("between", tuple(sites), arms.STEEL)
    fork = _Fork(body.tree(), route(body, body.tree(), [cable]))
    q = np.array([0.2, -0.3, 0.4, 0.5, -0.6])
    lengths, jacobian, hessian = fork.evaluate(q)

    trunk = body.joint_names.index("trunk")
    assert lengths[0] > 0.1
    assert jacobian[0, trunk] != 0.0
    assert_second_order(lambda y: fork.evaluate(y)[0], jacobian, q)
    assert_second_order(lambda y: fork.evaluate(y)[1], hessian, q)
    np.testing.assert_array_equal(hessian, hessian.transpose(0, 2, 1))
