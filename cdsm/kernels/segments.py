"""Numba kernels of cable lengths and their derivatives: L, J_L and H_L.

A segment between site a and site b has the length ℓ = |b − a|. With u = (b − a)/ℓ and the
derivative d_i = ∂(b − a)/∂θ_i,

    ∂ℓ/∂θ_i = u·d_i,    ∂²ℓ/∂θ_i∂θ_j = (d_i·d_j − (u·d_i)(u·d_j))/ℓ + u·∂²(b − a)/∂θ_i∂θ_j.

Only the joints between the two links matter. They have two sides: joints on the path to b have the
sign +, joints on the path to a have the sign −. A joint that turns about z through o has d = ±z ×
(x − o); a joint that slides along s has d = ±s. If joint i is not after joint j and both are on the
same side, the second derivative of b − a is z_i × d_j, with z = 0 where a joint slides.

For i not after j, the second derivative of ℓ is therefore c_i·d_j with the left factor

    c_i = (d_i − (u·d_i) u)/ℓ + u × z_i.

The last term counts only if both joints are on the same side: u·(z_i × d_j) = (u × z_i)·d_j. A left
factor is computed once per joint, and each pair of joints needs one dot product.
"""

from __future__ import annotations

import math

import numpy as np

from cdsm.kernels.compiling import compiled, inlined
from cdsm.kernels.tree import Frames, Indices, Routing, Tree, forward_kinematics
from cdsm.support.values import Array

SHORTEST_SEGMENT = 1e-9
"""Length [m] below which a segment has no direction: its two sites coincide."""


@inlined
def _direction(site: Array, a: int, b: int) -> tuple[float, float, float, float]:
    """Return the unit vector from site a to site b and their distance; zeros if they coincide."""
    x = site[b, 0] - site[a, 0]
    y = site[b, 1] - site[a, 1]
    z = site[b, 2] - site[a, 2]
    length = math.sqrt(x * x + y * y + z * z)
    if length < SHORTEST_SEGMENT:
        return 0.0, 0.0, 0.0, 0.0
    return x / length, y / length, z / length, length


@inlined
def _add_side(
    sign: float,
    site: int,
    part: tuple[int, int, int],
    joint: Indices,
    frames: Frames,
    direction: tuple[float, float, float, float],
    weight: float,
    left_factor: Array,
    cable: int,
    jacobian: Array,
    slot: int,
    hessian: Array,
) -> None:
    """Add the joints on one side of a segment to J_L and H_L, for i ≤ j only.

    ``sign`` is +1 for joints on the path to b and −1 for joints on the path to a; ``site`` is the
    site at this end. ``part`` holds indices into ``joint``: start of the segment's joints, start
    and end of this side. ``direction`` is u and ℓ. ``left_factor`` receives the weight times c_i.
    Row ``cable`` of J_L and matrix ``slot`` of the Hessians are changed; empty arrays are skipped.
    """
    first, begin, end = part
    ux, uy, uz, length = direction
    inverse = 1.0 / length
    for t in range(begin, end):
        j = joint[t]
        zx, zy, zz = frames.axis[j, 0], frames.axis[j, 1], frames.axis[j, 2]
        # d_j = ±z × (x − o), or ± the slide
        rx = sign * (frames.site[site, 0] - frames.origin[j, 0])
        ry = sign * (frames.site[site, 1] - frames.origin[j, 1])
        rz = sign * (frames.site[site, 2] - frames.origin[j, 2])
        dx, dy, dz = zy * rz - zz * ry, zz * rx - zx * rz, zx * ry - zy * rx
        if frames.slide.shape[0]:
            dx += sign * frames.slide[j, 0]
            dy += sign * frames.slide[j, 1]
            dz += sign * frames.slide[j, 2]
        along = ux * dx + uy * dy + uz * dz
        if jacobian.shape[0]:
            jacobian[cable, j - 1] += along
        if hessian.shape[0]:
            c, k = left_factor, t - first
            c[k, 0] = weight * ((dx - along * ux) * inverse + uy * zz - uz * zy)
            c[k, 1] = weight * ((dy - along * uy) * inverse + uz * zx - ux * zz)
            c[k, 2] = weight * ((dz - along * uz) * inverse + ux * zy - uy * zx)
            # pair joint j with itself and all joints before it, also those of the other side
            for k in range(t - first + 1):
                i = joint[first + k]
                value = c[k, 0] * dx + c[k, 1] * dy + c[k, 2] * dz
                hessian[slot, min(i, j) - 1, max(i, j) - 1] += value


@inlined
def _remove_cross_products(
    joint: Indices,
    first: int,
    end: int,
    axis: Array,
    direction: tuple[float, float, float, float],
    weight: float,
    left_factor: Array,
) -> None:
    """Subtract u × z_i from the left factors: the joints that follow are on the other side."""
    ux, uy, uz, _ = direction
    for t in range(first, end):
        zx, zy, zz = axis[joint[t], 0], axis[joint[t], 1], axis[joint[t], 2]
        left_factor[t - first, 0] -= weight * (uy * zz - uz * zy)
        left_factor[t - first, 1] -= weight * (uz * zx - ux * zz)
        left_factor[t - first, 2] -= weight * (ux * zy - uy * zx)


@compiled
def mirror(matrix: Array) -> None:
    """Copy the upper triangle of a matrix to the lower triangle."""
    for i in range(matrix.shape[0]):
        for j in range(i):
            matrix[i, j] = matrix[j, i]


@compiled
def add_segment_derivatives(
    segment: Indices,
    joint: Indices,
    frames: Frames,
    weight: Array,
    slot: Indices,
    left_factor: Array,
    lengths: Array,
    jacobian: Array,
    hessian: Array,
) -> int:
    """Add all segments to L (C,), J_L (C, nv) and weight[c] H_L[c] at hessian[slot[c]] (nv, nv).

    An array without rows skips J_L, and an array without matrices skips H_L. Only i ≤ j of H_L is
    filled. ``left_factor`` (nv, 3) is scratch.

    Returns:
        The first segment with coinciding sites, or −1. If there is one, all arrays are unfinished.
    """
    for s in range(segment.shape[0] - 1):
        cable, a, b = segment[s, 0], segment[s, 1], segment[s, 2]
        first, split, end = segment[s, 3], segment[s, 4], segment[s + 1, 3]
        direction = _direction(frames.site, a, b)
        if direction[3] == 0.0:
            return s
        lengths[cable] += direction[3]
        w, k = 0.0, 0
        if hessian.shape[0]:
            w, k = weight[cable], slot[cable]
        # first the joints on the path to a (none in a serpentine arm), then those on the path to b
        for towards_b in range(0 if split > first else 1, 2):
            sign, site, begin, stop = (1.0, b, split, end) if towards_b else (-1.0, a, first, split)
            part, c = (first, begin, stop), left_factor
            _add_side(sign, site, part, joint, frames, direction, w, c, cable, jacobian, k, hessian)
            if not towards_b:
                _remove_cross_products(joint, first, split, frames.axis, direction, w, c)
    return -1


@compiled
def cable_kinematics(
    parent: Indices,
    order: Indices,
    turn: Array,
    translation: Array,
    joint_axis: Array,
    joint_slide: Array,
    row: Indices,
    point: Array,
    segment: Indices,
    joint: Indices,
    fixed: Array,
    q: Array,
) -> tuple[Array, Array, Array, Array, Array, Array, int]:
    """Compute the joint and site frames at q (nv,), the cable lengths and their Jacobian.

    The arguments are the fields of :class:`Tree` and :class:`Routing`. Python passes and receives
    plain arrays: named tuples took a third of the total time.

    Returns:
        The fields of :class:`Frames`, L (C,), J_L (C, nv), and the first segment with coinciding
        sites, or −1. If there is one, L and J_L are unfinished.
    """
    tree = Tree(parent, order, turn, translation, joint_axis, joint_slide)
    routing = Routing(row, point, segment, joint, fixed)
    count, nv = parent.shape[0], q.shape[0]
    origin, axis, slide = np.empty((count, 3)), np.empty((count, 3)), np.empty(joint_slide.shape)
    frames = Frames(origin, axis, slide, np.empty((row.shape[0], 3)))
    forward_kinematics(tree, routing, q, np.empty((count, 3, 3)), frames)
    L, J = fixed.copy(), np.zeros((fixed.shape[0], nv))
    nothing, slot, scratch = np.empty((0, nv, nv)), np.empty(0, dtype=np.intp), np.empty((nv, 3))
    coincident = add_segment_derivatives(segment, joint, frames, L, slot, scratch, L, J, nothing)
    return origin, axis, slide, frames.site, L, J, coincident


@compiled
def add_length_hessian(
    segment: Indices, joint: Indices, frames: Frames, weight: Array, slot: Indices, hessian: Array
) -> None:
    """Add weight[c] ∂²L_c/∂θ_i∂θ_j to hessian[slot[c], i, j] for every cable c.

    H_L·F needs weight = F and all slots 0. The whole tensor needs weight 1 and slot c for cable c.
    Neighbouring sites must not coincide; :func:`cable_kinematics` checks this.
    """
    nv = hessian.shape[1]
    lengths, no_jacobian, scratch = np.zeros(weight.shape[0]), np.empty((0, nv)), np.empty((nv, 3))
    add_segment_derivatives(
        segment, joint, frames, weight, slot, scratch, lengths, no_jacobian, hessian
    )
    for k in range(hessian.shape[0]):
        mirror(hessian[k])
