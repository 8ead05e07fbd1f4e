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
from collections.abc import Callable
from typing import Any, NamedTuple, TypeVar, cast

import numpy as np
from numba import njit
from numpy.typing import NDArray

from cdsm._checks import Array

Indices = NDArray[np.intp]

SHORTEST_SEGMENT = 1e-9
"""A segment shorter than this [m] has no direction: its two sites coincide."""


_Function = TypeVar("_Function", bound=Callable[..., Any])


def compiled(function: _Function) -> _Function:
    """Compile for speed, once for all runs if there is a place to keep the result.

    No fastmath: it may drop NaN. Divisions are not guarded: none here is by zero.
    """
    try:
        return cast(_Function, njit(cache=True, error_model="numpy")(function))
    except RuntimeError:  # neither the package's folder nor the user's cache can be written
        return cast(_Function, njit(error_model="numpy")(function))


class Tree(NamedTuple):
    """The kinematic tree as plain arrays; row 0 is the base, row i joint i.

    Attributes:
        parent: Row of the joint before, (nv+1,).
        rotation: Joint frame in its parent joint's frame at q = 0, (nv+1, 3, 3).
        translation: Likewise its origin, (nv+1, 3) [m].
        axis: Unit axis in the joint's own frame, (nv+1, 3).
    """

    parent: Indices
    rotation: Array
    translation: Array
    axis: Array


class Routing(NamedTuple):
    """All cable sites, and the cable segments that joints can change; rows as in a tree.

    Few arrays on purpose: handing one to a kernel costs as much as computing a segment.

    Attributes:
        row: Row of the joint that moves each site, (P,).
        point: The site in the frame of that joint, (P, 3) [m].
        segment: For each segment its cable, site a, site b, and where its joints begin in
            ``joint``, (S+1, 4); the last row only says where the joints end.
        joint: The joints between a and b, ancestors first on each side: the row with a plus on the
            way to b, with a minus on the way to a.
        fixed: Length that joints do not change: lead and segments within one link, (C,) [m].
    """

    row: Indices
    point: Array
    segment: Indices
    joint: Indices
    fixed: Array


class Frames(NamedTuple):
    """Where the joints and the cable sites are, in base axes.

    Attributes:
        origin: A point on each joint axis, (nv+1, 3) [m].
        axis: Its unit direction, (nv+1, 3).
        site: The cable sites, (P, 3) [m].
    """

    origin: Array
    axis: Array
    site: Array


@compiled
def place(
    parent: Indices,
    rotation: Array,
    translation: Array,
    axis: Array,
    row: Indices,
    point: Array,
    q: Array,
) -> tuple[Array, Array, Array]:
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
    return o, z, x


@compiled
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


@compiled
def _direction(site: Array, a: int, b: int) -> tuple[float, float, float, float]:
    """Unit vector from site a to site b, and their distance; zeros if they coincide."""
    x = site[b, 0] - site[a, 0]
    y = site[b, 1] - site[a, 1]
    z = site[b, 2] - site[a, 2]
    length = math.sqrt(x * x + y * y + z * z)
    if length < SHORTEST_SEGMENT:
        return 0.0, 0.0, 0.0, 0.0
    return x / length, y / length, z / length, length


@compiled
def _derivative(
    origin: Array, axis: Array, site: Array, joint: int, a: int, b: int
) -> tuple[float, float, float]:
    """∂(b − a)/∂θ = ±z × (x − o) by a joint on the way to site b (+) or to site a (−)."""
    side, row, p = (1.0, joint, b) if joint > 0 else (-1.0, -joint, a)
    rx = site[p, 0] - origin[row, 0]
    ry = site[p, 1] - origin[row, 1]
    rz = site[p, 2] - origin[row, 2]
    zx, zy, zz = axis[row, 0], axis[row, 1], axis[row, 2]
    return side * (zy * rz - zz * ry), side * (zz * rx - zx * rz), side * (zx * ry - zy * rx)


@compiled
def evaluate(
    parent: Indices,
    rotation: Array,
    translation: Array,
    local_axis: Array,
    row: Indices,
    point: Array,
    segment: Indices,
    joint: Indices,
    fixed: Array,
    q: Array,
) -> tuple[Array, Array, Array, Array, Array, int]:
    """From :class:`Tree`, :class:`Routing` and q (nv,) to everything that depends on q.

    Fields are handed over one by one: unpacking a tuple at the border costs a microsecond.

    Returns:
        The fields of :class:`Frames`, L (C,), J_L (C, nv), and the first segment whose sites
        coincide, or −1; if there is one, L and J_L are unfinished.
    """
    origin, axis, site = place(parent, rotation, translation, local_axis, row, point, q)
    lengths = fixed.copy()
    length_jacobian = np.zeros((lengths.shape[0], q.shape[0]))
    for s in range(segment.shape[0] - 1):
        cable, a, b, first = segment[s]
        ux, uy, uz, length = _direction(site, a, b)
        if length == 0.0:
            return origin, axis, site, lengths, length_jacobian, s
        lengths[cable] += length
        for t in range(first, segment[s + 1, 3]):
            dx, dy, dz = _derivative(origin, axis, site, joint[t], a, b)
            length_jacobian[cable, abs(joint[t]) - 1] += ux * dx + uy * dy + uz * dz
    return origin, axis, site, lengths, length_jacobian, -1


@compiled
def add_length_hessian(
    segment: Indices,
    joint: Indices,
    origin: Array,
    axis: Array,
    site: Array,
    weight: Array,
    page: Indices,
    hessian: Array,
) -> None:
    """Add weight[c] ∂²L_c/∂θ_i∂θ_j to hessian[page[c], i, j] for every cable c.

    All pages zero and weight = F gives H_L·F; page c for cable c and weight 1 the whole tensor.
    No two neighbouring sites may coincide; :func:`evaluate` has seen to that.
    """
    for s in range(segment.shape[0] - 1):
        cable, a, b, first = segment[s]
        w, k = weight[cable], page[cable]
        ux, uy, uz, length = _direction(site, a, b)
        for t in range(first, segment[s + 1, 3]):
            i = abs(joint[t])
            ax, ay, az = _derivative(origin, axis, site, joint[t], a, b)
            along = ux * ax + uy * ay + uz * az
            # (1 − uuᵀ) d_i / ℓ, to which u × z_i is added for joints on the same side:
            # u·(z_i × d_j) = (u × z_i)·d_j
            vx = (ax - along * ux) / length
            vy = (ay - along * uy) / length
            vz = (az - along * uz) / length
            cx = vx + uy * axis[i, 2] - uz * axis[i, 1]
            cy = vy + uz * axis[i, 0] - ux * axis[i, 2]
            cz = vz + ux * axis[i, 1] - uy * axis[i, 0]
            for other in range(t, segment[s + 1, 3]):
                j = abs(joint[other])
                bx, by, bz = _derivative(origin, axis, site, joint[other], a, b)
                if (joint[t] > 0) == (joint[other] > 0):
                    value = w * (cx * bx + cy * by + cz * bz)
                else:
                    value = w * (vx * bx + vy * by + vz * bz)
                hessian[k, i - 1, j - 1] += value
                if other != t:
                    hessian[k, j - 1, i - 1] += value


@compiled
def joint_stiffness(
    segment: Indices,
    joint: Indices,
    origin: Array,
    axis: Array,
    site: Array,
    jacobian: Array,
    length_jacobian: Array,
    gravity: Array,
    tension: Array,
    cable_stiffness: Array,
    wrench: Array,
) -> tuple[Array, Array, Array, Array]:
    """Active, passive and load term of Eq. 16 and the sum of all four, (nv, nv) each."""
    nv = jacobian.shape[1]
    active = np.zeros((1, nv, nv))
    page = np.zeros(tension.shape[0], dtype=np.intp)
    add_length_hessian(segment, joint, origin, axis, site, tension, page, active)
    passive = np.zeros((nv, nv))
    for c in range(length_jacobian.shape[0]):
        last = nv  # a cable moves only with the joints before its end
        while last > 0 and length_jacobian[c, last - 1] == 0.0:
            last -= 1
        for i in range(last):
            pull = cable_stiffness[c] * length_jacobian[c, i]
            for j in range(i, last):
                passive[i, j] += pull * length_jacobian[c, j]
    for i in range(nv):
        for j in range(i):
            passive[i, j] = passive[j, i]
    load = load_stiffness(jacobian, wrench)
    return active[0], passive, load, active[0] + passive + gravity + load


@compiled
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
