"""Numba kernels of the rigid bodies: tip pose, tip Jacobian, gravity torque and stiffness.

Pinocchio computes the same, but its calls from Python take longer than all other computations. A
test compares the two to rounding. Joint i turns about the axis z_i through the point o_i. The
bodies that it moves have masses m, centres of mass c, the total mass M_i = Σ m and the first moment
S_i = Σ m c. With r_i = S_i − M_i o_i and the acceleration of gravity γ,

    g_i = −γ·(z_i × r_i),    ∂g_i/∂θ_j = −γ·(z_i × (z_j × r_j)) if i is j or moves joint j.

If joint j is prismatic with direction s, M_j s replaces z_j × r_j, and z_j is 0.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cdsm._former.compiling import Width, axes, inner, lanes, upwards
from cdsm._former.tree import Frames, Indices, Tree, turned
from cdsm.support.values import Array


class Masses(NamedTuple):
    """Masses that the joints carry, and the place of the tip; rows are those of :class:`Tree`.

    Attributes:
        mass: Mass of the bodies fixed to each joint's frame, (nv+1,) [kg].
        centre: Centre of mass of these bodies in the joint's frame, (nv+1, 3) [m].
        gravity: Gravity in base axes (3,) [m/s²].
        tip: Row of the last joint before the tip.
        tip_joints: Indices in q of the joints that move the tip, from the base on.
        rotation: Rotation of the tip in the frame of joint ``tip``, (3, 3).
        point: Origin of the tip in the frame of joint ``tip``, (3,) [m].
    """

    mass: Array
    centre: Array
    gravity: Array
    tip: int
    tip_joints: Indices
    rotation: Array
    point: Array


@inner
def tip_jacobian(
    parent: Indices,
    masses: Masses,
    rotation: Array,
    frames: Frames,
    tip: Array,
    jacobian: Array,
    width: Width,
) -> None:
    """Fill ``tip`` (4, 4, W) with the tip pose, and ``jacobian`` (6, nv, W) with J_X.

    Only the columns of joints that move the tip are filled. The caller sets the others, and the
    last row of the pose, to zero before. ``rotation`` (nv+1, 3, 3, W) and ``frames`` are results of
    :func:`~cdsm._former.tree.forward_kinematics`.
    """
    origin, axis, slide, _ = frames
    i = np.uint64(masses.tip)
    for r in axes(origin.shape[1], width):
        for c in axes(origin.shape[1], width):
            x, y, z = masses.rotation[0, c], masses.rotation[1, c], masses.rotation[2, c]
            for w in lanes(width):
                tip[r, c, w] = turned(rotation, i, r, x, y, z, w)
        x, y, z = masses.point[0], masses.point[1], masses.point[2]
        for w in lanes(width):
            tip[r, 3, w] = origin[i, r, w] + turned(rotation, i, r, x, y, z, w)
    for w in lanes(width):
        tip[3, 3, w] = 1.0
    while i > 0:
        column = i - np.uint64(1)
        for r in axes(origin.shape[1], width):
            p, q = (r + 1) % 3, (r + 2) % 3
            for w in lanes(width):
                jacobian[r, column, w] = axis[i, p, w] * (tip[q, 3, w] - origin[i, q, w]) - axis[
                    i, q, w
                ] * (tip[p, 3, w] - origin[i, p, w])
            if slide.shape[0]:
                for w in lanes(width):
                    jacobian[r, column, w] += slide[i, r, w]
            for w in lanes(width):
                jacobian[3 + r, column, w] = axis[i, r, w]
        i = np.uint64(parent[i])


@inner
def gravity_torque(
    tree: Tree,
    masses: Masses,
    rotation: Array,
    frames: Frames,
    carried: Array,
    torque: Array,
    width: Width,
) -> None:
    """Fill ``torque`` (nv, W) with the gravity torque g = ∂V/∂θ.

    Also fills ``carried`` (nv+1, 7, W) with γ × z_i, z_i × r_i and M_i of each joint i. The symbols
    are explained at the top of the module.
    """
    parent, order = tree.parent, tree.order
    origin, axis, slide, _ = frames
    gravity = masses.gravity
    # first S and M of each link alone: columns 3 to 5, and column 6
    for i in upwards(0, parent.shape[0]):
        m, x, y, z = masses.mass[i], masses.centre[i, 0], masses.centre[i, 1], masses.centre[i, 2]
        for r in axes(origin.shape[1], width):
            for w in lanes(width):
                carried[i, 3 + r, w] = m * (origin[i, r, w] + turned(rotation, i, r, x, y, z, w))
        for w in lanes(width):
            carried[i, 6, w] = m
    # then from the ends of the branches to the base: add each joint's complete sums to its parent
    for k in range(order.shape[0] - 1, -1, -1):
        i = np.uint64(order[k])
        before = np.uint64(parent[i])
        for r in upwards(3, carried.shape[1]):
            for w in lanes(width):
                carried[before, r, w] += carried[i, r, w]
        for r in axes(origin.shape[1], width):  # r = S − M o, kept here until γ × z replaces it
            for w in lanes(width):
                carried[i, r, w] = carried[i, 3 + r, w] - carried[i, 6, w] * origin[i, r, w]
        for r in axes(origin.shape[1], width):
            p, q = (r + 1) % 3, (r + 2) % 3
            for w in lanes(width):
                carried[i, 3 + r, w] = (
                    axis[i, p, w] * carried[i, q, w] - axis[i, q, w] * (carried[i, p, w])
                )
            if slide.shape[0]:
                for w in lanes(width):
                    carried[i, 3 + r, w] += carried[i, 6, w] * slide[i, r, w]
        for r in axes(origin.shape[1], width):
            p, q = (r + 1) % 3, (r + 2) % 3
            for w in lanes(width):
                carried[i, r, w] = gravity[p] * axis[i, q, w] - gravity[q] * axis[i, p, w]
        x, y, z, column = gravity[0], gravity[1], gravity[2], i - np.uint64(1)
        for w in lanes(width):
            torque[column, w] = -(
                x * carried[i, 3, w] + y * carried[i, 4, w] + z * carried[i, 5, w]
            )


@inner
def set_gravity_stiffness(parent: Indices, carried: Array, gravity: Array, width: Width) -> None:
    """Fill ``gravity`` (nv, nv, W) with ∂g_i/∂θ_j for i ≤ j.

    ``carried`` is a result of :func:`gravity_torque`, ``parent`` a field of :class:`Tree`.
    """
    for j in range(parent.shape[0] - 1, 0, -1):
        last = np.uint64(j)
        i = last
        while i > 0:
            row, column = min(i, last) - np.uint64(1), max(i, last) - np.uint64(1)
            for w in lanes(width):  # γ·(z_i × v) = (γ × z_i)·v
                gravity[row, column, w] = -(
                    carried[i, 0, w] * carried[last, 3, w]
                    + carried[i, 1, w] * carried[last, 4, w]
                    + carried[i, 2, w] * carried[last, 5, w]
                )
            i = np.uint64(parent[i])
