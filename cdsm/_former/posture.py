"""Numba kernel of one posture: everything that depends only on the joint angles."""

from __future__ import annotations

import numpy as np

from cdsm._former.bodies import Masses, gravity_torque, set_gravity_stiffness, tip_jacobian
from cdsm._former.compiling import inner
from cdsm._former.records import mirror
from cdsm._former.segments import segment_scratch, set_lengths
from cdsm._former.tree import Routing, Tree, empty_frames, forward_kinematics
from cdsm.support.values import Array

_Pose = tuple[Array, Array, Array, Array, Array, Array, Array, Array, Array, Array, float]


@inner
def compute_pose(tree: Tree, routing: Routing, masses: Masses, q: Array) -> _Pose:
    """Compute everything that depends only on the joint angles q (nv,) of one posture.

    Returns:
        Tip pose (4, 4), J_X (6, nv), L (C,), J_L (C, nv), g (nv,), ∂g/∂θ (nv, nv), the four fields
        of :class:`Frames` without the axis of postures, and the length of the shortest cable
        segment [m].
    """
    nv, cables, rows = q.shape[0], routing.fixed.shape[0], tree.parent.shape[0]
    frames, segments = empty_frames(tree, routing, 1), segment_scratch(nv, 1)
    rotation, carried = np.empty((rows, 3, 3, 1)), np.empty((rows, 7, 1))
    tip_pose, JX, L = np.zeros((4, 4, 1)), np.zeros((6, nv, 1)), np.empty((cables, 1))
    J, g, gravity_stiffness = np.empty((cables, nv, 1)), np.empty((nv, 1)), np.zeros((nv, nv, 1))
    shortest, angles = np.empty(1), q.reshape(nv, 1)
    forward_kinematics(tree, routing, angles, np.empty((2, 1)), rotation, frames, None)
    set_lengths(routing, frames, segments, L, J, shortest, None)
    tip_jacobian(tree.parent, masses, rotation, frames, tip_pose, JX, None)
    gravity_torque(tree, masses, rotation, frames, carried, g, None)
    set_gravity_stiffness(tree.parent, carried, gravity_stiffness, None)
    mirror(gravity_stiffness, None)
    return (
        tip_pose.reshape(4, 4),
        JX.reshape(6, nv),
        L.reshape(cables),
        J.reshape(cables, nv),
        g.reshape(nv),
        gravity_stiffness.reshape(nv, nv),
        frames.origin.reshape(rows, 3),
        frames.axis.reshape(rows, 3),
        frames.slide.reshape(tree.slide.shape[0], 3),
        frames.site.reshape(routing.row.shape[0], 3),
        shortest[0],
    )
