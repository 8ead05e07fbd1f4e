"""Numba kernels: joint angles and cable routing to L, J_L and H_L. Arrays in, arrays out.

A segment between site a and site b has the length ℓ = |b − a| and, with u = (b − a)/ℓ and
d_i = ∂(b − a)/∂θ_i,

    ∂ℓ/∂θ_i = u·d_i,    ∂²ℓ/∂θ_i∂θ_j = (d_i·d_j − (u·d_i)(u·d_j))/ℓ + u·∂²(b − a)/∂θ_i∂θ_j.

Only the joints between the two links enter: those on the way to b with +, those on the way to a
with −. For a joint with axis z through o, d = ±z × (x − o), and for a joint i not after joint j on
the same side the second derivative is z_i × d_j.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from cdsm._checks import Array

Indices = NDArray[np.intp]

SHORTEST_SEGMENT = 1e-9
"""A segment shorter than this [m] has no direction: its two sites coincide."""


class Routing(NamedTuple):
    """All sites and the cable segments that joints can change, as plain arrays; rows as in a tree.

    Attributes:
        row: Row of the joint that moves each site, (P,).
        point: The site in the frame of that joint, (P, 3) [m].
        cable: Cable that each segment belongs to, (S,).
        start: Site a of each segment, (S,).
        end: Site b, (S,).
        first: Where the joints of each segment begin in ``joint``, (S+1,).
        joint: Rows of the joints between a and b, ancestors first on each side.
        side: +1.0 on the way to b, −1.0 on the way to a.
        fixed: Length that joints do not change: lead and segments within one link, (C,) [m].
    """

    row: Indices
    point: Array
    cable: Indices
    start: Indices
    end: Indices
    first: Indices
    joint: Indices
    side: Array
    fixed: Array


class Frames(NamedTuple):
    """Where everything is, in base axes.

    Attributes:
        rotation: Orientation of each joint frame, (nv+1, 3, 3).
        origin: Its origin, (nv+1, 3) [m].
        axis: Its axis, (nv+1, 3).
        site: The cable sites, (P, 3) [m].
    """

    rotation: Array
    origin: Array
    axis: Array
    site: Array


@njit(cache=True, error_model="numpy")
def place(
    parent: Indices,
    rotation: Array,
    translation: Array,
    axis: Array,
    row: Indices,
    point: Array,
    q: Array,
) -> tuple[Array, Array, Array, Array]:
    """Forward kinematics: return the fields of :class:`Frames` at the joint angles q (nv,)."""
    count = parent.shape[0]
    R = np.zeros((count, 3, 3))
    o = np.zeros((count, 3))
    z = np.zeros((count, 3))
    x = np.empty((row.shape[0], 3))
    turn = np.empty((3, 3))
    for d in range(3):
        R[0, d, d] = 1.0
    for i in range(1, count):
        before = parent[i]
        _axis_rotation(axis, i, q[i - 1], turn)
        for r in range(3):
            o[i, r] = o[before, r]
            for k in range(3):
                o[i, r] += R[before, r, k] * translation[i, k]
                fixed = 0.0
                for m in range(3):
                    fixed += R[before, r, m] * rotation[i, m, k]
                for c in range(3):
                    R[i, r, c] += fixed * turn[k, c]
        for r in range(3):
            for c in range(3):
                z[i, r] += R[i, r, c] * axis[i, c]
    for p in range(row.shape[0]):
        i = row[p]
        for r in range(3):
            x[p, r] = o[i, r] + (
                R[i, r, 0] * point[p, 0] + R[i, r, 1] * point[p, 1] + R[i, r, 2] * point[p, 2]
            )
    return R, o, z, x


@njit(cache=True, error_model="numpy")
def _axis_rotation(axis: Array, row: int, angle: float, out: Array) -> None:
    """Rodrigues' formula for one row of axes."""
    s, c = math.sin(angle), math.cos(angle)
    for i in range(3):
        for j in range(3):
            out[i, j] = (1.0 - c) * axis[row, i] * axis[row, j]
        out[i, i] += c
    for i in range(3):
        j, m = (i + 1) % 3, (i + 2) % 3
        out[j, i] += s * axis[row, m]
        out[i, j] -= s * axis[row, m]


@njit(cache=True, error_model="numpy")
def _direction(site: Array, a: int, b: int) -> tuple[float, float, float, float]:
    """Unit vector from site a to site b, and their distance."""
    x = site[b, 0] - site[a, 0]
    y = site[b, 1] - site[a, 1]
    z = site[b, 2] - site[a, 2]
    length = math.sqrt(x * x + y * y + z * z)
    return x / length, y / length, z / length, length


@njit(cache=True, error_model="numpy")
def _derivative(
    axis: Array, origin: Array, site: Array, row: int, p: int, side: float
) -> tuple[float, float, float]:
    """D = ±z × (x − o) of site p by the joint of a row."""
    rx = site[p, 0] - origin[row, 0]
    ry = site[p, 1] - origin[row, 1]
    rz = site[p, 2] - origin[row, 2]
    zx, zy, zz = axis[row, 0], axis[row, 1], axis[row, 2]
    return side * (zy * rz - zz * ry), side * (zz * rx - zx * rz), side * (zx * ry - zy * rx)


@njit(cache=True, error_model="numpy")
def cable_lengths(routing: Routing, frames: Frames, length_jacobian: Array) -> tuple[Array, int]:
    """Fill J_L (C, nv); return L (C,) and the first segment whose sites coincide, or −1."""
    start, end, first, joint, side = (
        routing.start, routing.end, routing.first, routing.joint, routing.side
    )  # fmt: skip
    origin, axis, site = frames.origin, frames.axis, frames.site
    lengths = routing.fixed.copy()
    for s in range(routing.cable.shape[0]):
        ux, uy, uz, length = _direction(site, start[s], end[s])
        if not length > SHORTEST_SEGMENT:
            return lengths, s
        cable = routing.cable[s]
        lengths[cable] += length
        for t in range(first[s], first[s + 1]):
            j = joint[t]
            p = end[s] if side[t] > 0.0 else start[s]
            dx, dy, dz = _derivative(axis, origin, site, j, p, side[t])
            length_jacobian[cable, j - 1] += ux * dx + uy * dy + uz * dz
    return lengths, -1


@njit(cache=True, error_model="numpy")
def add_length_hessian(
    routing: Routing, frames: Frames, weight: Array, page: Indices, hessian: Array
) -> None:
    """Add weight[c] ∂²L_c/∂θ_i∂θ_j to hessian[page[c], i, j] for every cable c.

    All pages zero and weight = F gives H_L·F; page c for cable c and weight 1 the whole tensor.
    No two neighbouring sites may coincide; :func:`cable_lengths` has seen to that.
    """
    start, end, first, joint, side = (
        routing.start, routing.end, routing.first, routing.joint, routing.side
    )  # fmt: skip
    origin, axis, site = frames.origin, frames.axis, frames.site
    for s in range(routing.cable.shape[0]):
        w, k = weight[routing.cable[s]], page[routing.cable[s]]
        ux, uy, uz, length = _direction(site, start[s], end[s])
        for t in range(first[s], first[s + 1]):
            i = joint[t]
            p = end[s] if side[t] > 0.0 else start[s]
            ax, ay, az = _derivative(axis, origin, site, i, p, side[t])
            along = ux * ax + uy * ay + uz * az
            # (1 − uuᵀ) d_i / ℓ, to which u × z_i is added for joints on the same side:
            # u·(z_i × d_j) = (u × z_i)·d_j
            vx = (ax - along * ux) / length
            vy = (ay - along * uy) / length
            vz = (az - along * uz) / length
            cx = vx + uy * axis[i, 2] - uz * axis[i, 1]
            cy = vy + uz * axis[i, 0] - ux * axis[i, 2]
            cz = vz + ux * axis[i, 1] - uy * axis[i, 0]
            for other in range(t, first[s + 1]):
                j = joint[other]
                p = end[s] if side[other] > 0.0 else start[s]
                bx, by, bz = _derivative(axis, origin, site, j, p, side[other])
                if side[t] == side[other]:
                    value = w * (cx * bx + cy * by + cz * bz)
                else:
                    value = w * (vx * bx + vy * by + vz * bz)
                hessian[k, i - 1, j - 1] += value
                if other != t:
                    hessian[k, j - 1, i - 1] += value


@njit(cache=True, error_model="numpy")
def load_stiffness(jacobian: Array, wrench: Array) -> Array:
    """−∂(J_Xᵀ W)/∂θ (nv, nv) of a dead wrench W (6,): row torque, column angle.

    From the columns of J_X alone: ∂v_i/∂θ_j = z_a × v_b with a the earlier and b the later of the
    two joints, ∂z_i/∂θ_j = z_j × z_i where j comes before i and 0 otherwise.
    """
    nv = jacobian.shape[1]
    result = np.zeros((nv, nv))
    fx, fy, fz = wrench[0], wrench[1], wrench[2]
    mx, my, mz = wrench[3], wrench[4], wrench[5]
    for a in range(nv):
        zx, zy, zz = jacobian[3, a], jacobian[4, a], jacobian[5, a]
        # f·(z × v) = (f × z)·v, m·(z × z_b) = (m × z)·z_b
        gx, gy, gz = fy * zz - fz * zy, fz * zx - fx * zz, fx * zy - fy * zx
        hx, hy, hz = my * zz - mz * zy, mz * zx - mx * zz, mx * zy - my * zx
        for b in range(a, nv):
            force = gx * jacobian[0, b] + gy * jacobian[1, b] + gz * jacobian[2, b]
            moment = hx * jacobian[3, b] + hy * jacobian[4, b] + hz * jacobian[5, b]
            result[a, b] -= force
            if b != a:
                result[b, a] -= force + moment
    return result
