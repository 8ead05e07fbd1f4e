"""Numba kernel of the stiffness of many arms that differ a little in all their dimensions."""

from __future__ import annotations

import math

import numpy as np

from cdsm._former.bodies import Masses
from cdsm._former.compiling import threaded
from cdsm._former.posture import compute_pose
from cdsm._former.stiffness import single_cable_stiffness, single_stiffness
from cdsm._former.tree import Indices, Routing, Tree
from cdsm.support.values import Array


@threaded
def stiffness_of_draws(
    tree: Tree,
    routing: Routing,
    masses: Masses,
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
    length_jacobian: Array,
    torque: Array,
) -> None:
    """Compute K_θ and what else depends on the dimensions of N arms, drawn by Monte Carlo.

    The last five arguments are filled: ``joint_stiffness`` with K_θ (N, nv, nv), ``tip_rows`` with
    J_v (N, 3, nv), ``tips`` with the tip positions (N, 3), ``length_jacobian`` with J_L (N, C, nv)
    and ``torque`` with J_Xᵀ W − g (N, nv).

    All arms share the arguments before ``q``: ``first`` (C+1,) is the first site of each cable,
    ``series`` (C,) is 1/k_series [m/N], ``rest`` (C,) the tension [N] at which the springs are
    unstrained, ``wrench`` W (6,). The others have one row for each arm: q (N, nv); tensions F [N],
    ``rigidity`` EA (1 + ε) [N] and leads [m], (N, C) each; masses (N, nv+1) [kg]; and positions
    [m] of the sites (N, P, 3), of joint origins and centres of mass (N, nv+1, 3) and of the tip
    (N, 3), as in :class:`Routing`, :class:`Tree` and :class:`Masses`.
    """
    row, tip_joints, count = routing.row, masses.tip_joints, tension.shape[1]
    fixed, none = np.empty(count), np.zeros(count)
    for n in range(q.shape[0]):
        for c in range(count):  # segments within one link
            fixed[c] = lead[n, c]
            for a in range(first[c], first[c + 1] - 1):
                if row[a] == row[a + 1]:
                    x = site[n, a + 1, 0] - site[n, a, 0]
                    y, z = site[n, a + 1, 1] - site[n, a, 1], site[n, a + 1, 2] - site[n, a, 2]
                    fixed[c] += math.sqrt(x * x + y * y + z * z)
        joints = Tree(tree.parent, tree.order, tree.turn, origin[n], tree.axis, tree.slide)
        cables = Routing(row, site[n], routing.segment, routing.joint, fixed)
        bodies = Masses(
            mass[n],
            centre[n],
            masses.gravity,
            masses.tip,
            tip_joints,
            masses.rotation,
            tip_point[n],
        )
        found = compute_pose(joints, cables, bodies, q[n])
        (pose, JX, L, J, g, weight), frames = found[:6], found[6:10]
        k = single_cable_stiffness(L, tension[n], rigidity[n], none, series, rest)
        turned = routing.segment, routing.joint, *frames, JX, J, weight
        terms = single_stiffness(*turned, tension[n], k, wrench, tip_joints)
        joint_stiffness[n], length_jacobian[n] = terms[4], J
        for i in range(q.shape[1]):
            torque[n, i] = -g[i]
            for r in range(6):
                torque[n, i] += wrench[r] * JX[r, i]
            for r in range(3):
                tip_rows[n, r, i] = JX[r, i]
        for r in range(3):
            tips[n, r] = pose[r, 3]
