"""Kernels of cable lengths by themselves: trees that branch, which no geometry has."""

from typing import NamedTuple

import numpy as np
import pytest

import cdsm
from cdsm.arm_model import route
from cdsm.kernels import segments
from cdsm.kernels.tree import Frames, Routing, Tree
from cdsm.rigid_body import RigidBody
from cdsm.support.values import Array
from tests.support import arms
from tests.support.differences import assert_second_order

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


class _Fork(NamedTuple):
    tree: Tree
    routing: Routing

    def evaluate(self, q: Array) -> tuple[Array, Array, Array]:
        """L, J_L and H_L of its one cable."""
        *arrays, lengths, jacobian, coincident = segments.cable_kinematics(
            *self.tree, *self.routing, q
        )
        frames = Frames(*arrays)
        assert coincident == -1
        hessian = np.zeros((1, q.size, q.size))
        page = np.zeros(1, dtype=np.intp)
        segments.add_length_hessian(
            self.routing.segment, self.routing.joint, frames, np.ones(1), page, hessian
        )
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
