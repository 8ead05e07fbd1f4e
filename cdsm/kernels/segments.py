"""Numba kernels: joint angles and cable routing to L, J_L and H_L. Arrays in, arrays out.

A segment between site a and site b has the length ℓ = |b − a| and, with u = (b − a)/ℓ and
d_i = ∂(b − a)/∂θ_i,

    ∂ℓ/∂θ_i = u·d_i,    ∂²ℓ/∂θ_i∂θ_j = (d_i·d_j − (u·d_i)(u·d_j))/ℓ + u·∂²(b − a)/∂θ_i∂θ_j.

Only the joints between the two links enter: those on the way to b with +, those on the way to a
with −. For a joint that turns about z through o, d = ±z × (x − o), for one that slides along s,
d = ±s; and for a joint i not after joint j on the same side the second derivative is z_i × d_j,
with z = 0 where a joint slides.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cdsm.kernels.compiling import compiled, inlined
from cdsm.support.validation import Array, frozen

Indices = NDArray[np.intp]

SHORTEST_SEGMENT = 1e-9
"""A segment shorter than this [m] has no direction: its two sites coincide."""


class Tree(NamedTuple):
    """The kinematic tree as plain arrays; row 0 is the base, row i joint i.

    Attributes:
        parent: Row of the joint before, (nv+1,).
        order: Rows of the joints, each after the joint before it, (nv,); the rows themselves are in
            the order of q, whatever that is.
        turn: Three matrices of each joint, (nv+1, 3, 3, 3): by Rodrigues' formula the first, plus
            the second times cos q, plus the third times sin q, is the rotation of its frame in
            that of the joint before.
        translation: Origin in the frame of the joint before, (nv+1, 3) [m].
        axis: Unit axis of a joint that turns, likewise, (nv+1, 3); zero if it slides.
        slide: Unit direction of a joint that slides, likewise, (nv+1, 3), zero if it turns; (0, 3)
            if none slides, which is the usual case and costs nothing.
    """

    parent: Indices
    order: Indices
    turn: Array
    translation: Array
    axis: Array
    slide: Array

    @classmethod
    def of(
        cls,
        parent: Indices,
        order: Indices,
        rotation: Array,
        translation: Array,
        axis: Array,
        slide: Array,
    ) -> Tree:
        """From joint frames at q = 0 in the frames before; axes and slides in the joints' own."""
        along = axis[:, :, None] * axis[:, None, :]
        along[~axis.any(axis=1)] = np.eye(3)  # it does not turn, so all of it stays
        cross = np.cross(axis[:, None, :], np.eye(3)).transpose(0, 2, 1)
        parts = np.stack([along, np.eye(3) - along, cross], axis=1)
        return cls(
            parent=frozen(parent),
            order=frozen(order),
            turn=frozen(rotation[:, None] @ parts),
            translation=frozen(translation),
            axis=frozen((rotation @ axis[:, :, None])[:, :, 0].copy()),
            slide=frozen((rotation @ slide[:, :, None])[: len(slide) * slide.any(), :, 0].copy()),
        )


class Routing(NamedTuple):
    """All cable sites, and the cable segments that joints can change; rows as in a tree.

    Few arrays on purpose: handing one to a kernel costs as much as computing a segment.

    Attributes:
        row: Row of the joint that moves each site, (P,).
        point: The site in the frame of that joint, (P, 3) [m].
        segment: For each segment its cable, site a, site b, and where in ``joint`` its joints
            begin and those on the way to b, (S+1, 5); the last row only says where they end.
        joint: Rows of the joints between a and b: those on the way to a, then those on the way to
            b, ancestors first.
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
        axis: Its unit direction, (nv+1, 3); zero if the joint slides.
        slide: Where it slides to, (nv+1, 3), zero if it turns; (0, 3) if none slides.
        site: The cable sites, (P, 3) [m].
    """

    origin: Array
    axis: Array
    slide: Array
    site: Array


@compiled
def place(
    tree: Tree, row: Indices, point: Array, q: Array, rotation: Array, frames: Frames
) -> None:
    """Forward kinematics at q (nv,): fill the rotations of the joints (nv+1, 3, 3) and frames."""
    parent, order, turn, translation, local_axis, local_slide = tree
    origin, axis, slide, site = frames
    sliding = slide.shape[0] > 0
    for r in range(3):
        origin[0, r] = axis[0, r] = 0.0
        if sliding:
            slide[0, r] = 0.0
        for c in range(3):
            rotation[0, r, c] = 1.0 if r == c else 0.0
    for k in range(order.shape[0]):
        i = np.uint64(order[k])  # see upwards
        before, angle = np.uint64(parent[i]), q[i - np.uint64(1)]
        cosine, sine = math.cos(angle), math.sin(angle)
        for r in range(3):
            x, y, z = rotation[before, r, 0], rotation[before, r, 1], rotation[before, r, 2]
            t, a = translation[i], local_axis[i]
            origin[i, r] = origin[before, r] + (x * t[0] + y * t[1] + z * t[2])
            if sliding:
                s = local_slide[i]
                slide[i, r] = x * s[0] + y * s[1] + z * s[2]
                origin[i, r] += angle * slide[i, r]
            axis[i, r] = x * a[0] + y * a[1] + z * a[2]
            for c in range(3):
                rotation[i, r, c] = (
                    x * (turn[i, 0, 0, c] + cosine * turn[i, 1, 0, c] + sine * turn[i, 2, 0, c])
                    + y * (turn[i, 0, 1, c] + cosine * turn[i, 1, 1, c] + sine * turn[i, 2, 1, c])
                    + z * (turn[i, 0, 2, c] + cosine * turn[i, 1, 2, c] + sine * turn[i, 2, 2, c])
                )
    for p in range(row.shape[0]):
        i = row[p]
        x, y, z = point[p, 0], point[p, 1], point[p, 2]
        for r in range(3):
            shift = rotation[i, r, 0] * x + rotation[i, r, 1] * y + rotation[i, r, 2] * z
            site[p, r] = origin[i, r] + shift


@inlined
def _direction(site: Array, a: int, b: int) -> tuple[float, float, float, float]:
    """Unit vector from site a to site b, and their distance; zeros if they coincide."""
    x = site[b, 0] - site[a, 0]
    y = site[b, 1] - site[a, 1]
    z = site[b, 2] - site[a, 2]
    length = math.sqrt(x * x + y * y + z * z)
    if length < SHORTEST_SEGMENT:
        return 0.0, 0.0, 0.0, 0.0
    return x / length, y / length, z / length, length


@inlined
def _add_side(
    side: float,
    site: int,
    joints: tuple[int, int, int],
    joint: Indices,
    frames: Frames,
    direction: tuple[float, float, float, float],
    weight: float,
    bent: Array,
    cable: int,
    slopes: Array,
    page: int,
    curvature: Array,
) -> None:
    """Add what the joints on the way to one end of a segment do to J_L and H_L, for i ≤ j only.

    Args:
        side: +1 on the way to b, −1 on the way to a.
        site: The site at that end.
        joints: Where the joints of the segment begin, where those of this side, and where they end.
        joint: Rows of the joints.
        frames: Where they are.
        direction: u and ℓ.
        weight: Of ∂²ℓ/∂θ_i∂θ_j.
        bent: For each joint of the segment what stands before d_j in that times the weight,
            (1 − uuᵀ) d_i/ℓ, and, if on the same side, u × z_i: u·(z_i × d_j) = (u × z_i)·d_j.
        cable: Row of the slopes.
        slopes: J_L, or no rows.
        page: Of the curvature.
        curvature: H_L, or no pages.
    """
    first, begin, end = joints
    ux, uy, uz, length = direction
    inverse = 1.0 / length
    for t in range(begin, end):
        j = joint[t]
        zx, zy, zz = frames.axis[j, 0], frames.axis[j, 1], frames.axis[j, 2]
        rx = side * (frames.site[site, 0] - frames.origin[j, 0])
        ry = side * (frames.site[site, 1] - frames.origin[j, 1])
        rz = side * (frames.site[site, 2] - frames.origin[j, 2])
        dx, dy, dz = zy * rz - zz * ry, zz * rx - zx * rz, zx * ry - zy * rx
        if frames.slide.shape[0]:
            dx += side * frames.slide[j, 0]
            dy += side * frames.slide[j, 1]
            dz += side * frames.slide[j, 2]
        along = ux * dx + uy * dy + uz * dz
        if slopes.shape[0]:
            slopes[cable, j - 1] += along
        if curvature.shape[0]:
            bent[t - first, 0] = weight * ((dx - along * ux) * inverse + uy * zz - uz * zy)
            bent[t - first, 1] = weight * ((dy - along * uy) * inverse + uz * zx - ux * zz)
            bent[t - first, 2] = weight * ((dz - along * uz) * inverse + ux * zy - uy * zx)
            for other in range(first, t + 1):
                i, k = joint[other], other - first
                value = bent[k, 0] * dx + bent[k, 1] * dy + bent[k, 2] * dz
                curvature[page, min(i, j) - 1, max(i, j) - 1] += value


@inlined
def _unbend(
    joint: Indices,
    first: int,
    turn: int,
    axis: Array,
    direction: tuple[float, float, float, float],
    weight: float,
    bent: Array,
) -> None:
    """Take u × z_i away again, before the joints on the other side come."""
    ux, uy, uz, _ = direction
    for t in range(first, turn):
        zx, zy, zz = axis[joint[t], 0], axis[joint[t], 1], axis[joint[t], 2]
        bent[t - first, 0] -= weight * (uy * zz - uz * zy)
        bent[t - first, 1] -= weight * (uz * zx - ux * zz)
        bent[t - first, 2] -= weight * (ux * zy - uy * zx)


@compiled
def mirror(matrix: Array) -> None:
    """Copy the upper triangle of a matrix onto the lower one."""
    for i in range(matrix.shape[0]):
        for j in range(i):
            matrix[i, j] = matrix[j, i]


@compiled
def measure(
    segment: Indices,
    joint: Indices,
    frames: Frames,
    weight: Array,
    page: Indices,
    bent: Array,
    lengths: Array,
    slopes: Array,
    curvature: Array,
) -> int:
    """Add all segments to L (C,), J_L (C, nv) and weight[c] H_L[c] at curvature[page[c]] (nv, nv).

    J_L is left out if it has no rows, H_L if there are no pages for it; of H_L only i ≤ j is
    filled. ``bent`` (nv, 3) is scratch.

    Returns:
        The first segment whose sites coincide, or −1; if there is one, all are unfinished.
    """
    for s in range(segment.shape[0] - 1):
        cable, a, b = segment[s, 0], segment[s, 1], segment[s, 2]
        first, turn, end = segment[s, 3], segment[s, 4], segment[s + 1, 3]
        direction = _direction(frames.site, a, b)
        if direction[3] == 0.0:
            return s
        lengths[cable] += direction[3]
        w, k = 0.0, 0
        if curvature.shape[0]:
            w, k = weight[cable], page[cable]
        for half in range(0 if turn > first else 1, 2):
            side, site, begin, stop = (1.0, b, turn, end) if half else (-1.0, a, first, turn)
            joints = first, begin, stop
            _add_side(
                side, site, joints, joint, frames, direction, w, bent, cable, slopes, k, curvature
            )
            if not half:
                _unbend(joint, first, turn, frames.axis, direction, w, bent)
    return -1


@compiled
def evaluate(tree: Tree, routing: Routing, q: Array) -> tuple[Frames, Array, Array, int]:
    """Everything about cables that depends on q (nv,) alone.

    Returns:
        The frames, L (C,), J_L (C, nv), and the first segment whose sites coincide, or −1; if there
        is one, L and J_L are unfinished.
    """
    count, nv = tree.parent.shape[0], q.shape[0]
    origin, axis, slide = np.empty((count, 3)), np.empty((count, 3)), np.empty(tree.slide.shape)
    frames = Frames(origin, axis, slide, np.empty((routing.row.shape[0], 3)))
    place(tree, routing.row, routing.point, q, np.empty((count, 3, 3)), frames)
    fixed = routing.fixed
    L, J, nothing = fixed.copy(), np.zeros((fixed.shape[0], nv)), np.empty((0, nv, nv))
    page, bent = np.empty(0, dtype=np.intp), np.empty((nv, 3))
    coincident = measure(routing.segment, routing.joint, frames, fixed, page, bent, L, J, nothing)
    return frames, L, J, coincident


@compiled
def add_length_hessian(
    routing: Routing, frames: Frames, weight: Array, page: Indices, hessian: Array
) -> None:
    """Add weight[c] ∂²L_c/∂θ_i∂θ_j to hessian[page[c], i, j] for every cable c.

    All pages zero and weight = F gives H_L·F; page c for cable c and weight 1 the whole tensor.
    No two neighbouring sites may coincide; :func:`evaluate` has seen to that.
    """
    nv = hessian.shape[1]
    nothing, L = np.empty((0, nv)), np.zeros(weight.shape[0])
    bent = np.empty((nv, 3))
    measure(routing.segment, routing.joint, frames, weight, page, bent, L, nothing, hessian)
    for k in range(hessian.shape[0]):
        mirror(hessian[k])
