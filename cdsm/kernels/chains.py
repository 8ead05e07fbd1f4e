"""Numba kernels of cables as chains of segments: lengths, wrap angles and their gradients.

Each segment is routed as a cable of its own, so its length and its derivatives come from
``segments.py``: L is then l (S,), J_L is ∂l/∂θ (S, nv), and H_L·F is Σ T_j ∂²l_j/∂θ².

The wrap angle φ of a hole is the angle between the directions u and v of the cable before and after
it, φ = atan2(|u × v|, u·v). With the unit vectors p ⊥ u and q ⊥ v in their plane,

    ∂φ/∂θ_i = −(p·d_i/ℓ_u + q·e_i/ℓ_v),   p = ((u × v) × u)/|u × v|,   q = (v × (u × v))/|u × v|.

d and e are the derivatives of both segments as the link of the hole sees them: a joint between the
hole and the far end of a segment moves only that end. Where the cable goes straight through, φ has
a kink: it is |a·δθ| for small motions. Its gradient there is 0, the mean over both sides.
"""

from __future__ import annotations

import math

import numpy as np

from cdsm.kernels.compiling import Width, compiled, inner, lanes, upwards
from cdsm.kernels.segments import (
    Segments,
    add_length_hessian,
    mirror,
    one_frames,
    segment_scratch,
    set_derivative,
    set_direction,
    set_lengths,
)
from cdsm.kernels.tree import (
    Frames,
    Indices,
    Routing,
    Tree,
    empty_frames,
    forward_kinematics,
)
from cdsm.support.values import Array

STRAIGHT = 1e-9
"""Wrap angle [rad] below which a cable goes straight through a hole, but for rounding."""


@inner
def set_wraps(
    span: Indices,
    joint: Indices,
    hole: Indices,
    own: Array,
    frames: Frames,
    before: Segments,
    after: Segments,
    wrap: Array,
    gradient: Array,
    normal: Array,
    width: Width,
) -> None:
    """Fill φ (P, W), and ∂φ/∂θ (P, nv, W), of every hole.

    Segment s is between the sites 2 s and 2 s + 1. ``span`` (S, 3) is the start of its joints in
    ``joint``, the start of those on the path to its second site, and their end. ``own`` (P,) is the
    wrap angle that a hole adds. ``normal`` (7, W) is scratch: u × v, p/ℓ_u or q/ℓ_v, and |u × v|.
    """
    u, v, sine = before.direction, after.direction, normal[6]
    for h in upwards(0, hole.shape[0]):
        s = np.uint64(hole[h])
        first, second = np.uint64(2) * s, np.uint64(2) * s + np.uint64(3)
        middle = np.uint64(2) * s + np.uint64(1)
        set_direction(frames.site, first, middle, before, width)
        set_direction(frames.site, middle, second, after, width)
        for r in range(3):
            m, n = (r + 1) % 3, (r + 2) % 3
            for w in lanes(width):
                normal[r, w] = u[m, w] * v[n, w] - u[n, w] * v[m, w]
        for w in lanes(width):
            sine[w] = math.sqrt(
                normal[0, w] * normal[0, w]
                + normal[1, w] * normal[1, w]
                + normal[2, w] * normal[2, w]
            )
        for w in lanes(width):
            cosine = u[0, w] * v[0, w] + u[1, w] * v[1, w] + u[2, w] * v[2, w]
            wrap[h, w] = math.atan2(sine[w], cosine) + own[h]
        for i in upwards(0, gradient.shape[1]):
            for w in lanes(width):
                gradient[h, i, w] = 0.0
        for side in range(2):
            far, scratch = (first, before) if side == 0 else (second, after)
            a, inverse, sign = scratch.direction, scratch.inverse, 1.0 if side == 0 else -1.0
            for r in range(3):
                m, n = (r + 1) % 3, (r + 2) % 3
                for w in lanes(width):
                    across = normal[m, w] * a[n, w] - normal[n, w] * a[m, w]
                    scale = inverse[w] / sine[w] if sine[w] > STRAIGHT else 0.0
                    normal[3 + r, w] = sign * scale * across
            row = np.intp(s) + side
            for t in range(span[row, 0], span[row, 2]):
                j = np.uint64(joint[t])
                d, i = scratch.derivative, j - np.uint64(1)
                set_derivative(frames, 1.0 if t >= span[row, 1] else -1.0, far, j, d, width)
                for w in lanes(width):
                    gradient[h, i, w] -= (
                        normal[3, w] * d[0, w] + normal[4, w] * d[1, w] + normal[5, w] * d[2, w]
                    )


@compiled
def single_chains(
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
    span: Indices,
    hole: Indices,
    own: Array,
    q: Array,
) -> tuple[Array, Array, Array, Array, Array, Array, Array, Array]:
    """Compute the segments and wrap angles of one posture at q (nv,).

    The arguments are the fields of :class:`Tree`, those of the :class:`Routing` of the segments,
    and those that :func:`set_wraps` needs.

    Returns:
        l (S,), ∂l/∂θ (S, nv), φ (P,), ∂φ/∂θ (P, nv), and the fields of :class:`Frames`, all
        without the last axis.
    """
    tree = Tree(parent, order, turn, translation, joint_axis, joint_slide)
    routing = Routing(row, point, segment, joint, fixed)
    nv, count, holes, rows = q.shape[0], fixed.shape[0], hole.shape[0], parent.shape[0]
    frames, before, after = (
        empty_frames(tree, routing, 1),
        segment_scratch(nv, 1),
        segment_scratch(nv, 1),
    )
    length, J, shortest = np.empty((count, 1)), np.empty((count, nv, 1)), np.empty(1)
    wrap, gradient = np.empty((holes, 1)), np.empty((holes, nv, 1))
    rotation = np.empty((rows, 3, 3, 1))
    forward_kinematics(tree, routing, q.reshape(nv, 1), np.empty((2, 1)), rotation, frames, None)
    set_lengths(routing, frames, before, length, J, shortest, None)
    set_wraps(span, joint, hole, own, frames, before, after, wrap, gradient, np.empty((7, 1)), None)
    return (
        length.reshape(count),
        J.reshape(count, nv),
        wrap.reshape(holes),
        gradient.reshape(holes, nv),
        frames.origin.reshape(rows, 3),
        frames.axis.reshape(rows, 3),
        frames.slide.reshape(joint_slide.shape[0], 3),
        frames.site.reshape(row.shape[0], 3),
    )


@compiled
def single_tension_stiffness(
    segment: Indices,
    joint: Indices,
    origin: Array,
    axis: Array,
    slide: Array,
    site: Array,
    tension: Array,
    slot: Indices,
    slots: int,
) -> Array:
    """Compute Σ T_j ∂²l_j/∂θ² over the segments of each slot, (slots, nv, nv), of one posture."""
    nv = origin.shape[0] - 1
    total, weight = np.zeros((slots, nv, nv, 1)), tension.reshape(tension.shape[0], 1)
    frames = one_frames(origin, axis, slide, site)
    add_length_hessian(segment, joint, frames, weight, slot, segment_scratch(nv, 1), total, None)
    for s in range(slots):
        mirror(total[s], None)
    return total.reshape(slots, nv, nv)
