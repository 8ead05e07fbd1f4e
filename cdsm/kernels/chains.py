"""Numba kernels of cables as chains of segments: lengths, wrap angles and their gradients.

Each segment is routed as a cable of its own, so its length and its derivatives come from
``segments.py``: L is then l (S,), J_L is ∂l/∂θ (S, nv), and H_L·F is Σ T_j ∂²l_j/∂θ².

The wrap angle φ of a hole is the angle between the directions u and v of the cable before and after
it, φ = atan2(|u × v|, u·v). With the unit vectors p ⊥ u and q ⊥ v in their plane,

    ∂φ/∂θ_i = −(p·d_i/ℓ_u + q·e_i/ℓ_v),   p = ((u × v) × u)/|u × v|,   q = (v × (u × v))/|u × v|.

The segments before and after the hole have the lengths ℓ_u and ℓ_v. d_i and e_i are the derivatives
of the vectors along them (end minus start) with respect to θ_i, in the link of the hole. Where the
cable goes straight through, φ has a kink, |a·δθ| with some vector a; the gradient is set to 0, the
mean of both sides.
"""

from __future__ import annotations

import math

import numpy as np

from cdsm.kernels.compiling import Width, compiled, inner, lanes, threaded, upwards
from cdsm.kernels.segments import (
    Segments,
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
"""Wrap angle [rad] below which a cable counts as straight in a hole: the angle is rounding."""


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
    """Fill ``wrap`` (P, W) with φ of every hole, and ``gradient`` (P, nv, W) with ∂φ/∂θ.

    Segment s is between the sites 2 s and 2 s + 1; ``hole`` (P,) is the segment before each hole.
    ``span`` (S, 3) are places in ``joint``: where the joints of a segment start, where those on the
    path to its second site start, and where they end. ``own`` (P,) is a constant angle added to φ.
    ``normal`` (7, W) is scratch: u × v, p/ℓ_u or q/ℓ_v, and |u × v|.
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
        for side in range(2):  # p and d of the segment before the hole, then q and e
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
    before, after = segment_scratch(nv, 1), segment_scratch(nv, 1)
    frames = empty_frames(tree, routing, 1)
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


@threaded
def grip_rows(
    tree: Tree,
    routing: Routing,
    hole: Indices,
    own: Array,
    cable: Indices,
    friction: Array,
    q: Array,
    grip: Array,
) -> None:
    """Fill ``grip`` (B, C) [-] with Σ μ φ over the holes of each cable at angles q (B, nv) [rad].

    ``routing`` is that of the segments; ``cable`` and ``friction`` (P,) are those of the holes;
    ``hole`` and ``own`` (P,) are as for :func:`set_wraps`.
    """
    rows, nv = q.shape
    before, after = segment_scratch(nv, 1), segment_scratch(nv, 1)
    frames = empty_frames(tree, routing, 1)
    rotation, normal = np.empty((tree.parent.shape[0], 3, 3, 1)), np.empty((7, 1))
    wrap, gradient = np.empty((hole.shape[0], 1)), np.empty((hole.shape[0], 0, 1))
    span = np.zeros((routing.fixed.shape[0], 3), dtype=np.intp)  # no joints: no gradient
    for n in range(rows):
        angles = q[n].copy().reshape(nv, 1)
        forward_kinematics(tree, routing, angles, np.empty((2, 1)), rotation, frames, None)
        set_wraps(
            span, routing.joint, hole, own, frames, before, after, wrap, gradient, normal, None
        )
        grip[n] = 0.0
        for h in range(hole.shape[0]):
            grip[n, cable[h]] += friction[h] * wrap[h, 0]
