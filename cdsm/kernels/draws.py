"""Numba kernel of the stiffness of many arms that differ a little in all their dimensions."""

from __future__ import annotations

import math

import numpy as np

from cdsm.kernels.bodies import Masses, gravity_torque, set_gravity_stiffness, tip_jacobian
from cdsm.kernels.compiling import threaded
from cdsm.kernels.segments import add_length_hessian, mirror, segment_scratch, set_lengths
from cdsm.kernels.stiffness import (
    add_passive_stiffness,
    set_cable_stiffness,
    set_load_stiffness,
)
from cdsm.kernels.tree import Indices, Routing, Tree, empty_frames, forward_kinematics
from cdsm.support.values import Array


@threaded
def stiffness_of_draws(
    parent: Indices,
    order: Indices,
    turn: Array,
    joint_axis: Array,
    joint_slide: Array,
    row: Indices,
    segment: Indices,
    joint: Indices,
    gravity: Array,
    tip: int,
    tip_joints: Indices,
    tip_rotation: Array,
    first: Indices,
    series: Array,
    rest: Array,
    wrench: Array,
    q: Array,
    tension: Array,
    rigidity: Array,
    lead: Array,
    mass: Array,
    site: Array,
    origin: Array,
    centre: Array,
    tip_point: Array,
    joint_stiffness: Array,
    tip_rows: Array,
    tips: Array,
) -> None:
    """Fill K_θ (N, nv, nv), J_v (N, 3, nv) and the tip's position (N, 3) of N arms.

    The first arguments are those of :func:`~cdsm.kernels.posture.single_pose` that all arms share;
    then ``first`` (C+1,), the first site of each cable, and 1/k_series and the tension at rest of
    the series springs (C,). Each arm has its own q (N, nv), tensions and EA (1 + ε) (N, C), leads
    (N, C), masses (N, nv+1), and its own places (N, …) in the frames of the joints.
    """
    draws, nv = q.shape
    cables, rows = tension.shape[1], parent.shape[0]
    scratch, slot = segment_scratch(nv, 1), np.zeros(cables, dtype=np.intp)
    rotation, carried = np.empty((rows, 3, 3, 1)), np.empty((rows, 7, 1))
    pose, JX, L = np.zeros((4, 4, 1)), np.zeros((6, nv, 1)), np.empty((cables, 1))
    J, g, k = np.empty((cables, nv, 1)), np.empty((nv, 1)), np.empty((cables, 1))
    weight, load = np.zeros((nv, nv, 1)), np.zeros((nv, nv, 1))
    K = np.empty((1, nv, nv, 1))
    shortest, fixed = np.empty(1), np.empty(cables)
    for n in range(draws):
        for c in range(cables):  # segments within one link
            fixed[c] = lead[n, c]
            for a in range(first[c], first[c + 1] - 1):
                if row[a] == row[a + 1]:
                    square = (site[n, a + 1, 0] - site[n, a, 0]) ** 2
                    square += (site[n, a + 1, 1] - site[n, a, 1]) ** 2
                    fixed[c] += math.sqrt(square + (site[n, a + 1, 2] - site[n, a, 2]) ** 2)
        tree = Tree(parent, order, turn, origin[n], joint_axis, joint_slide)
        routing = Routing(row, site[n], segment, joint, fixed)
        masses = Masses(mass[n], centre[n], gravity, tip, tip_joints, tip_rotation, tip_point[n])
        frames = empty_frames(tree, routing, 1)
        angles = q[n].reshape(nv, 1)
        forward_kinematics(tree, routing, angles, np.empty((2, 1)), rotation, frames, None)
        set_lengths(routing, frames, scratch, L, J, shortest, None)
        tip_jacobian(parent, masses, rotation, frames, pose, JX, None)
        gravity_torque(tree, masses, rotation, frames, carried, g, None)
        set_gravity_stiffness(parent, carried, weight, None)
        force = tension[n].reshape(cables, 1)
        set_cable_stiffness(L, force, rigidity[n].reshape(cables, 1), series, rest, k, None)
        K[:] = 0.0
        add_length_hessian(segment, joint, frames, force, slot, scratch, K, None)
        add_passive_stiffness(J, k, K[0], np.empty((3, 1)), None)
        for i in range(nv):
            for j in range(i, nv):
                K[0, i, j, 0] += weight[i, j, 0]
        mirror(K[0], None)
        set_load_stiffness(JX, wrench.reshape(6, 1), tip_joints, load, np.empty((6, 1)), None)
        for i in range(nv):
            for j in range(nv):
                joint_stiffness[n, i, j] = K[0, i, j, 0] + load[i, j, 0]
            for r in range(3):
                tip_rows[n, r, i] = JX[r, i, 0]
        for r in range(3):
            tips[n, r] = pose[r, 3, 0]
