"""Numba kernels of the rigid bodies: tip pose, tip Jacobian, gravity torque and stiffness.

Single postures use Pinocchio. For many postures, its calls from Python would take longer than all
other computations. A test compares the two to rounding. Joint i moves bodies of total mass M and S
= Σ m c. With r_i = S − M o_i and gravity γ,

    g_i = −γ·(z_i × r_i),    ∂g_i/∂θ_j = −γ·(z_i × (z_j × r_j)) for i before or equal to j.

If joint j slides along s, M s replaces z_j × r_j.
"""

from __future__ import annotations

from typing import NamedTuple

from cdsm.kernels.compiling import compiled
from cdsm.kernels.tree import Frames, Indices, Tree
from cdsm.support.values import Array


class Masses(NamedTuple):
    """Masses that the joints carry, and the position of the tip; rows as in :class:`Tree`.

    Attributes:
        mass: Mass of the bodies fixed to each joint's frame, (nv+1,) [kg].
        centre: Centre of mass of these bodies in the joint's frame, (nv+1, 3) [m].
        gravity: Gravity in base axes (3,) [m/s²].
        tip: Row of the joint that moves the tip.
        tip_joints: Coordinates of the joints that move the tip, base first.
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


@compiled
def tip_jacobian(
    parent: Indices,
    masses: Masses,
    rotation: Array,
    frames: Frames,
    tip: Array,
    jacobian: Array,
) -> None:
    """Fill the tip pose (4, 4), and the columns of J_X (6, nv) of the joints that move the tip."""
    origin, axis, slide, _ = frames
    i = masses.tip
    for r in range(3):
        tip[3, r] = 0.0
        for c in range(3):
            tip[r, c] = 0.0
            for k in range(3):
                tip[r, c] += rotation[i, r, k] * masses.rotation[k, c]
        tip[r, 3] = origin[i, r]
        for k in range(3):
            tip[r, 3] += rotation[i, r, k] * masses.point[k]
    tip[3, 3] = 1.0
    while i > 0:
        rx, ry, rz = tip[0, 3] - origin[i, 0], tip[1, 3] - origin[i, 1], tip[2, 3] - origin[i, 2]
        zx, zy, zz = axis[i, 0], axis[i, 1], axis[i, 2]
        jacobian[0, i - 1] = zy * rz - zz * ry
        jacobian[1, i - 1] = zz * rx - zx * rz
        jacobian[2, i - 1] = zx * ry - zy * rx
        if slide.shape[0]:
            for r in range(3):
                jacobian[r, i - 1] += slide[i, r]
        jacobian[3, i - 1] = zx
        jacobian[4, i - 1] = zy
        jacobian[5, i - 1] = zz
        i = parent[i]


@compiled
def gravity_torque(
    tree: Tree, masses: Masses, rotation: Array, frames: Frames, carried: Array, torque: Array
) -> None:
    """Fill g (nv,), and the rows of carried (nv+1, 7) with M, z × r and γ × z of each joint."""
    parent, order = tree.parent, tree.order
    origin, axis, slide, _ = frames
    gx, gy, gz = masses.gravity[0], masses.gravity[1], masses.gravity[2]
    # first M and S of each link alone: column 0, and columns 1 to 3
    for i in range(parent.shape[0]):
        m = masses.mass[i]
        carried[i, 0] = m
        for r in range(3):
            centre = origin[i, r]
            for k in range(3):
                centre += rotation[i, r, k] * masses.centre[i, k]
            carried[i, 1 + r] = m * centre
    # then from the ends of the branches to the base: add each joint's complete sums to its parent
    for k in range(order.shape[0] - 1, -1, -1):
        i = order[k]
        before = parent[i]
        for r in range(4):
            carried[before, r] += carried[i, r]
        M = carried[i, 0]
        rx = carried[i, 1] - M * origin[i, 0]
        ry = carried[i, 2] - M * origin[i, 1]
        rz = carried[i, 3] - M * origin[i, 2]
        zx, zy, zz = axis[i, 0], axis[i, 1], axis[i, 2]
        carried[i, 1] = zy * rz - zz * ry
        carried[i, 2] = zz * rx - zx * rz
        carried[i, 3] = zx * ry - zy * rx
        if slide.shape[0]:
            for r in range(3):
                carried[i, 1 + r] += M * slide[i, r]
        carried[i, 4] = gy * zz - gz * zy
        carried[i, 5] = gz * zx - gx * zz
        carried[i, 6] = gx * zy - gy * zx
        torque[i - 1] = -(gx * carried[i, 1] + gy * carried[i, 2] + gz * carried[i, 3])


@compiled
def add_gravity_stiffness(parent: Indices, carried: Array, gravity: Array) -> None:
    """Add ∂g/∂θ to a matrix (nv, nv) for i ≤ j only; :func:`gravity_torque` fills ``carried``."""
    for j in range(parent.shape[0] - 1, 0, -1):
        x, y, z = carried[j, 1], carried[j, 2], carried[j, 3]
        i = j
        while i > 0:
            # γ·(z_i × w) = (γ × z_i)·w
            value = carried[i, 4] * x + carried[i, 5] * y + carried[i, 6] * z
            gravity[min(i, j) - 1, max(i, j) - 1] -= value
            i = parent[i]
